"""Where memory is limited (ulimit -v): libraries are loaded only where they have room to work in.

Without it OpenBLAS, below numpy, ends the process by itself, with the status 1 that says `refuted`. Nothing can be done
about it then, so room is looked for before.
"""

from __future__ import annotations

import mmap
import os
import resource
import sys
from collections.abc import Sequence
from typing import Any

# Bytes of addresses that each takes while it is loaded and works, measured, and half as much again.
_ROOM = {"numpy": 300 << 20, "matplotlib": 200 << 20, "numba": 300 << 20, "llvmlite": 300 << 20}


class _Room:
    """A finder of modules that finds none, and raises MemoryError for those that would not have room."""

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: Any = None) -> None:
        """Look for room once, at the first part of a library."""
        if name in _ROOM:
            try:
                mmap.mmap(-1, _ROOM[name]).close()
            except OSError as error:
                raise MemoryError(f"{name} would have no room") from error


def look_for_room() -> None:
    """Do so from now on, if memory is limited; the libraries of linear algebra then have one thread each."""
    if resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        sys.meta_path.insert(0, _Room())
