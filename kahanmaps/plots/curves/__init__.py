"""Invariant curves and the planes in which they are drawn."""
