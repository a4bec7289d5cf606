"""Systems and their Kahan maps as files for other programs.

formulas      what there is to write: right-hand sides, integrals, a density, the closed form of the map
language      a language as a table, with its names; the tables are in julia, maple, mathematica, pari, sage and sympy
writer        the file, from formulas and a table
latex         the document in LaTeX
convert       all of it as one function

A further language is a file with its table, an entry in `convert._TABLES` and one in the list of the command. Its tests
need the program itself, or files that somebody who knows the language has read.
"""
