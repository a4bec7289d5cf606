"""The elliptic curve of an orbit in the plane, as the level curve F(x, y) = 0 of an integral.

It is used for orbits that do not determine their curve, such as periodic ones. Lines through a point whose multiplicity
on the curve is the degree minus 2 meet the curve in two more points: so the curve becomes v^2 = g(t), g of degree 3 or
4, and then a Weierstrass curve.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly

from kahanmaps.algebra.elliptic_curves import AffinePoint, EllipticCurve
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.polynomials import RationalFunction, evaluate, irreducible_factors, ring, substitute
from kahanmaps.maps.implicit import MapFamily

Triple = tuple[fmpq, fmpq, fmpq]


def is_conserved(family: MapFamily, eps: fmpq, integral: RationalFunction) -> bool:
    """Return whether a rational function of the variables and eps is proved to be an integral at this eps."""
    K = FunctionField(family.variables)
    point = tuple(K.variables)
    try:
        image = family.at(eps, K).step(point)
        before, after = (integral.value(K, (*x, K.convert(eps))) for x in (point, image))
    except (BudgetExceeded, ZeroDivisionError):
        return False
    return before is not None and after is not None and K.equal(before, after)


def level_curve(
    integral: RationalFunction, eps: fmpq, points: Sequence[tuple[fmpq, ...]]
) -> tuple[EllipticCurve, AffinePoint, fmpq_mpoly] | None:
    """Return the curve on which an orbit lies, the difference of successive points, and F.

    Args:
        integral: a function of two variables and eps that the map conserves.
        eps: the value of eps.
        points: at least three successive points of the orbit.

    Returns None if the orbit meets several components of the level curve or a singular point, or if no projection of
    this kind is found.
    """
    level = integral.value(QQ, (*points[0], eps))
    if level is None:
        return None
    F = substitute(integral.numerator - level * integral.denominator, {integral.names[2]: eps})
    components = [factor for factor, _ in irreducible_factors(F)]
    through = [[k for k, factor in enumerate(components) if evaluate(factor, QQ, point) == 0] for point in points]
    if len(through[0]) != 1 or any(indices != through[0] for indices in through):
        return None
    F = components[through[0][0]]
    triples: list[Triple] = [(x, y, fmpq(1)) for x, y in points]
    for center in _centers(F, triples[0]):
        quadratic = _lines_through(F, center)
        if quadratic is None:
            continue
        basis, (p0, p1, p2) = quadratic
        content, factors = (p1 * p1 - 4 * p0 * p2).factor()
        g, square = fmpq_poly([content]), fmpq_poly([1])
        for factor, power in factors:
            g, square = g * factor ** (power % 2), square * factor ** (power // 2)
        if g.degree() not in (3, 4):
            continue
        places: list[tuple[fmpq, fmpq] | None] = []
        for triple in triples:
            sigma, alpha, beta = basis.solve(fmpq_mat(3, 1, list(triple))).entries()
            if alpha == 0 or square(beta / alpha) == 0:
                places.append(None)
            else:
                t = beta / alpha
                places.append((t, (2 * p2(t) * sigma / alpha + p1(t)) / square(t)))
        for first, second in pairwise(places):
            if first is not None and second is not None and first[0] != second[0] and first[1] != 0:
                return *_weierstrass(g, first, second), F
    return None


def _centers(F: fmpq_mpoly, start: Triple) -> Iterator[Triple]:
    """Yield points that may have the required multiplicity: for a cubic the start, and rational points at infinity."""
    one, zero = fmpq(1), fmpq(0)
    d = F.total_degree()
    if d == 3:
        yield start
    yield from ((one, zero, zero), (zero, one, zero))
    terms = F.to_dict()
    top = fmpq_poly([terms.get((d - k, k), zero) for k in range(d + 1)])
    for factor, _ in top.factor()[1]:
        if factor.degree() == 1 and factor[0] != 0:
            yield one, -factor[0] / factor[1], zero


def _lines_through(F: fmpq_mpoly, center: Triple) -> tuple[fmpq_mat, tuple[fmpq_poly, ...]] | None:
    """Return a basis O, A, B, and F(s O + A + t B) = p0 + p1 s + p2 s^2 with polynomials in t; None for other degrees.

    O is the center; the columns of the matrix are the basis.
    """
    k = next(k for k in range(3) if center[k] != 0)
    units = [tuple(fmpq(int(i == j)) for i in range(3)) for j in range(3) if j != k]
    columns = [center, *units]
    s, t = ring(["s", "t"]).gens()
    X, Y, Z = (s * columns[0][i] + columns[1][i] + t * columns[2][i] for i in range(3))
    d, total = F.total_degree(), 0 * s
    for (i, j), value in F.to_dict().items():
        total += value * X**i * Y**j * Z ** (d - i - j)
    if int(total.degrees()[0]) != 2:
        return None
    rows: list[list[fmpq]] = [[fmpq(0)] * (d + 1) for _ in range(3)]
    for (i, j), value in total.to_dict().items():
        rows[i][j] = value
    basis = fmpq_mat(3, 3, [columns[j][i] for i in range(3) for j in range(3)])
    return basis, tuple(fmpq_poly(row) for row in rows)


def _weierstrass(g: fmpq_poly, zero: tuple[fmpq, fmpq], point: tuple[fmpq, fmpq]) -> tuple[EllipticCurve, AffinePoint]:
    """Return the Weierstrass form of v^2 = g(t), with `zero` = (t, v), v != 0, as zero, and the image of `point`."""
    shifted = g(fmpq_poly([zero[0], 1]))
    a, b, c, d, e = (shifted[k] for k in range(5))
    q, s = zero[1], 1 / (point[0] - zero[0])
    curve = EllipticCurve(c, b * d - 4 * a * e, a * d * d + b * b * e - 4 * a * c * e)
    # With t = t_0 + 1/s and w = v s^2, the curve is w^2 = a s^4 + b s^3 + c s^2 + d s + e with a = q^2.
    x = 2 * q * point[1] * s * s + 2 * a * s * s + b * s
    y = ((4 * a * x + 4 * a * c - b * b) * s + b * x + 2 * a * d) / (2 * q)
    assert y * y == ((x + curve.a2) * x + curve.a4) * x + curve.a6
    return curve, (x, y)
