"""What becomes of a hypersurface under the Kahan map: points on it modulo large primes, followed along series.

Source: grammaticos-ramani-papageorgiou-1991.
"""

from __future__ import annotations

import random
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice, takewhile
from typing import Any

from flint import fmpq, nmod_poly

from kahanmaps.algebra.chance import random_prime_field
from kahanmaps.algebra.fields import PrimeField
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.algebra.polynomials import evaluate, gradient
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.growth.recurrences import find_recurrence
from kahanmaps.laboratory.singular.critical import critical_points, pole_points
from kahanmaps.laboratory.singular.jets import NotGeneric, PrecisionTooLow, Step, image_of, walk
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import BirationalMap

_MAX_PRECISION = 4096
_MOST_ALONG = 1024  # where series are followed far
_TRIES = 40
_LINES = 6  # on which critical points are looked for, and more while some have no point
_FEW_LINES = 2
_POINTS = 2  # each modulo a prime of its own
_CONSTANT = 8  # so often at least is the same order repeated that goes on
_CHECKED = 3  # so many times as many orders as their recurrence is long have to follow it
_SAME = 3  # points of one multiplicity and one first event that are followed, where it is done briefly
_FREE_STEPS = 100  # for which a hypersurface is followed that is one again

FIRST_STEPS = 12  # that are shown
CONFINED = "confined"
NOT_CONFINED = "not confined"
NOT_CONTRACTED = "not contracted"
UNDECIDED = "undecided"
NO_POINT = "no point was followed"
NO_TIME = "no two points could be followed in time"


@dataclass(frozen=True)
class Hypersurface:
    """An irreducible hypersurface over Q and what becomes of it under the map, at one exact eps.

    `is_pole`: it is a factor of det(I - eps f'(x)); `multiplicity`: how often it divides the Jacobian determinant of
    the homogeneous map (None: not computed); `polynomial` is "Z" for the hyperplane at infinity, and "?" where it is
    too large: then `degree` is that of all components of this multiplicity together. `status` is
    "confined", "not confined", "not contracted" or "undecided"; it is contracted by the step `contracted_at` and is a
    hypersurface again after the step `confined_at` (each None if that did not happen). `steps` tells the first steps,
    at the first of two points, modulo the first of the `primes`.

    It was followed for `followed` steps in all, and what happened after the step `settled_at` followed from what had
    happened before: nothing at all, the same again and again, or more and more by a linear recurrence. None where that
    cannot be said: its pattern is still running.
    """

    polynomial: str
    degree: int
    is_pole: bool
    multiplicity: int | None
    status: str
    contracted_at: int | None
    confined_at: int | None
    steps: tuple[Step, ...]
    primes: tuple[int, ...] = ()
    note: str = ""
    followed: int = 0
    settled_at: int | None = None


