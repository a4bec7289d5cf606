"""Invariant curves of Kahan maps, and the planes that contain these curves."""
