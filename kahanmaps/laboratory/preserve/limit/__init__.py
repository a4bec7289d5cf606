"""The vector field as the limit of small steps: what it preserves and what tends to that."""
