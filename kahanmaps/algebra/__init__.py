"""Exact fields, matrices, polynomials, and their conversion to and from text, independent of differential equations."""
