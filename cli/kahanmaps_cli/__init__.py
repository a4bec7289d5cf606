"""The command line of kahanmaps: thin commands that parse, call one library function, and print."""
