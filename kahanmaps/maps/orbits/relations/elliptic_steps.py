"""Steps along an orbit on an elliptic curve: its coordinates are forms in the terms of two Somos sequences.

Where a map moves the points of an elliptic curve by T, coordinates at step n are sections of a line bundle of degree d
at P + n T. They are forms with rational coefficients, the same for all n, in terms near n of the sequences W and U (see
`elliptic_search`), which have 1/d of the length: a step is some short products, and no gcd of long integers. The points
may lie on several curves in turn, as those of maps with several factors do: every `stride` steps of factors come back
to a curve, and T is what so many steps do. Maps that give one coordinate after the other have a sequence U for each
that is new, of lower degree than for all together.

Nothing is believed. The equation of a step, put into such forms, is a section as well, of a degree that is known. The
forms are the points of the orbit at more steps than that, exactly, hence for all n: a section of degree D that is not 0
has at most D zeros. That terms of Somos sequences are values of sigma functions on one curve is a theorem (hone-2005),
and multiples of T are different as long as W(n) is not 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import NamedTuple

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.algebra.residues import from_residues
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import MapOver
from kahanmaps.maps.orbits.integer_point import FractionsPoint, IntegerPoint
from kahanmaps.maps.orbits.relations.elliptic_search import (
    Curve,
    Rows,
    Sections,
    curve,
    exponents,
    forms,
    independent,
    points_needed,
)
from kahanmaps.maps.orbits.relations.somos import Terms, around, first_terms

_MOST_PRIMES = 100
_PRIME = 2**61 - 1
_LEFT_OUT = 3  # steps, where the start is special: as for W(0), terms of U near the beginning may be 0
_FIRST = 2  # the n that forms start with: W(0) is 0

Groups = Sequence[tuple[int, ...]]  # of coordinates that have a denominator in common


class EllipticSteps:
    """The steps of an orbit, of which the sequences leave out some at the beginning.

    `places` has, for the curves in turn, a row with the Coordinates of each group, or the number of the group that it
    was one step before.
    """

    name = "Somos sequences along the orbit"

    def __init__(self, map_over: MapOver, places: Sequence[Sequence[Coordinates | int]], left_out: int = 0) -> None:
        self._map, self._places, self._left_out = map_over, places, left_out
        self._residue: list[int] | None = None
        self._known: dict[tuple[int, int], list[fmpz]] = {}

    def step(self, last: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """The point with this number, which comes after the last one; None where the forms do not give it."""
        if not self._has_value(last[-1]):
            return None
        done = (number - self._left_out) * len(self._map.factors)
        n = done // len(self._places)
        for key in [key for key in self._known if key[0] < done - len(self._map.factors) * len(self._places[0])]:
            del self._known[key]
        for row in self._places:
            for one in row:
                if isinstance(one, Coordinates):
                    one.forget(n // 2 - 4)
        return self.at(done)

    def at(self, number: int) -> IntegerPoint | None:
        """The point after so many steps of factors from the first that is not left out; None where it is not given."""
        try:
            values = [self._value(number, g) for g in range(len(self._places[0]))]
        except ArithmeticError:
            return None
        if len(values) == 1:
            return IntegerPoint(tuple(values[0][:-1]), values[0][-1])
        return FractionsPoint([(p, q) for p, q in values])

    def _value(self, number: int, group: int) -> list[fmpz]:
        """Numerators and denominator of a group. Raises ArithmeticError."""
        key = number, group
        if key not in self._known:
            n, k = divmod(number, len(self._places))
            place = self._places[k][group]
            self._known[key] = self._value(number - 1, place) if isinstance(place, int) else place.at(n)
        return self._known[key]

    def _has_value(self, point: IntegerPoint) -> bool:
        """Whether the map is sure to have a value there: modulo a prime, by an orbit that goes along."""
        if self._residue is None:
            self._residue = residue(point, _PRIME)
        self._residue = self._residue and image_modulo(self._map, self._residue, _PRIME)
        return self._residue is not None


class Coordinates:
    """A group of coordinates on one curve: `forms` has a row for each of them, the last one for their denominator."""

    def __init__(self, degree: int, forms: fmpz_mat, W: Terms, U: Terms, primes: fmpz) -> None:
        self._degree, self._forms, self._W, self._U, self._primes = degree, forms, W, U, primes
        self._exponents = exponents(degree)

    def at(self, n: int) -> list[fmpz]:
        """Numerators and denominator in lowest terms, for n >= 2. Raises ArithmeticError where it or a term is 0."""
        W, U = self._W, self._U
        ratio, part = U.ratio(n), W.part(n)
        weights = primitive_integers(tuple(ratio**k * part**j for k, _, j in self._exponents))
        first, second = U.integer(n), U.integer(n + 1) * W.integer(n - 1)
        here, (square, outer) = W.integer(n), W.pair(n)
        first, second = (first, second * here) if self._degree % 2 else (first * here, second)
        powers = {(i, j): square**i * outer**j for _, i, j in self._exponents}
        column = [
            weight * (second if k else first) * powers[i, j]
            for weight, (k, i, j) in zip(weights, self._exponents, strict=True)
        ]
        values: list[fmpz] = (self._forms * fmpz_mat(len(column), 1, column)).entries()
        if values[-1] == 0:
            raise ZeroDivisionError
        common = self._primes.gcd(values[-1] % self._primes)
        while common != 1:
            common = reduce(lambda g, value: g if g == 1 else g.gcd(value % g), values, common)
            values = [value // common for value in values]
            common = common.gcd(values[-1] % common)
        return [-value for value in values] if values[-1] < 0 else values

    def forget(self, n: int) -> None:
        """Keep no terms of this number."""
        self._W.forget(n)
        self._U.forget(n)


def elliptic_steps(map_over: MapOver, start: IntegerPoint) -> EllipticSteps | None:
    """The steps of the orbit from a start; None where it is not known to lie on elliptic curves."""
    first: IntegerPoint | None = start
    for left_out in (0, _LEFT_OUT):
        for _ in range(left_out):
            first = first and map_over.integer_step(first)
        if first is None:
            break
        is_special = False
        for stride in (len(map_over.factors), 2 * len(map_over.factors)):
            search = _Search(map_over, first, stride)
            try:
                numbers = search.found()
                exact = None if numbers is None else _Exact(search, numbers)
            except ArithmeticError:
                is_special = True
                continue
            if exact is not None and _is_proved(map_over, first, search, exact.steps()):
                return exact.steps(left_out)
        if not is_special:
            break
    return None


class Numbers(NamedTuple):
    """What determines the forms of a group: H, y(2), y(3), and the rows of coefficients, one after the other."""

    H: fmpq
    y: fmpq
    z: fmpq
    coefficients: tuple[fmpq, ...]


class _Search:
    """For each curve and each group that is new on it how sections are made, and the numbers of the forms.

    `earlier` has, for the curves in turn, what each group was one step before, None where it is new.
    """

    def __init__(self, map_over: MapOver, start: IntegerPoint, stride: int) -> None:
        self.map, self._start, self.stride = map_over, start, stride
        n, factors = map_over.dim, map_over.factors
        is_one_by_one = all(one.integer_steps.is_one_by_one for one in factors)
        self.groups: Groups = [(i,) for i in range(n)] if is_one_by_one else [tuple(range(n))]
        self.earlier = [
            _copies(factors[(k - 1) % len(factors)].equation) if is_one_by_one else [None] for k in range(stride)
        ]
        self.new = [(k, g) for k, row in enumerate(self.earlier) for g, copied in enumerate(row) if copied is None]
        self.sections: dict[tuple[int, int], Sections] = {}

    def found(self) -> dict[tuple[int, int], Numbers] | None:
        """The numbers; None where there are none, or they are too long."""
        found = from_residues(self._modulo, _MOST_PRIMES) if self.new else None
        if found is None:
            return None
        rows = [Numbers(found[k][0], found[k + 1][0], found[k + 2][0], found[k + 3]) for k in range(0, len(found), 4)]
        return dict(zip(self.new, rows, strict=True))

    def degree(self, k: int, group: int) -> int:
        """That of a group on a curve."""
        copied = self.earlier[k][group]
        return self.sections[k, group].degree if copied is None else self.degree((k - 1) % self.stride, copied)

    def _modulo(self, prime: int) -> list[list[int]] | None:
        size, known = len(self.groups[0]), self.sections
        for needed in [max(one.points_used(size) for one in known.values())] if known else points_needed(size):
            points = self._residues(prime, self.stride * needed)
            if points is None:
                return None
            try:
                curves = self._curves(points, prime)
            except ArithmeticError:
                if known or needed == points_needed(size)[-1]:
                    raise
                continue
            if curves is not None:
                self.sections = {place: one.sections for place, one in curves.items()}
                return [group for one in curves.values() for group in one.numbers]
        return None

    def _curves(self, points: Rows, prime: int) -> dict[tuple[int, int], Curve] | None:
        found = {}
        for k, g in self.new:
            chosen = [[*(point[i] for i in self.groups[g]), 1] for point in points[k :: self.stride]]
            one = curve(chosen, prime, self.sections.get((k, g)))
            if one is None:
                return None
            found[k, g] = one
        return found

    def _residues(self, prime: int, length: int) -> Rows | None:
        """So many points from the start on modulo a prime, one for each step of a factor."""
        factors = self.map.factors
        point = residue(self._start, prime)
        points: Rows = []
        while point is not None and len(points) < length:
            points.append(point)
            point = image_modulo(factors[(len(points) - 1) % len(factors)], point, prime)
        return points if len(points) == length else None


def _copies(equation: Equation) -> list[int | None]:
    """Of each coordinate of the image which coordinate of the point it is; None for one that is new."""
    n = equation.dim
    found: list[int | None] = [None] * n
    for row in equation.terms:
        unknowns = [j for j in range(n) if row[j]]
        if len(unknowns) == 1 and len(row[unknowns[0]]) == len(row[n]) == 1:
            ((k, a),), ((m, b),) = row[unknowns[0]], row[n]
            change = [y - x for x, y in zip(equation.exponents[k], equation.exponents[m], strict=True)]
            if a == -b and sorted(change) == [-1] + [0] * (n - 1) + [1] and change[n] == -1:
                found[unknowns[0]] = change.index(1)
    return found


def _is_proved(map_over: MapOver, start: IntegerPoint, search: _Search, steps: EllipticSteps) -> bool:
    """Whether the forms are the points of the orbit at so many steps that they are at all of them."""
    factors, stride = map_over.factors, search.stride
    most = 0
    for k in range(stride):
        degrees = factors[k % len(factors)].equation.exponents
        most = max(
            most,
            sum(
                max(sum(exponent[i] for i in group) for exponent in degrees) * search.degree(k, g)
                + search.degree((k + 1) % stride, g)
                for g, group in enumerate(search.groups)
            ),
        )
    point = start
    for number in range((_FIRST + map_over.dim + most + 2) * stride):
        if number >= (_FIRST + map_over.dim) * stride and steps.at(number) != point:
            return False
        image = factors[number % len(factors)].integer_steps.step(point)
        if image is None:
            return False
        point = image
    return True


class _Exact:
    """Sequences and forms over Q from the numbers of each group."""

    def __init__(self, search: _Search, numbers: dict[tuple[int, int], Numbers]) -> None:
        self._search = search
        size = len(search.groups[0]) + 1
        self._tables = {
            place: fmpz_mat(size, search.sections[place].degree, primitive_integers(one.coefficients))
            for place, one in numbers.items()
        }
        found = {place: first_terms(one.H, one.y, one.z) for place, one in numbers.items()}
        self._W, *others = (W for W, _ in found.values())
        if any(other != self._W for other in others):
            raise ArithmeticError("the curves differ")
        self._U = {place: U for place, (_, U) in found.items()}
        at_0 = [around(U, 0, self._W)[0] for U in self._U.values()]
        if 0 in at_0:
            raise ArithmeticError("the start is special")
        self._primes = fmpz(1)
        for number in (*self._W, *(term for U in self._U.values() for term in U), *at_0):
            self._primes = self._primes.lcm(number.p).lcm(number.q)
        self._all_primes = {}
        for place, U in self._U.items():
            bound = _bound(search.sections[place].degree, self._tables[place], self._W, U)
            self._all_primes[place] = self._primes.lcm(bound.p).lcm(bound.q)

    def steps(self, left_out: int = 0) -> EllipticSteps:
        """The steps; the numbers are those of the orbit without its first points, so many."""
        primes, sections = self._primes, self._search.sections
        W = Terms(self._W, primes)
        new = {
            place: Coordinates(
                sections[place].degree, self._tables[place], W, Terms(U, primes, W), self._all_primes[place]
            )
            for place, U in self._U.items()
        }
        places = [
            [new[k, g] if copied is None else copied for g, copied in enumerate(row)]
            for k, row in enumerate(self._search.earlier)
        ]
        return EllipticSteps(self._search.map, places, left_out)


def _bound(degree: int, table: fmpz_mat, W: list[fmpq], U: list[fmpq]) -> fmpq:
    """A number in which all primes stand that all coordinates may have in common at one n. Raises ArithmeticError.

    A common prime of all coordinates is one of all products of a coordinate and a section psi(n) that depends on n T
    alone. Where these products span the forms of their degree, the index of what they span has all such primes, as
    those forms have none in common beyond the primes of the first terms.
    """
    for more in (0, *range(2, degree + 1)):
        length = degree + more
        if table.nrows() * max(more, 1) < length:
            continue
        basis, products = [], []
        terms = around(W, length // 2 + 3), around(U, length // 2 + 3, W)
        for n in range(-(length // 2), length - length // 2):
            values = (fmpq_mat(table) * fmpq_mat(degree, 1, forms(degree, *terms, n))).entries()
            basis.append(forms(length, *terms, n))
            products.append([value * psi for value in values for psi in _of_multiples(more, terms[0], n)])
        residues = [[int(x.p % _PRIME) * pow(int(x.q), -1, _PRIME) % _PRIME for x in row] for row in products]
        pivots = independent(residues, _PRIME)
        if len(pivots) == length:
            chosen = fmpq_mat([[row[k] for k in pivots] for row in products])
            return chosen.det() / fmpq_mat(basis).det()
    raise ArithmeticError("coordinates have zeros in common")


def _of_multiples(degree: int, W: Mapping[int, fmpq], n: int) -> list[fmpq]:
    """A basis of the sections of a degree other than 1 whose zeros have the sum 0."""
    square, outer, third = W[n] * W[n], W[n + 1] * W[n - 1], W[n - 1] ** 2 * W[n + 2]

    def even(top: int) -> list[fmpq]:
        return [square ** (top - j) * outer**j for j in range(top + 1)]

    half, odd = divmod(degree, 2)
    if odd:
        return [W[n] * value for value in even(half)] + [third * value for value in even(half - 1)]
    return even(half) + [third * W[n] * value for value in even(half - 2)]


def residue(point: IntegerPoint, prime: int) -> list[int] | None:
    """The point modulo a prime, with 1 behind its coordinates; None where the prime divides its denominator."""
    below = int(point.denominator % prime)
    if not below:
        return None
    inverse = pow(below, -1, prime)
    return [*(int(entry * inverse % prime) for entry in point.numerators), 1]


def image_modulo(map_over: MapOver, point: list[int], prime: int) -> list[int] | None:
    """The image of such a point, None where there is none."""
    for one in map_over.factors:
        both = one.integer_steps.residues(IntegerPoint(tuple(map(fmpz, point[:-1])), fmpz(1)), prime, 2)
        if both is None:
            return None
        point = both[1]
    return point
