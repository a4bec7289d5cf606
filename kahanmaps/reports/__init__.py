"""Pages about a system, a member of the family or a batch: one HTML file, with nothing to be fetched."""
