"""The version of the library, which every machine-readable output carries."""

__version__ = "0.2.0"
