"""The kinds of growth of the degrees of iterates, or of the heights of the points of an orbit."""

from __future__ import annotations

from enum import StrEnum


class Growth(StrEnum):
    """A kind of growth, from slow to fast. Finitely many heights or degrees support a kind, but do not prove it."""

    ZERO = "zero"  # the iterates have degree 0 (are constant) from some step on
    PERIODIC = "periodic"  # proved: the orbit returned to its initial point
    BOUNDED = "bounded"
    LOGARITHMIC = "logarithmic"
    LINEAR = "linear"
    QUADRATIC = "quadratic"
    POLYNOMIAL = "polynomial"
    EXPONENTIAL = "exponential"
    UNKNOWN = "unknown"  # degrees for which no recurrence is accepted
    UNDECIDED = "undecided"  # heights that match no rule of HeightGrowth


GROWTHS_OF_DEGREES = tuple(
    kind for kind in Growth if kind not in (Growth.PERIODIC, Growth.LOGARITHMIC, Growth.UNDECIDED)
)
