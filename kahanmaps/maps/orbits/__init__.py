"""Orbits of any map, in every arithmetic: the choice of the method, and the steps."""
