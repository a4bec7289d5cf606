"""The flow in a phase portrait: directions of the vector field, equilibria, separatrices and solution curves.

Solution curves are parametrized by arc length, not by time: RK4 solves x' = f/|f| with steps of a fixed fraction of the
window. So they pass through poles and look smooth. Default initial points of orbits lie around an equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.errors import InputError
from kahanmaps.maps.convention import time_step
from kahanmaps.maps.floats.classical import VectorField
from kahanmaps.maps.floats.float_conversion import FloatArray
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.trajectories import Trajectories, ensemble_for
from kahanmaps.plots.portraits.windows import Window, window_of
from kahanmaps.systems.quadratic import QuadraticSystem

SADDLE, CENTER, FOCUS, NODE, DEGENERATE = "saddle", "center", "focus", "node", "degenerate equilibrium"
_NEWTON_STARTS, _NEWTON_STEPS = 60, 40
_MAX_DIMENSION = 20  # in higher dimensions Newton's method starts only from the origin and (1, ..., 1)
_ZERO_TOLERANCE = 1e-7  # relative to the largest eigenvalue: smaller real or imaginary parts count as 0
_ARROWS_PER_SIDE = 21  # number of arrows along each side of the window
_STEPS_PER_WINDOW = 400  # number of steps in which a curve crosses the window
_MAX_STEPS = 6000  # maximal number of steps of a curve, whose length is then fifteen windows
_MIN_SPEED_RATIO = 1e-4  # near an equilibrium: a curve ends below this fraction of the largest speed in the window


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """An equilibrium `point` of f, the eigenvalues of f' at this point, and the eigenvectors of f' as columns."""

    point: FloatArray
    values: NDArray[Any]
    vectors: NDArray[Any]

    @property
    def expansion(self) -> float:
        """The largest real part of an eigenvalue of f'."""
        return round(float(self.values.real.max()), 6)

    @property
    def kind(self) -> str:
        """The kind of the linear part f', from its eigenvalues; a "center" need not be a center of the vector field."""
        values, real = self.values, self.values.real
        threshold = _ZERO_TOLERANCE * max(float(np.abs(values).max()), _ZERO_TOLERANCE)
        if (np.abs(values) <= threshold).any():
            return DEGENERATE
        if (real > threshold).any() and (real < -threshold).any():
            return SADDLE
        if (np.abs(real) <= threshold).all():
            return CENTER
        if (np.abs(real) <= threshold).any():
            return DEGENERATE
        return FOCUS if (np.abs(values.imag) > threshold).any() else NODE


def equilibria(system: QuadraticSystem) -> list[Equilibrium]:
    """Find the distinct real equilibria to which Newton's method converges from sixty initial points.

    >>> pendulum = QuadraticSystem.from_text(["x", "y"], ["y", "x - x^2"])
    >>> sorted((equilibrium.point.round(6).tolist(), equilibrium.kind) for equilibrium in equilibria(pendulum))
    [([0.0, 0.0], 'saddle'), ([1.0, 0.0], 'center')]
    """
    n = system.dim
    f = VectorField(system)
    random_points = np.random.default_rng(0).uniform(-3, 3, (_NEWTON_STARTS if n <= _MAX_DIMENSION else 0, n))
    all_equilibria: list[Equilibrium] = []
    for x in (np.zeros(n), np.ones(n), *random_points):
        for _ in range(_NEWTON_STEPS):
            velocity, tolerance = f(x), 1e-12 * (1 + float(np.abs(x).max()))
            if np.abs(velocity).max() <= tolerance:
                rounded_point = np.round(x, 9)
                point = rounded_point if np.abs(f(rounded_point)).max() <= tolerance else x
                # Near a degenerate equilibrium Newton's method ends at slightly different points, of which one is kept.
                if not any(np.allclose(point, equilibrium.point, atol=1e-3) for equilibrium in all_equilibria):
                    all_equilibria.append(Equilibrium(point, *np.linalg.eig(f.jacobian(point))))
                break
            x = x + np.linalg.lstsq(f.jacobian(x), -velocity, rcond=1e-10)[0]  # least squares, since f' may be singular
            if not np.isfinite(x).all() or np.abs(x).max() > 1e6:
                break
    return all_equilibria


@dataclass(frozen=True, eq=False)
class Flow:
    """The parts of the phase portrait of x' = f(x) that are drawn together with the orbits of the map.

    `places` (count, 2) are points of the plane, and `arrows` (count, 2) the directions of f there, relative to the
    window. `equilibria` are pairs (kind, point). `separatrices` and `solutions` are curves (n, 2) or (n, 3).
    """

    places: FloatArray
    arrows: FloatArray
    equilibria: tuple[tuple[str, FloatArray], ...] = ()
    separatrices: tuple[FloatArray, ...] = ()
    solutions: tuple[FloatArray, ...] = ()


