"""Display of values as LaTeX, HTML and lines of text: a file for the values of each folder, or of several."""
