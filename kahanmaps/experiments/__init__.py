"""Many experiments from one description: planned, run in worker processes, stored, resumed.

What is asked      spec.py (a spec in TOML) and experiment.py; options.py (the vocabulary), grid.py (values and
                   their combinations), recipes.py (how a task comes by its system), registry.py and the tasks
What passes        records.py: tasks and their keys, limits, records, what does them
Who does it        running: run.py (the loop); local.py here; cluster.py elsewhere, with the command on a worker
What is kept       results: store.py, one SQLite file
What comes out     results: export.py, summary.py
"""
