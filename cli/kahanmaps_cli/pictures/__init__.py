"""The subcommands of `kahanmaps plot`, one file each, and what they share (output.py)."""
