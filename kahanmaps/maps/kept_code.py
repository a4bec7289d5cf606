"""Machine code of numba kept on disk: what is damaged there is compiled anew, what cannot be kept is done without.

numba itself takes whatever it finds: a file that was cut off raises anything at all, a flipped bit is run. So a digest
stands behind what is written, of the content and of the source and the numba that it belongs to; and an error of the
disk while something is put there is no error of the computation.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import numba

_caching: Any = import_module("numba.core.caching")  # which has few types
_DIGEST = hashlib.sha256().digest_size


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """The function compiled by numba with these options, from the disk or for it if there is a folder that takes it."""
    found = numba.njit(**options)(function)
    with suppress(RuntimeError):  # "no locator available": no folder that can be written to
        found._cache = _Cache(function)
    return found


class _Cache(_caching.FunctionCache):  # type: ignore[misc]
    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, stamp)

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):  # the disk is full, the folder gone: the code is in memory all the same
            super().save_overload(sig, data)


class _Files(_caching.IndexDataCacheFile):  # type: ignore[misc]
    """The index and the files of code, each with a digest behind what numba reads, which ends where its pickle does."""

    def _digest(self, content: bytes) -> bytes:
        return hashlib.sha256(repr((self._version, self._source_stamp)).encode() + content).digest()

    def _require_whole(self, path: str) -> None:
        """Raises OSError, which means to numba that a file is not there."""
        content = Path(path).read_bytes()
        if content[-_DIGEST:] != self._digest(content[:-_DIGEST]):
            raise OSError(f"{path} is damaged or out of date")

    def _load_index(self) -> dict[Any, str]:
        try:
            self._require_whole(self._index_path)
        except OSError:
            return {}
        found: dict[Any, str] = super()._load_index()
        return found

    def _load_data(self, name: str) -> Any:
        self._require_whole(self._data_path(name))
        return super()._load_data(name)

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        with super()._open_for_write(filepath) as stream:
            content = io.BytesIO()
            yield content
            stream.write(content.getvalue() + self._digest(content.getvalue()))
