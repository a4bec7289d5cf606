"""Orbits of any map, in every arithmetic: which way to step, and the steps."""
