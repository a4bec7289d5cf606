"""Portraits of planar maps and sections: orbits, equilibria, separatrices, the flow."""
