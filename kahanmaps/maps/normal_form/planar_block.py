"""One plane of the normal form, and its Kahan map in homogeneous coordinates, without eps and without division.

The Kahan map of u' = h_v, v' = -h_u for a binary cubic h = a u^3 + b u^2 v + c u v^2 + d v^3 depends on 2 eps (u, v)
only. Write 2 eps (u, v) = (U/W, V/W). Then one step is

    Psi(U : V : W) = (U W + h_V : V W - h_U : W^2 + D),      D = (3ac - b^2) U^2 + (9ad - bc) UV + (3bd - c^2) V^2,

and the inverse step is the same with -W instead of W. The map conserves the level h : W (W^2 + D), so that a point
stays on the plane cubic

    E:   h(U, V) = level * W (W^2 + D(U, V)),

on which Psi is a translation. Let delta = disc(h) level^2. On the Jacobian

    y^2 + 6 x y + 16 gamma y = x^3 + 3 gamma x^2,      gamma = 1 - delta,

Psi is the translation by T = (0, 0). E is singular for delta = 0, and it consists of three lines for gamma = 0
(docs/mathematics.md). Coefficients and coordinates may be from any field, or integers: only sums and products occur.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Triple = tuple[Any, Any, Any]


class PlanarBlock:
    """The map Psi for the cubic h with the coefficients a, b, c, d, elements of a field or integers.

    >>> block = PlanarBlock(1, 0, 0, 1)
    >>> block.image((1, 2, 1)), block.preimage(block.image((1, 2, 1)))
    ((13, -1, 19), (244, 488, 244))
    """

    __slots__ = ("D", "_thrice_a", "_thrice_d", "_twice_b", "_twice_c", "a", "b", "c", "d")

    def __init__(self, a: Any, b: Any, c: Any, d: Any) -> None:
        self.a, self.b, self.c, self.d = a, b, c, d
        self.D: Triple = (3 * a * c - b * b, 9 * a * d - b * c, 3 * b * d - c * c)
        self._thrice_a, self._twice_b, self._twice_c, self._thrice_d = 3 * a, 2 * b, 2 * c, 3 * d

    @property
    def is_zero(self) -> bool:
        """Whether h = 0, so that Psi is the identity."""
        return bool(self.a == 0 and self.b == 0 and self.c == 0 and self.d == 0)

    @property
    def discriminant(self) -> Any:
        """disc(h) = b^2 c^2 - 4 a c^3 - 4 b^3 d + 18 abcd - 27 a^2 d^2."""
        a, b, c, d = self.a, self.b, self.c, self.d
        return b * b * c * c - 4 * (a * c * c * c + b * b * b * d) + 18 * (a * b * c * d) - 27 * (a * a * d * d)

    def image(self, point: Sequence[Any]) -> Triple:
        """Return Psi(U : V : W), not divided by its content; (0, 0, 0) at an indeterminacy point of Psi."""
        U, V, W = point
        UU, UV, VV = U * U, U * V, V * V
        p, q, r = self.D
        return (
            U * W + self.b * UU + self._twice_c * UV + self._thrice_d * VV,
            V * W - self._thrice_a * UU - self._twice_b * UV - self.c * VV,
            W * W + p * UU + q * UV + r * VV,
        )

    def preimage(self, point: Sequence[Any]) -> Triple:
        """Return the preimage of (U : V : W) under Psi, not divided by its content."""
        U, V, W = point
        U_image, V_image, W_image = self.image((U, V, -W))
        return -U_image, -V_image, W_image

    def h(self, U: Any, V: Any) -> Any:
        """Return the value of the cubic form h."""
        return (self.a * U + self.b * V) * (U * U) + (self.c * U + self.d * V) * (V * V)

    def level(self, point: Sequence[Any]) -> tuple[Any, Any]:
        """Return the conserved ratio h : W (W^2 + D) as numerator and denominator."""
        U, V, W = point
        p, q, r = self.D
        return self.h(U, V), W * (W * W + p * (U * U) + q * (U * V) + r * (V * V))


def determinant(P: Sequence[Any], Q: Sequence[Any], R: Sequence[Any]) -> Any:
    """Return det(P, Q, R), which is 0 if and only if the points are collinear."""
    return P[0] * (Q[1] * R[2] - Q[2] * R[1]) - P[1] * (Q[0] * R[2] - Q[2] * R[0]) + P[2] * (Q[0] * R[1] - Q[1] * R[0])


def same_point(P: Sequence[Any], Q: Sequence[Any]) -> bool:
    """Return whether two nonzero triples are proportional."""
    return bool(P[0] * Q[1] == P[1] * Q[0] and P[0] * Q[2] == P[2] * Q[0] and P[1] * Q[2] == P[2] * Q[1])
