"""Initial points of many orbits: typed, read from a .npy or a text file, on a grid or a line, or random.

A text file has one point a line: integers, fractions p/q and decimals, separated by commas or blanks; # starts a
comment. If the first line consists of the names of the variables, it assigns the columns to them.
"""

from __future__ import annotations

import io
import os
import stat
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.errors import ExpressionError, InputError, counted, quoted

MAX_TEXT_BYTES = 100_000_000  # maximal size of a text file of initial points
MAX_NPY_BYTES = 2_000_000_000
_MAGIC = b"\x93NUMPY"


def require_one_kind_of_starts(options: Mapping[str, Any], *, random_by_default: bool = False) -> str | None:
    """Return the name of the option that gives the initial points, or None; raise UsageError for several options."""
    sources = [name for name in ("start", "starts", "grid", "line", "count") if options.get(name) not in (None, ())]
    flags = ["--random" if name == "count" else f"--{name}" for name in sources]
    if len(sources) > 1:
        raise click.UsageError(f"give {flags[0]} or {flags[1]}, not both")
    has_random_options = "count" in options and (options["box"] is not None or options["seed"] is not None)
    if has_random_options and options["count"] is None and (sources or not random_by_default):
        raise click.UsageError("--box and --seed are for --random N")
    if options.get("starts") == "-" and options.get("system") == "-":
        raise click.UsageError("found - for both SYSTEM and --starts, but there is only one standard input")
    return sources[0] if sources else None


def requested_starts(file: lib.SystemFile, options: Mapping[str, Any], count: int | None = None) -> lib.FloatArray:
    """Return the requested initial points, by default `count` random points."""
    dim = file.dim
    if options["start"]:
        for x in options["start"]:
            if len(x) != dim:
                size = counted(len(x), "coordinate")
                raise InputError(f"found an initial point with {size}, expected {dim}: {', '.join(file.variables)}")
        return lib.to_floats([entry for x in options["start"] for entry in x]).reshape(-1, dim)
    if options["starts"] is not None:
        return read_starts(options["starts"], file.variables)
    for name, separator in (("grid", "="), ("line", ":")):
        if options[name] is not None:
            if separator not in options[name] or (name == "line" and "=" in options[name]):
                example = "x=-1:1:20,y=1/2" if name == "grid" else "0,0:1,1/2:50"
                raise InputError(f"found --{name} {quoted(options[name])}, expected a {name} such as {example}")
            return lib.starts_on(options[name], file.variables)
    count = options["count"] or count or 1
    if count * dim > lib.MAX_NUMBERS:
        raise InputError(
            f"found --random {count}, expected at most {lib.MAX_NUMBERS // dim} initial points in dimension {dim}"
        )
    box = lib.rational(1) if options["box"] is None else options["box"]
    if box <= 0:
        raise InputError(f"found --box {box}, expected a number above 0: coordinates are drawn from -R to R")
    bound = lib.to_float(box)
    if bound == 0.0:
        raise InputError("found a --box that underflows to 0 in floating point, expected a larger one")
    return lib.starts_in_box(count, dim, bound, options["seed"] or 0)


def starts_record(options: Mapping[str, Any], orbits: int) -> dict[str, Any]:
    """Return the JSON entries that determine the initial points; `orbits` is their number if they are random."""
    if options["start"]:
        points = [list(map(lib.format_number, x)) for x in options["start"]]
        return {"initial_points": {"points": points}, "seed": None}
    for name, key in (("starts", "file"), ("grid", "grid"), ("line", "line")):
        if options[name] is not None:
            return {"initial_points": {key: options[name]}, "seed": None}
    box = "1" if options["box"] is None else lib.format_number(options["box"])
    return {"initial_points": {"random": orbits, "box": box}, "seed": options["seed"] or 0}


