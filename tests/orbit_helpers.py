"""Exact orbits by single steps, against which quicker ways to the same points are held."""

from typing import Any

from flint import fmpq

import kahanmaps.maps.orbits.relations.rational_orbit as rational_orbit
from kahanmaps import load
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.orbits.integer_point import IntegerPoint

START = tuple(fmpq(p, q) for p, q in ((1, 2), (-1, 3), (2, 5), (1, 1), (3, 4), (-2, 7)))


def over(name: str, eps: str = "3/11") -> Map:
    """The map of a system of the catalogue."""
    result: Map = load(name).map.at(eps)
    return result


def begin(map_over: Map) -> IntegerPoint:
    """A start without special properties."""
    return IntegerPoint.from_rationals(START[: map_over.dim])


def single_steps(map_over: Map, start: IntegerPoint, steps: int) -> list[IntegerPoint]:
    """The points of an orbit, by one linear system each, as far as there are any."""
    points = [start]
    for _ in range(steps):
        image = map_over.integer_step(points[-1])
        if image is None:
            break
        points.append(image)
    return points


def walked(map_over: Map, start: IntegerPoint, steps: int) -> tuple[list[Any], rational_orbit.RationalOrbit]:
    """The points as orbits have them, and the orbit."""
    orbit = rational_orbit.RationalOrbit(map_over, start)
    return [point for point, _ in zip(orbit, range(steps + 1), strict=False)], orbit
