"""The names of the library that the command line uses: each is imported when it is used, so that --help stays light.

Which names there are, and where they come from, is said in internals.pyi, which type checkers read as well.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub("kahanmaps", __file__)
