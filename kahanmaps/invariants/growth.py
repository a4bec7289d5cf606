"""The kinds of growth of the degrees of iterates, or of the heights of the points of an orbit."""

from __future__ import annotations

from enum import StrEnum


class Growth(StrEnum):
    """A kind of growth, slower ones first; a finite number of heights supports it, but does not prove it."""

    ZERO = "zero"  # from some term on
    PERIODIC = "periodic"  # the orbit returned to its initial point: exact
    BOUNDED = "bounded"
    LOGARITHMIC = "logarithmic"
    LINEAR = "linear"
    QUADRATIC = "quadratic"
    POLYNOMIAL = "polynomial"
    EXPONENTIAL = "exponential"
    UNKNOWN = "unknown"  # degrees without a recurrence
    UNDECIDED = "undecided"  # heights that match no rule


OF_DEGREES = tuple(kind for kind in Growth if kind not in (Growth.PERIODIC, Growth.LOGARITHMIC, Growth.UNDECIDED))
