"""The points of an orbit over Q: single steps until relations between its points are known, which make steps short."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from itertools import count
from math import inf
from typing import Protocol

from kahanmaps.maps.implicit import Map
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.bilinear_steps import bilinear_forms
from kahanmaps.maps.orbits.relations.elliptic_orbit import TooLongRelation, elliptic_steps

# Relations are looked for when the steps so far took about as long as the search will, which depends on the bits of
# points, and numbers grow by less than _SLOW_GROWTH in a step: elsewhere there are none, or no steps for which they
# pay. As their coefficients are about as long as the start, points have to be longer; where coefficients are even
# longer, they are looked for again when points are _AGAIN times as long.
_LONG, _LONG_BY_COORDINATES = 4500, 300  # bits; the second times the square of (dimension + 1)
_AGAIN = 4
_LONGER_THAN_START = 8
_SLOW_GROWTH = 1.5


class Relations(Protocol):
    """Relations along one orbit, and their name."""

    @property
    def name(self) -> str: ...

    def step(self, last: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """The point with this number, after the last ones; None where the relations do not give it."""

    def skip(self, number: int) -> bool:
        """Whether the orbit has a point with this number, and those after it can do without it."""

    def point(self, number: int) -> IntegerPoint | None:
        """The point with this number, where it can be reached directly; otherwise None."""


class RationalOrbit:
    """The points of an orbit over Q: iterate once; ends where the map has no value, or after one with too many bits.

    Points that are not `wanted` are None where that makes them quicker. `since` is the number of the step from which on
    `relations` are in use; both are None before.
    """

    def __init__(
        self,
        map_over: Map,
        start: IntegerPoint,
        max_bits: int | None = None,
        wanted: Callable[[int], bool] | None = None,
    ) -> None:
        self.map, self.start, self.max_bits, self._wanted = map_over, start, max_bits, wanted
        self.relations: Relations | None = None
        self.since: int | None = None

    def __iter__(self) -> Iterator[IntegerPoint | None]:
        last, reached = deque([self.start], maxlen=3), 0
        by_coordinates = _LONG_BY_COORDINATES * (self.map.dim + 1) ** 2
        long: float = max(_LONG, by_coordinates, _LONGER_THAN_START * self.start.bits)
        too_late = inf if self.max_bits is None else self.max_bits / 2  # few steps are left then: bits grow like n^2
        yield self.start
        for number in count(1):
            if self.relations is not None and self._wanted is not None and not self._wanted(number):
                # Left out is a point that is not wanted, unless it may have too many bits.
                is_short = self.max_bits is None or 2 * last[-1].bits * number**2 < self.max_bits * reached**2
                if is_short and self.relations.skip(number):
                    yield None
                    continue
            image = None if self.relations is None else self.relations.step(last, number)
            # Near the end a factor on the way may have too many bits, which single steps see.
            if image is None or (
                self.max_bits is not None and len(self.map.factors) > 1 and 4 * image.bits > self.max_bits
            ):
                if self.relations is not None and reached < number - 1:
                    before = self.relations.point(number - 1)
                    if before is not None:
                        last.append(before)
                        reached = number - 1
                image = last[-1]
                for _ in range(number - reached):
                    if image is None or (self.max_bits is not None and image.exceeding(self.max_bits)):
                        break
                    image = self.map.integer_step(image, self.max_bits)
            if image is None:
                return
            yield image
            if self.max_bits is not None and image.exceeding(self.max_bits):
                return
            before = last[-1]
            last.append(image)
            reached = number
            if long < too_late and number > 1 and long <= image.bits < min(too_late, _SLOW_GROWTH * before.bits):
                try:
                    self.relations = relations(self.map, self.start, image)
                    long = inf
                except TooLongRelation:
                    long = _AGAIN * image.bits
                self.since = None if self.relations is None else number + 1


def relations(map_over: Map, start: IntegerPoint, point: IntegerPoint) -> Relations | None:
    """The relations that make steps shortest along the orbit of a start on which the point lies. Raises TooLong."""
    return elliptic_steps(map_over, start, point.bits) or bilinear_forms(map_over, point)
