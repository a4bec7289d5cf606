"""The drift of integrals along float orbits of several methods."""
