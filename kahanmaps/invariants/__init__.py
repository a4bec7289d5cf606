"""What Kahan maps preserve: integrals, densities, Poisson tensors, and how large the expressions for them are."""
