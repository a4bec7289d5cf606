"""The library as the command line uses it: its names are imported on first use, so that --help is fast.

The file internals.pyi lists the names and their modules, for lazy-loader and for type checkers.
"""

import sys
from typing import Any

from lazy_loader import attach_stub

_load, __dir__, __all__ = attach_stub("kahanmaps", __file__)


def __getattr__(name: str) -> Any:
    # Some versions of lazy-loader also store a loaded value in the package `kahanmaps`. There it would replace a public
    # function, which explains wrong arguments, or make a private name public.
    public = vars(sys.modules["kahanmaps"])
    is_stored, stored = name in public, public.get(name)
    value = _load(name)
    if is_stored:
        public[name] = stored
    else:
        public.pop(name, None)
    return value
