"""How what is said of a map is known, from an identity multiplied out to an estimate."""

from __future__ import annotations

from enum import StrEnum


class Known(StrEnum):
    """How something is known; NOTE where that is not the question.

    EXPLAINED is what follows exactly from the patterns of singularities, which are measured.
    """

    PROVED = "proved"
    SUPPORTED = "supported"  # at random points, with a bound for the probability of an error
    EXPLAINED = "explained"
    MEASURED = "measured"  # modulo primes, or on orbits
    ESTIMATED = "estimated"
    UNDECIDED = "undecided"
    NOTE = "note"
