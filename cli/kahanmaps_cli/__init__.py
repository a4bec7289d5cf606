"""The command line of kahanmaps: each command parses its options, calls one library function, and prints the result."""
