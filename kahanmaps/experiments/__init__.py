"""Plan, run, store and resume batches: many experiments that one file, the spec, describes.

Input         spec.py (a spec in TOML) and experiment.py; options.py (the options of tasks), grid.py (values and their
              combinations), registry.py and tasks.py (the kinds of tasks)
Data types    results: records.py (tasks, keys, limits, records), system_spec.py (the system of a task)
Execution     running: run.py (the loop), local.py (worker processes), cluster.py (dask, with the command of a worker)
Storage       results: store.py (one SQLite file)
Output        results: export.py, summary.py
"""
