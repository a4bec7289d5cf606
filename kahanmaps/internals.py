"""The names of the library that the command line uses, imported on first use so that --help is fast.

They are listed with their modules in internals.pyi, which type checkers read as well.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub("kahanmaps", __file__)
