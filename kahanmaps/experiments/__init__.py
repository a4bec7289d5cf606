"""Many experiments from one description: planned, run in child processes, stored, resumed.

What is asked      spec.py (a spec in TOML), with shape and experiment; options.py (the vocabulary), grid.py (values and
                   their combinations), recipes.py (how a task comes by its system), registry.py and the tasks
What passes        records.py: tasks and their keys, limits, records, what does them
Who does it        run.py (the loop); children.py and child.py here; cluster.py, dask_client.py and group.py (the
                   command on a worker) elsewhere
What is kept       store.py, on database, schema, tables, checking, merging, locks
What comes out     export.py, summary.py
"""
