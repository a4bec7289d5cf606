"""What the lengths of cycles over a finite field are compatible with: three laws, and none of them is proved.

A map of the plane with an integral maps each level curve to itself, and if it has infinite order, these have genus 1 or
0. An irreducible one has at most p + 1 + 2 sqrt p points, and no cycle on it is longer. A few are reducible: the Euler
numbers of the singular fibres of a pencil of cubics, or of any rational elliptic surface, add up to 12, so that at most
6 are. Their components are rational, at most 9 of them. A cycle that goes through k of them has k d points, where d is
the order of a Moebius map over GF(p): a divisor of p - 1 or of p + 1, or p. So a longer cycle of any other length, at a
prime of good reduction, tells that there is no such integral. In higher dimensions some are allowed for: special level
sets may consist of other parts that are exchanged.

For a product of two random involutions the share of points on cycles of length at most x z tends to 1 - e^-x (1 + x),
where z = 2 N/(fixed points of both). A random permutation of N points has about log N cycles. Each comparison is
evidence modulo one prime at one eps. Sources: roberts-jogia-vivaldi-2003 for the first law, roberts-vivaldi-2009 for
the second.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from kahanmaps.errors import counted
from kahanmaps.laboratory.finite.cycles import Census

LAWS = ("integrable bound", "random reversible", "random permutation")
_COMPONENTS = 9  # of a level curve, that of type II* or I_9
_EXCEPTIONS = 0.05  # of the points, in dimensions above 2
_ENOUGH = 0.05  # of all points have to be periodic before lengths say something of level curves
_FEW = 20  # cycles, below which no distribution is compared
_REPEATS = 200


@dataclass(frozen=True)
class Comparison:
    """Which laws the lengths of one census are compatible with, and a sentence for each law that says why.

    Laws that are neither `compatible` nor `refused` could not be tried.

    `share_within` is the share of periodic points on cycles of at most `bound` = p + 1 + floor(2 sqrt p) points;
    `longer` are the lengths above it, with the numbers of cycles (of points, for samples), and `unexplained` those of
    them that no reducible level curve has;
    `distance` the largest distance of the distribution of scaled lengths from 1 - e^-x (1 + x), `critical` what so many
    cycles of a random reversible map stay below in 99 of 100 cases (None: not compared).
    """

    bound: int
    share_within: float | None
    longer: Mapping[int, int]
    unexplained: tuple[int, ...]
    scale: float | None
    model_scale: float | None
    distance: float | None
    critical: float | None
    compatible: tuple[str, ...]
    refused: tuple[str, ...]
    reasons: Mapping[str, str]

    def verdict(self, law: str) -> str:
        """ "compatible", "not compatible" or "not tried"."""
        return "compatible" if law in self.compatible else "not compatible" if law in self.refused else "not tried"


def compare(census: Census, seed: int = 0) -> Comparison:
    """Which of the three laws the lengths of a census are compatible with, one prime and one eps at a time.

    Counts are exact; the critical distance is found with `seed` by drawing lengths of random reversible maps.
    Returns a Comparison; where a law cannot be tried (too few cycles, samples) its reason says why.
    Source: roberts-vivaldi-2009, roberts-jogia-vivaldi-2003.

    >>> from kahanmaps.laboratory.finite.cycles import cycle_census
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> census = cycle_census(QuadraticSystem.from_text(["x", "y"], ["y", "6*x^2 - 2"]), "1/10", 499)
    >>> compare(census).compatible
    ('integrable bound',)
    """
    from kahanmaps.maps.residues.projective import hasse_weil

    bound = hasse_weil(census.prime)
    reasons: dict[str, str] = {}
    verdicts: dict[str, bool] = {}
    lengths = _affine(census)
    weight = sum((length if census.complete else 1) * n for length, n in lengths.items())
    if not weight:
        none = "no cycle with an affine point was seen"
        return Comparison(bound, None, {}, (), None, None, None, None, (), (), dict.fromkeys(LAWS, none))
    longer = {length: n for length, n in lengths.items() if length > bound}
    unexplained = tuple(length for length in longer if not _passes_components(length, census.prime))

    def points_on(some: Iterable[int]) -> int:
        return sum((length if census.complete else 1) * lengths[length] for length in some)

    share = (weight - points_on(longer)) / (weight + census.open)
    strange = (points_on(unexplained) + census.open) / (weight + census.open)
    settled = "affine periodic points" if census.complete else "sampled points that meet no indeterminacy"
    reasons[LAWS[0]] = (
        f"{100 * share:.1f}% of the {settled} lie on cycles of at most p + 1 + 2 sqrt p = {bound} points, "
        "as many as a curve of genus 1 may have"
    )
    if longer:
        odd, number = sum(longer[length] for length in unexplained), sum(longer.values())
        what = "longer cycle" if census.complete else "sampled point"
        more = "" if census.complete else " on longer cycles"
        reasons[LAWS[0]] += f"; of {counted(number, what)}{more} {odd} cannot lie on a reducible curve"
    if unexplained and census.dim == 2:
        verdicts[LAWS[0]] = False
    elif weight < _ENOUGH * census.looked_at:
        reasons[LAWS[0]] += f"; but only {weight} of {census.looked_at} points are periodic, too few to tell"
    elif census.open and census.steps < bound:
        reasons[LAWS[0]] += f"; but {census.open} were left after {census.steps} steps, too early to tell"
    else:
        verdicts[LAWS[0]] = strange <= _EXCEPTIONS
    scale, model, distance, critical = _reversible(census, seed, reasons)
    if distance is not None and critical is not None:
        verdicts[LAWS[1]] = distance <= critical
    if census.cycles is None:
        reasons[LAWS[2]] = "cycles are not counted where points are sampled"
    else:
        cycles = sum(lengths.values())
        expected = math.log(weight) + 0.5772
        reasons[LAWS[2]] = (
            f"{cycles} cycles, where a random permutation of {weight} points has {expected:.1f} on average"
        )
        if weight < 50:
            reasons[LAWS[2]] += "; too few points to tell"
        else:
            verdicts[LAWS[2]] = abs(cycles - expected) <= 3 * math.sqrt(expected)
    held = tuple(law for law in LAWS if verdicts.get(law) is True)
    refused = tuple(law for law in LAWS if verdicts.get(law) is False)
    return Comparison(bound, share, longer, unexplained, scale, model, distance, critical, held, refused, reasons)


def _reversible(
    census: Census, seed: int, reasons: dict[str, str]
) -> tuple[float | None, float | None, float | None, float | None]:
    """Scale, scale of the model, distance and critical distance for the law of random reversible maps."""
    law = LAWS[1]
    model = 2 * census.points / sum(census.fixed) if census.fixed and sum(census.fixed) else None
    if census.symmetric is None:
        reasons[law] = "no reversing symmetry is known" if census.complete else "not compared where points are sampled"
        return None, None, None, None
    lengths = census.symmetric
    count = sum(lengths.values())
    if count < _FEW:
        reasons[law] = f"{count} symmetric cycles, too few to compare"
        return None, model, None, None
    # Orbits that fall out shorten the cycles of a random map as well: they end at the same rate everywhere, so the law
    # stays and only its scale is another. So the scale is the mean length, and that of the model is told beside it.
    scale = sum(length * n for length, n in lengths.items()) / count
    distance = _distance([(length / scale, n) for length, n in lengths.items()])
    critical = _critical(count, seed)
    shown = "" if model is None else f", where 2 N/(fixed points) = {model:.1f}"
    reasons[law] = (
        f"scaled by their mean {scale:.1f}{shown}, the lengths of {count} symmetric cycles are {distance:.3f} away "
        f"from 1 - e^-x (1 + x); of random maps 99 in 100 are less than {critical:.3f} away"
    )
    return scale, model, distance, critical


def _passes_components(length: int, prime: int) -> bool:
    """Whether a cycle of this length may go through the components of a reducible curve: k d, see above."""
    for k in range(2, _COMPONENTS + 1):
        d, rest = divmod(length, k)
        if rest == 0 and (d == prime or (prime - 1) % d == 0 or (prime + 1) % d == 0):
            return True
    return False


def _affine(census: Census) -> dict[int, int]:
    """The cycles with an affine point: a plane at infinity that the map leaves invariant has a law of its own."""
    left = {length: n - census.at_infinity.get(length, 0) for length, n in census.lengths.items()}
    return {length: n for length, n in left.items() if n}


def _distance(lengths: Sequence[tuple[float, int]]) -> float:
    """The largest distance between 1 - e^-x (1 + x) and the share of points on cycles of scaled length at most x."""
    total = sum(x * n for x, n in lengths)
    below = worst = 0.0
    for x, n in sorted(lengths):
        law = 1 - math.exp(-x) * (1 + x)
        worst = max(worst, abs(law - below / total))
        below += x * n
        worst = max(worst, abs(law - below / total))
    return worst


def _critical(count: int, seed: int) -> float:
    """The distance that 99 of 100 random reversible maps with so many cycles stay below."""
    rng = random.Random(f"cycles {seed}")
    drawn = min(count, 400)
    distances = []
    for _ in range(_REPEATS):
        lengths = [rng.expovariate(1.0) for _ in range(drawn)]
        mean = sum(lengths) / drawn
        distances.append(_distance([(length / mean, 1) for length in lengths]))
    return sorted(distances)[int(0.99 * _REPEATS)] * math.sqrt(drawn / count)
