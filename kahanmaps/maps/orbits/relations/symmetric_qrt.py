"""Steps of planar maps (x, y) -> (y, g(x, y)) along orbits on a symmetric biquadratic curve: a few products, no gcds.

Such are the symmetric QRT maps (qrt-1988). Let F(x, y) = A(y) x^2 + B(y) x + C(y), symmetric, be zero at a point, and
g(x, y) = -B(y)/A(y) - x wherever F is zero. Then F(y, z) = F(z, y) has the roots z = x and z = g(x, y), so that F is
zero at the image again, and at all points of the orbit. With y = p/q, and x = p_/q_ and z = p~/q~ before and after it,

    f p~ p_ = C(p, q),      f (p~ q_ + q~ p_) = -B(p, q),      f q~ q_ = A(p, q),

A, B, C being made forms of (p, q) of degree 2. All fractions in lowest terms, f is the common divisor of the three
forms: products of primitive linear forms are primitive. It divides the determinant of their coefficients, as p^2, p q
and q^2 have no common divisor. So a step is three products and two exact divisions, of the fractions of one coordinate,
and the conditions on F are put to the proof once.

The determinant is not 0: F would be a u(x) u(y) + b v(x) v(y) with quadratic u, v, so that two steps exchange the two
points with the same u/v, and on an orbit of at most four points there is more than one F. And where the denominator of
g is not 0, nor is A: else the conditions would make B = 0, then C = 0, and the determinant 0.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq, fmpq_mpoly, fmpz, fmpz_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.maps.implicit import MapOver
from kahanmaps.maps.orbits.integer_point import FractionsPoint, IntegerPoint

_POINTS = 8  # that the six coefficients of F are found from
_PRIME = 2**61 - 1


class SymmetricQRT:
    """The forms along one orbit: `coefficients` has a row for each of A, -B, C, columns for p^2, p q and q^2."""

    name = "the biquadratic curve of the orbit"

    def __init__(self, coefficients: fmpz_mat, denominator: fmpq_mpoly) -> None:
        self.coefficients = coefficients
        self._bound = abs(coefficients.det())
        self._denominator = [
            (int(c.p % _PRIME) * pow(int(c.q), -1, _PRIME), int(i), int(j)) for (i, j, _), c in denominator.terms()
        ]

    def step(self, last: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """The point with this number, after the last one; None where the forms do not give it."""
        (before, below), (p, q) = last[-1].lowest_terms()
        if self._may_be_pole(before, below, p, q):
            return None
        A, B, C = (self.coefficients * fmpz_mat(3, 1, [p * p, p * q, q * q])).entries()
        common = self._bound
        for value in (A, B, C):
            common = common.gcd(value % common)
        above, below = (C // before if before else B // below) // common, A // below // common
        sign = -1 if below < 0 else 1
        return FractionsPoint([(p, q), (sign * above, sign * below)])

    def _may_be_pole(self, *fractions: fmpz) -> bool:
        """Whether the denominator of g is 0 modulo a prime, or has no value there."""
        above, below, p, q = (int(entry % _PRIME) for entry in fractions)
        if not below or not q:
            return True
        x, y = above * pow(below, -1, _PRIME) % _PRIME, p * pow(q, -1, _PRIME) % _PRIME
        return not sum(c * pow(x, i, _PRIME) * pow(y, j, _PRIME) for c, i, j in self._denominator) % _PRIME


def symmetric_qrt(map_over: MapOver, start: IntegerPoint) -> SymmetricQRT | None:
    """The forms along the orbit of a start; None where there are none.

    F vanishes at its first points. That it has to do so at the image of each of its zeros is shown by a division.
    """
    if map_over.dim != 2 or len(map_over.factors) > 1:
        return None
    equation = map_over.factors[0].equation
    rows = [[entry.subs({"z": 1}) for entry in row] for row in equation.polynomials()]
    (one, zero, side), (other, Q, rest) = rows
    x, y, _ = side.context().gens()
    if not (zero.is_zero() and other.is_zero() and one.is_constant() and side == -one * y):
        return None
    points = list[IntegerPoint]()
    while len(points) < _POINTS:
        point = map_over.integer_step(points[-1]) if points else start
        if point is None:
            return None
        points.append(point)
    table = [_symmetric(*here, *ahead) for here, ahead in (point.lowest_terms() for point in points)]
    kernel, nullity = fmpz_mat(table).nullspace()
    if nullity != 1:
        return None
    c = primitive_integers(tuple(fmpq(kernel[k, 0]) for k in range(len(table[0]))))
    A, B, C = [c[0], c[1], c[2]], [c[1], c[3], c[4]], [c[2], c[4], c[5]]
    forms = fmpz_mat([A, [-entry for entry in B], C])
    A_of_y, B_of_y, C_of_y = (a * y**2 + b * y + c for a, b, c in (A, B, C))
    condition = Q * (B_of_y + x * A_of_y) - rest * A_of_y
    if not (condition % (A_of_y * x**2 + B_of_y * x + C_of_y)).is_zero():
        return None
    return SymmetricQRT(forms, Q)


def _symmetric(p: fmpz, q: fmpz, r: fmpz, s: fmpz) -> list[fmpz]:
    """x^2 y^2, x^2 y + x y^2, x^2 + y^2, x y, x + y and 1 for x = p/q and y = r/s, times q^2 s^2."""
    pp, pq, qq, rr, rs, ss = p * p, p * q, q * q, r * r, r * s, s * s
    return [pp * rr, pp * rs + pq * rr, pp * ss + qq * rr, pq * rs, pq * ss + qq * rs, qq * ss]
