"""The geometry of an orbit on a curve of genus 1 or 0: Weierstrass model, translation, height and rotation number.

The search for elliptic curves along an orbit (elliptic_orbit.py) ends with a proof that the points are P + n T on an
elliptic curve, and with the first terms W(1) = 1, ..., W(4) of the sequence of the multiples of T. These determine the
curve and T: on y^2 + a1 x y + a3 y = x^3 + a2 x^2 with T = (0, 0) the division polynomials at T are

    psi_2 = a3,      psi_3 = a2 a3^2,      psi_4 = a3^4 (a1 a2 - a3)                            (ward-1948).

If this cubic is singular, or the orbit lies on another rational curve, the map acts on a projective line: it multiplies
a coordinate by the multiplier kappa, or adds a constant to it. Source: docs/mathematics.md, "Orbits on elliptic
curves".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import arb, fmpq, fmpq_mat

from kahanmaps.algebra.elliptic_curves import (
    MAX_BITS,
    AffinePoint,
    EllipticCurve,
    canonical_height,
    rotation_number,
)
from kahanmaps.algebra.fields import QQ, RR
from kahanmaps.algebra.matrices import nullspace, rank
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import format_number
from kahanmaps.algebra.reduction import BadPrimes, bad_primes
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import InputError, PrecisionLost, UnknownCurve
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.elliptic_orbit import TooLongRelation, elliptic_steps
from kahanmaps.maps.orbits.relations.level_curve import is_conserved, level_curve

_MAX_BITS = 100_000  # maximal number of bits of the coefficients searched for, and of points on rational curves
# The search is repeated from later points, up to 16 steps in distances of 8, as long as points have at most 2000 bits.
_LAST_SEARCH_STEP, _SEARCH_DISTANCE, _MAX_SEARCH_BITS = 16, 8, 2000
_MAX_LEVEL_POINTS = 8  # number of points from which the translation on a level curve is computed
_MAX_PERIOD = 24  # largest period that is recognized: twice the largest order of a torsion point
_MAX_RATIONAL_DEGREE = 6  # largest degree of rational curves that are not rational normal curves
_ACCURACY = 1e-15  # accuracy of rotation numbers


@dataclass(frozen=True)
class OrbitCurve(PrintableResult):
    """The curve of an orbit, and the map on this curve; everything except the balls is exact and proved.

    The k-th iterate, k = `iterate`, maps the curve to itself; `curve`, `point` and the numbers belong to this iterate.
    For genus 1 the iterate is the translation by `point` on `curve`, y^2 = x^3 + A x + B, on which the coordinates have
    degree `degree`. For genus 0, `trace` is kappa + 1/kappa with the multiplier kappa; it is 2 for a parabolic map.
    """

    genus: int
    iterate: int
    curve: EllipticCurve | None = None
    point: AffinePoint | None = None
    degree: int = 0
    trace: fmpq | None = None

    @cached_property
    def order(self) -> int | None:
        """The order of the translation or of kappa; None if it is infinite."""
        return None if self.curve is None or self.point is None else self.curve.order(self.point)

    @cached_property
    def height(self) -> arb | None:
        """The canonical height of `point`."""
        if self.curve is None or self.point is None:
            return None
        return canonical_height(self.curve, self.point) if self.order is None else arb(0)

    @property
    def height_constant(self) -> float | None:
        """The constant C such that the largest coordinate of the n-th iterate of the map has about C n^2 bits.

        With all coordinates over one common denominator, the integers may be longer.
        """
        if self.height is None or self.order is not None:
            return None
        return self.degree * float(self.height.mid()) / (self.iterate**2 * math.log(2))

    @cached_property
    def _rotation_and_steps(self) -> tuple[arb | None, int]:
        if self.curve is not None and self.point is not None:
            return _rotation(self.curve, self.point)
        if self.trace is None or abs(self.trace) >= 2:
            return None, 1
        with RR(128).working():  # kappa = exp(2 pi i rho)
            return arb.atan2(arb(4 - self.trace**2).sqrt(), arb(self.trace)) / (2 * arb.pi()), 1

    @property
    def rotation(self) -> arb | None:
        """The rotation number in (0, 1/2] up to sign; None if kappa is real."""
        return self._rotation_and_steps[0]

    @property
    def steps(self) -> int:
        """1, or 2 if the iterate exchanges two real components; then `rotation` belongs to the iterate's square."""
        return self._rotation_and_steps[1]

    @cached_property
    def bad_primes(self) -> BadPrimes | None:
        """The primes of bad reduction of the curve over Q."""
        return None if self.curve is None else bad_primes(self.curve)

    @property
    def components(self) -> int | None:
        """The number of real components of the curve of genus 1: 1, or 2 if the discriminant is positive."""
        return None if self.curve is None else 2 if self.curve.discriminant > 0 else 1

    @property
    def is_dense(self) -> bool:
        """Whether the orbit is dense in those real components of its curves that it visits (proved).

        It is dense if the translation of a circle, or the rotation, has infinite order.
        """
        return self.rotation is not None and self.order is None

    @property
    def j(self) -> fmpq | None:
        """The j-invariant."""
        return None if self.curve is None else self.curve.j

    @property
    def text(self) -> str:
        iterate_text = "" if self.iterate == 1 else f", iterate {self.iterate} of the map"
        lines = [f"curve of the orbit\tgenus {self.genus} (proved){iterate_text}"]
        if (
            self.curve is not None
            and self.point is not None
            and self.height is not None
            and self.bad_primes is not None
        ):
            order = "infinite order" if self.order is None else f"order {self.order}"
            minimal = self.bad_primes.minimal_discriminant
            lines += [
                f"  Weierstrass model\ty^2 = x^3 + A x + B, A = {self.curve.a4}, B = {self.curve.a6}",
                f"  j-invariant\t{format_number(self.curve.j)}",
                f"  discriminant\t{16 * self.curve.discriminant}" + ("" if minimal is None else f", minimal {minimal}"),
                f"  bad primes\t{self.bad_primes.text}",
                f"  translation\t({', '.join(map(format_number, self.point))}), {order} (proved: multiples up to 12)",
                f"  canonical height\t{self.height.str(12)}",
            ]
            visits = {1: "", 2: ", the orbit stays on one" if self.steps == 1 else ", the orbit visits both in turn"}
            side_texts = {1: "", 2: ", the translation point is on the " + ("egg", "unbounded one")[self.steps == 1]}
            n = self.components or 1
            lines.append(f"  real components\t{n}{visits[n]}{side_texts[n]}")
        if self.trace is not None:
            multiplier = {True: "parabolic", False: "kappa + 1/kappa = " + format_number(self.trace)}[self.trace == 2]
            lines.append(f"  multiplier\t{multiplier}, infinite order (proved)")
        if self.rotation is not None:
            note = ", of the second iterate of it: two real components are exchanged" if self.steps == 2 else ""
            lines.append(f"  rotation number\t{self.rotation.str(12)}{note}")
            dense_text = "dense in the real components that it visits (proved: infinite order)"
            lines.append(f"  orbit\t{dense_text if self.is_dense else 'finite (proved)'}")
        if self.height_constant is not None:
            lines.append(f"heights\t{self.height_constant:.8g} n^2 bits, asymptotically, of the largest coordinate")
        return "\n".join(lines)

    def to_json(self) -> dict[str, Any]:
        """Return plain data; exact numbers and balls are given as text."""

        def text(x: fmpq | None) -> str | None:
            return None if x is None else format_number(x)

        return {
            "genus": self.genus,
            "iterate": self.iterate,
            "A": None if self.curve is None else format_number(self.curve.a4),
            "B": None if self.curve is None else format_number(self.curve.a6),
            "j": text(self.j),
            "discriminant": None if self.curve is None else format_number(16 * self.curve.discriminant),
            "bad_primes": None if self.bad_primes is None else self.bad_primes.to_json(),
            "components": self.components,
            "dense": self.is_dense,
            "point": None if self.point is None else [format_number(x) for x in self.point],
            "order": self.order,
            "height": None if self.height is None else self.height.str(15),
            "trace": text(self.trace),
            "rotation": None if self.rotation is None else self.rotation.str(15),
            "steps": self.steps,
            "height_constant": self.height_constant,
        }


