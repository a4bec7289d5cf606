"""The flow as the limit eps -> 0 of the map: its invariants, and the invariants of the map that tend to them."""
