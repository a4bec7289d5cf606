"""The differential equations: quadratic vector fields, cubic Hamiltonians."""
