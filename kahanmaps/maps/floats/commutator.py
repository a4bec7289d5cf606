"""The commutator of two maps along a float orbit, measured in addition to the exact check."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log2
from typing import Any

import numpy as np
from flint import fmpq

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.printing import format_number, json_float
from kahanmaps.errors import InputError, counted
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.floats.float_conversion import to_floats
from kahanmaps.maps.floats.steps import images_of
from kahanmaps.maps.implicit import MapFamily

_HALVINGS = 6  # number of values eps, eps/2, eps/4, ... at which the commutator is measured
_ROUNDING = 1e-13  # a size of the commutator (see `Commutator`) below this number counts as rounding error


@dataclass(frozen=True)
class Commutator:
    """The size |Phi_g Phi_f^n x - Phi_f^n Phi_g x|/max(1, largest coordinate of Phi_f^n x, Phi_f^n Phi_g x), measured.

    `by_step` contains pairs (n, size) for n = 1, 2, 4, ... and the last n; `largest` is the largest size for any n.
    `by_eps` contains pairs (eps, size) at n = 1 for eps, eps/2, eps/4, ... `slope` is the slope of log size over log
    eps for the last two sizes above rounding error (None without two). `message` says why an orbit ended early, or "".
    """

    by_step: tuple[tuple[int, float], ...]
    largest: float
    by_eps: tuple[tuple[fmpq, float], ...]
    slope: float | None
    message: str

    def lines(self) -> list[str]:
        """Return the result as sentences, which say that the numbers are measured."""
        sizes_text = ", ".join(f"{size:.2g} at n = {n}" for n, size in self.by_step)
        if not self.by_step:
            return [f"measured\t{self.message}"]
        lines = [f"measured\t|Phi_g Phi_f^n x - Phi_f^n Phi_g x|: {sizes_text}; largest {self.largest:.2g}"]
        if self.by_eps and self.slope is None:
            lines.append("measured\tat n = 1 it is rounding for all eps")
        elif self.slope is not None:
            (first_eps, first_size), (last_eps, last_size) = self.by_eps[0], self.by_eps[-1]
            text = (
                f"{first_size:.2g} at eps = {format_number(first_eps)} to {last_size:.2g} at {format_number(last_eps)}"
            )
            lines.append(f"measured\tat n = 1 it is of order eps^{self.slope:.2f}: {text}")
        return lines + [f"measured\t{self.message}"] * bool(self.message)

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "by_step": [{"step": n, "size": json_float(size)} for n, size in self.by_step],
            "by_eps": [{"eps": format_number(eps), "size": json_float(size)} for eps, size in self.by_eps],
            "largest": json_float(self.largest),
            "slope": self.slope,
            "message": self.message,
        }


def commutator(f: MapFamily, g: MapFamily, eps: Any, start: Sequence[Any], steps: int, ratio: Any = 1) -> Commutator:
    """Measure the commutator of two maps along the float orbit of a point, and at its first step for decreasing eps.

    Args:
        f, g: the maps, over Q.
        eps: an exact number, half the time step where there is one.
        start: the initial point, exact numbers.
        steps: the number of steps, at least 1.
        ratio: the eps of g divided by the eps of f.

    >>> from kahanmaps.maps.kahan import as_map
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> f, g = (as_map(QuadraticSystem.from_text(["x", "y"], rhs)) for rhs in (["y", "-x"], ["y", "-2*x"]))
    >>> commutator(f, f, "1/10", [1, 0], 100).largest < 1e-13, round(commutator(f, g, "1/10", [1, 0], 9).slope, 2)
    (True, 2.0)
    """
    if steps < 1:
        raise InputError(f"found {steps} steps, expected at least 1")
    if len(start) != f.dim:
        raise InputError(f"found an initial point with {counted(len(start), 'coordinate')}, expected {f.dim}")
    exact_eps, x = rational(eps), to_floats(start)

    def measure_sizes(f_eps: fmpq, count: int) -> tuple[list[float], str]:
        g_at_eps = g.at(f_eps * rational(ratio))
        image = images_of(g_at_eps, x)
        if not np.isfinite(image).all():
            return [], "the map of g is not defined at the initial point"
        ensemble, sizes = FloatEnsemble(f, f_eps, np.array([x, image]), threads=1), list[float]()
        for k, points in enumerate(ensemble.records(count, 1)):
            if k:
                endpoints = images_of(g_at_eps, points[:, 0]), points[:, 1]
                size = np.maximum(1.0, np.abs(points).max(axis=(1, 2)))
                sizes += (np.abs(endpoints[0] - endpoints[1]).max(axis=1) / size).tolist()
        messages = [ensemble.end(k).message for k in range(2) if ensemble.failed_at[k] >= 0]
        return [size for size in sizes if np.isfinite(size)], messages[0] if messages else ""

    step_sizes, message = measure_sizes(exact_eps, steps)
    printed_steps = (
        sorted({1 << k for k in range(len(step_sizes).bit_length())} | {len(step_sizes)}) if step_sizes else []
    )
    by_eps: list[tuple[fmpq, float]] = []
    for k in range(_HALVINGS if f.has_eps and g.has_eps else 0):
        by_eps += [(exact_eps / (1 << k), size) for size in measure_sizes(exact_eps / (1 << k), 1)[0]]
    significant_sizes = [size for _, size in by_eps if size > _ROUNDING]
    slope = log2(significant_sizes[-2] / significant_sizes[-1]) if len(significant_sizes) > 1 else None
    largest = max(step_sizes, default=float("nan"))
    return Commutator(tuple((n, step_sizes[n - 1]) for n in printed_steps if n), largest, tuple(by_eps), slope, message)
