"""Invariant curves and the planes that contain them."""
