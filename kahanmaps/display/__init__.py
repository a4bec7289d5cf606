"""Display of values as LaTeX, HTML and lines of text; each file displays the values of one or more packages."""
