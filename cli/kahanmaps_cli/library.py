"""The library as commands use it: a name is imported when it is used, so that --help stays light.

Which names there are, and where they come from, is said in library.pyi, which type checkers read.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="ascii")
_MODULE_OF = {name: module for module, name in re.findall(r"^from (\S+) import (\w+) as", _STUB, re.MULTILINE)}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"library.pyi has no name {name}")
    return getattr(import_module(_MODULE_OF[name]), name)
