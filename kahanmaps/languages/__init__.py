"""Systems and their Kahan maps as files for other programs.

formulas        what there is to write: right-hand sides, the equation of the map, integrals, a density, the closed form
convert         all of it as one function, and the files of all languages but LaTeX
languages.toml  how these languages write functions and linear equations; expressions are written by SymPy's printers
latex           the document in LaTeX

A further language is a table in languages.toml and an entry in the lists of `convert` and of its command.
"""
