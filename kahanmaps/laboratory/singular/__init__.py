"""The hypersurfaces that a map contracts, and their images under the iterates."""
