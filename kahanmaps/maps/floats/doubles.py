"""The road from exact numbers to machine numbers, and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
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


def exact(value: float) -> fmpq:
    """The rational number that a finite double is."""
    numerator, denominator = value.as_integer_ratio()
    return fmpq(numerator, denominator)
