"""The points at which a field vanishes, in machine numbers, and what the flow does near them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kahanmaps.maps.floats.classical import VectorField
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.systems.quadratic import QuadraticSystem

SADDLE, CENTRE, FOCUS, NODE, DEGENERATE = "saddle", "centre", "focus", "node", "degenerate equilibrium"
_TRIED = 60  # starts of Newton's method
_LARGE = 20  # variables, from which on only the origin and (1, ..., 1) are
_ZERO = 1e-7  # parts of eigenvalues, relative to the largest


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A point with f = 0 and the derivative f' there."""

    point: FloatArray
    jacobian: FloatArray

    @property
    def expansion(self) -> float:
        """The largest real part of an eigenvalue of f'."""
        return round(float(np.linalg.eigvals(self.jacobian).real.max()), 6)

    @property
    def kind(self) -> str:
        """What the eigenvalues of f' say: a centre is one of the linear part, and terms of degree 2 may undo it."""
        values = np.linalg.eigvals(self.jacobian)
        least = _ZERO * max(float(np.abs(values).max()), _ZERO)
        real = values.real
        if (np.abs(values) <= least).any():
            return DEGENERATE
        if (real > least).any() and (real < -least).any():
            return SADDLE
        if (np.abs(real) <= least).all():
            return CENTRE
        if (np.abs(real) <= least).any():
            return DEGENERATE
        return FOCUS if (np.abs(values.imag) > least).any() else NODE


def equilibria(system: QuadraticSystem) -> list[Equilibrium]:
    """The real equilibria to which Newton's method comes from sixty starts, each once.

    >>> pendulum = QuadraticSystem.from_text(["x", "y"], ["y", "x - x^2"])
    >>> sorted((one.point.round(6).tolist(), one.kind) for one in equilibria(pendulum))
    [([0.0, 0.0], 'saddle'), ([1.0, 0.0], 'centre')]
    """
    n = system.dim
    f = VectorField(system)
    drawn = np.random.default_rng(0).uniform(-3, 3, (_TRIED if n <= _LARGE else 0, n))
    found: list[Equilibrium] = []
    for x in (np.zeros(n), np.ones(n), *drawn):
        point = _newton(f, x)
        # where an equilibrium is degenerate, Newton's method ends somewhat beside it: once is enough
        if point is None or any(np.allclose(point, other.point, atol=1e-3) for other in found):
            continue
        found.append(Equilibrium(point, f.jacobian(point)))
    return found


def isolated_equilibria(system: QuadraticSystem) -> list[Equilibrium]:
    """The same, and none where there are more than the 2^n that quadrics can have: then they fill curves."""
    found = equilibria(system)
    return found if len(found) <= 2**system.dim else []


def _newton(f: VectorField, x: FloatArray) -> FloatArray | None:
    for _ in range(40):
        value = f(x)
        scale = 1 + float(np.abs(x).max())
        if np.abs(value).max() <= 1e-12 * scale:
            nearest = np.round(x, 9)
            return nearest if np.abs(f(nearest)).max() <= 1e-12 * scale else x
        x = x + np.linalg.lstsq(f.jacobian(x), -value, rcond=1e-10)[0]  # equilibria need not be isolated
        if not np.isfinite(x).all() or np.abs(x).max() > 1e6:
            return None
    return None
