"""The comparison of Kahan's method with other methods: drift of integrals along float orbits, errors, work."""
