"""The subcommands of `kahanmaps plot`, one file for each, and the code that they share (output.py)."""
