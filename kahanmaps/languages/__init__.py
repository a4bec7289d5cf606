"""Conversion of systems and their Kahan maps to files for other programs.

formulas        the formulas of a system: right-hand sides, equation and closed form of the map, integrals, a density
convert         the function `convert`, and the files in all languages except LaTeX
languages.toml  syntax of functions and linear equations in these languages (SymPy's printers write the expressions)
latex           the document in LaTeX

To add a language, add its table to languages.toml and its name to the lists of `convert` and of the command convert.
"""
