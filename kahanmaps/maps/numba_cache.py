"""The disk cache of functions compiled by numba."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numba


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function by numba with these options, using the disk cache if a folder is writable."""
    try:
        compiled_function = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # "no locator available": no folder that can be written to
        return numba.njit(**options)(function)
    save = compiled_function._cache.save_overload

    def save_if_possible(signature: Any, data: Any) -> None:
        with suppress(OSError):  # the disk is full or the folder was removed: the compiled code is in memory
            save(signature, data)

    compiled_function._cache.save_overload = save_if_possible
    return compiled_function
