"""HTML pages about a system or a member of the family, each a single file that needs no network."""
