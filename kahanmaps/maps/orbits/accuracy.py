"""How many bits balls need: more and more, until the last point is as accurate as asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flint import arb

from kahanmaps.algebra.fields import MAX_BALL_BITS
from kahanmaps.maps.orbits.iteration import Iterates, Orbit

_BITS_PER_DIGIT = 3.3219281


class NotAccurate(Exception):
    """No precision was enough."""


def bits_for(
    orbit_with: Callable[[int], Orbit | Iterates], digits: int, told: Callable[[str], None] | None = None
) -> int:
    """The bits with which every point has `digits` correct digits of its largest coordinate; doubled in every trial.

    `orbit_with` makes the orbit over RR(bits). An orbit that ends for another reason than precision is taken as it
    is. `told` hears of every trial. Raises NotAccurate where not even the largest precision will do.

    >>> from kahanmaps.algebra.fields import RR
    >>> from kahanmaps.maps.kahan import KahanMap
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"])
    >>> bits_for(lambda bits: Orbit(KahanMap(system, "1/10", RR(bits)), [1, 2], 50), 15)
    128
    """
    bits = 64
    while bits < digits * _BITS_PER_DIGIT + 32:
        bits *= 2
    while bits < MAX_BALL_BITS:
        orbit = orbit_with(bits)
        if told is not None:
            told(f"balls of {bits} bits")
        enough = all(_accurate(point.x, digits) for point in orbit)  # stops at the first one that is not
        if enough and orbit.end is not None and orbit.end.status != "precision":
            return bits
        bits *= 2
    raise NotAccurate(f"not even balls of {bits // 2} bits give {digits} digits at every point")


def _accurate(x: Sequence[arb], digits: int) -> bool:
    """Whether the coordinates are known to so many decimal digits of the largest one (a coordinate may be zero)."""
    largest = max(abs(entry.mid()) for entry in x)
    return all(entry.is_exact() or entry.rad() * arb(10) ** digits <= largest for entry in x)
