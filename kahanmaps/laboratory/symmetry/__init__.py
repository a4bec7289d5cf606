"""Symmetries of a vector field, and fields whose maps commute."""
