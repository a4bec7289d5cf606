"""The names of the library that the command line uses, imported on first use so that --help is fast.

The names and their modules are listed in internals.pyi, which type checkers read as well.
"""

import sys
from typing import Any

from lazy_loader import attach_stub

_load, __dir__, __all__ = attach_stub("kahanmaps", __file__)


def __getattr__(name: str) -> Any:
    # Some versions of lazy-loader also store what they load in the package. There it would replace public functions,
    # which explain wrong arguments, and would make private names public.
    public = vars(sys.modules["kahanmaps"])
    is_stored, stored = name in public, public.get(name)
    value = _load(name)
    if is_stored:
        public[name] = stored
    else:
        public.pop(name, None)
    return value
