"""The code that long commands run after their options are parsed and before their results are printed."""
