"""Kahan maps and their orbits: over any field, exactly over Q, in floating point."""
