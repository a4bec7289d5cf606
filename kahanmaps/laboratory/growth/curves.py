"""The images t -> Phi^n(a + b t) of a random line under a birational map over GF(p), exactly.

In dimension n, the curve is stored as n + 1 coprime polynomials in t. A map is a composition of one or more factors.
The equation of a factor (maps/equation.py) is an n x (n + 1) matrix of forms. Evaluated at the polynomials of a curve,
the matrix has a kernel of dimension 1, which is the image of the curve. It is computed in one of two ways:

    minors  up to dimension 5: the maximal minors, divided by the gcd of two random combinations of them;
    series  in higher dimensions, where there are many minors: M(x) x~ = r(x) is solved in power series in t, to as
            many terms as determine the image. The quotient of two random affine functions of x~ is a power series; its
            shortest recurrence (massey-1969) gives the common denominator of the coordinates. All further terms of all
            coordinates must satisfy this recurrence.

An explicit map is evaluated by its forms, without a kernel, in any dimension. In the plane minors are five to ten times
as fast as series; in dimension 6 both take the same time.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from enum import StrEnum
from functools import reduce

from flint import fmpq, fmpz_mod_ctx, fmpz_mod_poly_ctx, nmod, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomial_work import counted_product, gcd_units, minpoly_units, product_units, series_units
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.laboratory.singular.jets import PrecisionTooLow, kernel, row_units
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import Map, MapFamily

_MAX_MINORS_DIMENSION = 5  # the largest dimension in which minors are used
_MARGIN = 8  # terms of a series beyond those that determine the curve; a wrong curve fits one with probability 2^-60


class Ended(StrEnum):
    """The reason why a computation of degrees ended."""

    RECURRENCE = "recurrence"  # a recurrence of the first terms is confirmed by further terms
    DERIVED = "derived"  # the recurrence follows from the singularity patterns, and enough measured terms agree
    PROVED = "proved"  # the map is monomial, and powers of its exponent matrix give the degrees
    UNCONFIRMED = "unconfirmed"  # a recurrence fits, but not all singularity patterns have settled
    TERMS = "terms"  # as many terms as requested were computed
    BUDGET = "budget"  # the budget was spent
    STOPPED = "stopped"  # a TimeLimit stopped the computation
    DEGREE = "degree"  # the next degree exceeds `max_degree`
    CONSTANT = "constant"  # the iterate is a constant map
    SINGULAR = "singular"  # the next iterate is nowhere defined
    LINES = "lines"  # the degrees along different lines differ


class Stopped(Exception):
    """Ends the computation of curves and degrees; `ended` is the kind of reason, `message` the reason as a sentence."""

    def __init__(self, ended: Ended, message: str) -> None:
        self.ended, self.message = ended, message


def reduce_map(map_: MapFamily, eps: fmpq | None, rng: random.Random) -> Map:
    """Return the map modulo a random prime of 61 bits, at eps or (None) a random residue. Raises BadPrime."""
    field = GF(random_prime(rng))
    return map_.at(field.random(rng) if eps is None else field.convert(eps), field)


class Line:
    """The image of a line a + b t under `steps` steps of a map over GF(p), as coprime polynomials (X : Z) in t.

    X are the numerators of the coordinates and Z is their denominator. The line is random or given as `start`.
    """

    def __init__(
        self,
        map_: Map,
        rng: random.Random,
        budget: Budget,
        max_degree: int,
        start: Sequence[nmod_poly] | None = None,
    ) -> None:
        p = self.prime = map_.field.characteristic
        self.eps = int(map_.eps)
        self._rng, self._budget, self._max_degree = rng, budget, max_degree
        self._context = fmpz_mod_poly_ctx(fmpz_mod_ctx(p))
        self._equations = map_.equations
        self.steps = 0
        self.degree = 1
        coordinates = (nmod_poly([rng.randrange(p), rng.randrange(1, p)], p) for _ in range(map_.dim))
        self._X = [*coordinates, nmod_poly([1], p)] if start is None else list(start)

    @property
    def is_explicit(self) -> bool:
        """Whether every factor of the map is given by explicit formulas."""
        return all(equation.explicit is not None for equation in self._equations)

    def step(self, guess: int) -> None:
        """Replace the curve by its image under the map; `guess` is the expected degree of the image.

        Raises Stopped at a limit, and ZeroDivisionError if the map is undefined on the curve (with series: at t = 0).
        """
        for equation in self._equations:
            degree_error = Stopped(Ended.DEGREE, f"the degree of iterate {self.steps + 1} is above {self._max_degree}")
            curve: list[nmod_poly] | None = None
            if equation.dim <= _MAX_MINORS_DIMENSION or equation.explicit is not None:
                curve = self._image_by_minors(equation)
            max_length = 2 * self._max_degree + _MARGIN + 1
            length = min(2 * guess + _MARGIN + 1, max_length)
            # If `guess` is too small, the terms of the margin disagree, and twice the length is tried.
            while curve is None:
                self._require_budget()
                curve = self._image_by_series(equation, length)
                if curve is None and length == max_length:
                    raise degree_error
                length = min(2 * length, max_length)
            degree = max(0, *(int(entry.degree()) for entry in curve))
            if degree > self._max_degree:
                raise degree_error
            self._X, self.degree = curve, degree
        self.steps += 1

    def _image_by_minors(self, equation: Equation) -> list[nmod_poly]:
        def times(left: nmod_poly, right: nmod_poly) -> nmod_poly:
            self._require_budget()
            product: nmod_poly = counted_product(left, right)
            return product

        *numerators, denominator = equation.image(self._X, nmod_poly([0], self.prime), times)
        if denominator.is_zero():
            raise ZeroDivisionError("no point of the line has an image")
        common_factor = denominator.gcd(self._random_combination(numerators))
        count_work(gcd_units(len(denominator), len(common_factor)))
        self._require_budget()
        curve, t = [], nmod(self._rng.randrange(self.prime), self.prime)
        for entry in (*numerators, denominator):
            count_work(product_units(len(common_factor), len(entry) - len(common_factor) + 1) + len(entry) / 20)
            quotient = entry // common_factor
            # With probability about 1/p, `common_factor` does not divide all entries; their gcd is then used instead.
            if quotient(t) * common_factor(t) != entry(t):
                common_factor = reduce(nmod_poly.gcd, numerators, denominator)
                return [entry // common_factor for entry in (*numerators, denominator)]
            curve.append(quotient)
        return curve

    def _random_combination(self, entries: list[nmod_poly]) -> nmod_poly:
        zero = nmod_poly([0], self.prime)
        return sum((entry * nmod(self._rng.randrange(self.prime), self.prime) for entry in entries), zero)

    def _require_budget(self) -> None:
        if self._budget.is_spent:
            raise Stopped(Ended.BUDGET, f"work limit reached at iterate {self.steps + 1}; raise --effort")

    def _image_by_series(self, equation: Equation, length: int) -> list[nmod_poly] | None:
        """Return the image from power series with `length` terms; None if more terms are needed to be certain."""
        X = [entry.truncate(length) for entry in self._X]
        monomials = [entry.truncate(length) for entry in equation.monomials(X, counted_product)]
        count_work(row_units(equation, length))
        try:
            rows = equation.rows(monomials, nmod_poly([0], self.prime))
            *x, denominator = kernel(rows, 1, length, [], self._require_budget)
        except PrecisionTooLow:
            raise ZeroDivisionError("the point t = 0 of the line has no image") from None
        if not int(denominator[0]):
            raise ZeroDivisionError("the point t = 0 of the line has no image")
        count_work(series_units(length) + len(x) * product_units(length, length))
        reciprocal = denominator.inverse_series_trunc(length)
        x = [entry.mul_low(reciprocal, length) for entry in x]
        # Reconstruct the polynomials (X : Z) whose quotients X/Z have the power series x.
        for _ in range(2):
            numerator_series, denominator_series = (
                nmod_poly([self._rng.randrange(self.prime)], self.prime) + self._random_combination(x) for _ in range(2)
            )
            if int(denominator_series[0]) == 0:
                continue
            count_work(series_units(length) + minpoly_units(length) + (2 + len(x)) * product_units(length, length))
            inverse = denominator_series.inverse_series_trunc(length)
            values = [int(c) for c in numerator_series.mul_low(inverse, length).coeffs()]
            # The rational function may have numerator and denominator of equal degree; minus its value at t = 0, it is
            # t times a proper fraction.
            values = (values + [0] * (length - len(values)))[1:]
            recurrence = self._context.minpoly(values)
            degree = int(recurrence.degree())
            if 2 * degree + _MARGIN > len(values):
                return None
            denominator = nmod_poly([int(c) for c in reversed(recurrence.coeffs())], self.prime)
            Z = denominator.mul_low(inverse, length)
            curve = [*(Z.mul_low(entry, length) for entry in x), Z]
            # Except for random functions in special position, `denominator` is the denominator of all coordinates.
            if all(entry.degree() <= degree for entry in curve):
                return curve
        return None