def orbit_curve(
    map_over: Map, start: Sequence[Any], family: MapFamily | None = None, integrals: Sequence[RationalFunction] = ()
) -> OrbitCurve:
    """Return the geometry of the orbit of a point under a map over Q, if it lies on curves of genus 1 or 0.

    Args:
        map_over: the map.
        start: the initial point, exact.
        family, integrals: the map for every eps, and its claimed integrals. In the plane, the level curves of proved
            integrals are used for orbits whose points determine no curve.

    Raises UnknownCurve if no curve is found, InputError if the orbit is finite or the map is not over Q.

    >>> from kahanmaps.documents.inline import as_file
    >>> curve = orbit_curve(as_file("mcmillan").map.at(fmpq(1), QQ), [fmpq(1, 3), fmpq(2, 5)])
    >>> curve.genus, curve.curve.a4, curve.curve.a6, curve.rotation.str(8, radius=False)
    (1, -7323, 229622, '0.15215519')
    """
    require_rational(map_over)
    point = IntegerPoint.from_rationals(map_over.point(start))
    # An initial point in special position may give zeros among the first terms of the sequences.
    curve: OrbitCurve | None = None
    search_point = point
    for skipped in range(_LAST_SEARCH_STEP + 1):
        if skipped % _SEARCH_DISTANCE == 0:
            new_curve = _on_elliptic_curve(map_over, search_point)
            if new_curve is not None and new_curve.iterate == 1:
                return new_curve
            curve = curve if new_curve is None else new_curve
        image = map_over.integer_step(search_point)
        if image is None or image.exceeding(_MAX_SEARCH_BITS):
            break
        search_point = image
    orbit = _first_points(map_over, point)
    if orbit[-1] is None and (last_point := orbit[-2]) and map_over.integer_step(last_point) is None:
        raise InputError(
            f"the orbit ends: the map is not defined at step {len(orbit) - 2}; choose another initial point"
        )
    points = [entry.rationals() for entry in orbit if entry]
    if map_over.dim == 2 and family is not None and len(points) > 2 and points[2] != points[0]:
        # The level curves of integrals, if their genus is 1: an automorphism over Q of such a curve is a translation
        # unless its square is the identity.
        for integral in integrals:
            curve_and_polynomial = level_curve(integral, map_over.eps, points[:_MAX_LEVEL_POINTS])
            if curve_and_polynomial is not None and is_conserved(family, map_over.eps, integral):
                level, translation, F = curve_and_polynomial
                # The degree of single coordinates, or of coordinates with a common denominator, as in the search.
                is_triangular = all(factor.integer_steps.is_triangular for factor in map_over.factors)
                degree = max(map(int, F.degrees())) if is_triangular else int(F.total_degree())
                return OrbitCurve(1, 1, *level.short_model(translation), degree)
    if curve is not None:
        return curve
    if orbit[-1] == point and len(orbit) > 1:
        raise InputError(
            f"the orbit has period {len(orbit) - 1}, and its points determine no curve: choose another initial point"
        )
    result = _on_rational_curve(map_over, orbit)
    if result is None:
        raise UnknownCurve(
            "undecided: no curve of genus 0 or 1 was found that contains the orbit; the search covers curves of "
            "genus 1 on which the coordinates have degree at most 8, singular plane cubics, rational normal curves, "
            f"and rational curves of degree at most {_MAX_RATIONAL_DEGREE} on which a coordinate is a parameter"
        )
    return result


