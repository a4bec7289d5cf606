"""Points, steps and values of monomials modulo a prime: what the searches for integrals and densities feed on."""

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
from kahanmaps.algebra.work import count
from kahanmaps.errors import BadPrime, KahanmapsError, SingularStep
from kahanmaps.invariants.phase_functions import jacobian_determinant_sides
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanMap, as_map
from kahanmaps.systems.polynomial import PolynomialField
from kahanmaps.systems.quadratic import QuadraticSystem

Point = tuple[int, ...]
Values = Sequence[Any]  # as nmod, whose products take half the time of those of Python's integers; or as integers
Exponent = tuple[int, ...]
_TRIES = 60
_NO_VALUE = "the map is not defined at random points modulo a prime"


class NoPoint(KahanmapsError):
    """The map is not defined at any of many random points modulo a prime."""


class ModularMap:
    """A map modulo `prime`, at the residues `values` of its symbols and `eps`; a system stands for its Kahan map.

    Everything drawn at random comes from `rng`. Raises BadPrime where the prime divides denominators, or is eps.
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
            raise BadPrime(f"found eps = 0 modulo {prime}: take another prime", prime)
        self.map = as_map(system).at(field.convert(eps), field, [field.convert(value) for value in values])
        count(20 if isinstance(self.map, KahanMap) else 200)

    def random_point(self) -> Point:
        """A random point modulo the prime."""
        return tuple(self.rng.randrange(self.prime) for _ in range(self.dim))

    def step(self, x: Point) -> Point | None:
        """The image of a point, None where the map is not defined."""
        # Values of polynomials count themselves.
        count(15 + 5 * self.dim + self.dim**3 / 20 if isinstance(self.map, KahanMap) else 10)
        try:
            return tuple(int(entry) for entry in self.map.step(x))
        except SingularStep:
            return None

    def determinant(self, x: Point, image: Point) -> tuple[int, int]:
        """Numerator and denominator of det dPhi(x), as they come: for Kahan maps det(I +- eps f') at x~ and x."""
        count(25 + 8 * self.dim + self.dim**3 / 10)
        above, below = jacobian_determinant_sides(self.map, x, self.map.point(image))
        return int(above), int(below)

    def pairs(self, count: int) -> Iterator[tuple[Point, Point]]:
        """So many random points with their images. Raises NoPoint where the map has hardly any."""
        missed = 0
        while count > 0:
            x = self.random_point()
            image = self.step(x)
            if image is not None:
                yield x, image
                count -= 1
            else:
                missed += 1
                if missed > _TRIES:
                    raise NoPoint(_NO_VALUE)

    def orbit(self, count: int) -> list[Point]:
        """Up to `count` points of an orbit; fewer where it is periodic: then all of its points.

        An orbit that meets the singular set is given up for another. Raises NoPoint where all do.
        """
        longest = 0
        for _ in range(_TRIES):
            found = [self.random_point()]
            while len(found) < count and (image := self.step(found[-1])) != found[0]:
                if image is None:
                    break
                found.append(image)
            else:
                return found
            longest = max(longest, len(found))
        raise NoPoint(_NO_VALUE if longest == 1 else "orbits modulo a prime meet the singular set")

    def along_orbit(
        self, degree: int, count: int, support: Sequence[int] | None = None
    ) -> tuple[Sequence[Values], Point, int | None]:
        """The values of all monomials up to a degree along an orbit: a row a point; the first point; the period.

        A polynomial vanishes along the orbit if the `count` rows annihilate its coefficients. With a `support`, the
        numbers of monomials and of all their divisors, only these have columns. Raises NoPoint.
        """
        points = self.orbit(count)
        period = len(points) if len(points) < count else None
        layers = _layers(self.dim, degree) if support is None else _layers_of(self.dim, degree, support)
        return [_products(x, layers, self.prime) for x in points], points[0], period

    def moved(self, x: Point, image: Point, degree: int, by: tuple[int, int] = (1, 1)) -> tuple[Values, Values]:
        """The values of all monomials up to a degree at a point, and a step later; each times its number of `by`."""
        layers, p = _layers(self.dim, degree), self.prime
        return _products(x, layers, p, by[0]), _products(image, layers, p, by[1])


class ModularFlow(ModularMap):
    """The flow of a field modulo `prime`, at the residues `values` of its symbols; a step is x -> x + f(x).

    It stands in the place of a map: its integrals are found by the same searches. A solution x(t) is a power series,
    and the coefficients of P(x(t)) are what the values P(x_n) are along the orbit of a map: P vanishes along the
    solution if so many of them are 0. And where a search for maps compares P at a point and at its image, here P + P'
    stands for the second, P' = f . grad P: what is linear in both, as P(x~) - P(x) and P(x~) Q(x) - P(x) Q(x~) are,
    becomes the same of P' and Q'.

    Raises BadPrime where the prime divides denominators.
    """

    def __init__(self, field: PolynomialField, prime: int, values: Sequence[int] = (), seed: int = 0) -> None:
        # There is no map, and nothing of one is set up.
        self.prime, self.eps, self.dim, self.values = prime, 1, field.dim, tuple(values)
        self.rng = random.Random(f"flow {seed} {prime} {self.values}")
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

    def _terms(self, polynomial: fmpq_mpoly) -> list[tuple[int, int]]:
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


@cache
def exponents_up_to(dim: int, degree: int) -> tuple[tuple[int, ...], ...]:
    """The exponents of all monomials of degree at most `degree`, by increasing degree."""
    return tuple(m for k in range(degree + 1) for m in monomials(dim, k))


@cache
def places_of(dim: int, degree: int) -> dict[Exponent, int]:
    """The number of each monomial among `exponents_up_to` the degree."""
    return {exponent: k for k, exponent in enumerate(exponents_up_to(dim, degree))}


@cache
def monomial_tables(dim: int, degree: int) -> list[list[tuple[int, int, int]]]:
    """For each monomial (variable, exponent, place of the monomial with one factor less), of all its variables."""
    places = places_of(dim, degree)
    return [
        [(k, e, places[(*exponent[:k], e - 1, *exponent[k + 1 :])]) for k, e in enumerate(exponent) if e]
        for exponent in places
    ]


def _layers_of(dim: int, degree: int, support: Sequence[int]) -> list[list[tuple[int, int]]]:
    """(variable, place of the monomial without it) for monomials with these numbers, those of each degree together."""
    exponents, tables = exponents_up_to(dim, degree), monomial_tables(dim, degree)
    places = {number: place for place, number in enumerate(support)}
    layers: list[list[tuple[int, int]]] = [[] for _ in range(degree)]
    for number in support:
        if number:
            variable, _, without = tables[number][-1]
            layers[sum(exponents[number]) - 1].append((variable, places[without]))
    return layers


@cache
def _layers(dim: int, degree: int) -> list[list[tuple[int, int]]]:
    return _layers_of(dim, degree, range(len(exponents_up_to(dim, degree))))


def monomial_values(point: Point, degree: int, prime: int) -> list[int]:
    """The values of all monomials of degree at most `degree` at a point modulo a prime."""
    values = _products(point, _layers(len(point), degree), prime)
    count(len(values) / 8)
    return list(map(int, values))


def _products(point: Point, layers: Sequence[Sequence[tuple[int, int]]], prime: int, factor: int = 1) -> Values:
    x, table = [nmod(entry, prime) for entry in point], [nmod(factor, prime)]
    for layer in layers:
        table += [table[place] * x[variable] for variable, place in layer]
    count(len(table) / 10)
    return table


def gradient_values(vector: Sequence[int], point: Point, degree: int, prime: int) -> tuple[int, list[int]]:
    """The value and the gradient at a point of the polynomial of degree at most `degree` with these coefficients."""
    value, gradient = 0, [0] * len(point)
    powers = monomial_values(point, degree, prime)
    count(len(vector) / 20 + 0.75 * sum(map(bool, vector)))
    for coefficient, slopes, power in zip(vector, monomial_tables(len(point), degree), powers, strict=True):
        if coefficient:  # most are 0
            value += coefficient * power
            for variable, exponent, place in slopes:
                gradient[variable] = (gradient[variable] + coefficient * exponent * powers[place]) % prime
    return value % prime, gradient


def slope_values(point: Point, degree: int, prime: int) -> list[list[int]]:
    """The partial derivatives of all monomials of degree at most `degree` at a point: a row a variable."""
    powers = monomial_values(point, degree, prime)
    rows = [[0] * len(powers) for _ in point]
    count(len(point) * len(powers) / 5)
    for k, slopes in enumerate(monomial_tables(len(point), degree)):
        for variable, exponent, place in slopes:
            rows[variable][k] = exponent * powers[place] % prime
    return rows


def product_of(P: Sequence[int], Q: Sequence[int], dim: int, degree: int, prime: int) -> list[int] | None:
    """The coefficients of a product of polynomials, up to the degree; None where its degree is higher.

    The first ones suffice for a factor of a lower degree: the others are 0.
    """
    exponents, places = exponents_up_to(dim, degree), places_of(dim, degree)
    row = [0] * len(exponents)
    count(len(exponents) / 10 + 1.5 * sum(map(bool, P)) * sum(map(bool, Q)))
    for a, p in zip(exponents, P, strict=False):
        if p:
            for b, q in zip(exponents, Q, strict=False):
                if q:
                    place = places.get(tuple(i + j for i, j in zip(a, b, strict=True)))
                    if place is None:
                        return None
                    row[place] = (row[place] + p * q) % prime
    return row


def interpolated(nodes: Sequence[int], values: Sequence[int], prime: int) -> nmod_poly:
    """The polynomial modulo a prime that has these values at different nodes, of a degree below their number."""
    table = list(values)
    count(len(nodes) ** 2 / 2)
    inverse = cache(lambda difference: pow(difference, -1, prime))
    for k in range(1, len(nodes)):  # Newton's divided differences
        for i in range(len(nodes) - 1, k - 1, -1):
            table[i] = (table[i] - table[i - 1]) * inverse(nodes[i] - nodes[i - k]) % prime
    P = nmod_poly([0], prime)
    for node, c in zip(reversed(nodes), reversed(table), strict=True):
        P = P * nmod_poly([-node % prime, 1], prime) + nmod_poly([c], prime)
    return P


def slopes(function: RationalFunction, field: Any, place: Sequence[Any], n: int) -> list[Any]:
    """The gradient of N/D in the first n variables, times D^2."""
    N, D = (evaluate(part, field, place) for part in (function.numerator, function.denominator))
    upper, lower = (gradient(part)[:n] for part in (function.numerator, function.denominator))
    return [evaluate(a, field, place) * D - evaluate(b, field, place) * N for a, b in zip(upper, lower, strict=True)]


class Independent:
    """The gradients of independent functions at one random point modulo a prime: what depends on them does not count.

    `rows` are multiples of the gradients of those that were added.
    """

    def __init__(self, map_: ModularMap, functions: Sequence[RationalFunction] = ()) -> None:
        self.map, self.point = map_, map_.random_point()
        self.rows = [self.gradient(function) for function in functions]

    def gradient(self, function: RationalFunction) -> list[int]:
        """A multiple of the gradient of a function of (variables, symbols, eps) with respect to the variables."""
        field = GF(self.map.prime)
        place = [field.convert(c) for c in (*self.point, *self.map.values, self.map.eps)]
        return [int(entry) for entry in slopes(function, field, place, self.map.dim)]

    def adds(self, row: list[int]) -> bool:
        """Whether a gradient is no combination of the others; nothing is added."""
        return rank([*self.rows, row], self.map.prime) > len(self.rows)

    def add(self, row: list[int]) -> bool:
        """Add a gradient that is no combination of the others, and say whether it is none."""
        if not self.adds(row):
            return False
        self.rows.append(row)
        return True
