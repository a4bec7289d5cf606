"""Which members of a family of maps are integrable: the scan of its parameters."""
