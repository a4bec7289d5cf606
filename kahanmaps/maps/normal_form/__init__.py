"""Members of the commuting family in normal form: planes, tau functions, the n-th iterate, periods."""
