"""The flow of a quadratic system in the place of a map: its integrals are found by the same searches.

A solution x(t) modulo a prime is a power series, the coefficients of P(x(t)) are what the values P(x_n) are along the
orbit of a map: P vanishes along the solution if so many of them are 0. And where a search for maps compares P at a
point and at its image, here P + P' stands for the second, P' = f . grad P: what is linear in both, as P(x~) - P(x) and
P(x~) Q(x) - P(x) Q(x~) are, becomes the same of P' and Q'.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import lcm
from operator import mul
from typing import Any

from flint import fmpq_mpoly, nmod_poly

from kahanmaps.algebra.fields import GF, PrimeField
from kahanmaps.algebra.matrices import trace
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.laboratory.modular_points import ModularMap, Point, monomial_tables, monomial_values
from kahanmaps.systems.quadratic import QuadraticSystem

Terms = list[tuple[int, tuple[int, int]]]


def _pairs(f: fmpq_mpoly, n: int, field: PrimeField, values: Sequence[Any]) -> Terms:
    """The coefficients of f modulo a prime, at these values of the symbols, with two variables each; n stands for 1."""
    found = []
    for monomial, coefficient in f.terms():
        total = field.convert(coefficient)
        for value, exponent in zip(values, monomial[n:], strict=True):
            total = total * value ** int(exponent)
        j, k = ([k for k in range(n) for _ in range(int(monomial[k]))] + [n, n])[:2]
        found.append((int(total), (j, k)))
    return found


class ModularFlow(ModularMap):
    """The flow of a system modulo `prime`, at the residues `values` of its symbols; a step is x -> x + f(x).

    Raises BadPrime where the prime divides denominators.
    """

    def __init__(self, system: QuadraticSystem, prime: int, values: Sequence[int] = (), seed: int = 0) -> None:
        super().__init__(system, prime, 1, values, seed)
        field = GF(prime)
        given = [field.convert(value) for value in values]
        self._local = system.over(field, given)
        self._terms = [_pairs(f, system.dim, field, given) for f in system.rhs]

    def step(self, x: Point) -> Point:
        """x + f(x)."""
        f = self._local.value([self.map.field.convert(entry) for entry in x])
        return tuple((entry + int(slope)) % self.prime for entry, slope in zip(x, f, strict=True))

    def determinant(self, x: Point, image: Point) -> tuple[int, int]:
        """1 + div f(x) and 1: as P + P' is to P for a density P."""
        point = [self.map.field.convert(entry) for entry in x]
        return 1 + int(trace(self._local.jacobian(point))), 1

    def moved(self, x: Point, image: Point, degree: int) -> tuple[list[int], list[int]]:
        """The values of all monomials P up to a degree, and of P + f . grad P."""
        p = self.prime
        here = monomial_values(x, degree, p)
        f = [after - before for before, after in zip(x, image, strict=True)]
        there = [
            (value + sum(e * here[place] * f[k] for k, e, place in slopes)) % p
            for value, slopes in zip(here, monomial_tables(self.dim, degree), strict=True)
        ]
        return here, there

    def along_orbit(self, degree: int, count: int) -> tuple[list[list[int]], Point, int | None]:
        """The Taylor coefficients of all monomials along a solution: a row an order; and where it starts."""
        p, start = self.prime, self.random_point()
        x = [*([c] for c in start), [1]]  # series, the last one for the constant 1
        pairs = {pair for terms in self._terms for _, pair in terms}
        for order in range(1, count):
            products = {(j, k): sum(map(mul, x[j], reversed(x[k]))) for j, k in pairs}
            below = pow(order, -1, p)
            slopes = [sum(c * products[pair] for c, pair in terms) for terms in self._terms]
            for series, slope in zip(x, [*slopes, 0], strict=True):
                series.append(slope * below % p)
        table = [nmod_poly([1], p)]
        for factors in monomial_tables(self.dim, degree)[1:]:
            variable, _, place = factors[-1]
            table.append(table[place].mul_low(nmod_poly(x[variable], p), count))
        return [[int(series[k]) for series in table] for k in range(count)], start, None


def is_kept_by_flow(system: QuadraticSystem, function: RationalFunction, *, is_density: bool = False) -> bool:
    """Whether f . grad I = 0; of a density phi whether f . grad phi = phi div f, which says that dx/phi is invariant.

    Multiplied out, for every value of the symbols; the function is in (variables, symbols, eps). Exact.

    >>> from kahanmaps.algebra.text import parse_rational_function
    >>> rotation = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    >>> [is_kept_by_flow(rotation, parse_rational_function(t, ["x", "y", "eps"])) for t in ("x^2 + y^2", "x/y")]
    [True, False]
    """
    P, Q = function.numerator, function.denominator
    context = P.context()
    change = system.derivative(P) * Q - P * system.derivative(Q)
    if is_density:
        change -= P * Q * system.divergence.compose(*context.gens()[: system.dim + len(system.symbols)], ctx=context)
    return bool(change.is_zero())


def flow_exponents(system: QuadraticSystem, polynomials: Sequence[fmpq_mpoly]) -> list[list[int]]:
    """The coefficients of div f, and of K for each Darboux polynomial, P' = K P, as rows of integers.

    A product of powers P^k is conserved if sum k K = 0, and the phi of an invariant dx/phi if that is div f.
    """
    functions = [system.divergence, *(system.derivative(P) / P for P in polynomials)]
    terms = [{tuple(map(int, m))[: system.dim + len(system.symbols)]: c for m, c in K.terms()} for K in functions]
    below = lcm(*(int(c.q) for row in terms for c in row.values()))
    support = sorted({m for row in terms for m in row})
    return [[int(row.get(m, 0) * below) for m in support] for row in terms]
