"""HTML pages about a system or a member of the family; a page is a single file that needs no network."""
