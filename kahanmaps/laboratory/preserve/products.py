"""Integrals and densities that are products of powers of known polynomials: exponents from a lattice, of any degree.

For polynomials g_1, ..., g_r let C_i = g_i(x~)/g_i(x). A product g_1^k_1 ... g_r^k_r, exponents of either sign, is an
integral if C_1^k_1 ... C_r^k_r = 1, and phi of an invariant measure dx/phi if that is det dPhi. If it is another number
c, c^-n times the product at step n does not depend on n: an integral that depends on time.

On a random line modulo a prime all of these functions are quotients of polynomials in one variable. Written over a
basis of coprime polynomials, which takes gcds and no factorization, each C_i is a vector of integers, and the k are a
lattice. Polynomials in x without a common factor have none on a random line, but for a probability of about degree^2/p.
What is left are numbers c, functions of eps and the symbols: they are interpolated, and their relations are a lattice
again.

None of the polynomials need be a Darboux polynomial, of which alone celledoni-2019 forms products: for the map of
Lyness, (x, y) -> (y, (a + y)/x), neither x nor y is one, and dx dy/(x y) is invariant. Source: celledoni-2019.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate, repeat
from math import lcm, prod
from operator import mul
from typing import Any

from flint import fmpq, fmpq_mpoly, fmpz, fmpz_mat, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.functions import BudgetExceeded, Function, FunctionField
from kahanmaps.algebra.matrices import det
from kahanmaps.algebra.polynomials import (
    RationalFunction,
    degree_in,
    evaluate,
    irreducible_factors,
    over_one_denominator,
    primitive_part,
    ring,
)
from kahanmaps.algebra.printing import format_product
from kahanmaps.algebra.work import Budget, count, counted_cache
from kahanmaps.errors import BadPrime, InputError, SingularStep
from kahanmaps.invariants.phase_functions import jacobian_determinant_sides
from kahanmaps.laboratory.laboratory import Laboratory, reconstruct_at
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint, interpolated
from kahanmaps.laboratory.preserve.darboux.cofactors import Cofactor
from kahanmaps.maps.implicit import ElementaryMap, MapFamily

_BUDGET = 5_000_000  # products of terms, for the Jacobi determinants
_MAX_CANDIDATES = 60
_MAX_TERMS = 20_000  # of a product that is written out
_FIRST = 10**6  # the weight of the exponent of det dPhi: it is made as small as can be before all others


@dataclass(frozen=True)
class Product:
    """The product I of powers g^k of the `factors`, a function of (variables, symbols, eps); there may be none.

    `constant` is the number c with I(x~) = c I(x), a function of the symbols and eps: 1 for an integral. For a density
    it is that in phi(x~) = c det dPhi(x) phi(x), 1 or -1. Of a flow what depends on time has c with I' = c I.
    """

    factors: tuple[tuple[fmpq_mpoly, int], ...]
    constant: RationalFunction

    @property
    def text(self) -> str:
        """The product as a formula in factors."""
        return format_product(self.factors)

    @property
    def function(self) -> RationalFunction | None:
        """The product written out; None where it is too long."""
        parts = []
        for sign in (1, -1):
            powers = [(g, sign * k) for g, k in self.factors if sign * k > 0]
            if prod(len(g) ** k for g, k in powers) > _MAX_TERMS:
                return None
            one = self.constant.numerator.context().constant(1)
            parts.append(reduce(lambda P, power: P * power[0] ** power[1], powers, one))
        return RationalFunction(*parts)


@dataclass(frozen=True)
class Products:
    """What `products_of` found: integrals, a density (None without one), and what depends on time.

    Where there is no density, one that changes its sign takes its place: then |dx/phi| is invariant.
    """

    integrals: tuple[Product, ...]
    density: Product | None
    time_dependent: tuple[Product, ...]


def candidates(
    laboratory: Laboratory, cofactors: Sequence[Cofactor], budget: Budget, more: Sequence[fmpq_mpoly] = ()
) -> list[fmpq_mpoly]:
    """Irreducible polynomials over Q in (variables, symbols, eps) that integrals and densities may be products of.

    They are the variables, the polynomials of the cofactors (affine Darboux functions of a system, and factors of
    Jacobi determinants), and the factors of det dPhi and det dPhi^-1, as far as these are not too long, and of `more`;
    for a flow its Darboux polynomials, as far as the budget goes.
    """
    if laboratory.flow:
        return list(laboratory.flow_polynomials(budget).functions)
    n, context = laboratory.map.dim, ring(laboratory.map.names)
    known = [one.polynomial for one in cofactors if one.polynomial is not None]
    found = _irreducible((*context.gens()[:n], *known), n, laboratory.eps)
    found |= _jacobians(laboratory.map, laboratory.eps, laboratory.system is not None)
    found |= _irreducible(more, n, laboratory.eps)
    return sorted(found.values(), key=lambda P: (degree_in(P, n), len(P)))[:_MAX_CANDIDATES]


def _irreducible(polynomials: Iterable[fmpq_mpoly], n: int, eps: fmpq | None) -> dict[str, fmpq_mpoly]:
    """The irreducible factors in the first n variables, primitive, by their text."""
    found: dict[str, fmpq_mpoly] = {}
    for P in polynomials:
        if eps is not None:
            at: dict[str | int, int | fmpz | fmpq] = {"eps": eps}
            P = P.subs(at)
        for factor, _ in [] if P.is_zero() else irreducible_factors(P):
            if degree_in(factor, n):
                one = primitive_part(factor)[1]
                found.setdefault(str(one), one)
    return found


@counted_cache(4)  # searches for integrals and densities ask for the same, which may take half a second
def _jacobians(map_: MapFamily, eps: fmpq | None, both: bool) -> dict[str, fmpq_mpoly]:
    """Factors of numerators and denominators of det dPhi^-1 and, with `both`, of det dPhi."""
    n, sides = map_.dim, list[Function]()
    for backward in (False, True) if both else (True,):
        field = FunctionField(map_.names, _BUDGET, reduces=True)
        *x, step = field.variables
        try:
            local = map_.at(step, field, x[n:])
            local = local.inverse if backward else local
            sides += jacobian_determinant_sides(local, x[:n], local.generic_step(tuple(x[:n])))
        except (BudgetExceeded, InputError, SingularStep):
            continue
    return _irreducible((part for side in sides for part in (side.above, side.below)), n, eps)


class _Line:
    """A random line modulo the prime of a map, and its image (X : Z) without common factor, polynomials in t.

    det dPhi is `numerator` / (Z^n `denominator`) on it. Raises NoPoint.
    """

    def __init__(self, map_: ModularMap) -> None:
        p = map_.prime
        self.prime, self.map = p, map_
        start, slope = map_.random_point(), map_.random_point()
        self.here = [*(nmod_poly([c, d], p) for c, d in zip(start, slope, strict=True)), nmod_poly([1], p)]
        self.there, self.numerator, self.denominator = self.here, nmod_poly([1], p), nmod_poly([1], p)
        for one in map_.map.factors:
            self._step(one)

    def _step(self, one: ElementaryMap) -> None:
        """One factor further: det of it is its numerator times Z^n over its denominator times Z~^n."""
        p, n, curve = self.prime, one.dim, self.there
        top, size = max(1, one.equation.degree), max(int(entry.degree()) for entry in curve)

        def step(t: int) -> tuple[tuple[Any, ...], tuple[Any, ...], int]:
            """A point of the curve, its image and Z."""
            count(30 + 15 * n)
            *X, Z = (one.field.convert(int(entry(t))) for entry in curve)
            if Z == 0:
                raise SingularStep("a point of a curve is at infinity", (), one.eps)
            x = tuple(c / Z for c in X)
            return x, one.step(x), int(Z)

        def homogeneous(t: int) -> list[int]:
            x, image, Z = step(t)
            denominator = int(one.determinant(x)) * pow(Z, n * top, p)
            return [*(int(c) * denominator % p for c in image), denominator % p]

        raw = _interpolated(homogeneous, n * top * size, p)
        common = reduce(nmod_poly.gcd, raw)
        self.there = [entry // common for entry in raw]
        self.denominator = self.denominator * raw[-1]
        after = self.there[-1]

        def numerator(t: int) -> list[int]:
            x, image, Z = step(t)
            return [int(det(one.numerator_matrix(x, image))) * pow(Z, n * (top - 1), p) * pow(int(after(t)), n, p) % p]

        reach = max(int(entry.degree()) for entry in self.there)
        self.numerator = self.numerator * _interpolated(numerator, n * ((top - 1) * size + reach), p)[0]

    def along(self, g: fmpq_mpoly, place: Sequence[nmod_poly]) -> nmod_poly:
        """g on the line, or the numerator Z^deg g(X/Z) of g on its image."""
        n, p = self.map.dim, self.prime
        field = GF(p)
        rest = [field.convert(c) for c in (*self.map.values, self.map.eps)]
        top = degree_in(g, n)
        powers = [list(accumulate(repeat(c, top), mul, initial=nmod_poly([1], p))) for c in place]
        total = nmod_poly([0], p)
        count(50 + 15 * len(g))
        for monomial, coefficient in g.terms():
            exponents = [int(e) for e in monomial]
            factors = (c**e for c, e in zip(rest, exponents[n:], strict=True))
            value = nmod_poly([int(prod(factors, start=field.convert(coefficient)))], p)
            used = zip(powers, [*exponents[:n], top - sum(exponents[:n])], strict=True)
            total = total + reduce(mul, (row[e] for row, e in used if e), value)
        return total


def _interpolated(values: Callable[[int], list[int]], top: int, p: int) -> list[nmod_poly]:
    """The polynomials of degree at most `top` that have these values at t = 1, 2, ... Raises NoPoint."""
    nodes, rows, t, missed = list[int](), list[list[int]](), 0, 0
    while len(nodes) <= top:
        t += 1
        try:
            rows.append(values(t))
            nodes.append(t)
        except SingularStep:
            missed += 1
            if missed > top + 20:
                raise NoPoint("the map has no value at random points modulo a prime") from None
    return [interpolated(nodes, column, p) for column in zip(*rows, strict=True)]


def coprime_base(polynomials: Sequence[nmod_poly]) -> list[nmod_poly]:
    """Coprime polynomials, none constant, of which all those given are products up to constants.

    >>> P, Q = nmod_poly([1, 1], 101), nmod_poly([2, 1], 101)
    >>> [B.degree() for B in coprime_base([P * P * Q, P * Q])]
    [1, 1]
    """
    base: list[nmod_poly] = []
    waiting = list(polynomials)
    while waiting:
        P = waiting.pop()
        if P.degree() < 1:
            continue
        for k, Q in enumerate(base):
            common = P.gcd(Q)
            count(2 + (P.degree() + Q.degree()) / 3)
            if common.degree() > 0:
                base.pop(k)
                waiting += [P // common, Q // common, common]
                break
        else:
            base.append(P)
    return base


def _exponents(P: nmod_poly, base: Sequence[nmod_poly]) -> list[int]:
    """How often the elements of a coprime base divide a polynomial."""
    found = []
    for B in base:
        power = 0
        quotient, rest = divmod(P, B)
        while rest.is_zero():
            power, P = power + 1, quotient
            quotient, rest = divmod(P, B)
        found.append(power)
    return found


def relations(rows: Sequence[Sequence[int]]) -> list[list[int]]:
    """A basis over Z of all integer vectors k with sum k_i row_i = 0.

    >>> relations([[2, 0], [3, 0], [0, 1]])
    [[3, -2, 0]]
    """
    if not rows:
        return []
    size, width = len(rows), len(rows[0])
    count(10 + size**2 * (size + width) / 50)
    wide = fmpz_mat([[*row, *(int(i == k) for i in range(size))] for k, row in enumerate(rows)]).hnf()
    return [[int(e) for e in row[width:]] for row in wide.tolist() if not any(row[:width])]


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


def _reduced(vectors: Sequence[Sequence[int]], weights: Sequence[int]) -> list[list[int]]:
    """A basis of the same lattice, of short vectors, each entry times its weight."""
    if not vectors:
        return []
    weighted = fmpz_mat([[e * w for e, w in zip(v, weights, strict=True)] for v in vectors]).lll()
    return [[int(e) // w for e, w in zip(row, weights, strict=True)] for row in weighted.tolist()]


def products_of(laboratory: Laboratory, polynomials: Sequence[fmpq_mpoly]) -> Products:
    """The integrals, the density and the integrals depending on time that are products of powers of the polynomials.

    Exponents are found modulo one prime: what comes out is to be put to the proof. Raises NoPoint.

    >>> from kahanmaps.documents.catalog import load
    >>> laboratory = Laboratory(load("lotka_volterra"))
    >>> products_of(laboratory, candidates(laboratory, laboratory.cofactors(), Budget())).density.function.numerator
    x*y
    """
    weights = [_FIRST, *map(len, polynomials)]  # short formulas before long ones
    n, context, field = laboratory.map.dim, ring(laboratory.map.names), laboratory.field
    one, minus = (RationalFunction(context.constant(c), context.constant(1)) for c in (1, -1))
    if field is not None and laboratory.flow:
        # sum k K is 0 for integrals, div f for densities, free of x for what depends on time.
        gens = context.gens()
        cofactors = [
            field.divergence.compose(*gens[: n + len(field.symbols)], ctx=context),
            *(field.derivative(P) / P for P in polynomials),
        ]
        numbers = [K.compose(*[context.constant(0)] * n, *gens[n:], ctx=context) for K in cofactors]
        moving = [K - c for K, c in zip(cofactors, numbers, strict=True)]
        time_dependent = []
        for vector in _reduced(relations(coefficient_rows(moving)), weights):
            total = sum((k * c for k, c in zip(vector, numbers, strict=True)), context.constant(0))
            if vector[0] == 0 and not total.is_zero():
                time_dependent.append((vector, RationalFunction(total, context.constant(1))))
        exact = _reduced(relations(coefficient_rows(cofactors)), weights)
        return _assembled(polynomials, n, exact, [(one, exact)], time_dependent)
    line = _Line(laboratory.maps[0])
    here, there = ([line.along(g, place) for g in polynomials] for place in (line.here, line.there))
    # det dPhi and the C_i on a random line, as vectors over a coprime base.
    base = coprime_base([*here, *there, line.there[-1], line.numerator, line.denominator])
    Z, N, M = (_exponents(P, base) for P in (line.there[-1], line.numerator, line.denominator))
    rows = [[a - b - n * c for a, b, c in zip(N, M, Z, strict=True)]]
    for g, P, Q in zip(polynomials, here, there, strict=True):
        d = degree_in(g, n)
        rows.append([b - a - d * c for a, b, c in zip(_exponents(P, base), _exponents(Q, base), Z, strict=True)])
    vectors = _reduced(relations(rows), weights)  # the exponent of det dPhi first

    def constants(map_: ModularMap) -> list[int]:
        """prod C_i^k_i det dPhi^k_0 at a random point, for each vector k. Raises NoPoint."""
        p, residues, found = map_.prime, GF(map_.prime), list[int]()
        at = [residues.convert(c) for c in (*map_.values, map_.eps)]
        for (x, image), vector in zip(map_.pairs(len(vectors)), vectors, strict=True):
            count(50 + 10 * n)
            total = pow(int(det(map_.map.jacobian(x))), vector[0], p)
            for g, k in zip(polynomials, vector[1:], strict=True):
                if k:
                    before, after = (
                        int(evaluate(g, residues, [*map(residues.convert, place), *at])) for place in (x, image)
                    )
                    if not before or not after:
                        raise NoPoint("a polynomial vanishes at a random point modulo a prime")
                    total = total * pow(after, k, p) * pow(before, -k, p) % p
            found.append(total)
        return found

    values = constants_of(laboratory, constants)
    known = [(v, c) for v, c in zip(vectors, values, strict=True) if c is not None]

    def with_constant_1(more: list[RationalFunction]) -> list[list[int]]:
        """The vectors whose constant is 1 or, up to such factors, one of those given: a basis."""
        combinations = multiplicative_relations([*(c for _, c in known), *more])
        chosen = [_combined(a[: len(known)], [v for v, _ in known]) for a in combinations if any(a[: len(known)])]
        return _reduced(chosen, weights)

    exact = with_constant_1([])
    time_dependent = [(v, c) for v, c in known if v[0] == 0 and c != one]
    return _assembled(polynomials, n, exact, [(one, exact), (minus, with_constant_1([minus]))], time_dependent)


def _assembled(
    polynomials: Sequence[fmpq_mpoly],
    n: int,
    exact: Sequence[list[int]],
    of_densities: Sequence[tuple[RationalFunction, Sequence[list[int]]]],
    time_dependent: Sequence[tuple[list[int], RationalFunction]],
) -> Products:
    """The products: integrals and a density by their vectors, for each constant of one; what depends on time."""
    degrees = [0, *(degree_in(g, n) for g in polynomials)]
    integrals = []
    for v in (v for v in exact if v[0] == 0):
        # Of I and 1/I the one of positive degree or, where that is 0, whose first exponent is positive.
        total = sum(k * d for k, d in zip(v, degrees, strict=True))
        integrals.append(v if (total, next((k for k in v if k), 0)) > (0, 0) else [-k for k in v])

    def product(vector: Sequence[int], constant: RationalFunction) -> Product:
        return Product(tuple((g, k) for g, k in zip(polynomials, vector[1:], strict=True) if k), constant)

    def cost(vector: Sequence[int]) -> tuple[int, int, int]:
        """Few negative exponents are best, then a low degree."""
        denominator, numerator = (
            sum(sign * k * d for k, d in zip(vector, degrees, strict=True) if sign * k > 0) for sign in (-1, 1)
        )
        return denominator, numerator, sum(map(abs, vector))

    density = None
    for constant, choice in of_densities:
        vector = next((v if v[0] == -1 else [-e for e in v] for v in choice if abs(v[0]) == 1), None)
        while vector is not None and density is None:  # times integrals, as long as single ones help
            others = [_combined((1, sign), (vector, v)) for v in integrals for sign in (1, -1)]
            best = min(others, key=cost, default=vector)
            if cost(best) >= cost(vector):
                density = product(vector, constant)
            vector = best
    one = of_densities[0][0]
    return Products(tuple(product(v, one) for v in integrals), density, tuple(product(v, c) for v, c in time_dependent))


def constants_of(laboratory: Laboratory, constants: Callable[[ModularMap], list[int]]) -> list[RationalFunction | None]:
    """Numbers that are known on every map, as functions of the symbols and eps; None where these were not found."""
    context = ring(laboratory.map.names)
    one = RationalFunction(context.constant(1), context.constant(1))

    def box(prime: int, place: tuple[int, ...]) -> list[int] | None:
        try:
            return constants(laboratory.map_for(prime, place))
        except (NoPoint, BadPrime):
            return None

    is_one = [all(c == 1 for c in column) for column in zip(*map(constants, laboratory.maps), strict=True)]
    if all(is_one):
        return [one] * len(is_one)
    names = (*laboratory.symbols, "eps") if laboratory.eps_enters == "symbol" else laboratory.symbols
    answer = reconstruct_at(laboratory.root, box, names, seed=laboratory.seed)
    if answer.functions is None:
        return [one if good else None for good in is_one]
    gens = [gen for gen, name in zip(context.gens(), laboratory.map.names, strict=True) if name in names]
    moved = [over_one_denominator([c], context, gens) for c in answer.functions]
    return [RationalFunction(numerator, denominator) for [numerator], denominator in moved]


def _combined(weights: Sequence[int], vectors: Sequence[Sequence[int]]) -> list[int]:
    return [sum(w * e for w, e in zip(weights, column, strict=True)) for column in zip(*vectors, strict=True)]


def multiplicative_relations(functions: Sequence[RationalFunction]) -> list[list[int]]:
    """A basis over Z of all k for which the product of the powers f_i^k_i is 1; none of the functions is 0.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> functions = [parse_rational_function(text, ["a"]) for text in ("-4*a^2", "2*a", "3", "-1")]
    >>> multiplicative_relations(functions)
    [[1, -2, 0, 1], [0, 0, 0, 2]]
    """
    rows: list[dict[str, int]] = []
    for function in functions:
        row: dict[str, int] = {}
        for part, sign in ((function.numerator, 1), (function.denominator, -1)):
            number, factors = part.factor()
            for factor, k in factors:
                c, one = primitive_part(factor)
                number = number * c ** int(k)
                row[str(one)] = row.get(str(one), 0) + sign * int(k)
            row["sign"] = row.get("sign", 0) + (number < 0)
            for whole, s in ((number.p, sign), (number.q, -sign)):
                for q, k in abs(whole).factor():
                    row[str(q)] = row.get(str(q), 0) + s * int(k)
        rows.append(row)
    keys = sorted({key for row in rows for key in row} | {"sign"})
    # A sign counts modulo 2: one more unknown, which is left out of the answer, takes twice it.
    table = [*([row.get(key, 0) for key in keys] for row in rows), [2 * (key == "sign") for key in keys]]
    return [vector[:-1] for vector in relations(table)]
