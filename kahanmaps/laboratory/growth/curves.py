"""The curve t -> Phi^n(a + b t) that a birational map makes of a random line over GF(p), exactly.

The curve is kept as dim + 1 polynomials without a common factor. A map has one or several factors, and what each makes
of the curve is the kernel of the n x (n + 1) matrix of forms in its polynomials that is the equation of the factor
(maps/equation.py). There are two ways to it:

    minors  up to dimension 5: the maximal minors, and the gcd of two random combinations of them divided out;
    series  above it, where minors are many: M(x) x~ = r(x) in power series in t, to as
            many terms as the next curve needs. Its polynomials follow from the shortest recurrence (massey-1969) of the
            series of a random quotient of two affine functions, whose generating function has the common denominator
            of the coordinates. All terms to spare of all coordinates are tried.

The forms of an explicit map take the place of minors in any dimension. In the plane minors are five to ten times as
fast as series; in dimension 6 the two are even.
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
from kahanmaps.algebra.work import Budget, count
from kahanmaps.laboratory.singular.jets import PrecisionTooLow, kernel, row_units
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import Map, MapFamily

_MINORS = 5  # the largest dimension in which minors are taken
_MARGIN = 8  # terms of a series beyond those that determine the curve: each is right by chance once in 2^60


class Ended(StrEnum):
    """What ends the walk along curves, or the search for degrees."""

    RECURRENCE = "recurrence"  # one was found, with terms to spare
    DERIVED = "derived"  # from the singularity patterns, and enough measured terms agree
    PROVED = "proved"  # the degrees are those of powers of a matrix
    UNCONFIRMED = "unconfirmed"  # a recurrence fits, and the patterns of the singularities are not known to the end
    TERMS = "terms"  # as many as asked for
    BUDGET = "budget"  # is spent
    STOPPED = "stopped"  # by a TimeLimit
    DEGREE = "degree"  # the next is over the limit
    CONSTANT = "constant"  # the iterate is a constant map
    SINGULAR = "singular"  # the next iterate exists nowhere
    LINES = "lines"  # the lines do not agree


class Stopped(Exception):
    """Why no further curve is to be had, or no further degree is asked for."""

    def __init__(self, ended: Ended, message: str) -> None:
        self.ended, self.message = ended, message


def reduced(map_: MapFamily, eps: fmpq | None, rng: random.Random) -> Map:
    """The map modulo a random prime of 61 bits, at a random eps where none is given. Raises BadPrime."""
    field = GF(random_prime(rng))
    return map_.at(field.random(rng) if eps is None else field.convert(eps), field)


class Line:
    """The curve t -> Phi^n(a + b t) over GF(p) as polynomials (X : Z), Z below, without common factor.

    For a map over GF(p), along a random line or that which `start` gives.
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
        drawn = (nmod_poly([rng.randrange(p), rng.randrange(1, p)], p) for _ in range(map_.dim))
        self._X = [*drawn, nmod_poly([1], p)] if start is None else list(start)

    @property
    def is_explicit(self) -> bool:
        """Whether images are values of short forms."""
        return all(equation.explicit is not None for equation in self._equations)

    def step(self, guess: int) -> None:
        """One step on. Raises ZeroDivisionError where points of the line have no image, Stopped at a limit."""
        for equation in self._equations:
            too_large = Stopped(Ended.DEGREE, f"the degree of iterate {self.steps + 1} is above {self._max_degree}")
            curve: list[nmod_poly] | None = None
            if equation.dim <= _MINORS or equation.explicit is not None:
                curve = self._by_minors(equation)
            most = 2 * self._max_degree + _MARGIN + 1
            length = min(2 * guess + _MARGIN + 1, most)
            while curve is None:
                self._require_budget()
                curve = self._curve(self._image(equation, length), length)
                if curve is None and length == most:
                    raise too_large
                length = min(2 * length, most)
            degree = max(0, *(int(entry.degree()) for entry in curve))
            if degree > self._max_degree:
                raise too_large
            self._X, self.degree = curve, degree
        self.steps += 1

    def _by_minors(self, equation: Equation) -> list[nmod_poly]:
        def times(left: nmod_poly, right: nmod_poly) -> nmod_poly:
            self._require_budget()
            product: nmod_poly = counted_product(left, right)
            return product

        *above, below = equation.image(self._X, nmod_poly([0], self.prime), times)
        if below.is_zero():
            raise ZeroDivisionError("no point of the line has an image")
        common = below.gcd(self._mixture(above))
        count(gcd_units(len(below), len(common)))
        self._require_budget()
        curve, t = [], nmod(self._rng.randrange(self.prime), self.prime)
        for entry in (*above, below):
            count(product_units(len(common), len(entry) - len(common) + 1) + len(entry) / 20)
            quotient = entry // common
            if quotient(t) * common(t) != entry(t):  # a mixture with a factor that is not in all: once in about p
                common = reduce(nmod_poly.gcd, above, below)
                return [entry // common for entry in (*above, below)]
            curve.append(quotient)
        return curve

    def _mixture(self, entries: list[nmod_poly]) -> nmod_poly:
        zero = nmod_poly([0], self.prime)
        return sum((entry * nmod(self._rng.randrange(self.prime), self.prime) for entry in entries), zero)

    def _require_budget(self) -> None:
        if self._budget.is_spent:
            raise Stopped(Ended.BUDGET, f"work limit reached at iterate {self.steps + 1}; raise --effort")

    def _image(self, equation: Equation, length: int) -> list[nmod_poly]:
        """The coordinates of the next curve as power series, to `length` terms."""
        X = [entry.truncate(length) for entry in self._X]
        values = [entry.truncate(length) for entry in equation.monomials(X, counted_product)]
        count(row_units(equation, length))
        try:
            *x, below = kernel(equation.rows(values, nmod_poly([0], self.prime)), 1, length, [], self._require_budget)
        except PrecisionTooLow:
            raise ZeroDivisionError("the point t = 0 of the line has no image") from None
        if not int(below[0]):
            raise ZeroDivisionError("the point t = 0 of the line has no image")
        count(series_units(length) + len(x) * product_units(length, length))
        inverse = below.inverse_series_trunc(length)
        return [entry.mul_low(inverse, length) for entry in x]

    def _curve(self, x: list[nmod_poly], length: int) -> list[nmod_poly] | None:
        """The polynomials with these quotients, or None where there are not enough terms to be certain."""
        for _ in range(2):
            above, below = (
                nmod_poly([self._rng.randrange(self.prime)], self.prime) + self._mixture(x) for _ in range(2)
            )
            if int(below[0]) == 0:
                continue
            count(series_units(length) + minpoly_units(length) + (2 + len(x)) * product_units(length, length))
            inverse = below.inverse_series_trunc(length)
            values = [int(c) for c in above.mul_low(inverse, length).coeffs()]
            # The quotient may be as high above as below: without its first term it is a proper fraction over t.
            values = (values + [0] * (length - len(values)))[1:]
            minimal = self._context.minpoly(values)
            degree = int(minimal.degree())
            if 2 * degree + _MARGIN > len(values):
                return None
            denominator = nmod_poly([int(c) for c in reversed(minimal.coeffs())], self.prime)
            first = denominator.mul_low(inverse, length)
            curve = [*(first.mul_low(entry, length) for entry in x), first]
            # Only for functionals in special position is the denominator not that of all coordinates.
            if all(entry.degree() <= degree for entry in curve):
                return curve
        return None
