"""The flow of a polynomial field in the place of a map: its integrals are found by the same searches.

A solution x(t) modulo a prime is a power series, the coefficients of P(x(t)) are what the values P(x_n) are along the
orbit of a map: P vanishes along the solution if so many of them are 0. And where a search for maps compares P at a
point and at its image, here P + P' stands for the second, P' = f . grad P: what is linear in both, as P(x~) - P(x) and
P(x~) Q(x) - P(x) Q(x~) are, becomes the same of P' and Q'.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice, zip_longest
from math import lcm
from operator import mul
from random import Random

from flint import fmpq_mpoly, nmod, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.algebra.work import count
from kahanmaps.laboratory.modular_points import (
    ModularMap,
    Point,
    Values,
    monomial_tables,
    monomial_values,
    places_of,
)
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.systems.polynomial import PolynomialField

Terms = list[tuple[int, int]]


def euler_map(field: PolynomialField) -> ImplicitMap:
    """x -> x + eps f(x), the map that stands for a field where its variables and symbols are asked for."""
    context = ring((*field.variables, *field.symbols, "eps"))
    *old, eps = context.gens()
    moved = (x + eps * f.compose(*old, ctx=context) for x, f in zip(old, field.rhs, strict=False))
    return explicit_map(field.variables, [RationalFunction(P, context.constant(1)) for P in moved])


class ModularFlow(ModularMap):
    """The flow of a field modulo `prime`, at the residues `values` of its symbols; a step is x -> x + f(x).

    Raises BadPrime where the prime divides denominators.
    """

    def __init__(self, field: PolynomialField, prime: int, values: Sequence[int] = (), seed: int = 0) -> None:
        # There is no map, and nothing of one is set up.
        self.prime, self.eps, self.dim, self.values = prime, 1, field.dim, tuple(values)
        self.rng = Random(f"flow {seed} {prime} {self.values}")
        self.degree = field.degree
        self._f = [self._terms(f) for f in field.rhs]
        self._divergence = self._terms(field.divergence)
        # The products that a value of f takes: a monomial is a variable times one that comes before it.
        tables = monomial_tables(self.dim, self.degree)
        waiting = {place for terms in self._f for _, place in terms}
        products: dict[int, tuple[int, int]] = {}
        while waiting:
            place = waiting.pop()
            if place > self.dim and place not in products:
                variable, _, lower = tables[place][-1]
                products[place] = variable, lower
                waiting.add(lower)
        self._products = sorted(products.items())

    def _terms(self, polynomial: fmpq_mpoly) -> Terms:
        """The coefficients modulo the prime, at the values of the symbols, with the numbers of their monomials."""
        field, n = GF(self.prime), self.dim
        found = []
        for monomial, coefficient in polynomial.terms():
            total = field.convert(coefficient)
            for value, exponent in zip(self.values, monomial[n:], strict=True):
                total = total * field.convert(value) ** int(exponent)
            found.append((int(total), places_of(n, self.degree)[tuple(map(int, monomial[:n]))]))
        return found

    def step(self, x: Point) -> Point:
        """x + f(x)."""
        here = monomial_values(x, self.degree, self.prime)
        count(5 + sum(map(len, self._f)) / 6)
        return tuple((a + sum(c * here[k] for c, k in f)) % self.prime for a, f in zip(x, self._f, strict=True))

    def determinant(self, x: Point, image: Point) -> tuple[int, int]:
        """1 + div f(x) and 1: as P + P' is to P for a density P."""
        here = monomial_values(x, self.degree, self.prime)
        return 1 + sum(c * here[k] for c, k in self._divergence), 1

    def moved(self, x: Point, image: Point, degree: int, by: tuple[int, int] = (1, 1)) -> tuple[Values, Values]:
        """The values of all monomials P up to a degree, and of P + f . grad P; each times its number of `by`."""
        p = self.prime
        here = monomial_values(x, degree, p)
        count(len(here) * self.dim / 4)
        f = [after - before for before, after in zip(x, image, strict=True)]
        there = [
            (value + sum(e * here[place] * f[k] for k, e, place in slopes)) * by[1] % p
            for value, slopes in zip(here, monomial_tables(self.dim, degree), strict=True)
        ]
        return [by[0] * value % p for value in here], there

    def along_orbit(
        self, degree: int, count: int, support: Sequence[int] | None = None
    ) -> tuple[Sequence[Values], Point, int | None]:
        """The Taylor coefficients of all monomials along a solution: a row an order; and where it starts."""
        start = self.random_point()
        return self.series(start, degree, count, support), start, None

    def series(self, start: Point, degree: int, orders: int, support: Sequence[int] | None = None) -> list[Values]:
        """The first `orders` Taylor coefficients of all monomials, or some, along the solution from a point.

        A row has the coefficients of one order.
        """
        p, factors = self.prime, monomial_tables(self.dim, degree)
        columns = len(factors) if support is None else len(support)
        in_rows = len(self._products) * orders / 25 + sum(map(len, self._f)) / 3
        count(orders * (in_rows + columns / 2) + 3 * columns)
        # By the numbers of their monomials: 0 is that of 1, k + 1 that of the k-th variable.
        known = {0: [1], **{k + 1: [c] for k, c in enumerate(start)}}
        known |= {place: list[int]() for place, _ in self._products}
        for order in range(1, orders):
            for place, (variable, lower) in self._products:
                known[place].append(sum(map(mul, known[variable + 1], reversed(known[lower]))) % p)
            slopes = [sum(c * known[place][-1] for c, place in f) for f in self._f]
            inverse = pow(order, -1, p)
            known[0].append(0)
            for k, slope in enumerate(slopes, 1):
                known[k].append(slope * inverse % p)
        solution = [nmod_poly(known[k + 1], p) for k in range(self.dim)]
        table = {0: nmod_poly([1], p)}

        def monomial(place: int) -> nmod_poly:
            if place not in table:
                variable, _, lower = factors[place][-1]
                table[place] = monomial(lower).mul_low(solution[variable], orders)
            return table[place]

        series = [monomial(place).coeffs() for place in (range(len(factors)) if support is None else support)]
        # Coefficients end with the last one that is not 0: where all solutions are short, so are their lists.
        rows: list[Values] = list(islice(zip_longest(*series, fillvalue=nmod(0, p)), orders))
        return rows + [[nmod(0, p)] * columns] * (orders - len(rows))