def read_starts(path: str, variables: Sequence[str]) -> lib.FloatArray:
    """Read initial points from a file, or from standard input for "-", as an array (n, dim) of doubles.

    Raises InputError that names the file and the line of the first mistake.
    """
    import numpy as np

    where = "standard input" if path == "-" else path
    if path == "-":
        data = sys.stdin.buffer.read(MAX_NPY_BYTES + 1)
    else:
        # Refuse a device or named pipe, which may never end; but accept /dev/fd/63, which a shell passes for <(...).
        mode = os.stat(path).st_mode
        is_of_shell = stat.S_ISFIFO(mode) and path.startswith(("/dev/fd/", "/dev/stdin"))
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode) or is_of_shell):
            raise InputError(f"cannot read initial points from {path}: found a pipe or a device, expected a file")
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
    # One point per line; names in the first line assign the columns to variables.
    rows: list[list[float]] = []
    columns: list[int] | None = None
    width, is_first = len(variables), True
    for number, line in enumerate(text.split("\n"), start=1):
        content = line.partition("#")[0].strip().strip("()[]{}")  # points are often printed in brackets
        if not content:
            continue
        cells = [cell.strip() for cell in content.split(",")] if "," in content else content.split()
        if is_first and set(variables) <= set(cells):
            columns, width, is_first = [cells.index(name) for name in variables], len(cells), False
            continue
        is_first = False
        if len(cells) != width:
            count_text = "1 number" if len(cells) == 1 else f"{len(cells)} numbers"
            names = "" if columns is not None else f": {', '.join(variables)}"
            raise InputError(f"{where}:{number}: found {count_text}, expected {width}{names}")
        row: list[float] = []
        for k in range(len(cells)) if columns is None else columns:
            try:
                row.append(lib.to_float(lib.parse_number(cells[k])))
            except InputError as error:
                message = error.message if isinstance(error, ExpressionError) else error
                raise InputError(f"{where}:{number}: entry {k + 1}: {message}") from error
        rows.append(row)
        if len(rows) * len(variables) > lib.MAX_NUMBERS:
            raise InputError(f"{where}:{number}: found more than {lib.MAX_NUMBERS} numbers, expected fewer")
    if not rows:
        raise InputError(f"{where}: found no point, expected one per line: {', '.join(variables)}, e.g. 1/2,-1/3,...")
    return np.array(rows, dtype=np.float64)


def _from_npy(data: bytes, where: str, variables: Sequence[str]) -> lib.FloatArray:
    """Read the array of a .npy file; pickled objects are refused, since unpickling may execute code."""
    import numpy as np

    if len(data) > MAX_NPY_BYTES:
        raise InputError(f"{where}: found more than {MAX_NPY_BYTES} bytes, expected fewer")
    try:
        rows = np.load(io.BytesIO(data), allow_pickle=False)
    except Exception as error:  # numpy evaluates the header as a Python literal, which may raise any exception
        message = [*str(error).splitlines(), type(error).__name__][0]
        raise InputError(f"{where}: found a .npy file that cannot be read: {message[:200]}") from None
    dtype, shape, dim = rows.dtype, rows.shape, len(variables)
    if dtype.kind not in "fiu":
        kinds = {"c": "complex numbers", "b": "truth values", "U": "text", "S": "text"}
        kind = kinds.get(dtype.kind, f"the type {str(dtype)[:40]}")
        raise InputError(f"{where}: found an array of {kind}, expected real numbers")
    if len(shape) != 2 or shape[1] != dim or shape[0] < 1:
        raise InputError(
            f"{where}: found an array of shape {shape}, expected (n, {dim}): one row for each initial "
            f"point, with columns {', '.join(variables)}"
        )
    if rows.size > lib.MAX_NUMBERS:
        raise InputError(f"{where}: found an array of shape {shape}, expected at most {lib.MAX_NUMBERS} numbers")
    with np.errstate(over="ignore"):
        starts: lib.FloatArray = np.ascontiguousarray(rows, dtype=np.float64)
    bad_rows = np.flatnonzero(~np.isfinite(starts).all(axis=1))
    if len(bad_rows):
        bad_number = starts[bad_rows[0]][~np.isfinite(starts[bad_rows[0]])][0]
        raise InputError(f"{where}: row {bad_rows[0]}: found {bad_number}, expected finite numbers")
    return starts
