"""The flow as the limit eps -> 0 of the map: invariants of the flow, and invariants of the map that tend to them."""