def plane_flow(system: QuadraticSystem, plane: Sequence[int], window: Window) -> Flow:
    """Compute arrows, equilibria and separatrices of a planar system in a window of its plane.

    `plane` contains the indices of the variables along the axes. For a system in higher dimension the result is empty,
    since f does not determine a direction at a point of the picture.

    >>> saddle = plane_flow(QuadraticSystem.from_text(["x", "y"], ["x", "-y"]), (0, 1), ((-1, 1), (-1, 1)))
    >>> [kind for kind, _ in saddle.equilibria], len(saddle.separatrices)
    (['saddle'], 4)
    """
    if system.dim != 2 or sorted(plane) != [0, 1]:
        return Flow(np.zeros((0, 2)), np.zeros((0, 2)))
    permutation = list(plane)  # a permutation of (0, 1) is its own inverse
    low, high = (np.array(side) for side in zip(*window, strict=True))
    f = VectorField(system)
    cell_centers = (np.arange(_ARROWS_PER_SIDE) + 0.5) / _ARROWS_PER_SIDE
    places = low + (high - low) * np.stack(np.meshgrid(cell_centers, cell_centers), axis=-1).reshape(-1, 2)
    arrows = f(places[:, permutation])[:, permutation] / (high - low)
    lengths = np.linalg.norm(arrows, axis=1, keepdims=True)
    with np.errstate(all="ignore"):
        arrows = np.where(lengths > 0, arrows / lengths, 0)
    all_equilibria = equilibria(system)
    if len(all_equilibria) > 2**system.dim:  # more than isolated equilibria can be (Bezout): they fill curves
        all_equilibria = []
    visible_equilibria = [
        equilibrium
        for equilibrium in all_equilibria
        if np.all((equilibrium.point[permutation] >= low) & (equilibrium.point[permutation] <= high))
    ]
    box = tuple(window[k] for k in permutation)
    widths = np.array([b - a for a, b in box])
    separatrices = []
    for saddle in (equilibrium for equilibrium in visible_equilibria if equilibrium.kind == SADDLE):
        for value, vector in zip(saddle.values.real, saddle.vectors.real.T, strict=True):
            offset = vector / np.linalg.norm(vector / widths) * 1e-3
            for start in (saddle.point + offset, saddle.point - offset):
                separatrices.append(np.vstack([saddle.point, solution(f, start, box, np.copysign(np.inf, value))]))
    kinds_and_points = tuple((equilibrium.kind, equilibrium.point[permutation]) for equilibrium in visible_equilibria)
    return Flow(places, arrows, kinds_and_points, tuple(curve[:, permutation] for curve in separatrices))


def projected_solutions(
    system: QuadraticSystem, eps: fmpq, axes: Sequence[PointFunction | str], trajectories: Trajectories, backward: bool
) -> tuple[FloatArray, ...]:
    """Return the solutions of x' = f(x) through the initial points of orbits, as curves in the coordinates `axes`.

    A solution ends at the time of the last step, or far away from the orbits. Raises InputError for the axis "step".
    """
    functions = [axis for axis in axes if not isinstance(axis, str)]
    if len(functions) < len(axes):
        raise InputError("the flow is drawn as curves in phase space: it cannot be combined with the axis step")
    box = window_of(trajectories.points.reshape(-1, system.dim), trajectories.points[0])
    steps = len(trajectories.points) - 1
    time = float(time_step(eps) * steps) * (-1 if backward else 1) if steps else None
    curves = (solution(VectorField(system), start, box, time) for start in trajectories.points[0])
    return tuple(np.stack([axis(x) for axis in functions], axis=-1) for x in curves)


