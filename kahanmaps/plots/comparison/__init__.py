"""How far integrals move along float orbits."""
