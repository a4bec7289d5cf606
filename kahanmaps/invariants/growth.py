"""How something grows with n: the degrees of iterates, or the heights of the points of an orbit."""

from __future__ import annotations

from enum import StrEnum


class Growth(StrEnum):
    """The kinds of growth, the slower ones first; heights show them as far as a finite orbit does."""

    ZERO = "zero"  # from some term on
    PERIODIC = "periodic"  # the start came back: exact
    BOUNDED = "bounded"
    LOGARITHMIC = "logarithmic"
    LINEAR = "linear"
    QUADRATIC = "quadratic"
    POLYNOMIAL = "polynomial"
    EXPONENTIAL = "exponential"
    UNKNOWN = "unknown"  # of degrees without a recurrence
    UNDECIDED = "undecided"  # of heights that follow no rule


OF_DEGREES = tuple(kind for kind in Growth if kind not in (Growth.PERIODIC, Growth.LOGARITHMIC, Growth.UNDECIDED))