def solution(f: VectorField, start: FloatArray, box: Window, time: float | None = None) -> FloatArray:
    """Return the solution through `start` as a curve (points, dim); it ends where it closes or leaves the box.

    `box` has a range for each variable; a curve leaves the box when its distance from a range exceeds the length of the
    range. `time`, negative for the past, limits the time of the solution; None means no limit.

    >>> rotation = VectorField(QuadraticSystem.from_text(["x", "y"], ["y", "-x"]))
    >>> circle = solution(rotation, np.array([1.0, 0.0]), ((-2, 2), (-2, 2)))
    >>> bool(np.allclose(np.hypot(*circle.T), 1, rtol=1e-9)), bool((circle[0] == circle[-1]).all())
    (True, True)
    """
    low, high = (np.array(side, dtype=np.float64) for side in zip(*box, strict=True))
    size, center, step = high - low, (low + high) / 2, 1 / _STEPS_PER_WINDOW
    sign = -1.0 if time is not None and time < 0 else 1.0

    def speed(x: FloatArray) -> float:
        return float(np.linalg.norm(f(x) / size))

    def direction(x: FloatArray) -> FloatArray:
        velocity: FloatArray = sign * f(x)
        norm = float(np.linalg.norm(velocity / size))
        return velocity / norm if norm > 0 else velocity

    min_speed = _MIN_SPEED_RATIO * max(map(speed, (low, high, center, start)))
    points, x, elapsed = [start], start, 0.0
    for step_number in range(_MAX_STEPS):
        current_speed = speed(x)
        elapsed += step / current_speed if current_speed > 0 else np.inf
        # A separatrix (without a time limit) starts slowly at its saddle, so at first a small speed does not end it.
        is_slow = current_speed <= min_speed and (step_number > 2 * _STEPS_PER_WINDOW or not np.isinf(time or 0.0))
        if is_slow or (time is not None and elapsed > abs(time)) or np.abs((x - center) / size).max() > 1.5:
            break
        k1 = direction(x)
        k2 = direction(x + step / 2 * k1)
        k3 = direction(x + step / 2 * k2)
        x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + direction(x + step * k3))
        if not np.isfinite(x).all():
            break
        if step_number > 4 and np.linalg.norm((x - start) / size) < 0.6 * step:
            points.append(start)
            break
        points.append(x)
    return np.array(points)


START_COUNT = 16  # number of automatic initial points
_MAX_CENTERS = 4  # maximal number of equilibria that are tried as centers of the initial points
_MAX_SIZES = 24  # maximal number of distances from a center that are tried
_SIZE_RATIO = 0.8  # quotient of two successive distances
_TRIAL_STEPS = 300  # number of steps for which the orbits must stay near the center
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
_MAX_GROWTH = 4.0  # maximal ratio of distances from the center to the largest initial one


def automatic_starts(
    system: QuadraticSystem, eps: Any, plane: Sequence[int] = (0, 1), *, backward: bool = False
) -> FloatArray:
    """Choose sixteen initial points (16, dim) for a picture; the choice is deterministic, eps is half the time step.

    The points lie around the most stable equilibrium found: on a ray in the plane of the variables `plane`, or on a
    circle if f is homogeneous, since all points of a ray then move alike. Other coordinates are shifted a little. The
    distance is the largest one tried for which all orbits stay near the equilibrium.

    >>> lotka_volterra = QuadraticSystem.from_text(["x", "y"], ["x - x*y", "x*y - y"])
    >>> starts = automatic_starts(lotka_volterra, "1/20")
    >>> starts.shape, bool((starts > 1).all())
    ((16, 2), True)
    """
    plane = [index for index in plane if index < system.dim][:2]
    # The equilibria by increasing `expansion`, of equal ones those without negative coordinates first; then the origin.
    sorted_equilibria = sorted(
        equilibria(system), key=lambda equilibrium: (equilibrium.expansion, bool((equilibrium.point < 0).any()))
    )
    centers = [equilibrium.point for equilibrium in sorted_equilibria[:_MAX_CENTERS]]
    if all(center.any() for center in centers):
        centers.append(np.zeros(system.dim))
    other_indices = [index for index in range(system.dim) if index not in plane]
    candidates: list[tuple[int, FloatArray]] = []
    for center in centers:
        # For a homogeneous field the orbits of smaller initial points around the origin are the same, but slower.
        is_scaled = system.is_homogeneous and not center.any()
        for k in range(1 if is_scaled else _MAX_SIZES):
            size = (3 * float(np.abs(center[plane]).max()) or 1.5) * _SIZE_RATIO**k
            starts = np.tile(center, (START_COUNT, 1))
            if is_scaled and len(plane) == 2:
                angles = (np.arange(START_COUNT) + 0.5) * _GOLDEN_ANGLE  # no symmetry maps one angle to another
                starts[:, plane] += size * np.stack([np.cos(angles), np.sin(angles)], axis=1)
                starts[:, other_indices] += size / 5
            else:
                offsets = np.arange(1, START_COUNT + 1) / START_COUNT * size
                for index, weight in zip(plane, (1.0, 0.25), strict=False):
                    starts[:, index] += weight * offsets
                for position, index in enumerate(other_indices):
                    starts[:, index] += offsets / (4 + position)
            ensemble = ensemble_for(system, eps, starts, _TRIAL_STEPS, backward=backward)
            points = np.concatenate(list(ensemble.records(_TRIAL_STEPS, 1)))
            with np.errstate(all="ignore"):
                distances = np.abs(points - center).max(axis=2)
                has_moved = np.abs(points[-1] - starts).max(axis=1) > 1e-9 * np.abs(starts).max()
            has_stayed = (distances <= _MAX_GROWTH * np.abs(starts - center).max()).all(axis=0)
            if (has_stayed & has_moved).all():
                return starts
            candidates.append((int((has_stayed & has_moved).sum()), starts))
    return max(candidates, key=lambda candidate: candidate[0])[1]
