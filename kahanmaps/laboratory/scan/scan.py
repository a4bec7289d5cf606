"""Which members of a family of maps are integrable: components of parameter space where degrees grow more slowly.

All members with parameters in GF(p) are tried for several small primes p (`sweep`). Those whose degrees are smaller
than in general fall into classes by their degrees, these into pieces (`pieces`), and pieces that are there modulo all
primes are lifted to conditions over Q (`lift`). A condition is *found modulo* these primes. It is *confirmed* where
members on it, random modulo large primes, have the same degrees by the computation that `degrees` does. Nothing of this
is a proof. The kind of growth is that of one rational member, as `degrees` has it.
"""

from __future__ import annotations

import random
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.algebra.chance import seed_for
from kahanmaps.algebra.fields import QQ, rational
from kahanmaps.algebra.polynomials import primitive_part, ring
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.laboratory.scan.growth import Progress, with_growth, with_verdicts
from kahanmaps.laboratory.scan.lift import (
    RationalRows,
    flat_equations,
    lifted_conjugates,
    lifted_flats,
    lifted_forms,
    residues,
)
from kahanmaps.laboratory.scan.members import degrees_on, point_on
from kahanmaps.laboratory.scan.pieces import Rows, pieces, pivots
from kahanmaps.laboratory.scan.result import Component, Scan
from kahanmaps.laboratory.scan.sweep import Degrees, Sweep, TimeOver, sweep
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.kernels import processors

DEFAULT_SECONDS = 120.0
MAX_PARAMETERS = 8
# By the number of parameters, 0 standing for more, where members on random lines are tried: the ones that are wished,
# then those for families that take their time.
_PRIMES = {
    1: ((307, 311, 313, 317, 331, 337, 347, 349, 353, 359), (101, 103, 107, 109)),
    2: ((53, 59, 61, 67), (29, 31, 37, 41)),
    3: ((19, 23, 29, 31), (11, 13, 17, 19)),
    0: ((79, 83, 89, 97), (31, 37, 41, 43)),
}
_LINES = 150
_PART = 0.4  # of the time, for all members on their first line
_ROOM, _ROOM_OF_MANY = 260, 220  # for degrees before common factors are removed: up to 2 parameters, and more
_MOST_ROOM = 4096
_TRIAL_PRIME = 8179  # modulo which hardly a member is special
_MOST_TERMS = 7
_MEMBERS = 3  # that confirm a component
_SHARE = 0.5  # of the prime, points of a curve at least
_TRIES = 20  # for a rational member


