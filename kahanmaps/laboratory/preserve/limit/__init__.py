"""The vector field as the limit of small steps: what it preserves, and which invariants of the map tend to that."""
