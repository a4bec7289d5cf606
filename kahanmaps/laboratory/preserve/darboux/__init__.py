"""Darboux polynomials, their cofactors and the spaces that they make."""
