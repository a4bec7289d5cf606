"""Series along a curve followed for as long as it takes until the orders along its hypersurface are known."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

from flint import nmod_poly

from kahanmaps.laboratory.growth.recurrences import find_recurrence
from kahanmaps.laboratory.singular.jets import (
    Letters,
    NotGeneric,
    PrecisionTooLow,
    Step,
    equations_of,
    image_of,
    images_of_curve,
    orders_of,
)
from kahanmaps.laboratory.singular.orders import NOTHING, AlongCurves, Orders, Tracked
from kahanmaps.maps.equation import Equation

_MAX_PRECISION = 4096
_FIRST_ALONG, _MOST_ALONG = 512, 2048  # where series are followed far: a step costs at least as much as their length
_CONSTANT = 8  # so often at least is the same order repeated that goes on
_CHECKED = 4  # further orders have to follow a recurrence than tell it
_FREE_STEPS = 100  # for which a hypersurface is followed that is one again


@dataclass(frozen=True)
class Range:
    """How far hypersurfaces are followed: along series for `shown` steps, and for `reach` steps in all.

    Memory can only come back where the image of a hypersurface meets points without a value. Beyond the first steps
    its image is therefore followed as a point, which is cheap. Where it meets such points along series again, which is
    not: for at most `along` steps, or `enough` if orders repeat and each step uses up terms, so that series are long.
    `end` is the time of the monotonic clock at which all of it stops.
    """

    shown: int
    reach: int
    along: int
    end: float
    enough: int

    @property
    def is_over(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.end


@dataclass(frozen=True)
class Course:
    """The curve point + t direction over GF(p), what moves it and how far, and what is looked at along it."""

    equations: Sequence[Equation]
    point: Sequence[int]
    direction: Sequence[int]
    limits: Range
    tracked: AlongCurves = NOTHING

    @property
    def prime(self) -> int:
        """The prime modulo which all is computed."""
        return self.equations[0].over.characteristic

    def steps(
        self, count: int, tangents: Sequence[Sequence[int]] = (), most: int = _MAX_PRECISION
    ) -> tuple[list[Step], bool]:
        """So many steps along series as long as needed, and whether these are all: time or precision may end it.

        With tangents nothing is tracked.
        """
        precision, end = 8, self.limits.end
        functions = () if tangents else self.tracked.functions
        start = self.equations, self.point, self.direction
        while True:
            run: list[Step] = []
            try:
                for step in islice(images_of_curve(*start, precision, tangents, functions), count):
                    run.append(step)
                    if time.monotonic() > end:
                        return run, len(run) == count
                return run, True
            except PrecisionTooLow:
                if precision >= most or time.monotonic() > end:
                    return run, False
                precision = min(most, max(2 * precision, 8 + precision * count // max(1, len(run))))

    def all_steps(self, count: int, tangents: Sequence[Sequence[int]] = ()) -> tuple[Step, ...]:
        """The same where it does not end early. Raises PrecisionTooLow."""
        run, is_whole = self.steps(count, tangents)
        if not is_whole:
            raise PrecisionTooLow
        return tuple(run)

    def orders_until_return(self, up: int) -> Orders:
        """The orders along a curve whose hypersurface is one again after the step `up`, until it is a critical one.

        From then on they are those of the other.
        """
        steps = self.limits.shown
        reach = min(self.limits.reach, steps + _FREE_STEPS)
        while True:
            run = self.all_steps(steps)
            rows = self.tracked.rows(run)
            for t, (_, *nu) in enumerate(rows, 1):
                if t >= up and any(nu) and self.tracked.functions:
                    if sorted(nu)[-2:] not in ([1], [0, 1]):
                        raise NotGeneric("a point where several critical hypersurfaces meet")
                    return Orders(rows[:t], (), t, True, (t, nu.index(1)))
            hit, reached = self._next_hit(run[-1].limit, len(run), reach)
            if hit is None or not self.tracked.functions:  # nothing is asked beyond the next point without a value
                return Orders(rows[:up], (), reached, True)
            steps = hit

    def orders(self, first: int) -> Orders:
        """The orders along the curve, for as many steps as it takes until they are known for all, or the limits end it.

        `first` is the number of steps to begin with. The image may move on a critical hypersurface until something
        happens, so that orders have to repeat for as long as curves are followed.
        """
        steps, limits, most = first, self.limits, _FIRST_ALONG
        while True:
            run, is_whole = self.steps(steps, most=most)
            rows = self.tracked.rows(run)
            last = max((k for k, row in enumerate(rows, 1) if any(row)), default=0)
            hit = None
            if is_whole and len(rows) - last >= _CONSTANT:
                hit, reached = self._next_hit(run[-1].limit, len(run), limits.reach)
                if hit is None:
                    return Orders(rows[:last], (), reached, True)
            found = [find_recurrence(column) for column in zip(*rows, strict=True)]
            repeats = all(one is not None and len(rows) >= max(_CONSTANT, 2 * one.order + _CHECKED) for one in found)
            is_cut = not is_whole and not limits.is_over  # by the precision
            is_far = len(run) >= min(limits.reach, limits.along)
            if rows and repeats and (is_far or (is_cut and (most == _MOST_ALONG or len(rows) >= limits.enough))):
                laws = tuple(one.characteristic for one in found if one is not None)
                kept = max(_CONSTANT, *(2 * int(law.degree()) for law in laws))
                return Orders(rows[:kept], laws, len(run), True)
            if is_cut and most < _MOST_ALONG:
                most *= 2
                continue
            longest = min(limits.reach, max(limits.along, 2 * (hit or 0)))
            if rows and is_cut and (beyond := self._met_for_ever(run[-1].limit)) is not None:
                others = (
                    t
                    for t, (mu, *nu) in enumerate(rows, 1)
                    if mu or any(order for k, order in enumerate(nu) if k not in beyond)
                )
                return Orders(rows[: max(others, default=1)], (), limits.reach, True, None, beyond)
            if not is_whole or steps >= longest:
                return Orders(rows, (), len(rows), False)
            steps = longest

    def _met_for_ever(self, point: Sequence[int]) -> tuple[int, ...] | None:
        """The critical hypersurfaces on the later orbit of a point, if it closes and the map has a value on all of it.

        Then no power of t is ever divided out again. None elsewhere. Lines in this direction show the value of the map.
        """
        tracked, p = self.tracked, self.prime
        if not isinstance(tracked, Tracked) or isinstance(self.equations, Letters):
            return None
        point, seen, met = _normal(point, p), set[tuple[int, ...]](), set[int]()
        for _ in range(self.limits.reach):
            seen.add(point)
            line = [nmod_poly([x, v], p) for x, v in zip(point, self.direction, strict=True)]
            first = [function(line, _MAX_PRECISION) for function in tracked.functions]
            run = replace(self, point=point).steps(1)[0]
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

    def _next_hit(self, limit: Sequence[int], steps: int, reach: int) -> tuple[int | None, int]:
        """The next step that a point does not have, or with a zero of a function, and for how long it was followed."""
        at: Sequence[int] = limit
        for step in range(steps + 1, reach + 1):
            image = image_of(equations_of(self.equations, step), at)
            if image is None:
                return step, step
            at = image
            constants = [nmod_poly([x], self.prime) for x in at]
            if None in orders_of(self.equations, self.tracked.functions, step, constants, 1):
                return step, step
            if self.limits.is_over:
                return None, step
        return None, reach


def _normal(point: Sequence[int], p: int) -> tuple[int, ...]:
    """The coordinates of a point with the first one that is not zero as 1."""
    inverse = pow(next(x for x in point if x), -1, p)
    return tuple(x * inverse % p for x in point)
