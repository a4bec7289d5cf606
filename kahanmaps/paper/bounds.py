"""Bounds for degrees and coefficients, as a field: whatever is computed with field operations bounds itself.

An element stands for a rational function N / (product of powers of named denominators), N a polynomial with integer
coefficients: the Size of N is kept, and for every denominator its Size and power. Sums use a common denominator. A
matrix has one bound for all its entries. A linear system is solved by Cramer's rule. Run over this field, a
claim tells the degree and the coefficients of the polynomial equation that it amounts to.
"""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from typing import Any

from kahanmaps.algebra.fields import Element, Field, rational
from kahanmaps.errors import InputError
from kahanmaps.invariants.sizes import ONE, Size


class BoundField(Field):
    """The field of bounds. `variable()` is a variable, `constant(bits)` an integer of at most so many bits."""

    name = "bounds"
    characteristic = 0

    def __init__(self) -> None:
        self._denominators: list[Size] = []
        self._number_of: dict[int, tuple[Any, int]] = {}

    @property
    def zero(self) -> Bound:
        return Bound(self, ONE, {})

    @property
    def one(self) -> Bound:
        return Bound(self, ONE, {})

    def variable(self) -> Bound:
        """A variable."""
        return Bound(self, Size(1, 0.0), {})

    def polynomial(self, degree: int, bits: float) -> Bound:
        """A polynomial with integer coefficients of this degree, the sum of their absolute values below 2^bits."""
        return Bound(self, Size(degree, bits), {})

    def denominator(self, of: Any, size: Size) -> int:
        """The number of the denominator that belongs to the object `of`; one object has one denominator."""
        known = self._number_of.get(id(of))
        if known is None:
            known = self._number_of[id(of)] = (of, len(self._denominators))  # `of` is kept, so its id stays its own
            self._denominators.append(size)
        return known[1]

    def product(self, powers: Mapping[int, int]) -> Size:
        """The size of a product of denominators."""
        total = ONE
        for number, power in powers.items():
            total = total * self._denominators[number] ** power
        return total

    def convert(self, value: Any) -> Bound:
        if isinstance(value, Bound):
            return value
        number = rational(value)
        above = Bound(self, Size(0, _bits(int(abs(number.p)))), {})
        if number.q == 1:
            return above
        size = Size(0, _bits(int(number.q)))
        key = ("integer", int(number.q))
        known = next((k for of, k in self._number_of.values() if of == key), None)
        return Bound(self, above.above, {self.denominator(key, size) if known is None else known: 1})

    def random(self, rng: random.Random, height: int = 10) -> Bound:
        return self.variable()

    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> BoundMatrix:
        """The matrix with the common bound of these entries."""
        common: dict[int, int] = {}
        # Entries are mostly one object many times over.
        elements = [self.convert(entry) for entry in {id(entry): entry for entry in entries}.values()]
        for element in elements:
            common = _larger(common, element.below)
        above = ONE
        for element in elements:
            above = above | element.over(common)
        return BoundMatrix(self, rows, columns, Bound(self, above, common))

    def is_zero(self, element: Any) -> bool:
        return False

    def equal(self, left: Any, right: Any) -> bool:
        return True


class Bound(Element):
    """The bound of one rational function."""

    __slots__ = ("above", "below")

    field: BoundField

    def __init__(self, field: BoundField, above: Size, below: Mapping[int, int]) -> None:
        self.field = field
        self.above = above
        self.below = dict(below)

    def over(self, common: Mapping[int, int]) -> Size:
        """The numerator over a larger denominator."""
        missing = {number: power - self.below.get(number, 0) for number, power in common.items()}
        return self.above * self.field.product(missing)

    @property
    def pole_degree(self) -> int:
        """The degree of the denominator."""
        return int(self.field.product(self.below).degree)

    def _plus(self, other: Bound) -> Bound:
        common = _larger(self.below, other.below)
        return Bound(self.field, self.over(common) + other.over(common), common)

    def __neg__(self) -> Bound:
        return self

    def _times(self, other: Bound) -> Bound:
        return Bound(self.field, self.above * other.above, _together(self.below, other.below))

    def _over(self, other: Bound) -> Bound:
        number = self.field.denominator(other, other.above)
        above = self.above * self.field.product(other.below)
        return Bound(self.field, above, _together(self.below, {number: 1}))

    def _same(self, other: Bound) -> bool:
        return self is other


class BoundMatrix:
    """A matrix of which a common bound for all entries is known."""

    def __init__(self, field: BoundField, rows: int, columns: int, entry: Bound) -> None:
        self.field = field
        self._rows, self._columns = rows, columns
        self.entry = entry

    def nrows(self) -> int:
        return self._rows

    def ncols(self) -> int:
        return self._columns

    def entries(self) -> list[Bound]:
        return [self.entry] * (self._rows * self._columns)

    def __getitem__(self, place: tuple[int, int]) -> Bound:
        return self.entry

    def transpose(self) -> BoundMatrix:
        return BoundMatrix(self.field, self._columns, self._rows, self.entry)

    def __add__(self, other: BoundMatrix) -> BoundMatrix:
        if (self._rows, self._columns) != (other._rows, other._columns):
            raise InputError("matrices of different sizes are added")
        return BoundMatrix(self.field, self._rows, self._columns, self.entry + other.entry)

    def __sub__(self, other: BoundMatrix) -> BoundMatrix:
        return self + other

    def __neg__(self) -> BoundMatrix:
        return self

    def __mul__(self, other: Any) -> BoundMatrix:
        if not isinstance(other, BoundMatrix):
            return BoundMatrix(self.field, self._rows, self._columns, self.entry * self.field.convert(other))
        if self._columns != other._rows:
            raise InputError("matrices whose sizes do not fit are multiplied")
        product = self.entry * other.entry
        summed = Bound(self.field, product.above * Size(0, _bits(self._columns)), product.below)
        return BoundMatrix(self.field, self._rows, other._columns, summed)

    def det(self) -> Bound:
        """The determinant: n! products of n entries."""
        n = self._rows
        below = {number: n * power for number, power in self.entry.below.items()}
        return Bound(self.field, self._minor(n), below)

    def solve(self, right: BoundMatrix) -> BoundMatrix:
        """Cramer's rule: with entries N/d the solution is d adj(N) right / det N."""
        n = self._rows
        number = self.field.denominator(self, self._minor(n))
        above = self._minor(n - 1) * Size(0, _bits(n)) * self.field.product(self.entry.below)
        inverse = Bound(self.field, above, {number: 1})
        return BoundMatrix(self.field, n, right._columns, inverse * right.entry)

    def _minor(self, size: int) -> Size:
        return self.entry.above**size * Size(0, math.lgamma(size + 1) / math.log(2) + 1e-9)


def _larger(left: Mapping[int, int], right: Mapping[int, int]) -> dict[int, int]:
    """The least common multiple of two products of denominators."""
    return {number: max(left.get(number, 0), right.get(number, 0)) for number in {*left, *right}}


def _together(left: Mapping[int, int], right: Mapping[int, int]) -> dict[int, int]:
    """The product of two products of denominators."""
    return {number: left.get(number, 0) + right.get(number, 0) for number in {*left, *right}}


def _bits(value: int) -> float:
    return 0.0 if value <= 1 else math.log2(value) + 1e-9
