"""Invariant cubics of a planar Kahan map, and coordinates in which these cubics are symmetric.

The Kahan map of u' = h_v, v' = -h_u with h = a u^3 + b u^2 v + c u v^2 + d v^3 conserves h/(1 + eps^2 D) with
the Hessian determinant D = h_uu h_vv - h_uv^2. So an orbit lies on a cubic denominator * h = numerator * (1 + eps^2 D).

A linear change of variables of determinant 1 transforms a real binary cubic h without repeated factor to
kappa (u^3 - 3 u v^2), which is 0 on three real lines at angles of 60 degrees, or to kappa (u^3 + 3 u v^2), which is 0
on one real line; kappa > 0. Then D = -36 kappa^2 (u^2 + v^2) or D = 36 kappa^2 (u^2 - v^2). Hence up to scaling there
are only two such Kahan maps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import acb_mat, arb, arb_mat
from numpy.typing import NDArray

from kahanmaps.maps.normal_form.planar_block import PlanarBlock

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PlaneCubic:
    """The curve denominator * h = numerator * (1 + eps^2 D) in the plane, with a binary cubic h.

    `h` are the coefficients of u^3, u^2 v, u v^2, v^3 in h; D is the Hessian determinant of h; `eps` is half the time
    step. If `numerator` = 0, the curve consists of the lines h = 0 through the origin. If `denominator` = 0, it is the
    conic 1 + eps^2 D = 0, which the map sends to infinity. Both are 0 for a base point, which lies on all these curves.

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
        """The coefficients of u^2, uv and v^2 in the Hessian determinant D = h_uu h_vv - h_uv^2."""
        p, q, r = PlanarBlock(*self.h).D
        return 4 * p, 4 * q, 4 * r

    def h_at(self, u: Any, v: Any) -> Any:
        """Return h(u, v)."""
        return PlanarBlock(*self.h).h(u, v)

    def D_at(self, u: Any, v: Any) -> Any:
        """Return D(u, v)."""
        p, q, r = self.D
        return p * u * u + q * u * v + r * v * v

    @property
    def length(self) -> float:
        """The smallest distance of the conic 1 + eps^2 D = 0 from the origin; 1 if the conic is empty."""
        t = np.linspace(0, np.pi, 721)
        max_value = self.eps * self.eps * float(np.abs(self.D_at(np.cos(t), np.sin(t))).max())
        return float(1 / np.sqrt(max_value)) if max_value > 0 else 1.0

    def value(self, points: Floats) -> Floats:
        """Return the values of denominator * h - numerator * (1 + eps^2 D) at points (u, v), an array (..., 2)."""
        u, v = np.moveaxis(points, -1, 0)
        return np.asarray(self.denominator * self.h_at(u, v) - self.numerator * (1 + self.eps**2 * self.D_at(u, v)))

    def value_on_sphere(self, angles: Floats, length: float) -> Floats:
        """Return the values of the homogenized polynomial of `value` on a half sphere, the projective plane.

        A pair (s, t) in `angles` (..., 2) represents the point (u, v) = length tan(t) (cos(s), sin(s)), which is at
        infinity if t = pi/2. If the curve consists of lines through the origin, the factor that is 0 at the origin is
        omitted. If the curve is a conic, the factor that is 0 at infinity is omitted.
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
        """Return the level curve of h through the point (u, v): it contains the orbit of the differential equation."""
        return PlaneCubic(self.h, 0.0, self.h_at(u, v), 1.0)

    def gradient(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Return the derivatives of denominator * h - numerator * (1 + eps^2 D) with respect to u and to v."""
        a, b, c, d = self.h
        p, q, r = (self.numerator * self.eps * self.eps * entry for entry in self.D)
        along_u = self.denominator * (3 * a * u * u + 2 * b * u * v + c * v * v) - 2 * p * u - q * v
        along_v = self.denominator * (b * u * u + 2 * c * u * v + 3 * d * v * v) - q * u - 2 * r * v
        return along_u, along_v


Matrix = arb_mat | acb_mat  # a matrix of complex balls in a complex plane, of real balls in a real plane

