"""Orbits on elliptic curves: their coordinates are forms in the terms of two Somos sequences, and this is proved.

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

from collections.abc import Sequence
from itertools import cycle, islice
from typing import NamedTuple

from flint import fmpq, fmpz, fmpz_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.algebra.residues import from_residues
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import ElementaryMap, Map
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.elliptic_search import Curve, Rows, Sections, curve, points_needed
from kahanmaps.maps.orbits.relations.elliptic_steps import Coordinates, EllipticSteps
from kahanmaps.maps.orbits.relations.forms import common_primes
from kahanmaps.maps.somos import Integers, Terms, around, first_terms

_MOST_PRIMES = 100
_BITS_FOR_A_PRIME = 100  # of points: numbers are to be shorter
_MOST_FACTORS = 8
_LEFT_OUT = 3  # steps, where the start is special: as for W(0), terms of U near the beginning may be 0
_FIRST = 2  # the least n of forms

Groups = Sequence[tuple[int, ...]]  # of coordinates that have a denominator in common


class TooLongRelation(Exception):
    """The orbit lies on elliptic curves, but numbers of its forms are too long to be found yet."""


def elliptic_steps(map_over: Map, start: IntegerPoint, bits: int) -> EllipticSteps | None:
    """The steps of the orbit from a start; None where it is not known to lie on elliptic curves.

    No numbers are looked for that are not much shorter than points with so many bits. Raises TooLong where there are
    some that would be looked for along longer points.
    """
    unit = _unit(map_over.factors)
    most_primes = min(_MOST_PRIMES, bits // _BITS_FOR_A_PRIME)
    first: IntegerPoint | None = start
    for left_out in (0, _LEFT_OUT) if len(unit) <= _MOST_FACTORS else ():
        for _ in range(left_out):
            first = first and map_over.integer_step(first)
        if first is None:
            break
        is_special = False
        for stride in (len(unit), 2 * len(unit)):
            search = _Search(unit, first, stride)
            try:
                numbers = search.found(most_primes)
                exact = None if numbers is None else _Exact(search, numbers)
            except ArithmeticError:
                is_special = True
                continue
            if exact is not None and _is_proved(first, search, exact.steps(map_over)):
                return exact.steps(map_over, left_out)
            if search.sections:  # there are numbers, but they are too long
                if most_primes < _MOST_PRIMES:
                    raise TooLongRelation
                return None
        if not is_special:
            break
    return None


def _unit(factors: Sequence[ElementaryMap]) -> Sequence[ElementaryMap]:
    """The first ones, of which the others are repetitions."""
    count = len(factors)
    return next(
        factors[:k]
        for k in range(1, count + 1)
        if count % k == 0 and all(one is factors[i % k] for i, one in enumerate(factors))
    )


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

    def __init__(self, factors: Sequence[ElementaryMap], start: IntegerPoint, stride: int) -> None:
        self.factors, self._start, self.stride = factors, start, stride
        n = factors[0].dim
        self.groups: Groups = [tuple(range(n))]
        self.earlier: list[list[int | None]] = [[None]] * stride
        if all(one.integer_steps.is_triangular for one in factors):
            # Each coordinate is to be new some steps ago, and not one that is moved around for ever.
            earlier = [_copies(factors[(k - 1) % len(factors)].equation) for k in range(stride)]
            left = [(k, i) for k in range(stride) for i in range(n)]
            for _ in range(stride * n):
                left = [((k - 1) % stride, g) for k, i in left if (g := earlier[k][i]) is not None]
            if not left:
                self.groups, self.earlier = [(i,) for i in range(n)], earlier
        self.new = [(k, g) for k, row in enumerate(self.earlier) for g, copied in enumerate(row) if copied is None]
        self.sections: dict[tuple[int, int], Sections] = {}

    def found(self, most_primes: int = _MOST_PRIMES) -> dict[tuple[int, int], Numbers] | None:
        """The numbers; None where there are none, or they are too long."""
        found = from_residues(self._modulo, most_primes)
        if found is None:
            return None
        rows = [Numbers(found[k][0], found[k + 1][0], found[k + 2][0], found[k + 3]) for k in range(0, len(found), 4)]
        return dict(zip(self.new, rows, strict=True))

    @property
    def first(self) -> int:
        """The steps of factors from which on there are forms, W(0) being 0, and what they were some steps before."""
        return (_FIRST + self.factors[0].dim) * self.stride

    def degree(self, k: int, group: int) -> int:
        """That of a group on a curve."""
        copied = self.earlier[k][group]
        return self.sections[k, group].degree if copied is None else self.degree((k - 1) % self.stride, copied)

    def _modulo(self, prime: int) -> list[list[int]] | None:
        size, known = len(self.groups[0]), self.sections
        for needed in [max(one.points_used for one in known.values())] if known else points_needed(size):
            points: Rows = []  # from the start on, one for each step of a factor
            point = self._start.residues(prime)
            for one in islice(cycle(self.factors), self.stride * needed):
                if point is None:
                    return None
                points.append(point)
                point = one.integer_steps.image_modulo(point, prime)
            curves: dict[tuple[int, int], Curve] = {}
            try:
                for k, g in self.new:
                    chosen = [[*(point[i] for i in self.groups[g]), 1] for point in points[k :: self.stride]]
                    found = curve(chosen, prime, known.get((k, g)))
                    if found is None:
                        break
                    curves[k, g] = found
                else:
                    self.sections = {place: one.sections for place, one in curves.items()}
                    return [group for one in curves.values() for group in one.numbers]
            except ArithmeticError:
                if known or needed == points_needed(size)[-1]:
                    raise
        return None


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


def _is_proved(start: IntegerPoint, search: _Search, steps: EllipticSteps) -> bool:
    """Whether the forms are the points of the orbit at so many steps that they are at all of them."""
    factors, stride = search.factors, search.stride
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
    for number in range(search.first + (most + 2) * stride):
        if number >= search.first and steps.at(number) != point:
            return False
        image = factors[number % len(factors)].integer_steps.step(point)
        if image is None:
            return False
        point = image
    # Otherwise the steps would not be at different multiples of T.
    return all(steps.multiples.integer(n) != 0 for n in range(1, search.first // stride + most + 2))


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
            bound = common_primes(search.sections[place].degree, self._tables[place], self._W, U)
            self._all_primes[place] = self._primes.lcm(bound.p).lcm(bound.q)

    def steps(self, map_over: Map, left_out: int = 0) -> EllipticSteps:
        """The steps; the numbers are those of the orbit without its first points, so many."""
        numbers, sections = Integers(self._primes), self._search.sections
        W = Terms(self._W, numbers)
        new = {
            place: Coordinates(
                sections[place].degree, self._tables[place], W, Terms(U, numbers, W), self._all_primes[place]
            )
            for place, U in self._U.items()
        }
        places = [
            [new[k, g] if copied is None else copied for g, copied in enumerate(row)]
            for k, row in enumerate(self._search.earlier)
        ]
        return EllipticSteps(map_over, places, self._search.first, left_out)
