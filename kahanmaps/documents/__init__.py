"""Systems in text: files in TOML, what they claim, the catalogue."""