COMPLEX = "complex"
THREE_LINES, ONE_LINE, REPEATED, ZERO = "kappa (u^3 - 3 u v^2)", "kappa (u^3 + 3 u v^2)", "a repeated factor", "0"


def symmetric_coordinates(block: PlanarBlock) -> tuple[str, Matrix]:
    """Return the shape of the cubic h of a block as text, and a matrix of determinant 1 that brings h to this shape.

    The coefficients of h are real balls. If the ball of the discriminant of h contains 0, h counts as a cubic with a
    repeated factor, and the matrix is I.

    >>> block = PlanarBlock(arb(0), arb(1), arb(1), arb(0))
    >>> shape, matrix = symmetric_coordinates(block)
    >>> shape, [round(float(entry), 3) + 0 for entry in transform_cubic(block, matrix)]
    ('kappa (u^3 - 3 u v^2)', [0.31, 0.0, -0.931, 0.0])
    """
    identity = arb_mat([[1, 0], [0, 1]])
    if all(coefficient.contains(arb(0)) for coefficient in (block.a, block.b, block.c, block.d)):
        return ZERO, identity
    if block.discriminant.contains(arb(0)):
        return REPEATED, identity
    if block.discriminant > 0:
        # D is negative definite: transform it to a multiple of -(u^2 + v^2). A rotation then brings h to its shape.
        p, q, r = (-entry for entry in block.D)
        size = (p * r - q * q / 4).sqrt()
        stretch = (p / size).sqrt()
        to_circle = arb_mat([[stretch, stretch * q / (2 * p)], [0, 1 / stretch]])
        # In these coordinates h is the real part of (a - i b/3) (u + i v)^3.
        a, b, _, _ = transform_cubic(block, to_circle)
        # Rotate away from the branch cut of atan2: a ball that meets the cut would have the interval [-pi, pi] as
        # its angle.
        angle = (arb.atan2(-b / 3, -a) + arb.pi() if a < 0 else arb.atan2(b / 3, a)) / 3
        return THREE_LINES, arb_mat([[angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]]) * to_circle
    # D is a product of two real linear forms L, M, and h = s L^3 + t M^3. Scale L and M such that s = t, then rotate.
    p, q, r = block.D
    root = (q * q - 4 * p * r).sqrt()
    slope = -(q + root) / 2 if not q < 0 else -(q - root) / 2
    L, M = (p, -slope), (slope, -r)
    det = L[0] * M[1] - L[1] * M[0]
    s, t = block.h(M[1] / det, -M[0] / det), block.h(-L[1] / det, L[0] / det)
    ratio = abs(t / s).root(3) if t / s > 0 else -abs(t / s).root(3)
    if det * ratio < 0:
        L, M, s, det, ratio = M, L, t, -det, 1 / ratio
    scale = 1 / (det * ratio).sqrt()
    if s < 0:
        scale = -scale
    sqrt_half = arb(1) / arb(2).sqrt()
    forms = arb_mat([[entry * scale for entry in L], [entry * scale * ratio for entry in M]])
    return ONE_LINE, arb_mat([[sqrt_half, sqrt_half], [-sqrt_half, sqrt_half]]) * forms


def transform_cubic(block: PlanarBlock, matrix: Matrix) -> tuple[arb, arb, arb, arb]:
    """Return the coefficients of the cubic of a block in the coordinates `matrix` (of determinant 1) times (u, v)."""
    f, g, k, l = matrix.entries()
    # (u', v') are the new coordinates, and (u, v) = (l u' - g v', -k u' + f v').
    a, b, c, d = block.a, block.b, block.c, block.d
    slope_u, slope_v = 3 * a * l * l - 2 * b * l * k + c * k * k, b * l * l - 2 * c * l * k + 3 * d * k * k
    other_u, other_v = 3 * a * g * g - 2 * b * g * f + c * f * f, b * g * g - 2 * c * g * f + 3 * d * f * f
    return block.h(l, -k), -g * slope_u + f * slope_v, l * other_u - k * other_v, block.h(-g, f)
