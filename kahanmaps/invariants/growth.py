"""The kinds of growth of the degrees of iterates, or of the heights of the points of an orbit."""

from __future__ import annotations

from enum import StrEnum


class Growth(StrEnum):
    """A kind of growth, slower kinds first; finitely many heights or degrees support a kind, but do not prove it."""

    ZERO = "zero"  # all degrees are 0 from some step on
    PERIODIC = "periodic"  # the orbit returned to its initial point: this is exact
    BOUNDED = "bounded"
    LOGARITHMIC = "logarithmic"
    LINEAR = "linear"
    QUADRATIC = "quadratic"
    POLYNOMIAL = "polynomial"
    EXPONENTIAL = "exponential"
    UNKNOWN = "unknown"  # degrees for which no recurrence was found
    UNDECIDED = "undecided"  # heights that match no rule of HeightGrowth


GROWTHS_OF_DEGREES = tuple(
    kind for kind in Growth if kind not in (Growth.PERIODIC, Growth.LOGARITHMIC, Growth.UNDECIDED)
)
