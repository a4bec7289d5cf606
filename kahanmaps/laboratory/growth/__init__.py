"""How the degrees and heights of a map grow."""
