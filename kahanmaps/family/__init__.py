"""The commuting family of Petrera and Suris: skew-Hamiltonian matrices, their cubics, the associated systems."""
