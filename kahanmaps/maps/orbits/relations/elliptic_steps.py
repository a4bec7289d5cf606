"""Steps along an orbit on an elliptic curve: its coordinates are forms in the terms of two Somos sequences.

Where a map moves the points of an elliptic curve by T, coordinates at step n are sections of a line bundle of degree d
at P + n T. They are forms with rational coefficients, the same for all n, in terms near n of the sequences W and U (see
`elliptic_search`), which have 1/d of the length: a step is some short products, one division by a term of each
sequence, and no gcd of long integers. All the points may lie on several curves in turn, as those of maps with several
factors do: every `stride` steps come back to a curve, and T is what so many steps do.

Nothing is believed. The equation of a step, put into such forms, is a section as well, of a degree that is known. The
forms are the points of the orbit at more steps than that, exactly, hence for all n: a section of degree D that is not 0
has at most D zeros. That terms of Somos sequences are values of sigma functions on one curve is a theorem (hone-2005),
and multiples of T are different as long as W(n) is not 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import reduce
from itertools import accumulate

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.algebra.residues import from_residues
from kahanmaps.maps.implicit import MapOver
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.elliptic_search import (
    Sections,
    curve,
    exponents,
    forms,
    points_needed,
    sequences,
)
from kahanmaps.maps.orbits.relations.somos import Somos

_MOST_PRIMES = 100
_PRIME = 2**61 - 1
_FIRST = 2  # the n that sequences start with: W(0) is 0


class EllipticSteps:
    """The steps of an orbit from its beginning; `coordinates` are those on the curves in turn."""

    name = "Somos sequences along the orbit"

    def __init__(self, map_over: MapOver, W: Somos, coordinates: Sequence[Coordinates]) -> None:
        self._map, self._W, self._coordinates = map_over, W, coordinates
        self._n = _FIRST
        self._parts = len(map_over.factors)

    def step(self, last: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """The point with this number, which comes after the last one; None where the forms do not give it."""
        return self.at(number * self._parts) if _is_regular(self._map, last[-1]) else None

    def at(self, number: int) -> IntegerPoint | None:
        """The point after so many steps of factors. No number may be less than one before."""
        n, k = divmod(number, len(self._coordinates))
        try:
            while self._n < n:
                for one in self._coordinates:
                    one.advance(self._W)
                self._W.advance()
                self._n += 1
        except ArithmeticError:  # as it is forever after
            return None
        return self._coordinates[k].point(self._W)


class Coordinates:
    """Coordinates on one curve: `forms` has a row for each of them, the last one for their denominator.

    `ratio` is what the primes left out of both sequences make of the second kind of forms, as against the first.
    """

    def __init__(self, degree: int, forms: fmpz_mat, W: Somos, U: Somos, primes: fmpz) -> None:
        self._degree, self._forms, self._U, self._primes = degree, forms, U, primes
        self._exponents = exponents(degree)
        self._ratio = W.scales[0] * U.scales[2] / (W.scales[1] * U.scales[1])

    def point(self, W: Somos) -> IntegerPoint | None:
        """The point at the n of the sequences, in lowest terms; None where the denominator is 0."""
        part = W.parts[0]
        weights = primitive_integers(tuple(self._ratio**k * part**j for k, _, j in self._exponents))
        first, second = self._U.window[1], self._U.window[2] * W.window[0]
        first, second = (first, second * W.window[1]) if self._degree % 2 else (first * W.window[1], second)
        powers = {(i, j): W.square**i * W.outer**j for i, j in {(i, j) for _, i, j in self._exponents}}
        values = [
            weight * (second if k else first) * powers[i, j]
            for weight, (k, i, j) in zip(weights, self._exponents, strict=True)
        ]
        *numerators, denominator = (self._forms * fmpz_mat(len(values), 1, values)).entries()
        if denominator == 0:
            return None
        common = self._primes.gcd(denominator % self._primes)
        while common != 1:
            common = reduce(lambda g, value: g if g == 1 else g.gcd(value % g), numerators, common)
            numerators, denominator = [value // common for value in numerators], denominator // common
            common = common.gcd(denominator % common)
        sign = -1 if denominator < 0 else 1
        return IntegerPoint(tuple(sign * value for value in numerators), sign * denominator)

    def advance(self, W: Somos) -> None:
        """n + 1 for n, before W does so."""
        self._ratio *= self._U.parts[1] / W.parts[0]
        self._U.advance()


def elliptic_steps(map_over: MapOver, start: IntegerPoint) -> EllipticSteps | None:
    """The steps of the orbit from a start; None where it is not known to lie on elliptic curves."""
    parts = len(map_over.factors)
    for stride in (parts, 2 * parts):
        search = _Search(map_over, start, stride)
        numbers = search.found()
        if numbers is None:
            continue
        with suppress(ArithmeticError):  # ZeroDivisionError is one
            exact = _Exact(search.sections, numbers)
            if _is_proved(map_over, start, search.sections, exact.steps(map_over)):
                return exact.steps(map_over)
    return None


def _is_proved(map_over: MapOver, start: IntegerPoint, sections: Sequence[Sections], steps: EllipticSteps) -> bool:
    """Whether the forms are the points of the orbit at so many steps that they are at all of them."""
    factors, stride = map_over.factors, len(sections)
    most = max(
        sum(one.equation.exponents[0]) * sections[k].degree + sections[(k + 1) % stride].degree
        for k, one in enumerate(factors * (stride // len(factors)))
    )
    point = start
    for number in range((_FIRST + most + 2) * stride):
        if number >= _FIRST * stride and steps.at(number) != point:
            return False
        image = factors[number % len(factors)].integer_steps.step(point)
        if image is None:
            return False
        point = image
    return True


class _Exact:
    """Sequences and forms over Q from the numbers of each curve."""

    def __init__(self, sections: Sequence[Sections], numbers: Sequence[Sequence[fmpq]]) -> None:
        self._degrees = [one.degree for one in sections]
        self._H = numbers[0][0]
        most = 2 * max(self._degrees) + 8
        self._sequences = [sequences(H, y, z, most) for H, y, z, *_ in numbers]
        self._rows = [primitive_integers(tuple(rows)) for _, _, _, *rows in numbers]

    def steps(self, map_over: MapOver) -> EllipticSteps:
        """The steps, from the beginning. Raises ArithmeticError where something is special."""
        W = self._sequences[0][0]
        if any(other != W for other, _ in self._sequences):
            raise ArithmeticError("the curves differ")
        size = map_over.dim + 1
        tables = [fmpz_mat(size, len(rows) // size, rows) for rows in self._rows]
        primes = fmpz(1)
        for term in (self._H, *W[1:5], *(term for _, U in self._sequences for term in U[1:5])):
            primes = primes.lcm(term.p).lcm(term.q)
        for degree, table, (_, U) in zip(self._degrees, tables, self._sequences, strict=True):
            bound = _bound(degree, table, W, U)
            primes = primes.lcm(bound.p).lcm(bound.q)
        alpha, beta = self._H**2, -(self._H**3)
        first = slice(_FIRST - 1, _FIRST + 3)
        whole = Somos(W[first], alpha, beta, primes)
        coordinates = [
            Coordinates(degree, table, whole, Somos(U[first], alpha, beta, primes), primes)
            for degree, table, (_, U) in zip(self._degrees, tables, self._sequences, strict=True)
        ]
        return EllipticSteps(map_over, whole, coordinates)


def _bound(degree: int, table: fmpz_mat, W: list[fmpq], U: list[fmpq]) -> fmpq:
    """A number in which all primes stand that all coordinates may have in common at one n.

    A common prime of all coordinates is one of all products of a coordinate and a section psi(n) that depends on n T
    alone. Where these products span the forms of their degree, the index of what they span has all such primes, as
    those forms have none in common beyond the primes of the first terms.
    """
    for more in (0, *range(2, degree + 1)):
        length = degree + more
        basis, products = [], []
        for n in range(_FIRST, _FIRST + length):
            values = (fmpq_mat(table) * fmpq_mat(degree, 1, forms(degree, W, U, n))).entries()
            basis.append(forms(length, W, U, n))
            products.append([value * psi for value in values for psi in _of_multiples(more, W, n)])
        reduced, rank = fmpq_mat(products).rref()
        if rank == length:
            pivots = [next(k for k in range(reduced.ncols()) if reduced[i, k]) for i in range(rank)]
            chosen = fmpq_mat([[row[k] for k in pivots] for row in products])
            return chosen.det() / fmpq_mat(basis).det()
    raise ArithmeticError("coordinates have zeros in common")


def _of_multiples(degree: int, W: list[fmpq], n: int) -> list[fmpq]:
    """A basis of the sections of a degree other than 1 whose zeros have the sum 0."""
    square, outer, third = W[n] * W[n], W[n + 1] * W[n - 1], W[n - 1] ** 2 * W[n + 2]

    def even(top: int) -> list[fmpq]:
        return [square ** (top - j) * outer**j for j in range(top + 1)]

    half, odd = divmod(degree, 2)
    if odd:
        return [W[n] * value for value in even(half)] + [third * value for value in even(half - 1)]
    return even(half) + [third * W[n] * value for value in even(half - 2)]


class _Search:
    """For each curve how its sections are made, and H, y(2), y(3) and coefficients: residues, then numbers."""

    def __init__(self, map_over: MapOver, start: IntegerPoint, stride: int) -> None:
        self._map, self._start, self._stride = map_over, start, stride
        self.sections: list[Sections] = []
        self._sizes: list[int] = []

    def found(self) -> list[Sequence[fmpq]] | None:
        """The numbers of each curve; None where there are none, or they are too long."""
        numbers = from_residues(self._modulo, _MOST_PRIMES)
        if numbers is None:
            return None
        ends = accumulate(self._sizes)
        return [numbers[end - size : end] for size, end in zip(self._sizes, ends, strict=True)]

    def _modulo(self, prime: int) -> list[int] | None:
        dim = self._map.dim
        needed = max(one.points_used(dim) for one in self.sections) if self.sections else points_needed(dim)
        points = list(_residues(self._map, self._start, prime, self._stride * needed))
        if len(points) < self._stride * needed:
            return None
        found = []
        for k in range(self._stride):
            one = curve(points[k :: self._stride], prime, self.sections[k] if self.sections else None)
            if one is None:
                return None
            found.append(one)
        self.sections, self._sizes = [one.sections for one in found], [len(one.numbers) for one in found]
        return [entry for one in found for entry in one.numbers]


def _residues(map_over: MapOver, point: IntegerPoint, prime: int, length: int) -> Iterator[list[int]]:
    """The points from this one on modulo a prime, one for each step of a factor; ends where there is none."""
    below = int(point.denominator % prime)
    if not below:
        return
    inverse = pow(below, -1, prime)
    here = [*(int(entry * inverse % prime) for entry in point.numerators), 1]
    yield here
    for number in range(length - 1):
        steps = map_over.factors[number % len(map_over.factors)].integer_steps
        both = steps.residues(IntegerPoint(tuple(map(fmpz, here[:-1])), fmpz(1)), prime, 2)
        if both is None:
            return
        here = both[1]
        yield here


def _is_regular(map_over: MapOver, point: IntegerPoint) -> bool:
    """Whether the map is sure to have a value there: modulo a prime."""
    length = len(map_over.factors) + 1
    return len(list(_residues(map_over, point, _PRIME, length))) == length
