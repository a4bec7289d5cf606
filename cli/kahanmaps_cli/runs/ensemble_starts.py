"""The starts of many orbits: from a .npy file, from text with a point in each line, or drawn at random.

Text is exact: integers, p/q and decimals, separated by commas or blanks; # starts a comment. A first line with the
names of the variables says which columns are meant.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from kahanmaps.errors import ExpressionError, InputError
from kahanmaps_cli import library as lib

MAX_TEXT_BYTES = 100_000_000
MAX_NPY_BYTES = 2_000_000_000
MAX_NUMBERS = 50_000_000  # of all starts together
_MAGIC = b"\x93NUMPY"


def drawn(count: int, dim: int, box: Any, seed: int) -> lib.NDArray[Any]:
    """Starts at random: doubles from -box to box; the same ones for the same seed."""
    if count < 1:
        raise InputError(f"found --random {count}, expected at least 1 start")
    if count * dim > MAX_NUMBERS:
        raise InputError(f"found --random {count}, expected at most {MAX_NUMBERS // dim} starts in dimension {dim}")
    if seed < 0:
        raise InputError(f"found --seed {seed}, expected 0 or more")
    box = lib.rational(box)
    if box <= 0:
        raise InputError(f"found --box {box}, expected a number above 0: coordinates are drawn from -R to R")
    size = lib.to_float(box)
    if size == 0.0:
        raise InputError("found a --box that is 0 in machine numbers, expected a larger one")
    return lib.starts_in_box(count, dim, size, seed)


def asked_starts(file: lib.SystemFile, options: Mapping[str, Any], count: int | None = None) -> lib.NDArray[Any]:
    """The starts that the options ask for: those of a file, or drawn at random, `count` of them unless they say."""
    if options["starts"] is not None:
        return read_starts(options["starts"], file.variables)
    count = options["count"] if count is None or options["count"] is not None else count
    return drawn(count, file.dim, 1 if options["box"] is None else options["box"], options["seed"] or 0)


def read_starts(path: str, variables: Sequence[str]) -> lib.NDArray[Any]:
    """The starts in a file, or on standard input for "-": an array (n, dim) of doubles.

    Raises InputError with file and line of the first mistake.
    """
    where = "standard input" if path == "-" else path
    if path == "-":
        data = sys.stdin.buffer.read(MAX_NPY_BYTES + 1)
    else:
        with open(path, "rb") as stream:
            data = stream.read(MAX_NPY_BYTES + 1)
    if data.startswith(_MAGIC):
        return _from_npy(data, where, variables)
    if path.endswith(".npy"):
        raise InputError(f"{where}: found no .npy file (those start with \\x93NUMPY)")
    if len(data) > MAX_TEXT_BYTES:
        raise InputError(f"{where}: found more than {MAX_TEXT_BYTES} bytes of text, expected fewer: take a .npy file")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{where}: found neither a .npy file nor UTF-8 text with a point in each line") from None
    return _Text(where, variables).read(text)


def _from_npy(data: bytes, where: str, variables: Sequence[str]) -> lib.NDArray[Any]:
    """The array of a .npy file; nothing is ever unpickled."""
    import numpy as np

    if len(data) > MAX_NPY_BYTES:
        raise InputError(f"{where}: found more than {MAX_NPY_BYTES} bytes, expected fewer")
    try:
        rows = np.load(io.BytesIO(data), allow_pickle=False)
    except Exception as error:  # its head is read like Python, and may go wrong like Python: in its tokens, its depth
        raise InputError(f"{where}: found a .npy file that cannot be read: {_first(error)}") from None
    dtype, shape, dim = rows.dtype, rows.shape, len(variables)
    if dtype.kind not in "fiu":
        raise InputError(f"{where}: found an array of {_kind(dtype)}, expected real numbers")
    if len(shape) != 2 or shape[1] != dim or shape[0] < 1:
        raise InputError(
            f"{where}: found an array of shape {shape}, expected (n, {dim}): one row for each start, with columns "
            f"{', '.join(variables)}"
        )
    if rows.size > MAX_NUMBERS:
        raise InputError(f"{where}: found an array of shape {shape}, expected at most {MAX_NUMBERS} numbers")
    with np.errstate(over="ignore"):
        starts: lib.NDArray[Any] = np.ascontiguousarray(rows, dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(starts).all(axis=1))
    if len(bad):
        found = starts[bad[0]][~np.isfinite(starts[bad[0]])][0]
        raise InputError(f"{where}: row {bad[0]}: found {found}, expected finite numbers")
    return starts


class _Text:
    """Reads text with a point in each line."""

    def __init__(self, where: str, variables: Sequence[str]) -> None:
        self.where = where
        self.variables = list(variables)
        self.columns: list[int] | None = None
        self.width = len(self.variables)

    def read(self, text: str) -> lib.NDArray[Any]:
        import numpy as np

        rows: list[list[float]] = []
        fresh = True
        for number, line in enumerate(text.split("\n"), start=1):
            content = line.partition("#")[0].strip().strip("()[]{}")  # as people print points
            if not content:
                continue
            cells = [cell.strip() for cell in content.split(",")] if "," in content else content.split()
            if fresh and self._is_header(cells):
                fresh = False
                continue
            fresh = False
            rows.append(self._row(number, cells))
            if len(rows) * len(self.variables) > MAX_NUMBERS:
                raise InputError(f"{self.where}:{number}: found more than {MAX_NUMBERS} numbers, expected fewer")
        if not rows:
            raise InputError(
                f"{self.where}: found no point, expected one a line: {', '.join(self.variables)}, e.g. 1/2,-1/3,..."
            )
        return np.array(rows, dtype=np.float64)

    def _is_header(self, cells: list[str]) -> bool:
        """Whether this is a line of names; then the columns of the variables are looked up there."""
        if not set(self.variables) <= set(cells):
            return False
        self.columns, self.width = [cells.index(name) for name in self.variables], len(cells)
        return True

    def _row(self, number: int, cells: list[str]) -> list[float]:
        where = f"{self.where}:{number}"
        if len(cells) != self.width:
            what = "1 number" if len(cells) == 1 else f"{len(cells)} numbers"
            named = "" if self.columns is not None else f": {', '.join(self.variables)}"
            raise InputError(f"{where}: found {what}, expected {self.width}{named}")
        row: list[float] = []
        for k in range(len(cells)) if self.columns is None else self.columns:
            try:
                row.append(lib.to_float(lib.parse_number(cells[k])))
            except InputError as error:
                message = error.message if isinstance(error, ExpressionError) else error
                raise InputError(f"{where}: entry {k + 1}: {message}") from error
        return row


def _kind(dtype: Any) -> str:
    kinds = {"f": "machine floats", "c": "complex numbers", "b": "truth values", "U": "text", "S": "text"}
    return kinds.get(dtype.kind, f"the type {str(dtype)[:40]}")


def _first(error: Exception) -> str:
    lines = str(error).splitlines()
    return lines[0][:200] if lines else type(error).__name__
