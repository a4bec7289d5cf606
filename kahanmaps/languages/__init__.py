"""Systems and their Kahan maps as files for other programs.

formulas        the formulas of a system: right-hand sides, equation and closed form of the map, integrals, a density
convert         these formulas as one function, and the files of all languages but LaTeX
languages.toml  how these languages write functions and linear equations; expressions are written by SymPy's printers
latex           the document in LaTeX

A further language is a table in languages.toml and an entry in the lists of `convert` and of its command.
"""