def scan(
    file: SystemFile,
    over: Sequence[str],
    *,
    eps: Any = None,
    terms: int | None = None,
    primes: Sequence[int] | None = None,
    seconds: float = DEFAULT_SECONDS,
    seed: int = 0,
    jobs: int | None = None,
    analysis: float | None = None,
    progress: Progress = lambda _: None,
) -> Scan:
    """The conditions on parameters under which the degrees of the iterates are smaller than in general.

    Args:
        file: the family; its claims are not looked at.
        over: names of its parameters that vary, the others have the values of the file; eps may be one of them.
        eps: an exact number, or None for generic eps: conditions that hold for every eps.
        terms: how many iterates are measured, by default as many as have small degrees, at most 7.
        primes: at least three primes, by default such that the members are some ten thousand.
        seconds: time for everything, about.
        seed: of everything random.
        jobs: threads, by default as many as processors; they need numba.
        analysis: seconds for an analysis of a member on each component whose degrees do not grow exponentially; of
            points with the same degrees one is enough. None for none.
        progress: is told what is being done.

    Returns:
        A `Scan`. Found modulo primes and confirmed at members, which is evidence and no proof.

    Raises:
        InputError: for unknown parameters, wrong primes, a map that exists nowhere.

    >>> from kahanmaps.documents.files import parse_system
    >>> lines = parse_system('''variables = ["x", "y"]
    ... parameters.g = 1
    ... [system]
    ... rhs = ["x*(x + 2*y)", "-y*((g + 1)*x + g*y)"]''')
    >>> found = scan(lines, ["g"], terms=5)
    >>> [one.text for one in found.components if one.growth.growth == "quadratic"]
    ['2', '1']
    """
    names = tuple(dict.fromkeys(over))
    if not names:
        raise InputError("found no parameter to scan over, expected at least one")
    if len(names) > MAX_PARAMETERS:
        raise InputError(f"found {len(names)} parameters to scan over, expected at most {MAX_PARAMETERS}")
    if "eps" in names:
        names = (*(name for name in names if name != "eps"), "eps")
    map_ = map_with_symbols(file, [name for name in names if name != "eps"])
    exact = None if eps is None else rational(eps)
    if exact is not None and "eps" in names:
        raise InputError("found eps both as a number and as a parameter to scan over, expected one of the two")
    if "eps" in names and not map_.has_eps:
        raise InputError("found eps as a parameter to scan over, expected a map that depends on it")
    if exact == 0:
        raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
    if jobs is not None and jobs < 1:
        raise InputError(f"found {jobs} jobs, expected at least 1")
    if primes is not None and (len(set(primes)) < 3 or any(p < 5 or not fmpz(p).is_prime() for p in primes)):
        given = ", ".join(map(str, primes))
        raise InputError(f"found the primes {given}, expected at least three different ones, from 5 on")
    rng = random.Random(f"scan {seed_for(seed, names, map_.subject, exact)}")
    began = time.monotonic()
    terms, room, cost = _terms(map_, len(names), exact, terms, rng)
    lines = None if len(names) in _PRIMES else _LINES
    jobs = jobs or processors()

    def count(some: Sequence[int]) -> int:
        return sum(p ** len(names) if lines is None else p * lines for p in some)

    if primes is None:
        wished, fewer = _PRIMES[len(names) if lines is None else 0]
        primes = wished if cost * count(wished) / jobs < _PART * seconds else fewer
    sweeps: list[Sweep] = []
    ended = "complete"

    def told(done: int, _: int) -> None:
        done, total = done + sum(one.seen for one in sweeps), count(primes)
        left = (time.monotonic() - began) * (total - done) / done
        progress(f"scan: {done} of {total} members, {left:.0f} s left")

    limits: dict[str, Any] = {"lines": lines, "jobs": jobs, "deadline": began + 0.8 * seconds, "progress": told}
    for p in primes:
        try:
            name = f"{rng.getrandbits(64)} {p}"
            sweeps.append(sweep(map_, len(names), p, exact, terms, room, seed=name, **limits))
        except BadPrime:
            continue
        except TimeOver:
            ended = "time"
            break
    generic = max((one.generic for one in sweeps), default=())
    sweeps = [one for one in sweeps if one.generic == generic]
    found = _components(sweeps, names, rng)
    known = []
    for k, one in enumerate(found):
        progress(f"scan: confirms component {k + 1} of {len(found)}")
        known.append(_confirmed(one, names, map_, exact, found, rng))
    known = with_growth(known, file, map_, exact, began + seconds, seed, progress)
    if analysis is not None:
        known = with_verdicts(known, file, exact, analysis, seed, progress)
    left = tuple(_left(one, known) for one in sweeps)
    symmetric = tuple(
        (names[i], names[j]) for i, j in combinations(range(len(names)), 2) if _is_symmetric(sweeps, i, j)
    )
    return Scan(file, names, exact, seed, generic, tuple(known), tuple(sweeps), left, symmetric, ended)


def _terms(
    map_: BirationalMap, count: int, eps: fmpq | None, terms: int | None, rng: random.Random
) -> tuple[int, int, float]:
    """How many iterates are measured, the room that they need, and the seconds for a member.

    Tried on members modulo a larger prime.
    """
    import numpy as np

    from kahanmaps.maps.residues.families import LONG, NOWHERE, Family

    if terms is not None and not 1 <= terms <= 2 * _MOST_TERMS:
        raise InputError(f"found {terms} terms, expected 1 to {2 * _MOST_TERMS}")
    family = Family(map_, _TRIAL_PRIME)
    tried = np.array([[rng.randrange(1, _TRIAL_PRIME) for _ in range(count)] for _ in range(8)])
    usual = _ROOM if count <= 2 else _ROOM_OF_MANY
    room = usual if terms is None else _MOST_ROOM
    found = family.degrees(tried, eps, terms or _MOST_TERMS, room, rng).max(axis=0).tolist()
    if found[0] == NOWHERE:
        raise InputError("the map has no value anywhere, whatever the parameters are")
    measured = sum(degree >= 0 for degree in found)
    if measured == 0 or (terms is not None and measured < terms):
        raise InputError(f"the degrees of {terms or 1} iterates are too large to be scanned, expected fewer")
    room = max(family.dim * family.degree * d + 1 for d in [1, *found[: measured - 1]])
    family.degrees(np.resize(tried, (LONG, count)), eps, 1, room, rng)  # which compiles
    began = time.monotonic()
    family.degrees(np.resize(tried, (LONG, count)), eps, measured, room, rng)
    return measured, room, (time.monotonic() - began) / LONG


