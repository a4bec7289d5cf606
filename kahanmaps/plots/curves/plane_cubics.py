"""The level curves of a planar Kahan map, which are plane cubics.

The Kahan map of u' = h_v, v' = -h_u, h = a u^3 + b u^2 v + c u v^2 + d v^3, conserves h/(1 + eps^2 D) with the Hessian
determinant D = h_uu h_vv - h_uv^2, so an orbit stays on a cubic denominator * h = numerator * (1 + eps^2 D).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.maps.normal_form.planar_block import PlanarBlock

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PlaneCubic:
    """The curve denominator * h = numerator * (1 + eps^2 D) in the plane.

    `h` are the coefficients of the cubic, `eps` is half the time step. `numerator` = 0 is h = 0, lines through the
    origin; `denominator` = 0 is the conic 1 + eps^2 D = 0 of the points that the map sends to infinity; both zero: no
    level, as for a point where all the curves meet.

    >>> circle = PlaneCubic((1.0, 0.0, -3.0, 0.0), 0.5, 1.0, 0.0)
    >>> round(circle.length, 12), bool(abs(circle.value(np.array([0, circle.length]))) < 1e-12)
    (0.333333333333, True)
    """

    h: tuple[float, float, float, float]
    eps: float
    numerator: float
    denominator: float

    @property
    def D(self) -> tuple[float, float, float]:
        """The coefficients of D = h_uu h_vv - h_uv^2, of u^2, uv and v^2."""
        p, q, r = PlanarBlock(*self.h).D
        return 4 * p, 4 * q, 4 * r

    def h_at(self, u: Any, v: Any) -> Any:
        """The value of h."""
        return PlanarBlock(*self.h).h(u, v)

    def D_at(self, u: Any, v: Any) -> Any:
        """The value of D."""
        p, q, r = self.D
        return p * u * u + q * u * v + r * v * v

    @property
    def length(self) -> float:
        """The distance from the origin at which the map changes its ways: that of 1 + eps^2 D = 0, where it is real."""
        t = np.linspace(0, np.pi, 721)
        largest = self.eps * self.eps * float(np.abs(self.D_at(np.cos(t), np.sin(t))).max())
        return float(1 / np.sqrt(largest)) if largest > 0 else 1.0

    def value(self, points: Floats) -> Floats:
        """What is 0 on the curve, at points (..., 2)."""
        u, v = np.moveaxis(points, -1, 0)
        return np.asarray(self.denominator * self.h_at(u, v) - self.numerator * (1 + self.eps**2 * self.D_at(u, v)))

    def value_in_space(self, angles: Floats, length: float) -> Floats:
        """The same at points (..., 2) of half a sphere, which stand for lines through the origin of space.

        The first angle is the direction in the plane, the second that from the axis, a quarter of a turn at infinity:
        (u, v) = length tan(second) (cos(first), sin(first)). Where the curve is only lines through the origin, or only
        a conic, the origin and the line at infinity are left out.
        """
        first, second = np.moveaxis(angles, -1, 0)
        x, y, w, r = np.cos(first), np.sin(first), np.cos(second), np.sin(second)
        if self.numerator == 0:
            return np.asarray(self.denominator * self.h_at(x, y))
        conic = w * w + (self.eps * length * r) ** 2 * self.D_at(x, y)
        if self.denominator == 0:
            return np.asarray(conic)
        return np.asarray(self.denominator * (length * r) ** 3 * self.h_at(x, y) - self.numerator * w * conic)

    def flow_through(self, u: float, v: float) -> PlaneCubic:
        """The level curve of h itself through a point, on which the differential equation moves."""
        return PlaneCubic(self.h, 0.0, self.h_at(u, v), 1.0)

    def gradient(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """The derivatives of denominator h - numerator (1 + eps^2 D) along u and v."""
        a, b, c, d = self.h
        p, q, r = (self.numerator * self.eps * self.eps * entry for entry in self.D)
        along_u = self.denominator * (3 * a * u * u + 2 * b * u * v + c * v * v) - 2 * p * u - q * v
        along_v = self.denominator * (b * u * u + 2 * c * u * v + 3 * d * v * v) - q * u - 2 * r * v
        return along_u, along_v
