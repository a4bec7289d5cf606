"""Differential equations: quadratic and polynomial vector fields, cubic Hamiltonians.

`km.systems()` returns the catalogue, and `km.systems(name)` one of its systems, like `kahanmaps systems NAME`.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

from kahanmaps.function_calls import CallableModule


def command(name: str | None = None, **parameters: Any) -> Any:
    """Return the catalogue or, if `name` is given, its system of this name with these values of its parameters."""
    catalog = import_module("kahanmaps.documents.catalog")
    return catalog.catalogue() if name is None else catalog.load(name, **parameters)


sys.modules[__name__].__class__ = CallableModule
