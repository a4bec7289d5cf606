"""Lyapunov exponents of many float orbits, computed together from the exact tangent map.

The orbits are computed in portions (ensemble.py). The tangent map dPhi(x) = M(x)^{-1} N(x, x~) (implicit.py), which is
(I - eps f'(x))^{-1} (I + eps f'(x~)) for Kahan maps, is computed at all points of a portion together. Tangent maps are
multiplied along each orbit as long as the product stays well conditioned. The product is then applied to a frame of n
tangent vectors, and a QR decomposition makes the frame orthonormal again. The sums of log |R_ii| give the exponents.
The derivative dPhi is computed by its formula in double precision, not by finite differences.
Sources: benettin-1980 for the method; petrera-suris-2016, eq. (Jac), for the tangent map.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import reduce
from operator import mul
from typing import Any

import numpy as np

from kahanmaps.algebra.fields import integer, rational
from kahanmaps.algebra.printing import all_fields
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import InputError
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.maps import convention
from kahanmaps.maps.convention import either, resolve_eps
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.floats.float_conversion import FloatArray, to_float
from kahanmaps.maps.floats.steps import eliminate
from kahanmaps.maps.kahan import SystemLike, as_map
from kahanmaps.maps.values import start_rows

MAX_NUMBERS = 20_000_000  # maximal number of entries of the frames of all orbits together
_PORTION_ENTRIES = 200_000  # number of entries of the tangent maps in a portion
_MAX_PORTION_STEPS = 512
_MAX_LOG_CONDITION = 16.0  # logarithm of the condition number of a product of tangent maps; larger ones lose digits
_MAX_LOG_NORM = 300.0  # logarithm of the norm of a tangent map; the square of the norm must not overflow
_MIN_COMPILED_WORK = 10_000  # orbits times steps; for less work, compiling takes longer than it saves


@dataclass(frozen=True, eq=False)
class Lyapunov(ResultPart):
    """The Lyapunov exponents of an ensemble of float orbits, largest exponent first.

    `unit` is the time of a step: 2 eps, or 1 for a map without a time step, whose exponents are then per step.
    `exponents` (orbits, dim) are per unit of time, over all counted steps, for the orbits that completed them;
    `first_half_exponents`, over the first half of the steps, show how far they have converged. `log_volume` is the
    mean of log |det dPhi| per unit of time, computed independently; it should be the sum of the exponents. The orbits
    that overflowed or became singular, `ended_count` of them, are excluded. `steps` is the number of counted steps,
    after `transient` uncounted steps; it is smaller than requested if `is_stopped`: a time limit ended the computation.
    """

    unit: float
    steps: int
    transient: int
    orbits: int
    ended_count: int
    exponents: FloatArray
    first_half_exponents: FloatArray
    log_volume: FloatArray
    is_stopped: bool

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return all_fields(self, ended="ended_count", half="first_half_exponents", stopped="is_stopped")

    @property
    def text(self) -> str:
        """The table of the exponents."""
        lines = [f"orbits\t{self.orbits - self.ended_count} of {self.orbits}"]
        columns = ("# exponent", "per unit of time", "per step", "spread", "change from first half")
        lines += [f"steps\t{self.steps} after {self.transient}", "\t".join(columns)]
        table = zip(self.mean, self.per_step, self.spread, self.change, strict=True)
        lines += ["\t".join([str(k), *(f"{number:.6g}" for number in row)]) for k, row in enumerate(table, 1)]
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        orbits_text = f"{self.orbits - self.ended_count} of {self.orbits} orbits"
        return f"<Lyapunov: {', '.join(f'{x:.6g}' for x in self.mean)} per unit of time, {orbits_text}>"

    @property
    def mean(self) -> FloatArray:
        """The mean of each exponent over the orbits, per unit of time; NaN if no orbit was completed."""
        return _statistic_over_orbits(np.mean, self.exponents)

    @property
    def per_step(self) -> FloatArray:
        """The mean of each exponent over the orbits, per step."""
        return self.mean * self.unit

    @property
    def spread(self) -> FloatArray:
        """The standard deviation of each exponent over the orbits, per unit of time."""
        return _statistic_over_orbits(np.std, self.exponents)

    @property
    def change(self) -> FloatArray:
        """The absolute differences between the mean exponents over the first half of the steps and over all steps."""
        return np.abs(_statistic_over_orbits(np.mean, self.first_half_exponents) - self.mean)

    @property
    def residual(self) -> float:
        """The maximum over orbits of |sum of exponents - `log_volume`|, normally round-off; NaN if none completed."""
        residuals = np.abs(self.exponents.sum(axis=1) - self.log_volume)
        return float(residuals.max()) if len(residuals) else float("nan")


def _statistic_over_orbits(function: Any, values: FloatArray) -> FloatArray:
    statistics: FloatArray = function(values, axis=0) if len(values) else np.full(values.shape[1], np.nan)
    return statistics


def lyapunov_exponents(
    system: SystemLike,
    starts: Any = None,
    eps: Any = None,
    steps: int | None = None,
    *,
    x0: Any = None,
    time_step: Any = None,
    h: Any = None,
    n: int | None = None,
    transient: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> Lyapunov:
    """Compute the Lyapunov exponents of float orbits of a map.

    The method is that of Benettin et al. with the exact tangent map. In double precision chaotic orbits are not
    accurate, but their statistics are.

    Args:
        system: the map; a quadratic system stands for its Kahan map.
        starts, x0: the initial points, an array (orbits, dim) of floats, or one point.
        eps: an exact number of either sign, half the time step if there is one; `time_step` or `h` give 2 eps instead.
        steps, n: the number of counted steps, at least 2.
        transient: the number of uncounted steps before the counted ones.
        progress: a function that is called with a message for each portion.

    Returns:
        A `Lyapunov` object. If a TimeLimit is raised, its exponents are over the counted steps completed before.

    Raises:
        InputError: for eps = 0, for fewer than 2 steps, and for initial points of a wrong shape.

    Source: benettin-1980.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> oscillator = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    >>> exponents = lyapunov_exponents(oscillator, [1, 0], "1/10", 100)
    >>> bool(np.abs(exponents.mean).max() < 1e-12), exponents.ended_count
    (True, 0)
    """
    starts, steps = either(starts=starts, x0=x0), integer(either(steps=steps, n=n) or 0, "steps")
    eps, transient = rational(resolve_eps(eps, time_step, h, floats=True)), integer(transient, "transient")
    if starts is None:
        raise InputError("found no initial point, expected x0=[...]")
    float_eps = to_float(eps)
    if float_eps == 0.0:
        raise InputError(
            "eps rounds to 0 as a floating-point number, expected another number: the map is the identity at eps = 0"
        )
    if steps < 2 or transient < 0:
        raise InputError(f"found steps = {steps} and transient = {transient}, expected at least 2 and at least 0")
    map_ = as_map(system).real_approximation
    x = start_rows(starts, map_.variables)
    n = map_.dim
    if x.ndim != 2 or x.shape[1] != n or len(x) == 0 or not np.isfinite(x).all():
        raise InputError(f"found initial points of shape {x.shape}, expected rows of {n} finite numbers, at least one")
    if len(x) * n * n > MAX_NUMBERS:
        raise InputError(f"found {len(x)} initial points, expected at most {MAX_NUMBERS // (n * n)} in dimension {n}")
    orbits = FloatEnsemble(map_, eps, x, kernel="numpy" if len(x) * steps < _MIN_COMPILED_WORK else None, threads=1)
    equations = map_.at(rational(eps)).equations
    frames = np.broadcast_to(np.eye(n), (len(x), n, n))
    log_sums, half_sums = np.zeros((len(x), n)), np.zeros((len(x), n))
    log_volumes, is_running = np.zeros(len(x)), np.ones(len(x), bool)
    phase_ends = [transient, transient + steps // 2, transient + steps]
    checkpoint = 0, log_sums, half_sums, log_volumes, is_running  # the state after the last complete portion
    with suppress(TimeLimit):
        while orbits.step < phase_ends[-1] and is_running.any():
            progress(f"step {orbits.step} of {phase_ends[-1]}")
            phase_end = next(phase_end for phase_end in phase_ends if phase_end > orbits.step)
            count = min(phase_end - orbits.step, _MAX_PORTION_STEPS, max(1, _PORTION_ENTRIES // (len(x) * n * n)))
            previous_points = orbits.x[None]
            new_points = np.concatenate(list(orbits.records(count, 1)))[-count:]
            is_running &= ~np.isnan(new_points).any(axis=(0, 2))
            points = np.concatenate([previous_points, new_points])[:, is_running]
            with np.errstate(all="ignore"):
                maps, log_dets = _tangent_maps(equations, points[:-1].reshape(-1, n), points[1:].reshape(-1, n))
                maps, log_dets = maps.reshape(count, -1, n, n), log_dets.reshape(count, -1)
                norms = np.log(np.linalg.norm(maps, axis=(2, 3)))
            is_valid = np.isfinite(log_dets).all(axis=0) & (norms < _MAX_LOG_NORM).all(axis=0)
            is_running[is_running] = is_valid
            maps, log_dets, norms, Q = maps[:, is_valid], log_dets[:, is_valid], norms[:, is_valid], frames[is_running]
            log_volumes[is_running] += log_dets.sum(axis=0)
            # Logarithms of bounds: the condition number of dPhi is at most 2 (|dPhi|/sqrt n)^n/|det dPhi|, and the
            # condition number of a product is at most the product of the condition numbers.
            log_conditions = np.maximum(
                np.log(2.0) + n * (norms - np.log(n) / 2) - log_dets, norms * _MAX_LOG_CONDITION / _MAX_LOG_NORM
            )
            first_factor, log_condition_sum = 0, 0.0
            for k, log_condition in enumerate([*log_conditions.max(axis=1, initial=0.0).tolist(), np.inf]):
                if k and log_condition_sum + log_condition > _MAX_LOG_CONDITION:
                    Q, R = np.linalg.qr(reduce(lambda product, map_: map_ @ product, maps[first_factor:k], Q))
                    log_sums[is_running] += np.log(np.abs(np.diagonal(R, axis1=1, axis2=2)))
                    first_factor, log_condition_sum = k, 0.0
                log_condition_sum += log_condition
            frames = np.zeros((len(x), n, n))
            frames[is_running] = Q
            if orbits.step == transient:
                log_sums[:], log_volumes[:] = 0.0, 0.0
            elif orbits.step == phase_ends[1]:
                half_sums = log_sums.copy()
            checkpoint = orbits.step, log_sums.copy(), half_sums, log_volumes.copy(), is_running.copy()
    completed_steps, log_sums, half_sums, log_volumes, is_running = checkpoint
    counted_steps = max(0, completed_steps - transient)
    ended_count = len(x) - int(is_running.sum())
    is_running &= counted_steps > 0
    unit = convention.time_step(float_eps, map_) or 1.0
    permutation = np.argsort(-log_sums[is_running] / unit, axis=1)  # for negative eps the unit is negative
    first_half = half_sums[is_running] / (unit * (steps // 2) if counted_steps >= steps // 2 else np.nan)
    return Lyapunov(
        unit,
        counted_steps,
        min(completed_steps, transient),
        len(x),
        ended_count,
        np.take_along_axis(log_sums[is_running], permutation, axis=1) / (unit * max(1, counted_steps)),
        np.take_along_axis(first_half, permutation, axis=1),
        log_volumes[is_running] / (unit * max(1, counted_steps)),
        ended_count < len(x) and counted_steps < steps,
    )


def _tangent_maps(equations: Sequence[Equation], x: FloatArray, images: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return dPhi and log |det dPhi| at the points x with the images `images`, both arrays (count, n).

    dPhi is the product, over the factors of the map, of M(x)^{-1} N(x, x~), where N = -(d/dx)(M x~ - r) at fixed x~.
    """
    x, image, tangent_map = x.T, images.T, None
    log_volume = np.zeros(len(images))
    for equation in equations:
        n, exponents = equation.dim, [[int(e) for e in exponent] for exponent in equation.exponents]
        L, N = np.zeros((n, n + 1, len(images))), np.zeros((n, n, len(images)))  # (M | -r)

        def monomial_value(exponent: Sequence[int], x: FloatArray = x) -> Any:
            return reduce(mul, (x[i] ** e if e > 1 else x[i] for i, e in enumerate(exponent) if e), 1.0)

        values = [monomial_value(exponent[:n]) for exponent in exponents]
        terms = [
            (i, j, k, to_float(c))
            for i, row in enumerate(equation.terms)
            for j, entry in enumerate(row)
            for k, c in entry
        ]
        for i, j, k, c in terms:
            L[i, j] += c * values[k]
        if len(equations) > 1:
            M = L.copy()
            eliminate(M, n, 1)
            image = -M[:, n]
        for i, j, k, c in terms:
            for l, e in enumerate(exponents[k][:n]):
                if e:
                    lowered_exponent = [d - (l == q) for q, d in enumerate(exponents[k][:n])]
                    N[i, l] -= c * e * monomial_value(lowered_exponent) * (image[j] if j < n else 1.0)
        M = np.concatenate([L[:, :n], N], axis=1)
        log_volume = log_volume + np.log(eliminate(N, n, 0)).sum(axis=0) - np.log(eliminate(M, n, n)).sum(axis=0)
        factor_map = np.moveaxis(M[:, n:], 2, 0)
        tangent_map = factor_map if tangent_map is None else factor_map @ tangent_map
        x = image
    return np.ascontiguousarray(tangent_map), log_volume
