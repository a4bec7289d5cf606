"""Pictures, from values that were computed before: results in, figures out.

style             sizes in centimetres, fonts, colours that the colour-blind and a grey printer tell apart
figures           an empty figure in a style; a figure as a file (PDF, SVG, PNG) or as SVG inside a page
recipe            how a picture was made: written into its file, read from it
terminal          a figure as characters, for a terminal
"""
