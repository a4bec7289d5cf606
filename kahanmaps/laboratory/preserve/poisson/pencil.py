"""The invariant curves P = c Q of a planar map with the integral P/Q: the genus and the base points of this pencil.

The computation runs modulo a prime p, with a residue for eps, in random projective coordinates. Take the curve of the
pencil through a random point, and its component C through this point: C is irreducible over GF(p) and smooth at the
point, hence irreducible over the algebraic closure. If curves of the pencil have several components, the pencil of
these components replaces the given one. Two generic curves of degree d of the pencil meet only in the base points, and
are smooth outside of these, by Bertini's theorem (hartshorne-1977, III.10). The resultant gives their intersection
number at each base point. If it may exceed the squared multiplicity of the curves there, the point is blown up, and so
are base points infinitely near to it, until the curves are separated. All multiplicities m_i satisfy (ibid., V.3)

    sum m_i^2 = d^2,        genus = (d - 1)(d - 2)/2 - sum m_i (m_i - 1)/2.

There is no result if the first equation fails, or if the results for two primes differ.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from math import comb
from typing import Any

from flint import Ordering, fmpq, fq_default_ctx, fq_default_poly_ctx, nmod_mat, nmod_mpoly, nmod_mpoly_ctx, nmod_poly

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import GF, PrimeField
from kahanmaps.algebra.polynomials import RationalFunction, degree_in
from kahanmaps.algebra.printing import attributes
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.errors import BadPrime
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.singular.jets import modulo

MAX_DEGREE = 12  # of the numerator and the denominator of the integral
_TRIES = 3  # primes that are tried until the results for two of them agree
_BITS = 31  # of primes; python-flint does not sort factors with larger coefficients
# How the degrees grow, by the genus of the curves, if a planar map of infinite order preserves each curve of a pencil:
# diller-favre-2001.
GROWTH_ON = {0: Growth.LINEAR, 1: Growth.QUADRATIC}
_Series = dict[tuple[int, int], Any]  # a truncated power series in x, y at a point: coefficients by exponents


@dataclass(frozen=True)
class BasePoints:
    """The number of base points with one multiplicity, and how many of them are infinitely near to another one."""

    multiplicity: int
    count: int
    infinitely_near: int

    @property
    def text(self) -> str:
        """The base points as a phrase."""
        near_text = f" ({self.infinitely_near} infinitely near)" if self.infinitely_near else ""
        return f"{self.count} of multiplicity {self.multiplicity}{near_text}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return attributes(self, "multiplicity", "count", "infinitely_near")


@dataclass(frozen=True)
class Pencil:
    """The curves I = c of a planar map for generic c (measured); `integral` is the name of I.

    `components` is the number of components of a curve; `degree`, `genus` and `base_points` belong to one component.
    """

    integral: str
    components: int
    degree: int
    genus: int
    base_points: tuple[BasePoints, ...]

    @property
    def text(self) -> str:
        """A sentence on degree, genus and base points of the generic curve."""
        verb = "is" if self.components == 1 else f"has {self.components} components"
        points_text = ", ".join(points.text for points in self.base_points)
        return (
            f"the generic curve {self.integral} = c {verb} of degree {self.degree} and genus {self.genus}; "
            f"base points: {points_text}"
        )

    def motion(self, growth: Growth) -> str:
        """Return a sentence on the restriction of the map to the curves I = c, given the growth of the map's degrees.

        It is "" if nothing follows. An automorphism of a curve of genus 1 is a translation or has finite order.
        """
        if self.genus > 1:
            return "the map has finite order, since such a curve has only finitely many automorphisms"
        if self.genus == 1 and growth is Growth.QUADRATIC:
            subject_text = "on it the map" if self.components == 1 else "on each of them an iterate of the map"
            return f"{subject_text} is a translation, since the degrees grow"
        return ""

    def contradiction(self, growth: Growth) -> str:
        """Return a sentence on why this growth of the degrees is impossible; empty if the growth is possible."""
        is_unbounded = growth in (Growth.LINEAR, Growth.QUADRATIC, Growth.POLYNOMIAL)
        is_possible = not is_unbounded or growth is GROWTH_ON.get(self.genus)
        return "" if is_possible else f"{growth} growth is impossible where the generic curve has genus {self.genus}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return attributes(self, "integral", "components", "degree", "genus", "base_points", "text")


def pencil_of(
    name: str, integral: RationalFunction, eps: fmpq | None, *, seed: int = 0, effort: int | Budget = 1
) -> Pencil | None:
    """Measure genus and base points of the generic curve I = c, modulo two primes.

    Args:
        name: the name of the integral.
        integral: a function that is not constant, in two variables and eps.
        eps: half the time step, an exact number; None: a random residue replaces it.
        seed: the random seed.
        effort: each increase by 1 doubles the work limit.

    Returns:
        The `Pencil`; None if the degree is above 12, the work limit was reached, or a consistency check failed.

    Source: docs/mathematics.md.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> pencil = pencil_of("I", parse_rational_function("y^2 - x^3 - x", ["x", "y", "eps"]), None)
    >>> pencil.text
    'the generic curve I = c is of degree 3 and genus 1; base points: 9 of multiplicity 1 (8 infinitely near)'
    """
    if max(degree_in(polynomial, 2) for polynomial in (integral.numerator, integral.denominator)) > MAX_DEGREE:
        return None
    rng = random.Random(f"pencil {derive_seed(seed, integral, eps)}")
    budget = budget_for("invariant curves", effort)
    earlier_pencils: list[Pencil] = []
    for _ in range(_TRIES):
        try:
            _require(not budget.is_spent)
            field = GF(random_prime(rng, _BITS))
            residue = field.random(rng) if eps is None else field.convert(eps)
            pencil = _ModularPlane(field, rng, budget).pencil(name, integral, int(residue))
        except (BadPrime, _NotGeneric):
            continue
        if pencil in earlier_pencils:
            return pencil
        earlier_pencils.append(pencil)
    return None


class _NotGeneric(Exception):
    """Raised if the curves are not generic, or if the work limit is reached."""


def _require(condition: bool) -> None:
    if not condition:
        raise _NotGeneric


class _ModularPlane:
    """The plane modulo a prime; `points` counts base points by pairs (multiplicity, whether infinitely near)."""

    def __init__(self, field: PrimeField, rng: random.Random, budget: Budget) -> None:
        self.field, self.prime, self._rng, self._budget = field, field.prime, rng, budget
        self.ring = nmod_mpoly_ctx.get(("x", "y"), modulus=self.prime, ordering=Ordering.degrevlex)
        self.points: Counter[tuple[int, bool]] = Counter()

    def pencil(self, name: str, integral: RationalFunction, eps: int) -> Pencil:
        """Compute the `Pencil` modulo the prime, for the residue `eps`. Raises BadPrime, _NotGeneric."""
        # Homogenize P and Q to the same degree and substitute random affine forms for x, y and z.
        x, y = self.ring.gens()
        forms = (modulo(f, self.field) for f in (integral.numerator, integral.denominator))
        at_eps = [f.compose(x, y, self.ring.constant(eps), ctx=self.ring) for f in forms]
        degree, zero = int(max(f.total_degree() for f in at_eps)), self.ring.constant(0)
        count_work(500 + 60 * degree**3)  # for factorizations, resultants and base points
        X, Y, Z = (
            [form**k for k in range(degree + 1)]
            for form in (x * self._draw_residue() + y * self._draw_residue() + self._draw_residue() for _ in "xyz")
        )
        P, Q = (sum((X[i] * Y[j] * Z[degree - i - j] * int(c) for (i, j), c in f.terms()), zero) for f in at_eps)
        curves: list[nmod_mpoly] = []  # the components through three random points
        for _ in range(3):
            point = [self._draw_residue(), self._draw_residue()]
            member = P * int(Q(*point)) - Q * int(P(*point))
            _require(not member.is_zero())
            through_point = [(C, e) for C, e in member.factor()[1] if not int(C(*point))]
            _require(len(through_point) == 1 and through_point[0][1] == 1)
            curves.append(through_point[0][0])
            _require(any(int(curves[-1].derivative(k)(*point)) for k in range(2)))
        d = int(curves[0].total_degree())
        coefficients = [[int(C[i, j]) for i in range(d + 1) for j in range(d + 1 - i)] for C in curves]
        _require(all(C.total_degree() == d for C in curves) and nmod_mat(coefficients, self.prime).rank() == 2)
        components, remainder = divmod(int(max(P.total_degree(), Q.total_degree()) - P.gcd(Q).total_degree()), d)
        _require(remainder == 0)
        self._find_points(curves[0], curves[1], d)
        _require(sum(count * m * m for (m, _), count in self.points.items()) == d * d)
        genus_drop = sum(count * m * (m - 1) // 2 for (m, _), count in self.points.items())
        multiplicities = sorted({m for m, _ in self.points}, reverse=True)
        points = (
            BasePoints(m, self.points[m, False] + self.points[m, True], self.points[m, True]) for m in multiplicities
        )
        return Pencil(name, components, d, (d - 1) * (d - 2) // 2 - genus_drop, tuple(points))

    def _draw_residue(self) -> int:
        return self._rng.randrange(1, self.prime)

    def _find_points(self, C: nmod_mpoly, D: nmod_mpoly, d: int) -> None:
        eliminant = [0] * (d * d + 1)
        for (i, _), c in C.resultant(D, "y").terms():
            eliminant[i] = int(c)
        _require(eliminant[-1] != 0)
        for factor, intersection in nmod_poly(eliminant, self.prime).factor()[1]:
            if intersection < 4:  # below 2^2, so m = 1: a simple point and simple points infinitely near to it
                self._add_simple(int(factor.degree()), int(intersection), is_near=False)
                continue
            K = fq_default_ctx(self.prime, int(factor.degree()))
            a = _find_root(K, [K(int(c)) for c in factor.coeffs()])
            polynomials_on_line = list[Any]()  # F(a, y) as polynomials over K
            for F in (C, D):
                coefficients = [K(0)] * (int(F.total_degree()) + 1)
                for (i, j), c in F.terms():
                    coefficients[j] += a**i * K(int(c))
                polynomials_on_line.append(_polynomial(K, coefficients))
            gcd = polynomials_on_line[0].gcd(polynomials_on_line[1])
            k = int(gcd.degree())
            _require(k > 0)
            b = -gcd[k - 1] / K(k)
            _require(gcd == _polynomial(K, [-b, 1]) ** k)  # in random coordinates there is one point for each a
            max_intersection = int(intersection)
            f, g = (  # F(x + a, y + b) without terms of degree above `max_intersection`
                _collect_terms(
                    ((k, l), c * comb(i, k) * a ** (i - k) * comb(j, l) * b ** (j - l))
                    for (i, j), c in ((exponents, K(int(c))) for exponents, c in F.terms())
                    for k in range(min(i, max_intersection) + 1)
                    for l in range(min(j, max_intersection - k) + 1)
                )
                for F in (C, D)
            )
            self._resolve(K, f, g, max_intersection, is_exact=True, is_near=False)

    def _add_simple(self, conjugate_count: int, chain_length: int, is_near: bool) -> None:
        self.points[1, is_near] += conjugate_count
        self.points[1, True] += conjugate_count * (chain_length - 1)

    def _resolve(self, K: Any, f: _Series, g: _Series, max_intersection: int, *, is_exact: bool, is_near: bool) -> None:
        """Count the origin and points infinitely near to it that the curves f = 0 and g = 0 over K have in common.

        The intersection number at the origin is at most `max_intersection`, and equal to it if `is_exact`. Terms of f
        and g of a degree above `max_intersection` do not matter.
        """
        _require(not self._budget.is_spent)
        count_work(50 + 10 * (len(f) + len(g)) * K.degree())
        m = min(map(sum, f), default=max_intersection + 1)
        _require(m == min(map(sum, g), default=max_intersection + 1) and m * m <= max_intersection)
        if m == 0:
            return
        if m == 1 and is_exact:
            self._add_simple(K.degree(), max_intersection, is_near)
            return
        self.points[m, is_near] += K.degree()
        if m * m == max_intersection:
            return
        shear = K(self._draw_residue())  # afterwards x = 0 is tangent to neither curve
        f, g = (  # F(x + s y, y)
            _collect_terms(((i - k, j + k), c * comb(i, k) * shear**k) for (i, j), c in F.items() for k in range(i + 1))
            for F in (f, g)
        )
        cones = [_polynomial(K, [F.get((m - j, j), K(0)) for j in range(m + 1)]) for F in (f, g)]
        _require(all(cone.degree() == m for cone in cones))
        directions = cones[0].gcd(cones[1]).factor()[1]
        for direction, _ in directions:
            k = int(direction.degree())
            L = fq_default_ctx(self.prime, K.degree() * k)
            embed = _embedding(K, L)
            slope = _find_root(L, [embed(c) for c in direction.coeffs()])
            bound = (max_intersection - m * m) // (k if len(directions) == 1 else 1)
            f_blown_up, g_blown_up = (  # F(x, x (y + slope))/x^m without terms of a degree above `bound`
                _collect_terms(
                    ((i + j - m, k), c * comb(j, k) * slope ** (j - k))
                    for (i, j), c in ((exponents, embed(c)) for exponents, c in F.items())
                    for k in range(min(j, bound - (i + j - m)) + 1)
                )
                for F in (f, g)
            )
            self._resolve(L, f_blown_up, g_blown_up, bound, is_exact=is_exact and len(directions) == 1, is_near=True)


def _polynomial(K: Any, coefficients: list[Any]) -> Any:
    return fq_default_poly_ctx(K)(coefficients)  # type: ignore[arg-type]  # the stub does not allow lists


def _find_root(K: Any, coefficients: list[Any]) -> Any:
    return _polynomial(K, coefficients).roots()[0][0]


def _embedding(K: Any, L: Any) -> Any:
    """Return an embedding of the finite field K into L."""
    if K.degree() == L.degree():
        return lambda c: c
    generator = _find_root(L, [L(int(c)) for c in K.modulus().coeffs()])
    powers = [generator**k for k in range(K.degree())]
    return lambda c: sum((power * L(int(a)) for a, power in zip(c.to_list(), powers, strict=False)), L(0))


def _collect_terms(terms: Iterable[tuple[tuple[int, int], Any]]) -> _Series:
    """Add up terms and drop those that are 0."""
    coefficients: _Series = {}
    for exponents, c in terms:
        coefficients[exponents] = coefficients.get(exponents, 0) + c
    return {exponents: c for exponents, c in coefficients.items() if not c.is_zero()}
