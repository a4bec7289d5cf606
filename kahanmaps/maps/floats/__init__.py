"""Float orbits: steps in floating-point numbers, one by one and many at once."""
