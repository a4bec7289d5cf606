"""Poisson tensors that a map preserves, their Casimirs and pencils."""
