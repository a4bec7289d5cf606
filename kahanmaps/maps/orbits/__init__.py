"""Orbits of any map in every arithmetic: the choice of a method, and the computation of the steps."""
