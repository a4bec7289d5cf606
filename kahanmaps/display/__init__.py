"""How values look: LaTeX, MathML, HTML. Each file knows the values of the folder it is named for."""
