"""Machine numbers for people and for JSON, which knows no infinity; matrices on the line."""

from __future__ import annotations

from typing import Any

from kahanmaps.errors import InputError, counted
from kahanmaps_cli import library as lib


def json_number(value: Any) -> Any:
    """A JSON number, or the text inf, -inf or nan; for a complex number its real and imaginary part."""
    number = complex(value)
    if isinstance(value, complex) or getattr(value, "dtype", None) == "complex128":
        return [lib.json_float(number.real), lib.json_float(number.imag)]
    return lib.json_float(value)


def short_float(value: Any) -> str:
    """Three digits."""
    return f"{float(value):.3g}"


def read_matrix(text: str) -> lib.fmpq_mat:
    """A square matrix written row by row, rows separated by semicolons."""
    rows = [list(lib.parse_point(row)) for row in text.split(";")]
    if len(rows) > lib.MAX_DIMENSION or any(len(row) != len(rows) for row in rows):
        found = f"{counted(len(rows), 'row')} of lengths {sorted({len(row) for row in rows})}"
        raise InputError(f"found {found}, expected a square matrix, at most {lib.MAX_DIMENSION} x {lib.MAX_DIMENSION}")
    return lib.fmpq_mat(rows)
