"""One file for each command; it is imported only when the command runs or its help is shown."""
