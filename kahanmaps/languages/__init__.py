"""Systems and their Kahan maps as files for other programs.

formulas      what there is to write: right-hand sides, the equation of the map, integrals, a density, the closed form
language      a language as a table, with its names; the tables are the files of `tables/`
writer        the file, from formulas and a table
latex         the document in LaTeX
convert       all of it as one function

A further language is a table, an entry in `language.LANGUAGES` and one in the list of the command. Its tests need the
program itself, or files that somebody who knows the language has read.
"""
