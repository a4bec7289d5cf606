"""Display of values as LaTeX, HTML and lines of text; each file is for the values of one or more packages."""
