"""What is said of a map, and how it is known: from an identity multiplied out to an estimate."""

from __future__ import annotations

from dataclasses import dataclass
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


@dataclass(frozen=True)
class KnownStatement:
    """One line of a report and how it is known."""

    status: Known
    text: str
