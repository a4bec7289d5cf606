"""The disk cache of functions compiled by numba."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numba


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function by numba with these options; use the disk cache if its folder is writable."""
    try:
        compiled_function = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # numba's error "no locator available" means that no cache folder is writable
        return numba.njit(**options)(function)
    save = compiled_function._cache.save_overload

    def save_if_possible(signature: Any, data: Any) -> None:
        with suppress(OSError):  # disk full or folder removed: the compiled code remains in memory
            save(signature, data)

    compiled_function._cache.save_overload = save_if_possible
    return compiled_function
