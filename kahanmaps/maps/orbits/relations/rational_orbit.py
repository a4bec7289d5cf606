"""The points of an orbit over Q: single steps until relations between its points are known, which make steps short."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from itertools import count
from typing import Protocol

from kahanmaps.maps.implicit import MapOver
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.bilinear_steps import bilinear_forms
from kahanmaps.maps.orbits.relations.elliptic_orbit import elliptic_steps

# Relations are looked for once, when points have _LONG times the square of the number of coordinates bits, and numbers
# grow by less than _SLOW_GROWTH in a step: elsewhere there are none, or no steps for which they pay. As their
# coefficients are about as long as the start, points have to be longer.
_LONG = 500
_LONGER_THAN_START = 8
_SLOW_GROWTH = 1.5


class Relations(Protocol):
    """Relations along one orbit, and their name."""

    @property
    def name(self) -> str: ...

    def step(self, last: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """The point with this number, after the last ones; None where the relations do not give it."""


class RationalOrbit:
    """The points of an orbit over Q: iterate once; ends where the map has no value, or after one with too many bits.

    `since` is the number of the step from which on `relations` are in use; both are None before.
    """

    def __init__(self, map_over: MapOver, start: IntegerPoint, max_bits: int | None = None) -> None:
        self.map, self.start, self.max_bits = map_over, start, max_bits
        self.relations: Relations | None = None
        self.since: int | None = None

    def __iter__(self) -> Iterator[IntegerPoint]:
        last = deque([self.start], maxlen=3)
        is_tried = False
        long = max(_LONG * (self.map.dim + 1) ** 2, _LONGER_THAN_START * self.start.bits)
        yield self.start
        for number in count(1):
            image = None if self.relations is None else self.relations.step(last, number)
            if image is None:
                image = self.map.integer_step(last[-1], self.max_bits)
            if image is None:
                return
            yield image
            if self.max_bits is not None and image.exceeding(self.max_bits):
                return
            before = last[-1]
            last.append(image)
            if not is_tried and number > 1 and image.bits >= long and image.bits < _SLOW_GROWTH * before.bits:
                is_tried = True
                self.relations = relations(self.map, self.start, image)
                self.since = None if self.relations is None else number + 1


def relations(map_over: MapOver, start: IntegerPoint, point: IntegerPoint) -> Relations | None:
    """The relations that make steps shortest along the orbit of a start, on which another point lies."""
    return elliptic_steps(map_over, start) or bilinear_forms(map_over, point)
