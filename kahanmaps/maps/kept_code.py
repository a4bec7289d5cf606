"""Machine code of numba, kept on disk where there is a folder for it, so that it is compiled once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """The function compiled by numba with these options, from the disk or for it if there is a folder that takes it."""
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # "no locator available": no folder that can be written to
        return numba.njit(**options)(function)
