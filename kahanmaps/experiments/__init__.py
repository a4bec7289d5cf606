"""Many experiments from one description: planned, run in child processes, stored, resumed."""
