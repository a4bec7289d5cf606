"""A .npy file to which float orbits are appended as they are computed; the file is valid at any time.

A .npy file is a header with the shape, followed by the numbers. numpy reserves space in the header for a larger number
of rows, so a portion is appended in two writes: first the numbers, then the header with the new length, in
place. A reader between these writes, or after the program was killed, finds a file that is complete up to the last
portion (readers ignore numbers that the header does not count yet). The length shows how much was computed, and no disk
space is used for steps that are never taken. Closing the file writes it to the disk (fsync). If the machine crashes
before, the last portions may be missing, or may be zeros that the header already counts.
"""

from __future__ import annotations

import io
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Literal

import numpy as np
from numpy.typing import NDArray

from kahanmaps.atomic_files import sync, with_file_name
from kahanmaps.errors import InputError


class NpyFile:
    """A growing .npy file of shape (rows, *shape) with doubles or 64-bit integers; `rows` is its current length.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder, NpyFile(Path(folder) / "x.npy", (2,)) as file:
    ...     file.append(np.array([[1.0, 2.0], [3.0, 4.0]]))
    ...     np.load(Path(folder) / "x.npy").shape
    (2, 2)
    """

    def __init__(self, path: str | Path, shape: tuple[int, ...], kind: Literal["<f8", "<i8"] = "<f8") -> None:
        if Path(path).is_fifo():  # opening a pipe would wait for a reader
            raise InputError(f"{path} is a pipe, expected a file: the header of a .npy file is rewritten in place")
        self.path = path
        self.shape = shape
        self.rows = 0
        self.kind = kind
        self._header_size = len(self._header(0))
        self._stream: IO[bytes] = open(path, "wb", buffering=0)  # noqa: SIM115 (closed by `close`)
        try:
            with with_file_name(path):
                self._stream.write(self._header(0))
        except BaseException:
            self._stream.close()
            raise

    def append(self, rows: NDArray[Any]) -> None:
        """Append an array (count, *shape), then update the header."""
        if rows.shape[1:] != self.shape:
            raise InputError(f"found rows of shape {rows.shape[1:]}, expected {self.shape}")
        header = self._header(self.rows + len(rows))
        if len(header) != self._header_size:
            raise InputError(f"{self.rows + len(rows)} rows are more than the header of a .npy file can hold")
        with with_file_name(self.path):
            self._stream.seek(0, io.SEEK_END)
            remaining_bytes = memoryview(np.ascontiguousarray(rows, dtype=self.kind).tobytes())
            while remaining_bytes:  # one call of write may write only a part
                remaining_bytes = remaining_bytes[self._stream.write(remaining_bytes) :]
            self._stream.seek(0)
            self._stream.write(header)
        self.rows += len(rows)

    def close(self) -> None:
        """Write everything to the disk (fsync) and close the file."""
        try:
            if not self._stream.closed:
                with with_file_name(self.path):
                    sync(self._stream)
        finally:
            self._stream.close()

    def _header(self, rows: int) -> bytes:
        """Return the header; numpy pads it so that its length is the same for any number of rows."""
        stream = io.BytesIO()
        header_fields = {"descr": self.kind, "fortran_order": False, "shape": (rows, *self.shape)}
        np.lib.format.write_array_header_1_0(stream, header_fields)
        return stream.getvalue()

    def __enter__(self) -> NpyFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
