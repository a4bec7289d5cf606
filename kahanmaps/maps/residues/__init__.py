"""Orbits modulo a prime, as arrays."""
