"""Kahan maps and their orbits over any field: exact over Q, and in floating point."""
