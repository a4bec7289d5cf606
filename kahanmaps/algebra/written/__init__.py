"""Expressions, numbers and polynomials as people write them."""
