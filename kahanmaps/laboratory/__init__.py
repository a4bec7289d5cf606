"""The laboratory: searches for what a map preserves, and measurements of the growth of its iterates."""