def _components(sweeps: Sequence[Sweep], names: tuple[str, ...], rng: random.Random) -> list[Component]:
    """What the pieces of each class modulo the primes are lifted to."""
    found = []
    for degrees in sorted({degrees for one in sweeps for degrees in one.classes}):
        parts = [
            pieces(one.classes[degrees], one.prime, one.seen, one.complete, rng)
            for one in sweeps
            if degrees in one.classes
        ]
        for dimension in range(len(names)):
            flats = {part.prime: part.flats[dimension] for part in parts if part.flats.get(dimension)}
            if dimension == 0 and _is_a_curve({p: len(points) for p, points in flats.items()}):
                continue
            lifted = lifted_flats(flats)
            for rows, at in lifted.items():
                found.append(Component(flat_equations(rows, names), dimension, degrees, at))
            if dimension == 0:
                found += _conjugates(flats, set(lifted), degrees, names)
        for size in {len(rows) for part in parts for rows in part.forms}:
            inside = {part.prime: [rows for rows in part.forms if len(rows) == size] for part in parts}
            for rows in lifted_flats(inside):
                forms = {part.prime: part.forms.get(residues(rows, part.prime) or (), []) for part in parts}
                equations = flat_equations(rows, names)
                free = [name for k, name in enumerate(names) if k not in pivots(rows)]
                for form, at in lifted_forms(forms, free):
                    whole = form.project_to_context(ring(names))
                    found.append(Component((whole, *equations), len(free) - 1, degrees, at))
    return found


def _conjugates(
    points: Mapping[int, Sequence[Rows]], rational: Iterable[RationalRows], degrees: Degrees, names: Sequence[str]
) -> Iterator[Component]:
    """The points over quadratic fields among those that are not rational."""
    known = {p: {residues(rows, p) for rows in rational} for p in points}
    rest = {p: [[-row[-1] % p for row in rows] for rows in some if rows not in known[p]] for p, some in points.items()}
    for (*line, (s, q)), at in lifted_conjugates(rest, len(names)).items():
        context = ring(names)
        t = context.gen(next(k for k in range(len(names)) if k not in pivots(line)))
        equation = primitive_part(t**2 + s * t + q)[1]
        yield Component((equation, *flat_equations(tuple(line), names)), 0, degrees, at)


def _is_a_curve(counts: dict[int, int]) -> bool:
    """Whether numbers of points modulo primes grow as those of a curve do."""
    if len(counts) < 2:
        return False
    low, high = min(counts), max(counts)
    return counts[low] >= _SHARE * low and counts[high] - counts[low] >= _SHARE * (high - low)


def _confirmed(
    one: Component,
    names: Sequence[str],
    map_: BirationalMap,
    eps: fmpq | None,
    others: Sequence[Component],
    rng: random.Random,
) -> Component:
    """The component with what random members on it say, and a rational one that is on no smaller component."""
    measured = [degrees_on(map_, one.equations, len(names), eps, one.degrees, rng) for _ in range(_MEMBERS)]
    known = [degrees for degrees in measured if degrees is not None]
    values = None
    for _ in range(_TRIES):
        point = point_on(one.equations, len(names), QQ, rng)
        if point is None:
            break
        if names[-1] == "eps" and point[-1] == 0:
            continue
        if not any(other.dimension < one.dimension and other.contains(point) for other in others):
            values = dict(zip(names, point, strict=True))
            break
    return replace(one, tried=len(known), confirmed=known.count(one.degrees), values=values)


def _left(one: Sweep, components: Sequence[Component]) -> int:
    """The number of slow members modulo a prime that are on no component with their degrees."""
    return sum(
        not any(other.contains(point, one.prime) for other in components if other.degrees == degrees)
        for degrees, points in one.classes.items()
        for point in points
    )


def _is_symmetric(sweeps: Sequence[Sweep], i: int, j: int) -> bool:
    """Whether exchanging two parameters moves slow members, and to members with the same degrees, modulo each prime."""

    def exchanged(point: tuple[int, ...]) -> tuple[int, ...]:
        values = list(point)
        values[i], values[j] = values[j], values[i]
        return tuple(values)

    return bool(sweeps) and all(
        one.complete
        and any(exchanged(x) != x for x in one.slow)
        and all(one.slow.get(exchanged(x)) == degrees for x, degrees in one.slow.items())
        for one in sweeps
    )
