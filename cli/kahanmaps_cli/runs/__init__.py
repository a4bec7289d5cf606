"""The work of the longer commands between reading their options and printing."""
