"""The functions and tensors that Kahan maps preserve, as exact expressions; heights of orbits and their growth."""
