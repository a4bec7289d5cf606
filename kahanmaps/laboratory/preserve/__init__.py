"""What a map preserves: integrals, densities, Darboux polynomials, Poisson tensors."""
