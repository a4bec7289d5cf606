"""How degrees grow on the components of a scan, and what an analysis says of members on them."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kahanmaps.invariants.growth import OF_DEGREES, Growth
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.growth.curves import Ended
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.scan.members import Scanned
from kahanmaps.laboratory.scan.result import STEPS, Component
from kahanmaps.laboratory.scan.sweep import Degrees, TimeOver

Progress = Callable[[str], None]

_SECONDS, _ATTEMPTS = 10.0, 2
_TERMS, _LARGE = 26, 1000  # where no rational member is known: so many degrees, as far as they are not above this
_SOME = 100  # the degree up to which they are compared, at least
_MEASURED_EACH = (Growth.LINEAR, Growth.QUADRATIC, Growth.POLYNOMIAL)


def with_growth(
    components: list[Component], family: Scanned, deadline: float, check: Callable[[], None], progress: Progress
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
            if _goes_on(one, enough.get(one.degrees), family):
                continue
            left = max(0.1, deadline - time.monotonic())
            known = None
            if one.values is not None:
                member, step = family.member(one.values)
                given: dict[str, Any] = {"seconds": min(_SECONDS, left), "steps": STEPS, "enclosed": False}
                for attempt in range(_ATTEMPTS):  # singularities are followed at a random eps, which may be special
                    known = degree_growth(member.map, step, seed=family.seed + attempt, **given)
                    if known.growth is not Growth.UNKNOWN:
                        break
            # there may be a special member only
            if known is None or not _agree(known.degrees, (1, *one.degrees)):
                known = _beyond(one, family)
        except TimeOver:
            missed += 1
            continue
        found[k] = replace(one, growth=known)
        if known is not None and known.growth not in _MEASURED_EACH:
            enough[one.degrees] = known
    kinds = {one.degrees: one.growth.growth for one in reversed(found) if one.growth is not None}

    def order(one: Component) -> tuple[int, Degrees, str]:
        return OF_DEGREES.index(kinds.get(one.degrees, Growth.UNKNOWN)), one.degrees[::-1], one.text

    return sorted(found, key=order), missed


def _beyond(one: Component, family: Scanned, most: int = _LARGE) -> DegreeGrowth | None:
    """The growth that more degrees fit, measured modulo a prime; None where there is no member."""
    found = family.degrees_on(one.equations, [one.degrees[-1]] * _TERMS, random.Random(family.seed), most)
    if found is None:
        return None
    return DegreeGrowth((1, *found), family.eps, Ended.TERMS, f"{len(found)} iterates measured", family.seed, (), ())


def _goes_on(one: Component, known: DegreeGrowth | None, family: Scanned) -> bool:
    """Whether degrees go on as they do at a member of another component with the same first ones."""
    if known is None:
        return False
    found = _beyond(one, family, max(_SOME, 2 * one.degrees[-1]))
    return found is not None and _agree(found.degrees, known.degrees)


def _agree(some: Degrees, others: Degrees) -> bool:
    return all(a == b for a, b in zip(some, others, strict=False))


def with_verdicts(
    components: list[Component],
    family: Scanned,
    seconds: float,
    deadline: float,
    check: Callable[[], None],
    progress: Progress,
) -> tuple[list[Component], int]:
    """The components with what an analysis says of a member, where degrees do not grow exponentially; how many lack it.

    Each has so many seconds, as long as there is time.
    """
    found: list[Component] = []
    points: set[Degrees] = set()
    missed = 0
    for one in components:
        asked = one.values is not None and one.growth is not None and one.growth.growth is not Growth.EXPONENTIAL
        if asked and one.values is not None and one.degrees not in points:
            member, step = family.member(one.values)
            try:
                progress(f"scan: analyzes a member where {one.text}")
                check()
                left = max(0.1, deadline - time.monotonic())
                told = analyze(member, eps=step, seconds=min(seconds, left), seed=family.seed)
                one = replace(one, verdict=told.conclusion)
            except TimeOver:
                missed += 1
            if one.dimension == 0:
                points.add(one.degrees)
        found.append(one)
    return found, missed
