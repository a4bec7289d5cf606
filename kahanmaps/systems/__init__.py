"""Differential equations: quadratic and polynomial vector fields, cubic Hamiltonians."""
