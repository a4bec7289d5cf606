"""Orbits in files that `kahanmaps orbit` and `kahanmaps ensemble` wrote: .npy, .npz, .jsonl and .csv, read as doubles.

Exact numbers and balls (their middles) are rounded; residues are taken as the integers they are. Points of a .npy file
stay on the disk until they are drawn.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flint import fmpz

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.algebra.roots import parse_root
from kahanmaps.algebra.written.numerals import check_names
from kahanmaps.algebra.written.text import parse_polynomial
from kahanmaps.errors import InputError
from kahanmaps.maps.orbits.writers import meta_of

if TYPE_CHECKING:
    from kahanmaps.maps.floats.doubles import FloatArray

_ENDINGS = (".npy", ".npz", ".jsonl", ".csv")
_MAX_POINTS = 4_000_000  # of a file that has to be read as text
_EARLY = ("completed", "periodic")


@dataclass(frozen=True, eq=False)
class Stored:
    """Points (records, orbits, dim), their steps, and what the file says: `header` is empty for .npy."""

    variables: tuple[str, ...]
    points: FloatArray
    steps: Any
    header: dict[str, Any]
    end: dict[str, Any]

    @property
    def ended(self) -> dict[str, int]:
        """How many orbits ended early, in words."""
        import numpy as np

        if self.end and self.end.get("status") not in _EARLY:
            return {str(self.end.get("message", self.end.get("status")))[:200]: 1}
        if len(self.points) == 0:
            return {}
        gone = int(np.isnan(self.points[-1]).any(axis=1).sum())
        return {"NaN in the last record": gone} if gone else {}


def read_orbits(path: str, variables: Sequence[str] | None) -> Stored:
    """The orbits in a file; `variables` are those of the system, if there is one: the file has to agree.

    Raises InputError with what is wrong with the file.
    """
    ending = Path(path).suffix.lower()
    if ending not in _ENDINGS:
        raise InputError(
            f"{path}: found {ending or 'no ending'}, expected a file of kahanmaps orbit or ensemble: "
            f"{', '.join(_ENDINGS)}"
        )
    if not Path(path).is_fifo():  # which can be opened once
        open(path, "rb").close()  # raises what has nothing to do with what is in it
    try:
        if ending in (".npy", ".csv"):
            found = (_from_npy if ending == ".npy" else _from_csv)(path, variables)
        else:
            found = (_from_npz if ending == ".npz" else _from_jsonl)(path)
    except Exception as error:  # zip archives, headers of arrays and numbers that are damaged may go wrong in any way
        if isinstance(error, InputError) and path in str(error):
            raise
        raise InputError(
            f"{path}: found no orbit that kahanmaps wrote ({_first(error)}): it is another file, or damaged"
        ) from None
    if variables is not None and tuple(variables) != found.variables:
        raise InputError(
            f"{path}: found the variables {', '.join(found.variables)}, expected those of the system: "
            f"{', '.join(variables)}"
        )
    if found.points.size == 0:
        raise InputError(f"{path}: found no point in it")
    return found


def _from_npy(path: str, variables: Sequence[str] | None) -> Stored:
    import numpy as np

    array = np.lib.format.open_memmap(path, mode="r")
    if array.dtype.kind not in "fiu" or array.ndim not in (2, 3):
        raise InputError(
            f"{path}: found an array of type {array.dtype} and shape {array.shape}, expected numbers (points, dim) of "
            "one orbit or (records, orbits, dim) of an ensemble"
        )
    points = array[:, None, :] if array.ndim == 2 else array
    dim = points.shape[2]
    if variables is not None and dim != len(variables):
        raise InputError(f"{path}: found points of dimension {dim}, expected {len(variables)}: {', '.join(variables)}")
    names = tuple(variables) if variables is not None else tuple(f"x{k}" for k in range(1, dim + 1))
    return Stored(names, points, np.arange(len(points)), {}, {})


def _from_npz(path: str) -> Stored:
    import numpy as np

    with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as held:
        meta = json.loads(str(held["meta"]))
        steps, x = held["step"], held["x"]
    header, end = dict(meta["header"]), dict(meta["end"])
    if x.ndim != 2:
        raise InputError(f"{path}: found an array of shape {x.shape}, expected (points, dim)")
    if x.dtype.kind == "S":
        number = _reader(header)
        x = [[number(cell.decode()) for cell in row] for row in x.tolist()]
    return _stored(steps, x, header, end)


def _from_jsonl(path: str) -> Stored:
    header: dict[str, Any] = {}
    end: dict[str, Any] = {}
    steps: list[int] = []
    rows: list[list[float]] = []
    number: Callable[[str], float] = _number
    for line in _lines(path):
        record = json.loads(line)
        if record["record"] == "header":
            header = record
            number = _reader(header)
        elif record["record"] == "end":
            end = record
        else:
            steps.append(int(record["step"]))
            rows.append([number(str(entry)) for entry in record["x"]])
    return _stored(steps, rows, header, end)


def _from_csv(path: str, variables: Sequence[str] | None) -> Stored:
    """A table with the file beside it, or alone: then all columns, or as many as the system has, are variables."""
    names, *cells = csv.reader(_lines(path))
    if names[0] != "step":
        raise ValueError("its first column is not step")
    told: dict[str, Any] = {"header": {"variables": names[1 : None if variables is None else 1 + len(variables)]}}
    if Path(meta_of(path)).exists():
        told = json.loads(Path(meta_of(path)).read_text(encoding="utf-8"))
    header = dict(told["header"])
    width = len(header["variables"])
    number = _reader(header)
    rows = [[number(cell) for cell in row[1 : 1 + width]] for row in cells]
    return _stored([row[0] for row in cells], rows, header, dict(told.get("end") or {}))


def _lines(path: str) -> Iterator[str]:
    with open(path, encoding="utf-8") as stream:
        for number, line in enumerate(stream):
            if number > _MAX_POINTS:
                raise InputError(f"{path}: found more than {_MAX_POINTS} lines, expected fewer: take .npy")
            if line.strip():
                yield line


def _stored(steps: Sequence[Any], x: Any, header: dict[str, Any], end: dict[str, Any]) -> Stored:
    """An orbit; its steps become doubles, for those that were reached directly may be longer than machine integers."""
    import numpy as np

    width = len(x[0]) if len(x) else 0
    points = np.array(x, dtype=np.float64).reshape(len(x), 1, width)
    return Stored(_names(header, width), points, np.array([float(int(step)) for step in steps]), header, end)


def _names(header: dict[str, Any], width: int) -> tuple[str, ...]:
    names = tuple(str(name) for name in header["variables"])
    check_names(names)
    if width and len(names) != width:
        raise ValueError(f"{len(names)} names for {width} columns")
    return names


def _reader(header: dict[str, Any]) -> Callable[[str], float]:
    """What reads the numbers of an orbit; those over a number field are read at the real root that is meant."""
    root = next((parse_root(str(text)) for text in header.get("algebraic", {}).values()), None)
    if root is None or header.get("arithmetic") != "exact":
        return _number
    rounded = cache(root.rounded)

    def number(text: str) -> float:
        bits = 1 << max(256, 8 * len(text)).bit_length()  # more than can be lost where conjugates are far away
        return _number(str(evaluate(parse_polynomial(text, ["t"]), QQ, [rounded(bits)])))

    return number


def _number(text: str) -> float:
    """An integer, a decimal, p/q of any length, or the middle of a ball."""
    middle = text.partition(" +/- ")[0].strip("[] ")
    above, slash, below = middle.partition("/")
    try:
        value = int(fmpz(above)) / int(fmpz(below)) if slash else float(middle)
    except OverflowError:
        value = inf
    if not isfinite(value):
        raise InputError(f"found the number {middle[:40]}, expected one in the range of machine floats")
    return value


def _first(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"no {error} in it"
    lines = str(error).splitlines()
    return lines[0][:120] if lines else type(error).__name__
