"""Float orbits: steps in machine numbers, one by one and many at once."""
