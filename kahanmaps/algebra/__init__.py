"""Exact fields, matrices, polynomials and their text: nothing here knows of differential equations."""
