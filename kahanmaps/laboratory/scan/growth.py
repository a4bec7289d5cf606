"""How degrees grow on the components of a scan, and what an analysis says of members on them."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import replace

from flint import fmpq

from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.symbols import member_of
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.growth.recurrences import GrowthClass
from kahanmaps.laboratory.scan.members import degrees_on
from kahanmaps.laboratory.scan.result import STEPS, Component
from kahanmaps.laboratory.scan.sweep import Degrees, TimeOver
from kahanmaps.maps.implicit import BirationalMap

Progress = Callable[[str], None]

_SECONDS, _ATTEMPTS = 10.0, 2
_TERMS, _LARGE = 26, 1000  # where no rational member is known: so many degrees, as far as they are not above this
_SOME = 100  # the degree up to which they are compared, at least
_MEASURED_EACH = (GrowthClass.LINEAR, GrowthClass.QUADRATIC, GrowthClass.POLYNOMIAL)
_ORDER = (*(c for c in GrowthClass if c is not GrowthClass.UNKNOWN), GrowthClass.UNKNOWN)


def with_growth(
    components: list[Component],
    file: SystemFile,
    map_: BirationalMap,
    eps: fmpq | None,
    deadline: float,
    check: Callable[[], None],
    seed: int,
    progress: Progress,
    by: str,
) -> tuple[list[Component], int]:
    """The components with the growth at a rational member, those with the slowest first; for how many it is missing.

    Where it is bounded or exponential one member of each class is enough, if further degrees of the others are its own.
    """
    found = sorted(components, key=lambda one: one.degrees[::-1])
    enough: dict[Degrees, DegreeGrowth] = {}
    missed = 0
    for k, one in enumerate(found):
        if one.degrees[-1] < 0:
            continue
        try:
            progress(f"scan: growth on component {k + 1} of {len(components)}")
            check()
            if by == "degrees" and _goes_on(one, enough.get(one.degrees), map_, eps, seed):
                continue
            left = max(0.1, deadline - time.monotonic())
            known = None if one.values is None else _growth(one.values, file, eps, left, seed)
            # there may be a special member only
            if known is None or (by == "degrees" and not _agree(known.degrees, (1, *one.degrees))):
                known = _beyond(one, map_, eps, seed)
        except TimeOver:
            missed += 1
            continue
        found[k] = replace(one, growth=known)
        if known is not None and known.growth not in _MEASURED_EACH:
            enough[one.degrees] = known
    kinds = {one.degrees: one.growth.growth for one in reversed(found) if one.growth is not None}

    def order(one: Component) -> tuple[int, Degrees, str]:
        return _ORDER.index(kinds.get(one.degrees, GrowthClass.UNKNOWN)), one.degrees[::-1], one.text

    return sorted(found, key=order), missed


def _growth(values: dict[str, fmpq], file: SystemFile, eps: fmpq | None, left: float, seed: int) -> DegreeGrowth:
    """The growth at a rational member."""
    member, step = _member(file, values, eps)
    for attempt in range(_ATTEMPTS):  # the singularities are followed at a random eps, which may be special
        found = degree_growth(
            member.map, step, seconds=min(_SECONDS, left), steps=STEPS, seed=seed + attempt, enclosed=False
        )
        if found.growth is not GrowthClass.UNKNOWN:
            break
    return found


def _beyond(
    one: Component, map_: BirationalMap, eps: fmpq | None, seed: int, most: int = _LARGE
) -> DegreeGrowth | None:
    """The growth that more degrees fit, measured modulo a prime; None where there is no member."""
    count = one.equations[0].context().nvars()
    found = degrees_on(map_, one.equations, count, eps, [one.degrees[-1]] * _TERMS, random.Random(seed), most)
    if found is None:
        return None
    return DegreeGrowth((1, *found), eps, "terms", f"{len(found)} iterates measured", seed, (), ())


def _goes_on(one: Component, known: DegreeGrowth | None, map_: BirationalMap, eps: fmpq | None, seed: int) -> bool:
    """Whether degrees go on as they do at a member of another component with the same first ones."""
    if known is None:
        return False
    found = _beyond(one, map_, eps, seed, max(_SOME, 2 * one.degrees[-1]))
    return found is not None and _agree(found.degrees, known.degrees)


def _agree(some: Degrees, others: Degrees) -> bool:
    return all(a == b for a, b in zip(some, others, strict=False))


def _member(file: SystemFile, values: dict[str, fmpq], eps: fmpq | None) -> tuple[SystemFile, fmpq | None]:
    """The system of a member and its eps."""
    return member_of(file, {name: value for name, value in values.items() if name != "eps"}), values.get("eps", eps)


def with_verdicts(
    components: list[Component],
    file: SystemFile,
    eps: fmpq | None,
    seconds: float,
    deadline: float,
    check: Callable[[], None],
    seed: int,
    progress: Progress,
) -> tuple[list[Component], int]:
    """The components with what an analysis says of a member, where degrees do not grow exponentially; how many lack it.

    Each has so many seconds, as long as there is time.
    """
    found: list[Component] = []
    points: set[Degrees] = set()
    missed = 0
    for one in components:
        asked = one.values is not None and one.growth is not None and one.growth.growth is not GrowthClass.EXPONENTIAL
        if asked and one.values is not None and one.degrees not in points:
            member, step = _member(file, one.values, eps)
            try:
                progress(f"scan: analyzes a member where {one.text}")
                check()
                left = max(0.1, deadline - time.monotonic())
                one = replace(one, verdict=analyze(member, eps=step, seconds=min(seconds, left), seed=seed).conclusion)
            except TimeOver:
                missed += 1
            if one.dimension == 0:
                points.add(one.degrees)
        found.append(one)
    return found, missed
