"""The version of the library, which machine-readable outputs contain, except stable exports of batches."""

__version__ = "0.2.0"
