"""The work of longer commands between the parsing of options and the printing of results."""
