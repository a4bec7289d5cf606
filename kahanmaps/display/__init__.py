"""Display: LaTeX, HTML, lines of text. A file knows the values of the folder it is named for, or of several."""
