"""The road from exact numbers to machine numbers, and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from math import isfinite
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.parsing import parse_point
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.errors import InputError

FloatArray = NDArray[np.float64]


def to_float(value: fmpq) -> float:
    """The double nearest to a rational number. Raises InputError where it lies outside the range of doubles."""
    try:
        nearest = int(value.p) / int(value.q)
    except OverflowError as error:
        raise InputError("found a number beyond the range of machine floats (1.8e308): use exact arithmetic") from error
    return nearest


def to_floats(values: Sequence[Any]) -> FloatArray:
    """Exact numbers rounded to doubles, each to the nearest.

    >>> to_floats(["1/3", "2"])
    array([0.33333333, 2.        ])
    """
    return np.array([to_float(rational(value)) for value in values], dtype=np.float64)


def start_rows(starts: Any) -> FloatArray:
    """One start or many as rows of doubles: of numbers of any kind, or of text.

    >>> start_rows(["1/2", 0]), start_rows([[1, 2.5]])
    (array([[0.5, 0. ]]), array([[1. , 2.5]]))
    """
    if isinstance(starts, str):
        starts = parse_point(starts)
    try:
        return np.atleast_2d(np.array(starts, dtype=np.float64))
    except (TypeError, ValueError):
        rows = starts if all(isinstance(row, list | tuple) for row in starts) else [starts]
    if len({len(row) for row in rows}) != 1:
        raise InputError("found starts of different lengths, expected as many coordinates in each")
    return np.array([[x if isinstance(x, float) else to_float(rational(x)) for x in row] for row in rows])


def exact(value: float) -> fmpq:
    """The rational number that a finite double is."""
    numerator, denominator = value.as_integer_ratio()
    return fmpq(numerator, denominator)


class _Floats:
    """Machine numbers, as far as evaluating a rational function, and printing a point, need a field."""

    zero = 0.0
    one = 1.0

    @staticmethod
    def convert(value: Any) -> float:
        return to_float(rational(value))

    @staticmethod
    def value(polynomial: Any, point: Sequence[float]) -> None:
        """None: there is no other way than term by term."""

    @staticmethod
    def is_zero(value: float) -> bool:
        return value == 0.0

    @staticmethod
    def format(value: float) -> str:
        return repr(value)

    @staticmethod
    def working() -> AbstractContextManager[None]:
        return nullcontext()


FLOATS: Any = _Floats()


def float_function(function: RationalFunction) -> Callable[[Sequence[float]], float | None]:
    """The rational function in double precision; None where the denominator is 0 or the value is no finite number."""

    def value(point: Sequence[float]) -> float | None:
        try:
            result: float | None = function.value(_Floats, point)
        except (OverflowError, ZeroDivisionError):
            return None
        return result if result is not None and isfinite(result) else None

    return value
