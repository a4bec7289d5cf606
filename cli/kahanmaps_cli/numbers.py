"""Machine numbers for people and for JSON, which knows no infinity."""

from __future__ import annotations

from math import isfinite
from typing import Any


def json_float(value: Any) -> float | str:
    """A JSON number, or the text inf, -inf or nan."""
    number = float(value)
    return number if isfinite(number) else repr(number)


def json_number(value: Any) -> Any:
    """The same, and for a complex number its real and imaginary part."""
    number = complex(value)
    if isinstance(value, complex) or getattr(value, "dtype", None) == "complex128":
        return [json_float(number.real), json_float(number.imag)]
    return json_float(value)


def short_float(value: Any) -> str:
    """Three digits."""
    return f"{float(value):.3g}"
