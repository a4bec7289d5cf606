"""Series along a curve followed for as long as it takes until the orders along its hypersurface are known."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

from flint import nmod_poly

from kahanmaps.laboratory.growth.recurrences import find_recurrence
from kahanmaps.laboratory.singular.jets import (
    Function,
    Letters,
    NotGeneric,
    PrecisionTooLow,
    Step,
    equations_of,
    image_of,
    orders_of,
    walk,
)
from kahanmaps.laboratory.singular.orders import AlongCurves, Orders, Tracked
from kahanmaps.maps.equation import Equation

_MAX_PRECISION = 4096
_MOST_ALONG = 2048  # where series are followed far
_CONSTANT = 8  # so often at least is the same order repeated that goes on
_CHECKED = 4  # further orders have to follow a recurrence than tell it
_FREE_STEPS = 100  # for which a hypersurface is followed that is one again


@dataclass(frozen=True)
class Range:
    """How far hypersurfaces are followed: along series for `shown` steps, and for `reach` steps in all.

    Memory can only come back where the image of a hypersurface meets points without a value. Beyond the first steps
    its image is therefore followed as a point, which is cheap. Where it meets such points along series again, which is
    not: for at most `along` steps. `end` is the time of the monotonic clock at which all of it stops.
    """

    shown: int
    reach: int
    along: int
    end: float

    @property
    def is_over(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.end


def orders_until_return(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    tracked: AlongCurves,
    up: int,
    limits: Range,
) -> Orders:
    """The orders along a curve whose hypersurface is one again after the step `up`, until it is a critical one.

    From then on they are those of the other.
    """
    steps = limits.shown
    reach = min(limits.reach, steps + _FREE_STEPS)
    while True:
        run = whole(walked(equations, point, direction, [], steps, limits.end, functions=tracked.functions))
        rows = tracked.rows(run)
        for t, (_, *nu) in enumerate(rows, 1):
            if t >= up and any(nu) and tracked.functions:
                if sorted(nu)[-2:] not in ([1], [0, 1]):
                    raise NotGeneric("a point where several critical hypersurfaces meet")
                return Orders(rows[:t], (), t, True, (t, nu.index(1)))
        hit, reached = _next_hit(equations, run[-1].limit, len(run), reach, limits, tracked.functions)
        if hit is None or not tracked.functions:  # nothing is asked beyond the next point without a value
            return Orders(rows[:up], (), reached, True)
        steps = hit


def whole(walked: tuple[list[Step], bool]) -> tuple[Step, ...]:
    """The steps of a walk that has not ended early. Raises PrecisionTooLow."""
    run, is_whole = walked
    if not is_whole:
        raise PrecisionTooLow
    return tuple(run)


def orders_at(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    tracked: AlongCurves,
    span: tuple[int, int],
    limits: Range,
) -> Orders:
    """The orders along a curve, for as many steps as it takes until they are known for all, or the limits end it.

    `span` has the number of steps to begin with, and the largest one. The image may move on a critical hypersurface
    until something happens, so that orders have to repeat for as long as curves are followed.
    """
    steps, reach = span
    while True:
        run, is_whole = walked(
            equations, point, direction, [], steps, limits.end, most=_MOST_ALONG, functions=tracked.functions
        )
        rows = tracked.rows(run)
        last = max((k for k, row in enumerate(rows, 1) if any(row)), default=0)
        hit = None
        if is_whole and len(rows) - last >= _CONSTANT:
            hit, reached = _next_hit(equations, run[-1].limit, len(run), reach, limits, tracked.functions)
            if hit is None:
                return Orders(rows[:last], (), reached, True)
        found = [find_recurrence(column) for column in zip(*rows, strict=True)]
        repeats = all(one is not None and len(rows) >= max(_CONSTANT, 2 * one.order + _CHECKED) for one in found)
        is_cut = not is_whole and not limits.is_over  # by the precision
        if rows and repeats and (len(run) >= min(reach, limits.along) or is_cut):
            laws = tuple(one.characteristic for one in found if one is not None)
            kept = max(_CONSTANT, *(2 * int(law.degree()) for law in laws))
            return Orders(rows[:kept], laws, len(run), True)
        longest = min(reach, max(limits.along, 2 * (hit or 0)))
        if (
            rows
            and is_cut
            and (beyond := _met_for_ever(equations, run[-1].limit, direction, reach, tracked, limits.end)) is not None
        ):
            last = max(
                (
                    t
                    for t, (mu, *nu) in enumerate(rows, 1)
                    if mu or any(order for k, order in enumerate(nu) if k not in beyond)
                ),
                default=1,
            )
            return Orders(rows[:last], (), reach, True, None, beyond)
        if not is_whole or steps >= longest:
            return Orders(rows, (), len(rows), False)
        steps = longest


def _met_for_ever(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    reach: int,
    tracked: AlongCurves,
    end: float,
) -> tuple[int, ...] | None:
    """The critical hypersurfaces on the later orbit of a point, where that closes and the map has a value on all of it.

    Then no power of t is ever divided out again. None elsewhere. Lines in a random direction show the value of the map.
    """
    if not isinstance(tracked, Tracked) or isinstance(equations, Letters):
        return None
    p = equations[0].over.characteristic
    point, seen, met = _normal(point, p), set[tuple[int, ...]](), set[int]()
    for _ in range(reach):
        seen.add(point)
        line = [nmod_poly([x, v], p) for x, v in zip(point, direction, strict=True)]
        first = [function(line, _MAX_PRECISION) for function in tracked.functions]
        run = walked(equations, point, direction, [], 1, end, functions=tracked.functions)[0]
        if not run or None in first:
            return None
        ((mu, *orders),) = replace(tracked, first=tuple(k or 0 for k in first)).rows(run)
        if mu:
            return None
        point = _normal(run[0].limit, p)
        met |= {k for k, order in enumerate(orders) if order}
        if point in seen:
            return tuple(sorted(met))
    return None


def _normal(point: Sequence[int], p: int) -> tuple[int, ...]:
    """The coordinates of a point with the first one that is not zero as 1."""
    inverse = pow(next(x for x in point if x), -1, p)
    return tuple(x * inverse % p for x in point)


def walked(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    tangents: Sequence[Sequence[int]],
    steps: int,
    end: float,
    most: int = _MAX_PRECISION,
    functions: Sequence[Function] = (),
) -> tuple[list[Step], bool]:
    """So many steps along series as long as needed, and whether these are all: time or precision may end it."""
    precision = 8
    while True:
        run: list[Step] = []
        try:
            for step in islice(walk(equations, point, direction, precision, tangents, functions), steps):
                run.append(step)
                if time.monotonic() > end:
                    return run, len(run) == steps
            return run, True
        except PrecisionTooLow:
            if precision >= most or time.monotonic() > end:
                return run, False
            precision = min(most, max(2 * precision, 8 + precision * steps // max(1, len(run))))


def _next_hit(
    equations: Sequence[Equation],
    limit: Sequence[int],
    steps: int,
    reach: int,
    limits: Range,
    functions: Sequence[Function] = (),
) -> tuple[int | None, int]:
    """The next step that a point does not have, or with a zero of a function, and for how long it was followed."""
    p = equations[0].over.characteristic
    at: Sequence[int] = limit
    for step in range(steps + 1, reach + 1):
        image = image_of(equations_of(equations, step), at)
        if image is None:
            return step, step
        at = image
        constants = [nmod_poly([x], p) for x in at]
        if None in orders_of(equations, functions, step, constants, 1):
            return step, step
        if limits.is_over:
            return None, step
    return None, reach
