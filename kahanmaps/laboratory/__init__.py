"""The laboratory: given a quadratic system, find out what its Kahan map preserves and how it grows."""
