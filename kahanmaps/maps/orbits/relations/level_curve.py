"""The elliptic curve of an orbit in the plane, as the level curve F(x, y) = 0 of an integral.

It is used for orbits that do not determine their curve, such as periodic ones. Lines through a point of multiplicity
d - 2 on the curve, d = deg F, meet the curve in two more points. This transforms the curve into v^2 = g(t), with g of
degree 3 or 4, and then into a Weierstrass curve.
"""

from __future__ import annotations

from collections.abc import Sequence
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
        value, image_value = (integral.value(K, (*x, K.convert(eps))) for x in (point, image))
    except (BudgetExceeded, ZeroDivisionError):
        return False
    return value is not None and image_value is not None and K.equal(value, image_value)


def level_curve(
    integral: RationalFunction, eps: fmpq, points: Sequence[tuple[fmpq, ...]]
) -> tuple[EllipticCurve, AffinePoint, fmpq_mpoly] | None:
    """Return the Weierstrass curve of an orbit, the difference of successive points on it, and the polynomial F.

    Args:
        integral: a function of two variables and eps that the map conserves.
        eps: the value of eps.
        points: at least three successive points of the orbit.

    Returns None if the orbit meets several components of the level curve or a singular point, or if no rational point
    of multiplicity d - 2 is found on the curve, where d is its degree.
    """
    level = integral.value(QQ, (*points[0], eps))
    if level is None:
        return None
    F = substitute(integral.numerator - level * integral.denominator, {integral.names[2]: eps})
    components = [factor for factor, _ in irreducible_factors(F)]
    indices = [[k for k, factor in enumerate(components) if evaluate(factor, QQ, point) == 0] for point in points]
    if len(indices[0]) != 1 or any(indices_of_point != indices[0] for indices_of_point in indices):
        return None
    F = components[indices[0][0]]
    triples: list[Triple] = [(x, y, fmpq(1)) for x, y in points]
    # Points that may have the required multiplicity: for a cubic the initial point, and rational points at infinity.
    one, zero, degree, terms = fmpq(1), fmpq(0), F.total_degree(), F.to_dict()
    centers: list[Triple] = [*triples[: degree == 3], (one, zero, zero), (zero, one, zero)]
    for factor, _ in fmpq_poly([terms.get((degree - k, k), zero) for k in range(degree + 1)]).factor()[1]:
        if factor.degree() == 1 and factor[0] != 0:
            centers.append((one, -factor[0] / factor[1], zero))
    for center in centers:
        quadratic = _lines_through(F, center)
        if quadratic is None:
            continue
        basis, (p0, p1, p2) = quadratic
        content, factors = (p1 * p1 - 4 * p0 * p2).factor()
        g, square_root = fmpq_poly([content]), fmpq_poly([1])
        for factor, power in factors:
            g, square_root = g * factor ** (power % 2), square_root * factor ** (power // 2)
        if g.degree() not in (3, 4):
            continue
        quartic_points: list[tuple[fmpq, fmpq] | None] = []
        for triple in triples:
            sigma, alpha, beta = basis.solve(fmpq_mat(3, 1, list(triple))).entries()
            if alpha == 0 or square_root(beta / alpha) == 0:
                quartic_points.append(None)
            else:
                t = beta / alpha
                quartic_points.append((t, (2 * p2(t) * sigma / alpha + p1(t)) / square_root(t)))
        for P, Q in pairwise(quartic_points):
            if P is None or Q is None or P[0] == Q[0] or P[1] == 0:
                continue
            # The Weierstrass form of v^2 = g(t), with P = (t_0, v_0) as zero. With t = t_0 + 1/s and w = v s^2, it is
            # w^2 = a s^4 + b s^3 + c s^2 + d s + e with a = v_0^2.
            a, b, c, d, e = (g(fmpq_poly([P[0], 1]))[k] for k in range(5))
            s = 1 / (Q[0] - P[0])
            curve = EllipticCurve(c, b * d - 4 * a * e, a * d * d + b * b * e - 4 * a * c * e)
            X = 2 * P[1] * Q[1] * s * s + 2 * a * s * s + b * s
            Y = ((4 * a * X + 4 * a * c - b * b) * s + b * X + 2 * a * d) / (2 * P[1])
            assert Y * Y == ((X + curve.a2) * X + curve.a4) * X + curve.a6
            return curve, (X, Y), F
    return None


def _lines_through(F: fmpq_mpoly, center: Triple) -> tuple[fmpq_mat, tuple[fmpq_poly, ...]] | None:
    """Return a basis O, A, B, and F(s O + A + t B) = p0 + p1 s + p2 s^2, p_i in Q[t]; None if the degree in s is not 2.

    O is the center; the columns of the matrix are the basis.
    """
    k = next(k for k in range(3) if center[k] != 0)
    unit_vectors = [tuple(fmpq(int(i == j)) for i in range(3)) for j in range(3) if j != k]
    columns = [center, *unit_vectors]
    s, t = ring(["s", "t"]).gens()
    X, Y, Z = (s * columns[0][i] + columns[1][i] + t * columns[2][i] for i in range(3))
    d, restriction = F.total_degree(), 0 * s
    for (i, j), value in F.to_dict().items():
        restriction += value * X**i * Y**j * Z ** (d - i - j)
    if int(restriction.degrees()[0]) != 2:
        return None
    rows: list[list[fmpq]] = [[fmpq(0)] * (d + 1) for _ in range(3)]
    for (i, j), value in restriction.to_dict().items():
        rows[i][j] = value
    basis = fmpq_mat(3, 3, [columns[j][i] for i in range(3) for j in range(3)])
    return basis, tuple(fmpq_poly(row) for row in rows)
