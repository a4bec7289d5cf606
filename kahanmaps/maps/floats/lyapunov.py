"""Lyapunov exponents of float orbits, many at once, by the exact tangent map.

A frame of n tangent vectors goes along with each orbit by dPhi(x) = M(x)^{-1} N(x, x~) (implicit.py), which is (I - eps
f'(x))^{-1} (I + eps f'(x~)) for Kahan maps, and is made orthonormal again after every step; the logarithms of its
lengths add up to the exponents. The tangent map is the exact derivative of the map, evaluated in double precision:
nothing is differenced.
Source: benettin-1980 for the method, petrera-suris-2016, eq. (Jac), for the tangent map.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.written.plain import all_fields
from kahanmaps.errors import InputError
from kahanmaps.maps.convention import time_step
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.floats.doubles import FloatArray, start_rows, to_float
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.kahan import as_map
from kahanmaps.systems.quadratic import QuadraticSystem

MAX_NUMBERS = 20_000_000  # entries of all frames together


@dataclass(frozen=True, eq=False)
class Lyapunov:
    """The exponents of an ensemble in machine numbers, largest first.

    `unit` is the time of a step: 2 eps, and 1 for a map without a time step, whose exponents are per step. `exponents`
    (orbits, dim) are per unit of time, over all counted steps of the orbits that went through, and `half` the same over
    the first half of them: how far they differ tells how far they have converged. `log_volume` is the mean of log |det
    dPhi| per unit of time, computed apart, which the exponents add up to. `ended` counts the orbits that left the range
    of floats or met a pole; they are in no average. `steps` are those counted, after `transient` steps that were not;
    fewer than asked for if `stopped` by the clock.
    """

    unit: float
    steps: int
    transient: int
    orbits: int
    ended: int
    exponents: FloatArray
    half: FloatArray
    log_volume: FloatArray
    stopped: bool

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return all_fields(self)

    def __str__(self) -> str:
        lines = [f"orbits\t{self.orbits - self.ended} of {self.orbits}", f"steps\t{self.steps} after {self.transient}"]
        lines.append("# exponent\tper unit of time\tper step\tspread\tchange from half")
        table = zip(self.mean, self.mean * self.unit, self.spread, self.change, strict=True)
        lines += ["\t".join([str(k), *(f"{number:.6g}" for number in row)]) for k, row in enumerate(table, 1)]
        return "\n".join(lines)

    @property
    def per_step(self) -> FloatArray:
        """The exponents for each step instead of a unit of time: 2 eps times as large."""
        return self.exponents * self.unit

    @property
    def mean(self) -> FloatArray:
        """The mean of each exponent over the orbits, per unit of time; NaN where no orbit went through."""
        return _over_orbits(np.mean, self.exponents)

    @property
    def spread(self) -> FloatArray:
        """The standard deviation of each exponent over the orbits, per unit of time."""
        return _over_orbits(np.std, self.exponents)

    @property
    def change(self) -> FloatArray:
        """How far the mean exponents of the first half of the steps are from those of all."""
        return np.abs(_over_orbits(np.mean, self.half) - self.mean)

    @property
    def residual(self) -> float:
        """The largest distance of a sum of exponents from the mean of log |det dPhi|: rounding, if all is well.

        NaN where no orbit went through.
        """
        if len(self.exponents) == 0:
            return float("nan")
        return float(np.abs(self.exponents.sum(axis=1) - self.log_volume).max())


def lyapunov_exponents(
    given: QuadraticSystem | BirationalMap,
    starts: Any,
    eps: Any,
    steps: int,
    *,
    transient: int = 0,
    seconds: float = 60.0,
    progress: Callable[[str], None] = lambda _: None,
) -> Lyapunov:
    """The Lyapunov exponents of the float orbits of a map from `starts`, an array (orbits, dim) of floats, or one.

    A system stands for its Kahan map. `eps` is exact, half the time step where there is one, of either sign; `steps`
    steps are counted after `transient` steps, both for at most about `seconds` seconds. Double precision: the numbers
    carry rounding and, in chaos, only their statistics mean anything. Returns a Lyapunov; raises InputError for eps =
    0, no steps and starts of a wrong shape.
    Source: benettin-1980.

    >>> oscillator = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    >>> found = lyapunov_exponents(oscillator, [1, 0], "1/10", 100)
    >>> bool(np.abs(found.mean).max() < 1e-12), found.ended
    (True, 0)
    """
    size = to_float(rational(eps))
    if size == 0.0:
        raise InputError(
            "found eps = 0 in machine numbers, expected another number: the Kahan map is the identity there"
        )
    if steps < 2 or transient < 0:
        raise InputError(f"found {steps} steps after {transient}, expected at least 2 after 0 or more")
    x = start_rows(starts)
    map_ = as_map(given).rounded
    n = map_.dim
    if x.ndim != 2 or x.shape[1] != n or len(x) == 0 or not np.isfinite(x).all():
        raise InputError(f"found starts of the shape {x.shape}, expected rows of {n} finite numbers, at least one")
    if len(x) * n * n > MAX_NUMBERS:
        raise InputError(f"found {len(x)} starts, expected at most {MAX_NUMBERS // (n * n)} in dimension {n}")
    walk = _Walk([_Step(equation) for equation in map_.at(rational(eps)).equations], x)
    end = time.monotonic() + seconds
    done = counted = half_at = 0
    half = walk.sums.copy()
    while done < transient + steps:
        progress(f"step {done} of {transient + steps}")
        if time.monotonic() > end or len(walk.lanes) == 0:
            break
        walk.step()
        done += 1
        if done == transient:
            walk.reset()
        counted = max(0, done - transient)
        if counted == steps // 2:
            half, half_at = walk.sums.copy(), counted
    alive = walk.lanes if counted else walk.lanes[:0]
    unit = time_step(size, map_) or 1.0
    span, first = unit * max(1, counted), unit * max(1, half_at)
    order = np.argsort(-walk.sums[alive] / span, axis=1)
    exponents = np.take_along_axis(walk.sums[alive] / span, order, axis=1)
    early = np.take_along_axis(half[alive] / first, order, axis=1)
    return Lyapunov(
        unit,
        counted,
        min(done, transient),
        len(x),
        len(x) - len(walk.lanes),
        exponents,
        early if half_at else np.full_like(early, np.nan),
        walk.volumes[alive] / span,
        len(walk.lanes) > 0 and counted < steps,
    )


class _Step:
    """The matrices of the equation of a factor at many points."""

    def __init__(self, equation: Equation) -> None:
        n = equation.dim
        self._exponents = np.array(equation.exponents, dtype=np.int64)[:, :n]
        self._coefficients = np.zeros((n, n + 1, len(equation.exponents)))
        for i, row in enumerate(equation.terms):
            for j, entry in enumerate(row):
                for k, coefficient in entry:
                    self._coefficients[i, j, k] = to_float(coefficient)

    def matrices(self, x: FloatArray) -> FloatArray:
        """(M | -r) at the points."""
        monomials = np.prod(x[:, None, :] ** self._exponents, axis=2)
        found: FloatArray = np.tensordot(monomials, self._coefficients, axes=(1, 2))
        return found

    def numerators(self, x: FloatArray, image: FloatArray) -> FloatArray:
        """N = -(d/dx)(M x~ - r) at fixed x~."""
        slopes = np.zeros((len(x), *self._exponents.shape))  # of each monomial by each variable
        for k, exponents in enumerate(self._exponents.T):
            less = self._exponents.copy()
            less[:, k] -= exponents > 0
            slopes[:, :, k] = exponents * np.prod(x[:, None, :] ** less, axis=2)
        after = np.concatenate([image, np.ones((len(image), 1))], axis=1)
        found: FloatArray = -(np.einsum("ijk,bj->bik", self._coefficients, after) @ slopes)
        return found


class _Walk:
    """Points, frames and sums of logarithms of all orbits; `lanes` are those still going."""

    def __init__(self, factors: Sequence[_Step], x: FloatArray) -> None:
        n = x.shape[1]
        self._factors = factors
        self._x = x
        self._frames = np.broadcast_to(np.eye(n), (len(x), n, n)).copy()
        self.sums = np.zeros((len(x), n))
        self.volumes = np.zeros(len(x))
        self.lanes: NDArray[np.int64] = np.arange(len(x))

    def reset(self) -> None:
        """Count from here."""
        self.sums[:] = 0.0
        self.volumes[:] = 0.0

    def step(self) -> None:
        """One step of all orbits; those without an image, or with one out of range, end."""
        for one in self._factors:
            self._step(one)

    def _step(self, one: _Step) -> None:
        x = self._x
        with np.errstate(all="ignore"):
            rows = one.matrices(x)
            below, right = rows[:, :, :-1], -rows[:, :, -1]
            sound: NDArray[Any] = np.asarray(np.isfinite(rows).all(axis=(1, 2)))
            sound[sound] = np.linalg.det(below[sound]) != 0.0
            image = np.full_like(x, np.nan)
            image[sound] = _solved(below[sound], right[sound][:, :, None])[:, :, 0]
            above = one.numerators(x, image)
            sound &= np.isfinite(above).all(axis=(1, 2))
            below, above = below[sound], above[sound]
            frames = _solved(below, above @ self._frames[sound])
            fine: NDArray[Any] = np.asarray(np.isfinite(frames).all(axis=(1, 2)))
            fine[fine] = np.abs(frames[fine]).max(axis=(1, 2), initial=0.0) < 1e150  # squares are taken
            sound[sound] = fine
            frames, R = np.linalg.qr(frames[fine])
            lengths = np.log(np.abs(np.diagonal(R, axis1=1, axis2=2)))
            volumes = np.linalg.slogdet(above[fine])[1] - np.linalg.slogdet(below[fine])[1]
            good = np.isfinite(lengths).all(axis=1) & np.isfinite(volumes)
            sound[sound] = good
        self.lanes = self.lanes[sound]
        self._x, self._frames = image[sound], frames[good]
        self.sums[self.lanes] += lengths[good]
        self.volumes[self.lanes] += volumes[good]


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """The solutions; NaN for all where a matrix is singular in spite of its determinant."""
    try:
        found: NDArray[Any] = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        found = np.full_like(right, np.nan)
        for k in range(len(matrix)):
            try:
                found[k] = np.linalg.solve(matrix[k], right[k])
            except np.linalg.LinAlgError:
                continue
    return found


def _over_orbits(function: Any, values: FloatArray) -> FloatArray:
    if len(values) == 0:
        return np.full(values.shape[1], np.nan)
    found: FloatArray = function(values, axis=0)
    return found
