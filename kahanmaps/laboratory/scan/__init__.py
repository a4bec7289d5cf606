"""The scan of parameters: a search for the integrable members of a family of maps."""
