"""The differential equation behind a portrait: its direction, equilibria, separatrices and solutions as curves.

Curves are followed by their length, not by time: x' = f/|f| by RK4 with steps of a fraction of the window, so that
they pass through what would be a pole in time, and are as smooth as can be seen everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import fmpq

from kahanmaps.errors import InputError
from kahanmaps.maps.convention import time_step
from kahanmaps.maps.floats.classical import VectorField
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.equilibria import SADDLE, Equilibrium, isolated_equilibria
from kahanmaps.plots.portraits.trajectories import Trajectories
from kahanmaps.plots.portraits.windows import Window, window_of
from kahanmaps.systems.quadratic import QuadraticSystem

_ARROWS = 21  # along each side
_FINE = 400  # steps of a curve across the window
_LONGEST = 6000  # steps: fifteen times across
_SLOW = 1e-4  # of the largest speed in the window: near an equilibrium curves stop


@dataclass(frozen=True, eq=False)
class Flow:
    """What is drawn of x' = f(x) below the orbits of the map.

    `places` and `arrows` (count, 2) are points of the plane and the direction there in units of the window;
    `equilibria` are points (2,) with the word for their kind, `separatrices` and `solutions` curves (n, 2 or 3).
    """

    places: FloatArray
    arrows: FloatArray
    equilibria: tuple[tuple[str, FloatArray], ...] = ()
    separatrices: tuple[FloatArray, ...] = ()
    solutions: tuple[FloatArray, ...] = ()


def plane_flow(system: QuadraticSystem, plane: Sequence[int], window: Window) -> Flow:
    """Arrows, equilibria and separatrices of a planar system, in a window of the plane of its two variables.

    `plane` says which variable is along which axis. In another dimension the directions at a point of the picture are
    many, and there is nothing.

    >>> saddle = plane_flow(QuadraticSystem.from_text(["x", "y"], ["x", "-y"]), (0, 1), ((-1, 1), (-1, 1)))
    >>> [kind for kind, _ in saddle.equilibria], len(saddle.separatrices)
    (['saddle'], 4)
    """
    nothing = Flow(np.zeros((0, 2)), np.zeros((0, 2)))
    if system.dim != 2 or sorted(plane) != [0, 1]:
        return nothing
    order = list(plane)
    low, high = (np.array(side) for side in zip(*window, strict=True))
    f = VectorField(system)
    middles = (np.arange(_ARROWS) + 0.5) / _ARROWS
    places = low + (high - low) * np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    arrows = f(_swapped(places, order))[:, order] / (high - low)
    length = np.linalg.norm(arrows, axis=1, keepdims=True)
    with np.errstate(all="ignore"):
        arrows = np.where(length > 0, arrows / length, 0)
    found = isolated_equilibria(system)
    shown = [one for one in found if np.all((one.point[order] >= low) & (one.point[order] <= high))]
    box = tuple(window[order.index(k)] for k in range(2))
    branches = [curve for one in shown if one.kind == SADDLE for curve in _branches(f, one, box)]
    return Flow(
        places,
        arrows,
        tuple((one.kind, one.point[order]) for one in shown),
        tuple(curve[:, order] for curve in branches),
    )


def solutions(
    system: QuadraticSystem, starts: FloatArray, box: Window, time: float | None = None
) -> tuple[FloatArray, ...]:
    """The solutions through starts (n, dim), as curves (points, dim) that end where they close or leave the box.

    `box` has a range for each variable, and curves may leave it by its own size; `time` (default: any), negative for
    the past, is how long they are followed.

    >>> rotation = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    >>> (circle,) = solutions(rotation, np.array([[1.0, 0.0]]), ((-2, 2), (-2, 2)))
    >>> bool(np.allclose(np.hypot(*circle.T), 1, rtol=1e-9)), bool((circle[0] == circle[-1]).all())
    (True, True)
    """
    return tuple(_curve(VectorField(system), start, box, time) for start in starts)


def projected_solutions(
    system: QuadraticSystem, eps: fmpq, axes: Sequence[PointFunction | str], found: Trajectories, backward: bool
) -> tuple[FloatArray, ...]:
    """The solutions through the starts of orbits, as long as these are followed and around them, along some axes.

    Raises InputError where an axis is the step.
    """
    functions = [axis for axis in axes if not isinstance(axis, str)]
    if len(functions) < len(axes):
        raise InputError("the flow is drawn as curves in phase space: it does not go with the axis step")
    box = window_of(found.points.reshape(-1, system.dim), found.points[0])
    steps = len(found.points) - 1
    time = float(time_step(eps) * steps) * (-1 if backward else 1) if steps else None
    curves = solutions(system, found.points[0], box, time)
    return tuple(np.stack([axis(x) for axis in functions], axis=-1) for x in curves)


def _branches(f: VectorField, saddle: Equilibrium, box: Window) -> list[FloatArray]:
    """The four curves that leave a saddle or come to it."""
    values, vectors = np.linalg.eig(saddle.jacobian)
    size = np.array([high - low for low, high in box])
    made = []
    for value, vector in zip(values.real, vectors.real.T, strict=True):
        offset = vector / np.linalg.norm(vector / size) * 1e-3
        made += [
            np.vstack([saddle.point, _curve(f, saddle.point + side * offset, box, np.copysign(np.inf, value))])
            for side in (1, -1)
        ]
    return made


def _curve(f: VectorField, start: FloatArray, box: Window, time: float | None) -> FloatArray:
    low, high = (np.array(side, dtype=np.float64) for side in zip(*box, strict=True))
    size = high - low
    middle, step = (low + high) / 2, 1 / _FINE
    sign = -1.0 if time is not None and time < 0 else 1.0

    def speed(x: FloatArray) -> float:
        return float(np.linalg.norm(f(x) / size))

    corners = np.stack([low, high, middle])
    stop = _SLOW * max(map(speed, (*corners, start)))

    def direction(x: FloatArray) -> FloatArray:
        value: FloatArray = sign * f(x)
        found = float(np.linalg.norm(value / size))
        return value / found if found > 0 else value

    points, x, spent = [start], start, 0.0
    for count in range(_LONGEST):
        pace = speed(x)
        spent += step / pace if pace > 0 else np.inf
        slow = pace <= stop and (count > 2 * _FINE or not np.isinf(time or 0.0))
        if slow or (time is not None and spent > abs(time)) or np.abs((x - middle) / size).max() > 1.5:
            break
        k1 = direction(x)
        k2 = direction(x + step / 2 * k1)
        k3 = direction(x + step / 2 * k2)
        x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + direction(x + step * k3))
        if not np.isfinite(x).all():
            break
        if count > 4 and np.linalg.norm((x - start) / size) < 0.6 * step:
            points.append(start)
            break
        points.append(x)
    return np.array(points)


def _swapped(places: FloatArray, order: Sequence[int]) -> FloatArray:
    found = np.empty_like(places)
    found[:, list(order)] = places
    return found