def is_kept_by_flow(
    system: PolynomialField,
    function: RationalFunction,
    *,
    is_density: bool = False,
    factor: RationalFunction | None = None,
) -> bool:
    """Whether f . grad I = 0; of a density phi whether f . grad phi = phi div f, which says that dx/phi is invariant.

    With a factor c, a function of the symbols, whether f . grad I = c I: exp(-c t) I is an integral depending on time.
    Multiplied out, for every value of the symbols; the function is in (variables, symbols, eps). Exact.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> rotation = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    >>> [is_kept_by_flow(rotation, parse_rational_function(t, ["x", "y", "eps"])) for t in ("x^2 + y^2", "x/y")]
    [True, False]
    """
    P, Q = function.numerator, function.denominator
    context = P.context()
    count(10 + len(P) * len(Q) * sum(map(len, system.rhs)) / 10)
    change = system.derivative(P) * Q - P * system.derivative(Q)
    if is_density:
        change -= P * Q * system.divergence.compose(*context.gens()[: system.dim + len(system.symbols)], ctx=context)
    if factor is not None:
        change = change * factor.denominator - P * Q * factor.numerator
    return bool(change.is_zero())


def coefficient_rows(polynomials: Sequence[fmpq_mpoly]) -> list[list[int]]:
    """The coefficients of polynomials, a polynomial a row, times one number that makes them integers.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> coefficient_rows([x + 1, y / 2 - x])
    [[2, 0, 2], [0, 1, -2]]
    """
    denominator = lcm(*(int(c.q) for P in polynomials for c in P.coeffs()))
    terms = [{tuple(map(int, m)): int(c * denominator) for m, c in P.terms()} for P in polynomials]
    support = sorted({m for row in terms for m in row})
    return [[row.get(m, 0) for m in support] for row in terms]
