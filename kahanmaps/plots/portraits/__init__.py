"""Phase portraits of planar maps and of projections: orbits, equilibria, separatrices, the flow."""
