"""Darboux polynomials, their cofactors, and spaces of Darboux polynomials with the same cofactor."""
