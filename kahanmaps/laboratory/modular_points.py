"""Points, steps and values of monomials modulo a prime: the data for searches for integrals and densities."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import islice, zip_longest
from operator import mul
from typing import Any

from flint import fmpq_mpoly, nmod, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.modular_matrices import rank
from kahanmaps.algebra.polynomials import RationalFunction, evaluate, gradient, monomials
from kahanmaps.algebra.work import count_work
from kahanmaps.errors import BadPrime, KahanmapsError, SingularStep
from kahanmaps.invariants.integrals_and_densities import jacobian_determinant_fraction
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanMap, as_map
from kahanmaps.systems.polynomial import PolynomialField
from kahanmaps.systems.quadratic import QuadraticSystem

Point = tuple[int, ...]
Values = Sequence[Any]  # Python integers, or `nmod` (products take half the time)
Exponent = tuple[int, ...]
_TRIES = 60  # maximal number of random points or orbits that are tried
_UNDEFINED = "the map is not defined at random points modulo a prime"


class NoPoint(KahanmapsError):
    """The map is undefined at too many random points, or on too many orbits, modulo a prime."""


class ModularMap:
    """A map modulo `prime`, at residues `eps` and `values` (of its symbols); a system stands for its Kahan map.

    All random choices use `rng`. Raises BadPrime if the prime divides eps or a denominator in the map.
    """

    def __init__(
        self,
        system: QuadraticSystem | MapFamily,
        prime: int,
        eps: int,
        values: Sequence[int] = (),
        seed: int = 0,
    ) -> None:
        self.prime = prime
        self.eps = eps
        self.dim = system.dim
        self.values = tuple(values)
        self.rng = random.Random(f"{seed} {prime} {eps} {tuple(values)}")
        field = GF(prime)
        if eps % prime == 0:
            raise BadPrime(f"found eps = 0 modulo {prime}: use another prime", prime)
        self.map = as_map(system).at(field.convert(eps), field, [field.convert(value) for value in values])
        count_work(20 if isinstance(self.map, KahanMap) else 200)

    def random_point(self) -> Point:
        """Return a random point modulo the prime."""
        return tuple(self.rng.randrange(self.prime) for _ in range(self.dim))

    def step(self, x: Point) -> Point | None:
        """Return the image of a point; None if the map is not defined there."""
        # Only the work of other operations is counted here: the evaluation of polynomials counts its own.
        count_work(15 + 5 * self.dim + self.dim**3 / 20 if isinstance(self.map, KahanMap) else 10)
        try:
            return tuple(int(entry) for entry in self.map.step(x))
        except SingularStep:
            return None

    def determinant(self, x: Point, image: Point) -> tuple[int, int]:
        """Return numerator and denominator of det dPhi(x): for Kahan maps det(I + eps f'(x~)), det(I - eps f'(x))."""
        count_work(25 + 8 * self.dim + self.dim**3 / 10)
        numerator, denominator = jacobian_determinant_fraction(self.map, x, self.map.point(image))
        return int(numerator), int(denominator)

    def pairs(self, count: int) -> Iterator[tuple[Point, Point]]:
        """Yield `count` random points with their images. Raises NoPoint if the map is undefined at over 60 points."""
        failure_count = 0
        while count > 0:
            x = self.random_point()
            image = self.step(x)
            if image is not None:
                yield x, image
                count -= 1
            else:
                failure_count += 1
                if failure_count > _TRIES:
                    raise NoPoint(_UNDEFINED)

    def orbit(self, count: int) -> list[Point]:
        """Return the first `count` points of an orbit, or all of its points if the orbit has a smaller period.

        If an orbit contains an indeterminacy point, another random orbit is tried. Raises NoPoint after 60 such orbits.
        """
        max_length = 0
        for _ in range(_TRIES):
            points = [self.random_point()]
            while len(points) < count and (image := self.step(points[-1])) != points[0]:
                if image is None:
                    break
                points.append(image)
            else:
                return points
            max_length = max(max_length, len(points))
        raise NoPoint(_UNDEFINED if max_length == 1 else "orbits modulo a prime meet the singular set")

    def along_orbit(
        self, degree: int, count: int, support: Sequence[int] | None = None
    ) -> tuple[Sequence[Values], Point, int | None]:
        """Evaluate all monomials up to a degree along an orbit of `count` points.

        Returns (values, first point, period); the period is None if it is not less than `count`. The matrix of values
        has a row for each point and a column for each monomial; it annihilates polynomials that vanish along the orbit.
        A `support` (indices of monomials, closed under divisors) restricts the columns. Raises NoPoint.
        """
        points = self.orbit(count)
        period = len(points) if len(points) < count else None
        layers = _layers(self.dim, degree) if support is None else _layers_of(self.dim, degree, support)
        return [_layered_values(x, layers, self.prime) for x in points], points[0], period

    def monomials_at_both(
        self, x: Point, image: Point, degree: int, factors: tuple[int, int] = (1, 1)
    ) -> tuple[Values, Values]:
        """Return the values of all monomials up to a degree, at x and at the image, times factors[0] and factors[1]."""
        layers, p = _layers(self.dim, degree), self.prime
        return _layered_values(x, layers, p, factors[0]), _layered_values(image, layers, p, factors[1])


class ModularFlow(ModularMap):
    """The flow of a vector field modulo `prime`, at the residues `values` of its symbols; a step is x -> x + f(x).

    It has the interface of a map, so that the searches for maps also apply to flows. A solution x(t) is a power series,
    and the coefficients of P(x(t)) replace the values P(x_n) along an orbit: P vanishes along the solution if enough
    coefficients are 0. Where a search evaluates P(x~), a flow returns P + P' with P' = f . grad P. So the expressions
    P(x~) - P(x) and P(x~) Q(x) - P(x) Q(x~) become P' and P' Q - P Q'.

    Raises BadPrime if the prime divides a denominator in f.
    """

    def __init__(self, field: PolynomialField, prime: int, values: Sequence[int] = (), seed: int = 0) -> None:
        # The constructor of ModularMap is not called, since a flow has no attribute `map`.
        self.prime, self.eps, self.dim, self.values = prime, 1, field.dim, tuple(values)
        self.rng = random.Random(f"flow {seed} {prime} {self.values}")
        self.degree = field.degree
        self._f = [self._terms(f) for f in field.rhs]
        self._divergence = self._terms(field.divergence)
        # The products from which the monomials of f are evaluated: a monomial is a variable times an earlier monomial.
        tables = monomial_tables(self.dim, self.degree)
        indices = {index for terms in self._f for _, index in terms}
        products: dict[int, tuple[int, int]] = {}
        while indices:
            index = indices.pop()
            if index > self.dim and index not in products:
                variable, _, quotient_index = tables[index][-1]
                products[index] = variable, quotient_index
                indices.add(quotient_index)
        self._products = sorted(products.items())

    def _terms(self, polynomial: fmpq_mpoly) -> list[tuple[int, int]]:
        """Return pairs (residue of a coefficient at the values of the symbols, index of its monomial)."""
        field, n = GF(self.prime), self.dim
        terms = []
        for monomial, coefficient in polynomial.terms():
            residue = field.convert(coefficient)
            for value, exponent in zip(self.values, monomial[n:], strict=True):
                residue = residue * field.convert(value) ** int(exponent)
            terms.append((int(residue), monomial_index(n, self.degree)[tuple(map(int, monomial[:n]))]))
        return terms

    def step(self, x: Point) -> Point:
        """Return x + f(x)."""
        values = monomial_values(x, self.degree, self.prime)
        count_work(5 + sum(map(len, self._f)) / 6)
        return tuple((a + sum(c * values[k] for c, k in f)) % self.prime for a, f in zip(x, self._f, strict=True))

    def determinant(self, x: Point, image: Point) -> tuple[int, int]:
        """Return 1 + div f(x) and 1; a density P of the flow satisfies P + f . grad P = (1 + div f) P."""
        values = monomial_values(x, self.degree, self.prime)
        return 1 + sum(c * values[k] for c, k in self._divergence), 1

    def monomials_at_both(
        self, x: Point, image: Point, degree: int, factors: tuple[int, int] = (1, 1)
    ) -> tuple[Values, Values]:
        """Return the values at x of all monomials P, times factors[0], and of all P + f . grad P, times factors[1]."""
        p = self.prime
        values = monomial_values(x, degree, p)
        count_work(len(values) * self.dim / 4)
        f = [image_coordinate - coordinate for coordinate, image_coordinate in zip(x, image, strict=True)]
        image_values = [
            (value + sum(e * values[quotient_index] * f[k] for k, e, quotient_index in derivatives)) * factors[1] % p
            for value, derivatives in zip(values, monomial_tables(self.dim, degree), strict=True)
        ]
        return [factors[0] * value % p for value in values], image_values

    def along_orbit(
        self, degree: int, count: int, support: Sequence[int] | None = None
    ) -> tuple[Sequence[Values], Point, int | None]:
        """Return the Taylor coefficients of monomials along a solution, its initial point, and None for the period."""
        start = self.random_point()
        return self.series(start, degree, count, support), start, None

    def series(self, start: Point, degree: int, orders: int, support: Sequence[int] | None = None) -> list[Values]:
        """Return the first `orders` Taylor coefficients of all monomials (or those in `support`) along a solution x(t).

        A row of the result has the coefficients of one order in t, a column those of one monomial.
        """
        p, factors = self.prime, monomial_tables(self.dim, degree)
        column_count = len(factors) if support is None else len(support)
        recursion_units = len(self._products) * orders / 25 + sum(map(len, self._f)) / 3
        count_work(orders * (recursion_units + column_count / 2) + 3 * column_count)
        # The keys are indices of monomials: the constant 1 has index 0, the k-th variable has index k + 1.
        coefficients = {0: [1], **{k + 1: [c] for k, c in enumerate(start)}}
        coefficients |= {index: list[int]() for index, _ in self._products}
        for order in range(1, orders):
            for index, (variable, divisor) in self._products:
                coefficients[index].append(
                    sum(map(mul, coefficients[variable + 1], reversed(coefficients[divisor]))) % p
                )
            derivatives = [sum(c * coefficients[index][-1] for c, index in f) for f in self._f]
            inverse_order = pow(order, -1, p)
            coefficients[0].append(0)
            for k, derivative in enumerate(derivatives, 1):
                coefficients[k].append(derivative * inverse_order % p)
        solution = [nmod_poly(coefficients[k + 1], p) for k in range(self.dim)]
        monomial_series = {0: nmod_poly([1], p)}

        def series_of(index: int) -> nmod_poly:
            if index not in monomial_series:
                variable, _, divisor = factors[index][-1]
                monomial_series[index] = series_of(divisor).mul_low(solution[variable], orders)
            return monomial_series[index]

        expansions = [series_of(index).coeffs() for index in (range(len(factors)) if support is None else support)]
        # Lists of coefficients end with a nonzero entry, so that all may be shorter than `orders`: append zeros.
        rows: list[Values] = list(islice(zip_longest(*expansions, fillvalue=nmod(0, p)), orders))
        return rows + [[nmod(0, p)] * column_count] * (orders - len(rows))


@cache
def exponents_up_to(dim: int, degree: int) -> tuple[tuple[int, ...], ...]:
    """Return the exponents of all monomials in `dim` variables of degree at most `degree`, by increasing degree."""
    return tuple(m for k in range(degree + 1) for m in monomials(dim, k))


@cache
def monomial_index(dim: int, degree: int) -> dict[Exponent, int]:
    """Return a dict that maps the exponents of each monomial to its index in `exponents_up_to(dim, degree)`."""
    return {exponent: k for k, exponent in enumerate(exponents_up_to(dim, degree))}


@cache
def monomial_tables(dim: int, degree: int) -> list[list[tuple[int, int, int]]]:
    """Return for each monomial the triples (variable, exponent, index of monomial/variable) of its variables."""
    indices = monomial_index(dim, degree)
    return [
        [(k, e, indices[(*exponent[:k], e - 1, *exponent[k + 1 :])]) for k, e in enumerate(exponent) if e]
        for exponent in indices
    ]


def _layers_of(dim: int, degree: int, support: Sequence[int]) -> list[list[tuple[int, int]]]:
    """Return, by degree, a pair (variable, column of monomial/variable) for each monomial of the support except 1."""
    exponents, tables = exponents_up_to(dim, degree), monomial_tables(dim, degree)
    columns = {index: column for column, index in enumerate(support)}
    layers: list[list[tuple[int, int]]] = [[] for _ in range(degree)]
    for index in support:
        if index:
            variable, _, quotient_index = tables[index][-1]
            layers[sum(exponents[index]) - 1].append((variable, columns[quotient_index]))
    return layers


@cache
def _layers(dim: int, degree: int) -> list[list[tuple[int, int]]]:
    return _layers_of(dim, degree, range(len(exponents_up_to(dim, degree))))


def monomial_values(point: Point, degree: int, prime: int) -> list[int]:
    """Return the values of all monomials of degree at most `degree` at a point modulo a prime."""
    values = _layered_values(point, _layers(len(point), degree), prime)
    count_work(len(values) / 8)
    return list(map(int, values))


def _layered_values(point: Point, layers: Sequence[Sequence[tuple[int, int]]], prime: int, factor: int = 1) -> Values:
    """Return the values of the monomials 1 and those in `layers` (see `_layers_of`), times a factor."""
    x, values = [nmod(entry, prime) for entry in point], [nmod(factor, prime)]
    for layer in layers:
        values += [values[quotient_index] * x[variable] for variable, quotient_index in layer]
    count_work(len(values) / 10)
    return values


def gradient_values(vector: Sequence[int], point: Point, degree: int, prime: int) -> tuple[int, list[int]]:
    """Return the value and the gradient, at a point, of the polynomial with the coefficients `vector`."""
    value, gradient = 0, [0] * len(point)
    residues = monomial_values(point, degree, prime)
    count_work(len(vector) / 20 + 0.75 * sum(map(bool, vector)))
    for coefficient, factors, residue in zip(vector, monomial_tables(len(point), degree), residues, strict=True):
        if coefficient:  # most coefficients are 0
            value += coefficient * residue
            for variable, exponent, quotient_index in factors:
                gradient[variable] = (gradient[variable] + coefficient * exponent * residues[quotient_index]) % prime
    return value % prime, gradient


def monomial_derivatives(point: Point, degree: int, prime: int) -> list[list[int]]:
    """Return the partial derivatives at a point of all monomials up to a degree; a row for each variable."""
    residues = monomial_values(point, degree, prime)
    rows = [[0] * len(residues) for _ in point]
    count_work(len(point) * len(residues) / 5)
    for k, factors in enumerate(monomial_tables(len(point), degree)):
        for variable, exponent, quotient_index in factors:
            rows[variable][k] = exponent * residues[quotient_index] % prime
    return rows


def product_of(P: Sequence[int], Q: Sequence[int], dim: int, degree: int, prime: int) -> list[int] | None:
    """Return the coefficients of the product P Q modulo a prime; None if the degree of P Q exceeds `degree`.

    P and Q are lists of coefficients in the order of `exponents_up_to`; missing coefficients at the end are 0.
    """
    exponents, indices = exponents_up_to(dim, degree), monomial_index(dim, degree)
    coefficients = [0] * len(exponents)
    count_work(len(exponents) / 10 + 1.5 * sum(map(bool, P)) * sum(map(bool, Q)))
    for a, p in zip(exponents, P, strict=False):
        if p:
            for b, q in zip(exponents, Q, strict=False):
                if q:
                    index = indices.get(tuple(i + j for i, j in zip(a, b, strict=True)))
                    if index is None:
                        return None
                    coefficients[index] = (coefficients[index] + p * q) % prime
    return coefficients


def interpolated(nodes: Sequence[int], values: Sequence[int], prime: int) -> nmod_poly:
    """Return the polynomial modulo a prime with given values at n distinct nodes; its degree is less than n."""
    differences = list(values)
    count_work(len(nodes) ** 2 / 2)
    inverse = cache(lambda difference: pow(difference, -1, prime))
    for k in range(1, len(nodes)):  # Newton's divided differences
        for i in range(len(nodes) - 1, k - 1, -1):
            differences[i] = (differences[i] - differences[i - 1]) * inverse(nodes[i] - nodes[i - k]) % prime
    P = nmod_poly([0], prime)
    for node, c in zip(reversed(nodes), reversed(differences), strict=True):
        P = P * nmod_poly([-node % prime, 1], prime) + nmod_poly([c], prime)
    return P


def scaled_gradient(function: RationalFunction, field: Any, point: Sequence[Any], n: int) -> list[Any]:
    """Return D^2 times the gradient, in the first n variables, of the function N/D at a point."""
    N, D = (evaluate(polynomial, field, point) for polynomial in (function.numerator, function.denominator))
    dN, dD = (gradient(polynomial)[:n] for polynomial in (function.numerator, function.denominator))
    return [evaluate(a, field, point) * D - evaluate(b, field, point) * N for a, b in zip(dN, dD, strict=True)]


class IndependentGradients:
    """The gradients of functions at one random point modulo a prime, for tests of functional independence.

    `rows` are multiples of the linearly independent gradients stored so far.
    """

    def __init__(self, map_: ModularMap, functions: Sequence[RationalFunction] = ()) -> None:
        self.map, self.point = map_, map_.random_point()
        self.rows = [self.gradient(function) for function in functions]

    def gradient(self, function: RationalFunction) -> list[int]:
        """Return a multiple of the gradient, in the variables only, of a function of (variables, symbols, eps)."""
        field = GF(self.map.prime)
        point = [field.convert(c) for c in (*self.point, *self.map.values, self.map.eps)]
        return [int(entry) for entry in scaled_gradient(function, field, point, self.map.dim)]

    def adds(self, row: list[int]) -> bool:
        """Return whether a gradient is linearly independent of the stored gradients, without adding it."""
        return rank([*self.rows, row], self.map.prime) > len(self.rows)

    def add(self, row: list[int]) -> bool:
        """Add a gradient if it is linearly independent of the stored gradients, and return whether it is."""
        if not self.adds(row):
            return False
        self.rows.append(row)
        return True
