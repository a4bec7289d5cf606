"""Integrals and densities of any degree that are products of powers of known polynomials, by lattices of exponents.

Let x~ = Phi(x) be the image of x, and P = g_1^k_1 ... g_r^k_r, with exponents of either sign. Then P(x~)/P(x) =
C_1^k_1 ... C_r^k_r with C_i = g_i(x~)/g_i(x). If this quotient is 1, P is an integral. If it is det dPhi(x), dx/P is an
invariant volume form. If it is another constant c, c^-n P(x_n) is a time-dependent integral of the orbits x_0, x_1, ...

On a random line modulo a prime p, all C_i and det dPhi are quotients of polynomials in one variable. These are products
of powers of coprime polynomials, which gcds give without a factorization; so each C_i is a vector of integer exponents.
The k with constant P(x~)/P(x) form a lattice. Polynomials in x without a common factor have none on a random line,
except with a probability of about degree^2/p. The constants c are functions of eps and the symbols, and are
interpolated. The exponents of the multiplicative relations between several c form a lattice again.

The g_i need not be Darboux polynomials, unlike in celledoni-2019: for the Lyness map (x, y) -> (y, (a + y)/x), neither
x nor y is a Darboux polynomial, but dx dy/(x y) is invariant. Source: celledoni-2019.
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
from kahanmaps.algebra.work import Budget, count_work, counted_cache
from kahanmaps.errors import BadPrime, InputError, SingularStep
from kahanmaps.invariants.integrals_and_densities import jacobian_determinant_fraction
from kahanmaps.laboratory.laboratory import Laboratory, reconstruct_at
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint, interpolated
from kahanmaps.laboratory.preserve.darboux.cofactors import Cofactor
from kahanmaps.maps.implicit import ElementaryMap, MapFamily

_BUDGET = 5_000_000  # products of terms in the expansion of a Jacobi determinant
_MAX_CANDIDATES = 60  # polynomials whose powers are multiplied
_MAX_TERMS = 20_000  # monomials of an expanded product
_DETERMINANT_WEIGHT = 10**6  # of the exponent of det dPhi, so that this exponent is small in reduced bases


@dataclass(frozen=True)
class Product:
    """A product I of powers g^k for the pairs (g, k) in `factors`: a function of (variables, symbols, eps).

    `constant` is the c in I(x~) = c I(x), a function of the symbols and eps; for an integral c = 1. For a density phi,
    phi(x~) = c det dPhi(x) phi(x) with c = 1 or -1. For a time-dependent integral of a flow, I' = c I.
    """

    factors: tuple[tuple[fmpq_mpoly, int], ...]
    constant: RationalFunction

    @property
    def text(self) -> str:
        """The formula in factored form."""
        return format_product(self.factors)

    @property
    def function(self) -> RationalFunction | None:
        """The expanded product; None if it has too many terms."""
        numerator_and_denominator = []
        for sign in (1, -1):
            powers = [(g, sign * k) for g, k in self.factors if sign * k > 0]
            if prod(len(g) ** k for g, k in powers) > _MAX_TERMS:
                return None
            one = self.constant.numerator.context().constant(1)
            numerator_and_denominator.append(reduce(lambda P, power: P * power[0] ** power[1], powers, one))
        return RationalFunction(*numerator_and_denominator)


@dataclass(frozen=True)
class Products:
    """The result of `products_of`: integrals, the denominator phi of an invariant dx/phi, time-dependent integrals.

    If there is no such phi, `density` is an anti-invariant phi (constant -1; |dx/phi| is invariant) or None.
    """

    integrals: tuple[Product, ...]
    density: Product | None
    time_dependent: tuple[Product, ...]


def candidates(
    laboratory: Laboratory, cofactors: Sequence[Cofactor], budget: Budget, polynomials: Sequence[fmpq_mpoly] = ()
) -> list[fmpq_mpoly]:
    """Collect irreducible polynomials over Q in (variables, symbols, eps) as candidate factors of integrals.

    For a map they are: the variables; the polynomials of the cofactors (affine Darboux functions of a system, and
    factors of Jacobi determinants); the factors of the Jacobi determinants of Phi and Phi^-1, if these can be expanded;
    and the factors of the given `polynomials`. For a flow they are the Darboux polynomials found within the budget.
    """
    if laboratory.flow:
        return list(laboratory.flow_polynomials(budget).functions)
    n, context = laboratory.map.dim, ring(laboratory.map.names)
    cofactor_polynomials = [cofactor.polynomial for cofactor in cofactors if cofactor.polynomial is not None]
    factors = _irreducible_factors((*context.gens()[:n], *cofactor_polynomials), n, laboratory.eps)
    factors |= _jacobian_factors(laboratory.map, laboratory.eps, laboratory.system is not None)
    factors |= _irreducible_factors(polynomials, n, laboratory.eps)
    return sorted(factors.values(), key=lambda P: (degree_in(P, n), len(P)))[:_MAX_CANDIDATES]


def _irreducible_factors(polynomials: Iterable[fmpq_mpoly], n: int, eps: fmpq | None) -> dict[str, fmpq_mpoly]:
    """Return the primitive irreducible factors, at eps if it is given, that contain one of the first n variables."""
    factors: dict[str, fmpq_mpoly] = {}
    for P in polynomials:
        if eps is not None:
            substitution: dict[str | int, int | fmpz | fmpq] = {"eps": eps}
            P = P.subs(substitution)
        for factor, _ in [] if P.is_zero() else irreducible_factors(P):
            if degree_in(factor, n):
                primitive_factor = primitive_part(factor)[1]
                factors.setdefault(str(primitive_factor), primitive_factor)
    return factors


@counted_cache(4)  # may take half a second; the searches for integrals and for densities call it
def _jacobian_factors(map_: MapFamily, eps: fmpq | None, has_map_itself: bool) -> dict[str, fmpq_mpoly]:
    """Return the factors of the Jacobi determinant of Phi^-1 and, if `has_map_itself`, also of that of Phi."""
    n, fractions = map_.dim, list[Function]()
    for is_inverse in (False, True) if has_map_itself else (True,):
        field = FunctionField(map_.names, _BUDGET, reduces=True)
        *x, eps_variable = field.variables
        try:
            map_over_field = map_.at(eps_variable, field, x[n:])
            map_over_field = map_over_field.inverse if is_inverse else map_over_field
            fractions += jacobian_determinant_fraction(map_over_field, x[:n], map_over_field.generic_step(tuple(x[:n])))
        except (BudgetExceeded, InputError, SingularStep):
            continue
    return _irreducible_factors((P for f in fractions for P in (f.numerator, f.denominator)), n, eps)


class _Line:
    """A random line modulo the prime of a map, and the image of the line, both parametrized by t.

    `line` and `image` hold homogeneous coordinates (X : Z), polynomials in t without a common factor. On the line,
    det dPhi is `numerator`/(Z^n `denominator`), where Z is the last coordinate of `image`. Raises NoPoint.
    """

    def __init__(self, map_: ModularMap) -> None:
        p = map_.prime
        self.prime, self.map = p, map_
        start, slope = map_.random_point(), map_.random_point()
        self.line = [*(nmod_poly([c, d], p) for c, d in zip(start, slope, strict=True)), nmod_poly([1], p)]
        self.image, self.numerator, self.denominator = self.line, nmod_poly([1], p), nmod_poly([1], p)
        for factor in map_.map.factors:
            self._apply(factor)

    def _apply(self, factor: ElementaryMap) -> None:
        """Replace `image` by its image under a factor of the map; multiply by the Jacobi determinant of the factor."""
        p, n, curve = self.prime, factor.dim, self.image
        map_degree, curve_degree = max(1, factor.equation.degree), max(int(entry.degree()) for entry in curve)

        def step(t: int) -> tuple[tuple[Any, ...], tuple[Any, ...], int]:
            """Return the point X/Z of the curve at t, the image of the point, and Z."""
            count_work(30 + 15 * n)
            *X, Z = (factor.field.convert(int(entry(t))) for entry in curve)
            if Z == 0:
                raise SingularStep("a point of a curve is at infinity", (), factor.eps)
            x = tuple(c / Z for c in X)
            return x, factor.step(x), int(Z)

        def homogeneous_image(t: int) -> list[int]:
            x, image, Z = step(t)
            denominator = int(factor.determinant(x)) * pow(Z, n * map_degree, p)
            return [*(int(c) * denominator % p for c in image), denominator % p]

        # Remove the common factor: each further map would multiply its degree, and its zeros need not be at infinity.
        forms = _interpolate(homogeneous_image, n * map_degree * curve_degree, p)
        common_factor = reduce(nmod_poly.gcd, forms)
        self.image = [entry // common_factor for entry in forms]
        self.denominator = self.denominator * forms[-1]
        image_Z = self.image[-1]

        def numerator_at(t: int) -> list[int]:
            x, image, Z = step(t)
            scale = pow(Z, n * (map_degree - 1), p) * pow(int(image_Z(t)), n, p)
            return [int(det(factor.numerator_matrix(x, image))) * scale % p]

        image_degree = max(int(entry.degree()) for entry in self.image)
        self.numerator = (
            self.numerator * _interpolate(numerator_at, n * ((map_degree - 1) * curve_degree + image_degree), p)[0]
        )

    def along(self, g: fmpq_mpoly, curve: Sequence[nmod_poly]) -> nmod_poly:
        """Return Z^deg(g) g(X/Z), the numerator of g on a curve (X : Z), as a polynomial in t."""
        n, p = self.map.dim, self.prime
        field = GF(p)
        parameters = [field.convert(c) for c in (*self.map.values, self.map.eps)]
        degree_of_g = degree_in(g, n)
        powers = [list(accumulate(repeat(c, degree_of_g), mul, initial=nmod_poly([1], p))) for c in curve]
        value = nmod_poly([0], p)
        count_work(50 + 15 * len(g))
        for monomial, coefficient in g.terms():
            exponents = [int(e) for e in monomial]
            factors = (c**e for c, e in zip(parameters, exponents[n:], strict=True))
            term = nmod_poly([int(prod(factors, start=field.convert(coefficient)))], p)
            tables_and_exponents = zip(powers, [*exponents[:n], degree_of_g - sum(exponents[:n])], strict=True)
            value = value + reduce(mul, (table[e] for table, e in tables_and_exponents if e), term)
        return value


def _interpolate(function: Callable[[int], list[int]], max_degree: int, p: int) -> list[nmod_poly]:
    """Return the polynomials of degree at most `max_degree` with the values `function(t)` at t = 1, 2, ...

    Raises NoPoint if `function` raises SingularStep for too many t.
    """
    nodes, rows, t, failure_count = list[int](), list[list[int]](), 0, 0
    while len(nodes) <= max_degree:
        t += 1
        try:
            rows.append(function(t))
            nodes.append(t)
        except SingularStep:
            failure_count += 1
            if failure_count > max_degree + 20:
                raise NoPoint("random points modulo a prime are indeterminacy points of the map") from None
    return [interpolated(nodes, column, p) for column in zip(*rows, strict=True)]


def coprime_base(polynomials: Sequence[nmod_poly]) -> list[nmod_poly]:
    """Return nonconstant coprime polynomials; the given ones are constants times products of powers of these.

    >>> P, Q = nmod_poly([1, 1], 101), nmod_poly([2, 1], 101)
    >>> [B.degree() for B in coprime_base([P * P * Q, P * Q])]
    [1, 1]
    """
    base: list[nmod_poly] = []
    remaining_polynomials = list(polynomials)
    while remaining_polynomials:
        P = remaining_polynomials.pop()
        if P.degree() < 1:
            continue
        for k, Q in enumerate(base):
            common_factor = P.gcd(Q)
            count_work(2 + (P.degree() + Q.degree()) / 3)
            if common_factor.degree() > 0:
                base.pop(k)
                remaining_polynomials += [P // common_factor, Q // common_factor, common_factor]
                break
        else:
            base.append(P)
    return base


def _exponents(P: nmod_poly, base: Sequence[nmod_poly]) -> list[int]:
    """Return the multiplicity of each element of a coprime base in a polynomial."""
    multiplicities = []
    for B in base:
        multiplicity = 0
        quotient, remainder = divmod(P, B)
        while remainder.is_zero():
            multiplicity, P = multiplicity + 1, quotient
            quotient, remainder = divmod(P, B)
        multiplicities.append(multiplicity)
    return multiplicities


def relations(rows: Sequence[Sequence[int]]) -> list[list[int]]:
    """Return a basis over Z of all integer vectors k with sum k_i row_i = 0.

    >>> relations([[2, 0], [3, 0], [0, 1]])
    [[3, -2, 0]]
    """
    if not rows:
        return []
    row_count, column_count = len(rows), len(rows[0])
    count_work(10 + row_count**2 * (row_count + column_count) / 50)
    augmented_rows = fmpz_mat([[*row, *(int(i == k) for i in range(row_count))] for k, row in enumerate(rows)]).hnf()
    return [[int(e) for e in row[column_count:]] for row in augmented_rows.tolist() if not any(row[:column_count])]


def coefficient_rows(polynomials: Sequence[fmpq_mpoly]) -> list[list[int]]:
    """Return the coefficients of polynomials, one row for each polynomial, times a common denominator.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> coefficient_rows([x + 1, y / 2 - x])
    [[2, 0, 2], [0, 1, -2]]
    """
    denominator = lcm(*(int(c.q) for P in polynomials for c in P.coeffs()))
    terms = [{tuple(map(int, m)): int(c * denominator) for m, c in P.terms()} for P in polynomials]
    support = sorted({m for row in terms for m in row})
    return [[row.get(m, 0) for m in support] for row in terms]


def _reduce_basis(vectors: Sequence[Sequence[int]], weights: Sequence[int]) -> list[list[int]]:
    """Return an LLL-reduced basis of the lattice of the vectors, where entry i of a vector counts weights[i] times."""
    if not vectors:
        return []
    reduced_rows = fmpz_mat([[e * w for e, w in zip(v, weights, strict=True)] for v in vectors]).lll()
    return [[int(e) // w for e, w in zip(row, weights, strict=True)] for row in reduced_rows.tolist()]


def products_of(laboratory: Laboratory, polynomials: Sequence[fmpq_mpoly]) -> Products:
    """Find the products of powers of the polynomials that are integrals, time-dependent integrals or a density.

    The exponents are computed modulo one prime. The products are not verified as identities. Raises NoPoint.

    >>> from kahanmaps.documents.catalog import load
    >>> laboratory = Laboratory(load("lotka_volterra"))
    >>> products_of(laboratory, candidates(laboratory, laboratory.cofactors(), Budget())).density.function.numerator
    x*y
    """
    weights = [_DETERMINANT_WEIGHT, *map(len, polynomials)]  # prefers powers of short polynomials
    n, context, field = laboratory.map.dim, ring(laboratory.map.names), laboratory.field
    one, minus_one = (RationalFunction(context.constant(c), context.constant(1)) for c in (1, -1))
    if field is not None and laboratory.flow:
        # With P_i' = K_i P_i, sum k_i K_i is 0 for integrals, div f for densities, free of x if time-dependent.
        gens = context.gens()
        cofactors = [
            field.divergence.compose(*gens[: n + len(field.symbols)], ctx=context),
            *(field.derivative(P) / P for P in polynomials),
        ]
        constant_parts = [K.compose(*[context.constant(0)] * n, *gens[n:], ctx=context) for K in cofactors]
        parts_with_x = [K - c for K, c in zip(cofactors, constant_parts, strict=True)]
        time_dependent = []
        for vector in _reduce_basis(relations(coefficient_rows(parts_with_x)), weights):
            constant = sum((k * c for k, c in zip(vector, constant_parts, strict=True)), context.constant(0))
            if vector[0] == 0 and not constant.is_zero():
                time_dependent.append((vector, RationalFunction(constant, context.constant(1))))
        constant_one = _reduce_basis(relations(coefficient_rows(cofactors)), weights)
        return _build_products(polynomials, n, constant_one, [(one, constant_one)], time_dependent)
    line = _Line(laboratory.maps[0])
    values_on_line, values_on_image = ([line.along(g, curve) for g in polynomials] for curve in (line.line, line.image))
    # det dPhi and the quotients C_i = g_i(x~)/g_i(x) on a random line, as vectors of exponents of a coprime base.
    base = coprime_base([*values_on_line, *values_on_image, line.image[-1], line.numerator, line.denominator])
    Z, N, M = (_exponents(P, base) for P in (line.image[-1], line.numerator, line.denominator))
    rows = [[a - b - n * c for a, b, c in zip(N, M, Z, strict=True)]]
    for g, P, Q in zip(polynomials, values_on_line, values_on_image, strict=True):
        d = degree_in(g, n)
        rows.append([b - a - d * c for a, b, c in zip(_exponents(P, base), _exponents(Q, base), Z, strict=True)])
    vectors = _reduce_basis(relations(rows), weights)  # entry 0 is the exponent of det dPhi

    def evaluate_constants(map_: ModularMap) -> list[int]:
        """Return prod C_i^k_i det dPhi^k_0 at a random point, for each vector k. Raises NoPoint."""
        p, field_p, constants = map_.prime, GF(map_.prime), list[int]()
        parameters = [field_p.convert(c) for c in (*map_.values, map_.eps)]
        for (x, image), vector in zip(map_.pairs(len(vectors)), vectors, strict=True):
            count_work(50 + 10 * n)
            constant = pow(int(det(map_.map.jacobian(x))), vector[0], p)
            for g, k in zip(polynomials, vector[1:], strict=True):
                if k:
                    value, image_value = (
                        int(evaluate(g, field_p, [*map(field_p.convert, point), *parameters])) for point in (x, image)
                    )
                    if not value or not image_value:
                        raise NoPoint("a polynomial vanishes at a random point modulo a prime")
                    constant = constant * pow(image_value, k, p) * pow(value, -k, p) % p
            constants.append(constant)
        return constants

    values = constants_of(laboratory, evaluate_constants)
    vectors_with_constant = [(v, c) for v, c in zip(vectors, values, strict=True) if c is not None]

    def select_vectors(allowed_constants: list[RationalFunction]) -> list[list[int]]:
        """Return a basis of the vectors whose constant is 1 or a product of powers of the allowed constants."""
        combinations = multiplicative_relations([*(c for _, c in vectors_with_constant), *allowed_constants])
        combined_vectors = [
            _linear_combination(a[: len(vectors_with_constant)], [v for v, _ in vectors_with_constant])
            for a in combinations
            if any(a[: len(vectors_with_constant)])
        ]
        return _reduce_basis(combined_vectors, weights)

    constant_one = select_vectors([])
    time_dependent = [(v, c) for v, c in vectors_with_constant if v[0] == 0 and c != one]
    return _build_products(
        polynomials, n, constant_one, [(one, constant_one), (minus_one, select_vectors([minus_one]))], time_dependent
    )


def _build_products(
    polynomials: Sequence[fmpq_mpoly],
    n: int,
    constant_one: Sequence[list[int]],
    densities: Sequence[tuple[RationalFunction, Sequence[list[int]]]],
    time_dependent: Sequence[tuple[list[int], RationalFunction]],
) -> Products:
    """Build the result of `products_of` from vectors: the exponent of det dPhi, then those of the polynomials.

    `constant_one` are the vectors with constant 1. `densities` are pairs of a constant 1 or -1 and a basis of vectors.
    """
    degrees = [0, *(degree_in(g, n) for g in polynomials)]
    integrals = []
    for v in (v for v in constant_one if v[0] == 0):
        # Choose I or 1/I so that the degree is positive or, if it is 0, so that the first exponent is positive.
        degree = sum(k * d for k, d in zip(v, degrees, strict=True))
        integrals.append(v if (degree, next((k for k in v if k), 0)) > (0, 0) else [-k for k in v])

    def build_product(vector: Sequence[int], constant: RationalFunction) -> Product:
        return Product(tuple((g, k) for g, k in zip(polynomials, vector[1:], strict=True) if k), constant)

    def cost(vector: Sequence[int]) -> tuple[int, int, int]:
        """Return the sort key of a vector: first the degree of the denominator, then the degree of the numerator."""
        denominator, numerator = (
            sum(sign * k * d for k, d in zip(vector, degrees, strict=True) if sign * k > 0) for sign in (-1, 1)
        )
        return denominator, numerator, sum(map(abs, vector))

    density = None
    for constant, vectors in densities:
        vector = next((v if v[0] == -1 else [-e for e in v] for v in vectors if abs(v[0]) == 1), None)
        while vector is not None and density is None:  # multiply phi by integrals while this lowers the cost
            neighbours = [_linear_combination((1, sign), (vector, v)) for v in integrals for sign in (1, -1)]
            best_neighbour = min(neighbours, key=cost, default=vector)
            if cost(best_neighbour) >= cost(vector):
                density = build_product(vector, constant)
            vector = best_neighbour
    first_density = densities[0][0]
    return Products(
        tuple(build_product(v, first_density) for v in integrals),
        density,
        tuple(build_product(v, c) for v, c in time_dependent),
    )


def constants_of(laboratory: Laboratory, constants: Callable[[ModularMap], list[int]]) -> list[RationalFunction | None]:
    """Interpolate the numbers `constants(map)` as functions of the symbols and eps; None where this fails."""
    context = ring(laboratory.map.names)
    one = RationalFunction(context.constant(1), context.constant(1))

    def constants_at(prime: int, values: tuple[int, ...]) -> list[int] | None:
        try:
            return constants(laboratory.map_for(prime, values))
        except (NoPoint, BadPrime):
            return None

    are_one = [all(c == 1 for c in column) for column in zip(*map(constants, laboratory.maps), strict=True)]
    if all(are_one):
        return [one] * len(are_one)
    names = (*laboratory.symbols, "eps") if laboratory.eps_enters == "symbol" else laboratory.symbols
    reconstruction = reconstruct_at(laboratory.root, constants_at, names, seed=laboratory.seed)
    if reconstruction.functions is None:
        return [one if is_constant_one else None for is_constant_one in are_one]
    gens = [gen for gen, name in zip(context.gens(), laboratory.map.names, strict=True) if name in names]
    quotients = [over_one_denominator([c], context, gens) for c in reconstruction.functions]
    return [RationalFunction(numerator, denominator) for [numerator], denominator in quotients]


def _linear_combination(weights: Sequence[int], vectors: Sequence[Sequence[int]]) -> list[int]:
    return [sum(w * e for w, e in zip(weights, column, strict=True)) for column in zip(*vectors, strict=True)]


def multiplicative_relations(functions: Sequence[RationalFunction]) -> list[list[int]]:
    """Return a basis over Z of all k with f_1^k_1 ... f_r^k_r = 1, for nonzero `functions` f_1, ..., f_r.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> functions = [parse_rational_function(text, ["a"]) for text in ("-4*a^2", "2*a", "3", "-1")]
    >>> multiplicative_relations(functions)
    [[1, -2, 0, 1], [0, 0, 0, 2]]
    """
    rows: list[dict[str, int]] = []
    for function in functions:
        row: dict[str, int] = {}
        for polynomial, sign in ((function.numerator, 1), (function.denominator, -1)):
            scalar, factors = polynomial.factor()
            for factor, k in factors:
                c, primitive = primitive_part(factor)
                scalar = scalar * c ** int(k)
                row[str(primitive)] = row.get(str(primitive), 0) + sign * int(k)
            row["sign"] = row.get("sign", 0) + (scalar < 0)
            for integer, s in ((scalar.p, sign), (scalar.q, -sign)):
                for q, k in abs(integer).factor():
                    row[str(q)] = row.get(str(q), 0) + s * int(k)
        rows.append(row)
    keys = sorted({key for row in rows for key in row} | {"sign"})
    # Signs matter modulo 2 only, so a row with the sign 2 is added. Its exponent is dropped from the result.
    exponent_rows = [*([row.get(key, 0) for key in keys] for row in rows), [2 * (key == "sign") for key in keys]]
    return [vector[:-1] for vector in relations(exponent_rows)]
