"""The growth of the degrees of iterates, and of heights along orbits."""
