"""Conversion between exact numbers and floating-point numbers (doubles)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from math import isfinite
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.errors import InputError

FloatArray = NDArray[np.float64]


def to_float(value: fmpq) -> float:
    """Return the double nearest to a rational number. Raises InputError if the number is too large for a double."""
    try:
        nearest_double = int(value.p) / int(value.q)
    except OverflowError as error:
        raise InputError(
            "found a number beyond the range of floating-point numbers, expected one below 1.8e308 (exact orbits have "
            "no such limit)"
        ) from error
    return nearest_double


def double(value: Any) -> float:
    """Round an exact number to the nearest double; return a float of Python or numpy unchanged."""
    return float(value) if isinstance(value, float | np.floating) else to_float(rational(value))


def to_floats(values: Sequence[Any]) -> FloatArray:
    """Round exact numbers to the nearest doubles; floats do not change.

    >>> to_floats(["1/3", "2"])
    array([0.33333333, 2.        ])
    """
    return np.array([double(value) for value in values], dtype=np.float64)


def exact(value: float) -> fmpq:
    """Return the rational number that equals a finite double."""
    numerator, denominator = value.as_integer_ratio()
    return fmpq(numerator, denominator)


class _Floats:
    """Floating-point numbers, with those methods of a field that evaluation and printing need."""

    zero = 0.0
    one = 1.0

    @staticmethod
    def convert(value: Any) -> float:
        return to_float(rational(value))

    @staticmethod
    def value(polynomial: Any, point: Sequence[float]) -> None:
        """Return None: floats have no evaluation method of their own, so `polynomials.evaluate` sums the terms."""

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
    """Return a function that evaluates a rational function in double precision.

    Its value is None if the denominator is 0 or the result is not finite.
    """

    def value(point: Sequence[float]) -> float | None:
        try:
            result: float | None = function.value(_Floats, point)
        except (OverflowError, ZeroDivisionError):
            return None
        return result if result is not None and isfinite(result) else None

    return value
