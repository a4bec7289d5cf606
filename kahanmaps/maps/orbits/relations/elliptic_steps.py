"""Steps along an orbit P + n T on an elliptic curve; the coordinates are forms in the terms of two Somos sequences.

If the forms have degree d, the terms have 1/d of the length of the coordinates: a step consists of a few short
products, without a gcd of long integers.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

from flint import fmpz, fmpz_mat

from kahanmaps.algebra.integers import common_part
from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.orbits.integer_point import FractionsPoint, IntegerPoint
from kahanmaps.maps.orbits.relations.sections import exponents
from kahanmaps.maps.somos import Terms

_PRIME = 2**61 - 1  # the prime modulo which skipped points are shown to exist


class EllipticSteps:
    """The steps of an orbit by Somos sequences.

    A step of a composition consists of one step of each factor. Let s be the length of `groups`: after n s + k steps of
    factors, 0 <= k < s, the point lies on the k-th of s curves. The row `groups[k]` describes this curve. It contains
    the `Coordinates` of each group of coordinates or, for a group that the last step of a factor only copied, the index
    of the group before that step. The sequences begin at the point number `skipped` of the orbit. The forms give
    the points from `first` steps of factors after that point on.
    """

    name = "Somos sequences along the orbit"

    def __init__(
        self, map_over: Map, groups: Sequence[Sequence[Coordinates | int]], first: int, skipped: int = 0
    ) -> None:
        self._map, self._groups, self._first, self._skipped = map_over, groups, first, skipped
        self._residues: list[int] | None = None  # the last point modulo _PRIME
        self._values: dict[tuple[int, int], list[fmpz]] = {}

    @property
    def multiples(self) -> Terms:
        """The sequence W of the multiples of T."""
        return next(
            coordinates.W for row in self._groups for coordinates in row if isinstance(coordinates, Coordinates)
        )

    @property
    def stride(self) -> int:
        """The number of steps of factors by which T translates."""
        return len(self._groups)

    @property
    def degree(self) -> int:
        """The largest degree of coordinates that are computed together on one curve."""
        return max(group.degree for row in self._groups for group in row if isinstance(group, Coordinates))

    def step(self, last_points: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """Return point `number` of the orbit, if the point before was computed or skipped; None if undetermined."""
        return self.point(number) if self._has_point(number) else None

    def may_skip(self, number: int) -> bool:
        """Return whether the point with this number is known to exist, so that it need not be computed."""
        return self._has_point(number)

    def _has_point(self, number: int) -> bool:
        """Return whether the orbit modulo a prime proves that point `number` exists.

        The numbers of successive calls must increase by 1 as long as the answer is True.
        """
        if self._residues is None:
            previous_point = self.point(number - 1)
            self._residues = None if previous_point is None else previous_point.residues(_PRIME)
        for factor in self._map.factors:
            self._residues = self._residues and factor.integer_steps.image_modulo(self._residues, _PRIME)
        return self._residues is not None

    def point(self, number: int) -> IntegerPoint | None:
        """Return the point with this number; None if the forms do not give it. Terms no longer needed are discarded."""
        factor_steps = (number - self._skipped) * len(self._map.factors)
        n = factor_steps // len(self._groups)
        for key in [
            key for key in self._values if key[0] < factor_steps - len(self._map.factors) * len(self._groups[0])
        ]:
            del self._values[key]
        for row in self._groups:
            for coordinates in row:
                if isinstance(coordinates, Coordinates):
                    coordinates.forget(n // 2 - 4)
        return self.at(factor_steps)

    def at(self, number: int) -> IntegerPoint | None:
        """Return the point after `number` steps of factors; None if the forms do not give it."""
        if number < self._first:
            return None
        try:
            values = [self._value(number, g) for g in range(len(self._groups[0]))]
        except ArithmeticError:
            return None
        if len(values) == 1:
            return IntegerPoint(tuple(values[0][:-1]), values[0][-1])
        return FractionsPoint([(p, q) for p, q in values])

    def _value(self, number: int, group: int) -> list[fmpz]:
        """Return the numerators and the denominator of a group. Raises ArithmeticError if the denominator is 0."""
        key = number, group
        if key not in self._values:
            n, k = divmod(number, len(self._groups))
            source = self._groups[k][group]
            self._values[key] = self._value(number - 1, source) if isinstance(source, int) else source.at(n)
        return self._values[key]


class Coordinates:
    """A group of coordinates on one curve; `forms` has a row for each numerator, and a last row for the denominator."""

    def __init__(self, degree: int, forms: fmpz_mat, W: Terms, U: Terms, primes: fmpz) -> None:
        self.W, self.degree, self._U, self._primes = W, degree, U, primes
        self._exponents = exponents(degree)
        # The content of a column is multiplied into the monomial, not into each row: fewer products of long numbers.
        self._contents = [reduce(fmpz.gcd, column) or fmpz(1) for column in forms.transpose().tolist()]
        self._forms = fmpz_mat([[c // g for c, g in zip(row, self._contents, strict=True)] for row in forms.tolist()])

    def at(self, n: int) -> list[fmpz]:
        """Return numerators and denominator in lowest terms, n >= 2. Raises ArithmeticError if the denominator is 0."""
        W, U = self.W, self._U
        mixed_quotient, own_quotient = U.mixed_quotient(n), W.own_quotient(n)
        weights = primitive_integers(
            tuple(
                g * mixed_quotient**k * own_quotient**j
                for g, (k, _, j) in zip(self._contents, self._exponents, strict=True)
            )
        )
        product0, product1 = U.integer(n), U.integer(n + 1) * W.integer(n - 1)
        term, (square, neighbour_product) = W.integer(n), W.pair(n)
        product0, product1 = (product0, product1 * term) if self.degree % 2 else (product0 * term, product1)
        powers = {(i, j): square**i * neighbour_product**j for i, j in {(i, j) for _, i, j in self._exponents}}
        column = [
            weight * (product1 if k else product0) * powers[i, j]
            for weight, (k, i, j) in zip(weights, self._exponents, strict=True)
        ]
        values: list[fmpz] = (self._forms * fmpz_mat(len(column), 1, column)).entries()
        if values[-1] == 0:
            raise ZeroDivisionError
        common_factor = common_part(values[::-1], self._primes)
        if values[-1] < 0:
            common_factor = -common_factor
        return values if common_factor == 1 else [value // common_factor for value in values]

    def forget(self, n: int) -> None:
        """Discard the long terms with index below n."""
        self.W.forget(n)
        self._U.forget(n)
