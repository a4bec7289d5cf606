"""System files in TOML, their claims, and the catalogue of named systems."""
