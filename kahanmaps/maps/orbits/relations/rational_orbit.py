"""Orbits over Q: single steps until relations between the points are found; these make the later steps faster."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from itertools import count
from math import inf
from typing import Protocol

from kahanmaps.maps.implicit import Map
from kahanmaps.maps.orbits.integer_point import IntegerPoint

# The search for relations starts when the steps so far took about as long as the search will take (which depends on the
# bit length of the points), provided that the length grows by a factor below _SLOW_GROWTH per step: for faster growth
# there are no relations. Their coefficients are about as long as the initial point, so points must be longer than that.
# If the coefficients are longer than expected, the search is repeated when points are _RETRY_FACTOR times as long.
_MIN_BITS, _MIN_BITS_BY_COORDINATES = 4500, 70  # the second is multiplied by the cube of (dimension + 1)
_RETRY_FACTOR = 4
_LONGER_THAN_START = 8  # the search starts when points are this many times as long as the initial point
_SLOW_GROWTH = 1.5


class Relations(Protocol):
    """Relations between the points of one orbit, from which its next points are computed."""

    @property
    def name(self) -> str: ...

    def step(self, last_points: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """Return the point with this number, given the last points; None if the relations do not determine it."""

    def may_skip(self, number: int) -> bool:
        """Return whether the point with this number certainly exists and can be skipped, as no later point needs it."""

    def point(self, number: int) -> IntegerPoint | None:
        """Return the point with this number if it can be computed directly, otherwise None."""


class RationalOrbit:
    """The points of an orbit over Q; they can be iterated over once.

    The orbit ends if the map is not defined at a point, or after a point with more than `max_bits` bits. Points that
    are not requested may be None. `relations` are used from step `since` on; both are None before relations are found.
    """

    def __init__(
        self,
        map_over: Map,
        start: IntegerPoint,
        max_bits: int | None = None,
        is_requested: Callable[[int], bool] | None = None,
    ) -> None:
        self.map, self.start, self.max_bits, self._is_requested = map_over, start, max_bits, is_requested
        self.relations: Relations | None = None
        self.since: int | None = None

    def __iter__(self) -> Iterator[IntegerPoint | None]:
        last_points, last_number = deque([self.start], maxlen=3), 0
        min_bits_by_coordinates = _MIN_BITS_BY_COORDINATES * (self.map.dim + 1) ** 3
        search_bits: float = max(_MIN_BITS, min_bits_by_coordinates, _LONGER_THAN_START * self.start.bits)
        # When points are longer than this, few steps remain, since the bit length grows like n^2.
        max_search_bits = inf if self.max_bits is None else self.max_bits / 2
        yield self.start
        for number in count(1):
            if self.relations is not None and self._is_requested is not None and not self._is_requested(number):
                # A point that is not requested is skipped, unless it might exceed the budget.
                is_short = (
                    self.max_bits is None or 2 * last_points[-1].bits * number**2 < self.max_bits * last_number**2
                )
                if is_short and self.relations.may_skip(number):
                    yield None
                    continue
            image = None if self.relations is None else self.relations.step(last_points, number)
            # Near the budget, an intermediate point of a composition may exceed it, which only single steps notice.
            if image is None or (
                self.max_bits is not None and len(self.map.factors) > 1 and 4 * image.bits > self.max_bits
            ):
                if self.relations is not None and last_number < number - 1:
                    previous_point = self.relations.point(number - 1)
                    if previous_point is not None:
                        last_points.append(previous_point)
                        last_number = number - 1
                image = last_points[-1]
                for _ in range(number - last_number):
                    if image is None or (self.max_bits is not None and image.exceeding(self.max_bits)):
                        break
                    image = self.map.integer_step(image, self.max_bits)
            if image is None:
                return
            yield image
            if self.max_bits is not None and image.exceeding(self.max_bits):
                return
            previous_point = last_points[-1]
            last_points.append(image)
            last_number = number
            # If a point keeps its common factors, the orbit grows fast; computing the exact length would take a gcd.
            if (
                search_bits < max_search_bits
                and number > 1
                and not image.keeps_factors
                and image.approximate_bits < _SLOW_GROWTH * previous_point.approximate_bits
                and search_bits <= image.bits < min(max_search_bits, _SLOW_GROWTH * previous_point.bits)
            ):
                # Imported here and in `relations`, since only long orbits need these modules: short ones start faster.
                from kahanmaps.maps.orbits.relations.elliptic_orbit import TooLongRelation

                try:
                    self.relations = relations(self.map, self.start, image)
                    search_bits = inf
                except TooLongRelation:
                    search_bits = _RETRY_FACTOR * image.bits
                self.since = None if self.relations is None else number + 1


def relations(map_over: Map, start: IntegerPoint, point: IntegerPoint) -> Relations | None:
    """Search for relations along the orbit of `start`, of which `point` is a later point.

    Raises TooLongRelation if there are relations, but their coefficients are longer than the points so far.
    """
    from kahanmaps.maps.orbits.relations.bilinear_steps import bilinear_forms
    from kahanmaps.maps.orbits.relations.elliptic_orbit import elliptic_steps

    return elliptic_steps(map_over, start, point.bits) or bilinear_forms(map_over, point)