@dataclass(frozen=True)
class Range:
    """How far hypersurfaces are followed: along series for `shown` steps, and for `reach` steps in all.

    Memory can only come back where the image of a hypersurface meets points without a value. Beyond the first steps
    its image is therefore followed as a point, which is cheap. Where it meets such points along series again, which is
    not: for at most `along` steps. `end` is the time of the monotonic clock at which all of it stops. `briefly`: not
    even the first steps where fewer tell the fate.
    """

    shown: int
    reach: int
    along: int
    end: float
    briefly: bool = False

    @property
    def is_over(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.end


@dataclass(frozen=True)
class _Fate:
    """What became of one point: see Hypersurface."""

    status: str
    contracted_at: int | None = None
    confined_at: int | None = None
    steps: tuple[Step, ...] = ()
    followed: int = 0
    settled_at: int | None = None


_UNKNOWN = _Fate(UNDECIDED)


def fate_of(
    map_: BirationalMap,
    eps: fmpq,
    factor: Any,
    text: str,
    is_pole: bool,
    multiplicity: int | None,
    rng: random.Random,
    limits: Range,
) -> Hypersurface:
    """The hypersurface on which a form over Q vanishes, with what becomes of it, at one exact eps (half the time step).

    `factor` is irreducible, in the variables (X : Z), and `text` stands for it; two points modulo two random primes are
    followed. Source: grammaticos-ramani-papageorgiou-1991.
    """
    fates: list[_Fate] = []
    primes: list[int] = []

    def told(fate: _Fate, note: str = "") -> Hypersurface:
        degree = int(factor.total_degree())
        return Hypersurface(text, degree, is_pole, multiplicity, primes=tuple(primes), note=note, **vars(fate))

    for _ in range(_TRIES):
        if len(fates) == _POINTS or limits.is_over:
            break
        field = random_prime_field(rng)
        try:
            equations = map_.at(eps, field).equations
            place = _point_on(factor, field, rng)
        except BadPrime:
            continue
        if place is None or field.prime in primes:
            continue
        try:
            fates.append(_fate_at(equations, *place, rng, limits, len(fates[0].steps) if fates else None))
            primes.append(field.prime)
        except NotGeneric:
            continue
        except PrecisionTooLow:
            return told(_UNKNOWN, NO_TIME if limits.is_over else "the series lost all their terms")
    if len(fates) < _POINTS:
        return told(_UNKNOWN, NO_TIME)
    one, other = ((fate.status, fate.contracted_at, fate.confined_at) for fate in fates)
    if one != other:
        return told(_Fate(UNDECIDED, steps=fates[0].steps), "two points tell different things")
    return told(fates[0])


def untold(reason: str) -> Hypersurface:
    """Contracted hypersurfaces of which nothing is known, and why."""
    return Hypersurface("?", 0, False, None, note=reason, **vars(_UNKNOWN))


def unwritten(map_: BirationalMap, eps: fmpq, rng: random.Random, limits: Range) -> list[Hypersurface]:
    """The contracted hypersurfaces without their polynomials, told apart by multiplicity and fate of random points.

    At one exact `eps` (half the time step), on lines modulo random primes. Poles and infinity are left out. One with a
    multiplicity of which no point was found is undecided. Source: zander-2021.
    """
    return _at_random(map_, eps, rng, limits, False, _LINES)


def fates_at_random(map_: BirationalMap, eps: fmpq, rng: random.Random, limits: Range) -> list[Hypersurface]:
    """As `unwritten`, with the poles and infinity: in every dimension, without any polynomial."""
    lines = _FEW_LINES if limits.briefly else _LINES
    found = _at_random(map_, eps, rng, limits, True, lines)
    found += _at_random(map_, eps, rng, limits, False, lines)
    for _ in range(_TRIES):
        field = random_prime_field(rng)
        try:
            equations = map_.at(eps, field).equations
            point = [rng.randrange(field.prime) for _ in range(map_.dim)] + [0]
            tangents = _tangents(point, [0] * map_.dim + [1], field)
            event = _first_event(equations, point, rng, limits)
            fate = _UNKNOWN
            if tangents is not None:
                fate = _fate_at(equations, point, tangents, rng, limits, event=event)
        except (BadPrime, NotGeneric):
            continue
        except PrecisionTooLow:
            fate = _UNKNOWN
        found.append(Hypersurface("Z", 1, False, None, primes=(field.prime,), **vars(fate)))
        break
    return found


def _at_random(
    map_: BirationalMap, eps: fmpq, rng: random.Random, limits: Range, poles: bool, lines: int
) -> list[Hypersurface]:
    found: dict[tuple[Any, ...], Hypersurface] = {}
    degrees: dict[int, int] = {}
    seen_so: dict[tuple[int, int | None], int] = {}  # how many points of a multiplicity and a first event
    whole = False  # whether some line met every component in points over GF(p)
    for line in range(4 * lines):
        if (line >= lines and set(degrees) <= {key[0] for key in found}) or (whole and limits.briefly):
            break
        field = random_prime_field(rng)
        try:
            here = map_.at(eps, field)
            equations, inverses = here.equations, here.inverse.equations[::-1]
        except BadPrime:
            continue
        points, seen = pole_points(equations, rng) if poles else critical_points(equations, inverses, rng)
        degrees |= seen
        whole = whole or sum(seen.values()) == len(points)
        for critical in points:
            tangents = _tangents(critical.point, critical.gradient, field)
            if tangents is None or limits.is_over:
                continue
            event = _first_event(equations, critical.point, rng, limits) if limits.briefly else None
            seen_so[critical.multiplicity, event] = seen_so.get((critical.multiplicity, event), 0) + 1
            if event and seen_so[critical.multiplicity, event] > _SAME:
                continue
            try:
                fate = _fate_at(equations, critical.point, tangents, rng, limits, event=event)
            except NotGeneric:
                continue
            except PrecisionTooLow:
                fate = _UNKNOWN
            key = (critical.multiplicity, fate.status, fate.contracted_at, fate.confined_at)
            one = Hypersurface("?", seen[key[0]], poles, key[0], primes=(field.prime,), **vars(fate))
            found[key] = _joined(found[key], one) if key in found else one
    for multiplicity in set(degrees) - {h.multiplicity for h in found.values()}:
        untried = Hypersurface("?", degrees[multiplicity], poles, multiplicity, note=NO_POINT, **vars(_UNKNOWN))
        found[(multiplicity,)] = untried
    return sorted(found.values(), key=lambda h: (h.multiplicity, h.status, h.confined_at or 0))


def _joined(before: Hypersurface, new: Hypersurface) -> Hypersurface:
    """Two points of the same multiplicity with the same fate as one."""
    settled = None if None in (before.settled_at, new.settled_at) else max(before.settled_at or 0, new.settled_at or 0)
    return replace(
        before,
        primes=tuple(dict.fromkeys((*before.primes, *new.primes))),
        followed=min(before.followed, new.followed),
        settled_at=settled,
    )


def _told(ranks: Sequence[int], full: int) -> tuple[str, int | None, int | None]:
    """Status, the step that contracts and the step that ends it."""
    down = next((k for k, rank in enumerate(ranks, 1) if rank < full), None)
    if down is None:
        return NOT_CONTRACTED, None, None
    up = next((k for k, rank in enumerate(ranks, 1) if k > down and rank == full), None)
    return (NOT_CONFINED, down, None) if up is None else (CONFINED, down, up)


def _fate_at(
    equations: Sequence[Equation],
    point: Sequence[int],
    tangents: list[list[int]],
    rng: random.Random,
    limits: Range,
    shown: int | None = None,
    event: int | None = None,
) -> _Fate:
    """What becomes of the hypersurface with these tangents at a point.

    In `shown` steps only where that is given, and in steps just beyond the first event where these tell enough.
    """
    full = len(tangents)
    direction = [rng.randrange(equations[0].over.characteristic) for _ in point]

    def followed(steps: int) -> tuple[Step, ...]:
        run, is_whole = _walked(equations, point, direction, tangents, steps, limits.end)
        if not is_whole:
            raise PrecisionTooLow
        return tuple(run)

    attempts = [shown or limits.shown]
    if event is not None and event + 2 < limits.shown:
        attempts = [event + 2, *attempts]
    for steps in attempts:
        run = followed(steps)
        status, down, up = _told([step.rank for step in run], full)
        again = next((k for k, step in enumerate(run) if up is not None and k >= up and step.rank < full), None)
        if again is not None or (up or len(run)) < len(run) or not any(step.common for step in run):
            break
    last = max((k for k, step in enumerate(run, 1) if step.common), default=0)
    if status == NOT_CONTRACTED or shown is not None or again is not None:
        # A hypersurface that comes back to one that is contracted shares the fate of that one from then on.
        return _Fate(status, down, up, run, len(run), again if again is not None else up or 0)
    reach = limits.reach if up is None else min(limits.reach, len(run) + _FREE_STEPS)
    hit, reached = _next_hit(equations, run[-1].limit, len(run), reach, limits)
    if hit is None:
        return _Fate(status, down, up, run, reached, up or last)
    if up is not None:
        return _Fate(status, down, up, run, hit, hit)
    orders, _ = _walked(
        equations, point, direction, [], min(limits.reach, max(limits.along, 2 * hit)), limits.end, most=_MOST_ALONG
    )
    # What a pattern without an end meets on its way may show in the order of the denominator only.
    known = [step.denominator for step in takewhile(lambda step: step.denominator is not None, orders)]
    several = [_settled([step.common for step in orders[: len(known)]]), _settled([k or 0 for k in known])]
    settled = None if None in several else max(k or 0 for k in several)
    if settled is not None and settled + 2 > len(run) and len(orders) >= settled + 2:
        run = followed(settled + 2)
        status, down, up = _told([step.rank for step in run], full)
    return _Fate(status, down, up, run, len(orders), settled)


def _first_event(equations: Sequence[Equation], point: Sequence[int], rng: random.Random, limits: Range) -> int:
    """The first step that divides by a power of t, 0 where none of the first steps does."""
    direction = [rng.randrange(equations[0].over.characteristic) for _ in point]
    run, _ = _walked(equations, point, direction, [], limits.shown, limits.end, to_event=True)
    return len(run) if run and run[-1].common else 0


def _walked(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    tangents: Sequence[Sequence[int]],
    steps: int,
    end: float,
    to_event: bool = False,
    most: int = _MAX_PRECISION,
) -> tuple[list[Step], bool]:
    """So many steps along series as long as needed, and whether these are all: time or precision may end it.

    `to_event`: only to the first step that divides by a power of t.
    """
    precision = 8
    while True:
        run: list[Step] = []
        try:
            for step in islice(walk(equations, point, direction, tangents, precision), steps):
                run.append(step)
                if to_event and step.common:
                    return run, True
                if time.monotonic() > end:
                    return run, len(run) == steps
            return run, True
        except PrecisionTooLow:
            precision *= 2
            if precision > most or time.monotonic() > end:
                return run, False


def _next_hit(
    equations: Sequence[Equation], limit: Sequence[int], steps: int, reach: int, limits: Range
) -> tuple[int | None, int]:
    """The next step that a point of the image does not have, and the number of steps it was followed for."""
    at: Sequence[int] = limit
    for step in range(steps + 1, reach + 1):
        image = image_of(equations, at)
        if image is None:
            return step, step
        at = image
        if limits.is_over:
            return None, step
    return None, reach


def _settled(orders: Sequence[int]) -> int | None:
    """After how many terms a sequence of orders follows from those before, by a linear recurrence, or None.

    >>> _settled([0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]), _settled([0, 1, 1, 1, 1, 1, 1, 1, 1, 1])
    (3, 2)
    >>> _settled([0, 0, 1, 0, 1, 0, 2, 0, 2, 0, 3, 0, 3, 0, 4, 0, 4, 0]), _settled([0, 0, 0, 0, 0, 1])
    (6, None)
    """
    size = len(orders)
    change = next((k for k in range(size - 1, 0, -1) if orders[k] != orders[k - 1]), 0)
    if size - change >= _CONSTANT:
        return change + 1 if any(orders[change:]) else change
    found = find_recurrence(orders)
    return found.order if found is not None and size >= _CHECKED * found.order else None


def _point_on(factor: Any, field: PrimeField, rng: random.Random) -> tuple[list[int], list[list[int]]] | None:
    """A random point of the hypersurface modulo p and a basis of its tangent space in projective space, or None."""
    p = field.prime
    size = factor.context().nvars()
    a, b = ([rng.randrange(p) for _ in range(size)] for _ in range(2))
    line = evaluate(factor, field, [nmod_poly([x, v], p) for x, v in zip(a, b, strict=True)])
    if line.degree() < 1:
        return None
    roots = [-int(found[0]) for found, _ in line.factor()[1] if found.degree() == 1]
    if not roots:
        return None
    point = [(x + roots[0] * v) % p for x, v in zip(a, b, strict=True)]
    at = [field.convert(x) for x in point]
    slopes = [int(evaluate(slope, field, at)) for slope in gradient(factor)]
    tangents = _tangents(point, slopes, field) if any(slopes) else None
    return None if tangents is None else (point, tangents)


def _tangents(point: Sequence[int], gradient: Sequence[int], field: PrimeField) -> list[list[int]] | None:
    """A basis of the tangent space of a hypersurface at a point, modulo the point itself; None in special position."""
    size = len(point)
    basis = [[int(entry) for entry in vector] for vector in nullspace(field, field.matrix(1, size, list(gradient)))]
    # The point itself is tangent to the cone: a basis vector that occurs in it makes room for it. Basis vectors belong
    # to the columns without the pivot, which is the first that is not zero.
    pivot = next(k for k in range(size) if gradient[k])
    free = [k for k in range(size) if k != pivot]
    occurs = next((index for index, k in enumerate(free) if point[k]), None)
    return None if occurs is None else basis[:occurs] + basis[occurs + 1 :]