def require_rational(map_over: Map) -> None:
    """Raise InputError for a map whose coefficients contain an algebraic number."""
    if map_over.field is not QQ:
        raise InputError(
            f"found a map over {map_over.field}, expected rational parameters: curves are found over Q only"
        )


def _on_elliptic_curve(map_over: Map, start: IntegerPoint) -> OrbitCurve | None:
    """Search for an elliptic curve, and return the geometry from the terms of W and the degrees of the coordinates."""
    try:
        steps = elliptic_steps(map_over, start, _MAX_BITS, prime_limit=_MAX_BITS)
    except TooLongRelation:
        raise UnknownCurve(
            f"undecided: the orbit seems to lie on an elliptic curve, but its coefficients have more than {_MAX_BITS} "
            "bits: choose an initial point, eps or parameters with fewer digits"
        ) from None
    if steps is None:
        return None
    W2, W3, W4 = (steps.multiples.value(n) for n in (2, 3, 4))
    a2, a3 = W3 / W2**2, W2
    a1 = (W4 / a3**4 + a3) / a2
    curve, T = EllipticCurve(a2 + a1 * a1 / 4, a1 * a3 / 2, a3 * a3 / 4), (fmpq(0), a3 / 2)
    # T belongs to `stride` steps of factors; `factor_steps` is the least common multiple of `stride`, `factor_count`.
    factor_count = len(map_over.factors)
    factor_steps = math.lcm(factor_count, steps.stride)
    iterate = factor_steps // factor_count
    point = curve.multiple(factor_steps // steps.stride, T)
    assert point is not None  # W(n) is not 0
    if curve.discriminant == 0:
        return _on_singular_cubic(curve, point, iterate)
    curve, point = curve.short_model(point)
    return OrbitCurve(1, iterate, curve, point, steps.degree)


def _rotation(curve: EllipticCurve, point: AffinePoint) -> tuple[arb, int]:
    bits = 128
    while bits <= MAX_BITS:
        with RR(bits).working():
            real_curve = EllipticCurve(*(arb(a) for a in (curve.a2, curve.a4, curve.a6)))
            try:
                number, steps = rotation_number(real_curve, (arb(point[0]), arb(point[1])), curve.discriminant > 0)
            except PrecisionLost:
                number = None
            if number is not None and number.is_finite() and float(number.rad()) < _ACCURACY:
                return number, steps
        bits *= 4
    raise PrecisionLost(f"the rotation number needs more than {MAX_BITS} bits: the curve is almost singular")


def _on_singular_cubic(curve: EllipticCurve, point: AffinePoint, iterate: int) -> OrbitCurve:
    """Return the result, with the multiplier of the translation, on the singular cubic Y^2 = (x - r)^2 (x - s).

    The translation multiplies (Y + m (x - r))/(Y - m (x - r)), m^2 = r - s, by the value of this function at the point.
    """
    a, b, c = curve.a2, curve.a4, curve.a6
    squared_difference = a * a - 3 * b  # (r - s)^2
    if squared_difference == 0:
        return OrbitCurve(0, iterate, trace=fmpq(2))
    r = (9 * c - a * b) / (2 * squared_difference)
    x, y = point
    m_squared, w = 3 * r + a, x - r  # r - s, as 2 r + s = -a
    return OrbitCurve(0, iterate, trace=2 * (y * y + m_squared * w * w) / (y * y - m_squared * w * w))


def _first_points(map_over: Map, start: IntegerPoint) -> list[IntegerPoint | None]:
    """Return enough points to show a period or a rational curve; None follows if the orbit ends or gets too long."""
    dim = map_over.dim
    map_degree = max(sum(exponent) for factor in map_over.factors for exponent in factor.equation.exponents)
    points: list[IntegerPoint | None] = [start]
    degree = max(dim, _MAX_RATIONAL_DEGREE)
    while len(points) < max(_MAX_PERIOD, map_degree * degree + degree + 2, (dim + 1) * (degree + 1)) + dim:
        image = map_over.integer_step(points[-1])  # type: ignore[arg-type]
        if image is None or image.exceeding(_MAX_BITS):  # on a rational curve the length grows linearly
            return [*points, None]
        points.append(image)
        if image == start:
            break
    return points


def _on_rational_curve(map_over: Map, points: list[IntegerPoint | None]) -> OrbitCurve | None:
    """Return the multiplier of an orbit on a rational curve, on which the map acts as z -> (p z + q)/(r z + s).

    The coordinates are forms of degree d in (z : 1). Substituted into the equation of the map, they give a form of
    known degree, which is 0 if it vanishes at more points than its degree.
    """
    if len(map_over.factors) > 1 or None in points:  # points between the factors lie on other curves
        return None
    dim, map_degree = map_over.dim, max(sum(exponent) for exponent in map_over.factors[0].equation.exponents)
    rows = [[fmpq(p.denominator), *(fmpq(x) for x in p.numerators)] for p in points if p is not None]
    size = dim + 3
    # Coordinates that are independent on the orbit, beginning with the nonzero denominator.
    independent_columns: list[int] = []
    for k in range(dim + 1):
        columns = [*independent_columns, k]
        if rank(QQ, fmpq_mat(size, len(columns), [row[i] for row in rows[:size] for i in columns])) == len(columns):
            independent_columns = columns
    independent_rows = [[row[k] for k in independent_columns] for row in rows]
    d = len(independent_columns) - 1
    if d < 1:
        return None
    # On a rational normal curve, hyperplanes through d - 1 points of the orbit give z. Otherwise try the coordinates.
    parameters = [
        ([row[k] / row[0] for row in rows], range(d, _MAX_RATIONAL_DEGREE + 1)) for k in independent_columns[1:]
    ]
    conditions = fmpq_mat(d - 1, d + 1, [x for row in independent_rows[: d - 1] for x in row])
    if len(pencil := nullspace(QQ, conditions)) == 2:
        pairs = [[sum(a * x for a, x in zip(form, row, strict=True)) for form in pencil] for row in independent_rows]
        pairs = pairs[d - 1 :]
        if all(second != 0 for _, second in pairs):
            quotients = [first / second for first, second in pairs]
            parameters.insert(0, (quotients, range(d, d + 1)))
    for z, degrees in parameters:
        equations = [[z[k], fmpq(1), -z[k] * z[k + 1], -z[k + 1]] for k in range(3)]
        kernel = nullspace(QQ, fmpq_mat(3, 4, [x for row in equations for x in row]))
        p, q, r, s = kernel[0]
        if len(kernel) != 1 or len(set(z)) < len(z):
            continue
        if any(z[k + 1] * (r * z[k] + s) != p * z[k] + q for k in range(len(z) - 1)):
            continue
        for degree in degrees:
            point_count = max(map_degree * degree + degree + 2, len(independent_columns) * (degree + 1))
            if _are_forms(z[:point_count], independent_rows[len(rows) - len(z) :][:point_count], degree):
                return OrbitCurve(0, 1, trace=(p + s) ** 2 / (p * s - q * r) - 2)
    return None


def _are_forms(z: Sequence[fmpq], rows: Sequence[Sequence[fmpq]], degree: int) -> bool:
    """Return whether the rows are, up to factors, the values of unique forms of this degree in (z : 1).

    Unique forms have no common factor: otherwise another factor could replace it.
    """
    width = degree + 1
    unknown_count, equations = len(rows[0]) * width, []
    for value, row in zip(z, rows, strict=True):
        monomials = [value**k for k in range(width)]
        for i in range(1, len(row)):
            equation = [fmpq(0)] * unknown_count
            equation[:width] = [row[i] * x for x in monomials]
            equation[i * width : (i + 1) * width] = [-row[0] * x for x in monomials]
            equations.append(equation)
    return len(nullspace(QQ, fmpq_mat(len(equations), unknown_count, [x for row in equations for x in row]))) == 1
