"""The differential equations: quadratic vector fields, cubic Hamiltonians, system files, the catalogue."""
