"""Float orbits: steps in floating point, one by one and many at once."""
