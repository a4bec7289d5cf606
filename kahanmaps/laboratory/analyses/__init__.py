"""The steps of an analysis (`table.py`) and the statements of its report (`statements.py`)."""
