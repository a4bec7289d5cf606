"""Orbits on elliptic curves: their coordinates are forms in the terms of two Somos sequences, with a proof.

If a map translates the points of an elliptic curve by T, the coordinates at step n are sections of a line bundle of
degree d at P + n T. They are forms in the terms near n of the sequences W and U (see `elliptic_search`); the
forms have rational coefficients that do not depend on n. Such terms have 1/d of the length of a coordinate, so a step
takes short products, and no gcds of long integers. The points of a composition of several maps may lie alternately on
several curves: after `stride` steps of factors the orbit returns to the same curve, and T is the translation by these
steps. If the equation is triangular, each new coordinate has its own sequence U, of lower degree than a common one.

The forms are proved. Substituted into the equation of a step they give a section of known degree D. They agree with
the points of the orbit, exactly, at more than D steps. A nonzero section of degree D has at most D zeros; hence the
forms give all points. That the terms of Somos sequences are values of sigma functions on one curve is a theorem
(hone-2005), and the multiples n T are different from 0 as long as W(n) is not 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle, islice, product
from typing import NamedTuple

from flint import fmpq, fmpz, fmpz_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.algebra.residues import from_residues
from kahanmaps.maps.implicit import ElementaryMap, Map
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.elliptic_search import Curve, Rows, Sections, curve, points_needed
from kahanmaps.maps.orbits.relations.elliptic_steps import Coordinates, EllipticSteps
from kahanmaps.maps.orbits.relations.sections import common_primes
from kahanmaps.maps.somos import Integers, Terms, around, first_terms

_MAX_PRIMES = 100  # maximal number of primes from which the coefficients are computed
_BITS_PER_PRIME = 100  # bits of the points for each prime: the coefficients must be shorter than the points
_MAX_FACTORS = 8  # maximal length of the shortest sequence of factors that a composition repeats
_SKIPPED_STEPS = 3  # steps skipped at a special initial point: terms of U near the beginning may be 0, like W(0)
_MIN_INDEX = 2  # the least n for which the forms are used

Groups = Sequence[tuple[int, ...]]  # groups of coordinates with a common denominator


class TooLongRelation(Exception):
    """The orbit lies on elliptic curves, but the coefficients of its forms are longer than its points so far."""


def elliptic_steps(
    map_over: Map, start: IntegerPoint, bits: int, prime_limit: int = _MAX_PRIMES
) -> EllipticSteps | None:
    """Search for elliptic curves that contain the orbit of `start`; return the steps of the orbit, or None.

    `bits` is the bit length of the current points; only much shorter coefficients are useful. Raises TooLongRelation if
    the coefficients of a curve are too long now, but may be useful once the points have grown; it is not raised if
    `prime_limit` primes do not suffice to decide this.
    """
    factors = map_over.factors
    period = next(  # the shortest initial sequence of factors whose repetition gives all factors
        factors[:k]
        for k in range(1, len(factors) + 1)
        if len(factors) % k == 0 and all(factor is factors[i % k] for i, factor in enumerate(factors))
    )
    max_primes = min(prime_limit, bits // _BITS_PER_PRIME)
    start_point: IntegerPoint | None = start
    for skipped in (0, _SKIPPED_STEPS) if len(period) <= _MAX_FACTORS else ():
        for _ in range(skipped):
            start_point = start_point and map_over.integer_step(start_point)
        if start_point is None:
            break
        is_special = False
        for stride in (len(period), 2 * len(period)):
            search = _Search(period, start_point, stride)
            try:
                coefficients = search.numbers(max_primes)
                exact_curves = None if coefficients is None else _ExactCurves(search, coefficients)
            except ArithmeticError:
                is_special = True
                continue
            if exact_curves is not None and _is_proved(start_point, search, exact_curves.steps(map_over)):
                return exact_curves.steps(map_over, skipped)
            if search.sections:  # curves exist, but their coefficients are too long
                if max_primes < prime_limit:
                    raise TooLongRelation
                return None
        if not is_special:
            break
    return None


class Numbers(NamedTuple):
    """The numbers H, y = y(2), z = y(3) (elliptic_search.py) and the coefficients (by row) of the forms of a group."""

    H: fmpq
    y: fmpq
    z: fmpq
    coefficients: tuple[fmpq, ...]


class _Search:
    """The search modulo primes for the sections of each curve and each group of coordinates that is new on the curve.

    `earlier` has one row for each of the alternating curves. An entry is None for a new group of coordinates; if the
    group is a copy of a group at the previous step, the entry is the index of that group.
    """

    def __init__(self, factors: Sequence[ElementaryMap], start: IntegerPoint, stride: int) -> None:
        self.factors, self._start, self.stride = factors, start, stride
        n = factors[0].dim
        self.groups: Groups = [tuple(range(n))]
        self.earlier: list[list[int | None]] = [[None]] * stride
        if all(factor.integer_steps.is_triangular for factor in factors):
            # Each coordinate must be new, or equal to one that was new at an earlier step; they must not only permute.
            earlier: list[list[int | None]] = [[None] * n for _ in range(stride)]
            for k, copied_coordinates in enumerate(earlier):
                # For each coordinate of the image that is a copy: the index of the equal coordinate of the point.
                equation = factors[(k - 1) % len(factors)].equation
                for row in equation.terms:
                    unknowns = [j for j in range(n) if row[j]]
                    if len(unknowns) == 1 and len(row[unknowns[0]]) == len(row[n]) == 1:
                        ((left, a),), ((right, b),) = row[unknowns[0]], row[n]  # indices of monomials, coefficients
                        exponent_pairs = zip(equation.exponents[left], equation.exponents[right], strict=True)
                        exponent_change = [y - x for x, y in exponent_pairs]
                        is_copy = sorted(exponent_change) == [-1] + [0] * (n - 1) + [1] and exponent_change[n] == -1
                        if a == -b and is_copy:
                            copied_coordinates[unknowns[0]] = exponent_change.index(1)
            unresolved = list(product(range(stride), range(n)))
            for _ in range(stride * n):
                unresolved = [((k - 1) % stride, g) for k, i in unresolved if (g := earlier[k][i]) is not None]
            if not unresolved:
                self.groups, self.earlier = [(i,) for i in range(n)], earlier
        self.new_groups = [
            (k, g) for k, row in enumerate(self.earlier) for g, copied_group in enumerate(row) if copied_group is None
        ]
        self.sections: dict[tuple[int, int], Sections] = {}

    def numbers(self, max_primes: int = _MAX_PRIMES) -> dict[tuple[int, int], Numbers] | None:
        """Return {(curve, new group): its numbers}; None if no curves exist or `max_primes` primes do not suffice."""
        residues = from_residues(self._numbers_modulo, max_primes)
        if residues is None:
            return None
        rows = [
            Numbers(residues[k][0], residues[k + 1][0], residues[k + 2][0], residues[k + 3])
            for k in range(0, len(residues), 4)
        ]
        return dict(zip(self.new_groups, rows, strict=True))

    @property
    def first(self) -> int:
        """The number of steps of factors after which the forms are used, since W(0) = 0."""
        return (_MIN_INDEX + self.factors[0].dim) * self.stride

    def degree(self, k: int, group: int) -> int:
        """Return the degree of a group of coordinates on a curve."""
        copied_group = self.earlier[k][group]
        return (
            self.sections[k, group].degree if copied_group is None else self.degree((k - 1) % self.stride, copied_group)
        )

    def _numbers_modulo(self, prime: int) -> list[list[int]] | None:
        size, known_sections = len(self.groups[0]), self.sections
        for point_count in (
            [max(sections.points_used for sections in known_sections.values())]
            if known_sections
            else points_needed(size)
        ):
            points: Rows = []  # the initial point, then one point for each step of a factor
            point = self._start.residues(prime)
            for factor in islice(cycle(self.factors), self.stride * point_count):
                if point is None:
                    return None
                points.append(point)
                point = factor.integer_steps.image_modulo(point, prime)
            curves: dict[tuple[int, int], Curve] = {}
            try:
                for k, g in self.new_groups:
                    coordinates = [[*(point[i] for i in self.groups[g]), 1] for point in points[k :: self.stride]]
                    curve_of_group = curve(coordinates, prime, known_sections.get((k, g)))
                    if curve_of_group is None:
                        break
                    curves[k, g] = curve_of_group
                else:
                    self.sections = {key: curve_of_key.sections for key, curve_of_key in curves.items()}
                    return [numbers for curve_of_key in curves.values() for numbers in curve_of_key.numbers]
            except ArithmeticError:
                if known_sections or point_count == points_needed(size)[-1]:
                    raise
        return None


def _is_proved(start: IntegerPoint, search: _Search, steps: EllipticSteps) -> bool:
    """Return whether the forms agree with the orbit at more steps than their degree, and hence at all steps."""
    factors, stride = search.factors, search.stride
    max_degree = 0
    for k in range(stride):
        exponents = factors[k % len(factors)].equation.exponents
        max_degree = max(
            max_degree,
            sum(
                max(sum(exponent[i] for i in group) for exponent in exponents) * search.degree(k, g)
                + search.degree((k + 1) % stride, g)
                for g, group in enumerate(search.groups)
            ),
        )
    point = start
    for number in range(search.first + (max_degree + 2) * stride):
        if number >= search.first and steps.at(number) != point:
            return False
        image = factors[number % len(factors)].integer_steps.step(point)
        if image is None:
            return False
        point = image
    # The steps must belong to pairwise different multiples of T.
    return all(steps.multiples.integer(n) != 0 for n in range(1, search.first // stride + max_degree + 2))


class _ExactCurves:
    """The sequences and forms over Q, constructed from the numbers of each group."""

    def __init__(self, search: _Search, numbers: dict[tuple[int, int], Numbers]) -> None:
        self._search = search
        size = len(search.groups[0]) + 1
        self._coefficient_matrices = {
            key: fmpz_mat(size, search.sections[key].degree, primitive_integers(numbers_of_key.coefficients))
            for key, numbers_of_key in numbers.items()
        }
        initial_terms = {
            key: first_terms(numbers_of_key.H, numbers_of_key.y, numbers_of_key.z)
            for key, numbers_of_key in numbers.items()
        }
        self._W, *other_sequences = (W for W, _ in initial_terms.values())
        if any(sequence != self._W for sequence in other_sequences):
            raise ArithmeticError("the curves differ")
        self._U = {key: U for key, (_, U) in initial_terms.items()}
        terms_at_0 = [around(U, 0, self._W)[0] for U in self._U.values()]
        if 0 in terms_at_0:
            raise ArithmeticError("the initial point is special")
        self._primes = fmpz(1)
        for number in (*self._W, *(term for U in self._U.values() for term in U), *terms_at_0):
            self._primes = self._primes.lcm(number.p).lcm(number.q)
        self._all_primes = {}
        for key, U in self._U.items():
            common_number = common_primes(search.sections[key].degree, self._coefficient_matrices[key], self._W, U)
            self._all_primes[key] = self._primes.lcm(common_number.p).lcm(common_number.q)

    def steps(self, map_over: Map, skipped: int = 0) -> EllipticSteps:
        """Return the steps of the orbit; the sequences begin at the point after `skipped` steps."""
        numbers, sections = Integers(self._primes), self._search.sections
        W = Terms(self._W, numbers)
        new_coordinates = {
            key: Coordinates(
                sections[key].degree, self._coefficient_matrices[key], W, Terms(U, numbers, W), self._all_primes[key]
            )
            for key, U in self._U.items()
        }
        rows = [
            [new_coordinates[k, g] if copied_group is None else copied_group for g, copied_group in enumerate(row)]
            for k, row in enumerate(self._search.earlier)
        ]
        return EllipticSteps(map_over, rows, self._search.first, skipped)
