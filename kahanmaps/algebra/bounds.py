"""A field whose elements bound degrees and coefficients: a computation that runs over it bounds its own result.

An element represents a rational function N / (s D_1^k_1 D_2^k_2 ...). s is a positive integer, N and the D_i are
polynomials over Z, and only the `CoefficientSize` of N and D_i is stored. The D_i are the numerators of all elements by
which the computation divides. A sum is written over a common denominator. A matrix has one bound for all its entries,
and a linear system is solved by Cramer's rule. If a claim says that pairs of elements are equal, `bound_of` bounds the
polynomials that vanish if and only if the claim is true.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq_mat, fmpz

from kahanmaps.algebra.fields import Element, Field, rational
from kahanmaps.errors import InputError


@dataclass(frozen=True)
class CoefficientSize:
    """Bounds on a polynomial over Z: its total degree, and log2 of the sum of the absolute values of its coefficients.

    This sum is a norm on polynomials with |P Q| <= |P| |Q|, so bounds can be computed operation by operation.

    >>> CoefficientSize(2, 1.0) * CoefficientSize(3, 0.5)
    CoefficientSize(degree=5, bits=1.5)
    >>> CoefficientSize(2, 1.0) + CoefficientSize(3, 1.0)
    CoefficientSize(degree=3, bits=2.0)
    """

    degree: int
    bits: float

    def __mul__(self, other: CoefficientSize) -> CoefficientSize:
        return CoefficientSize(self.degree + other.degree, self.bits + other.bits)

    def __add__(self, other: CoefficientSize) -> CoefficientSize:
        min_bits, max_bits = sorted((self.bits, other.bits))
        bits = max_bits + math.log2(1 + 2 ** (min_bits - max_bits)) if max_bits - min_bits < 200 else max_bits + 1e-9
        return CoefficientSize(max(self.degree, other.degree), bits)

    def __pow__(self, exponent: int) -> CoefficientSize:
        return CoefficientSize(self.degree * exponent, self.bits * exponent)

    def __or__(self, other: CoefficientSize) -> CoefficientSize:
        """Return a bound that holds for every polynomial bounded by `self` or by `other`."""
        return CoefficientSize(max(self.degree, other.degree), max(self.bits, other.bits))


ONE = CoefficientSize(0, 0.0)


def bound_of(field: BoundField, pairs: Iterable[tuple[Any, Any]]) -> tuple[CoefficientSize, int]:
    """Bound the polynomials that are all 0 if and only if the two elements (or matrices) of each pair are equal.

    Returns:
        (bound, degree): `bound` holds for each of these polynomials. The computation assumes that all divisors and all
        elements compared with zero are nonzero; `degree` bounds the degree of the product of their numerators.
    """
    bound = ONE
    for pair in pairs:
        left, right = (side.entry if isinstance(side, BoundMatrix) else field.convert(side) for side in pair)
        bound = bound | (left - right).numerator
    return bound, field.pole_degree


class BoundField(Field):
    """The field of bounds. `variable()` bounds a variable, `polynomial(...)` all polynomials of a given size."""

    name = "bounds"
    characteristic = 0

    def __init__(self) -> None:
        self._denominators: list[CoefficientSize] = []
        self._index_by_id: dict[int, tuple[Any, int]] = {}

    @property
    def zero(self) -> Bound:
        return Bound(self, ONE, 1, {})

    @property
    def one(self) -> Bound:
        return Bound(self, ONE, 1, {})

    def variable(self) -> Bound:
        """Return the bound of a variable."""
        return Bound(self, CoefficientSize(1, 0.0), 1, {})

    def polynomial(self, degree: int, bits: float) -> Bound:
        """Bound the integer polynomials of degree at most `degree` whose |coefficients| sum to at most 2^bits."""
        return Bound(self, CoefficientSize(degree, bits), 1, {})

    @property
    def pole_degree(self) -> int:
        """The degree of the product of the numerators of all divisors and of all elements compared with zero."""
        return sum(size.degree for size in self._denominators)

    def denominator(self, owner: Any, size: CoefficientSize) -> int:
        """Return the index i of D_i, the numerator of the divisor `owner`; the same object always has the same index.

        If `owner` is the common bound of the entries of a matrix, each call returns a new index: entries may differ.
        """
        if isinstance(owner, Bound) and owner.is_common:
            self._denominators.append(size)
            return len(self._denominators) - 1
        owner_and_index = self._index_by_id.get(id(owner))
        if owner_and_index is None:
            owner_and_index = self._index_by_id[id(owner)] = owner, len(self._denominators)  # keeps `owner` alive
            self._denominators.append(size)
        return owner_and_index[1]

    def product(self, powers: Mapping[int, int]) -> CoefficientSize:
        """Return the size of the product of the D_i^k for `powers` = {i: k, ...}."""
        total = ONE
        for index, power in powers.items():
            total = total * self._denominators[index] ** power
        return total

    def convert(self, value: Any) -> Bound:
        if isinstance(value, Bound):
            if value.field is not self:
                raise InputError("found an element of another field of bounds, expected one of this field")
            return value
        number = rational(value)
        return Bound(self, CoefficientSize(0, log2(number.p)), int(number.q), {})

    def convert_matrix(self, matrix: fmpq_mat) -> BoundMatrix:
        numerator, denominator = matrix.numer_denom()
        largest = max((abs(entry) for entry in numerator.entries()), default=fmpz(0))
        return BoundMatrix(
            self, matrix.nrows(), matrix.ncols(), Bound(self, CoefficientSize(0, log2(largest)), int(denominator), {})
        )

    def random(self, rng: random.Random, height: int = 10) -> Bound:
        return self.variable()

    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> BoundMatrix:
        """Return the matrix whose entries all have the common bound of these entries."""
        # Most entries are the same object, so remove duplicates first.
        elements = [self.convert(entry) for entry in {id(entry): entry for entry in entries}.values()]
        scale, exponents = 1, dict[int, int]()
        for element in elements:
            scale, exponents = (math.lcm(scale, element.scale), _lcm_exponents(exponents, element.denominator))
        numerator = ONE
        for element in elements:
            numerator = numerator | element.over(scale, exponents)
        return BoundMatrix(self, rows, columns, Bound(self, numerator, scale, exponents))

    def is_zero(self, element: Any) -> bool:
        """Return False: an element compared with zero is assumed nonzero, and its numerator counts as a divisor."""
        self.denominator(element, element.numerator)
        return False

    def equal(self, left: Any, right: Any) -> bool:
        return True


class Bound(Element):
    """The bound of one rational function, or, if `is_common` is True, of each entry of a matrix."""

    __slots__ = ("denominator", "is_common", "numerator", "scale")

    field: BoundField

    def __init__(
        self, field: BoundField, numerator: CoefficientSize, scale: int, denominator: Mapping[int, int]
    ) -> None:
        self.field = field
        self.numerator = numerator
        self.scale = scale
        self.denominator = dict(denominator)
        self.is_common = False

    def over(self, scale: int, denominator: Mapping[int, int]) -> CoefficientSize:
        """Return the size of the numerator over `scale` times the product of D_i^k, `denominator` = {i: k, ...}."""
        missing_exponents = {index: power - self.denominator.get(index, 0) for index, power in denominator.items()}
        return self.numerator * self.field.product(missing_exponents) * CoefficientSize(0, log2(scale // self.scale))

    @property
    def pole_degree(self) -> int:
        """The degree of the denominator of the bounded function."""
        return int(self.field.product(self.denominator).degree)

    def _add(self, other: Bound) -> Bound:
        scale, denominator = math.lcm(self.scale, other.scale), _lcm_exponents(self.denominator, other.denominator)
        return Bound(self.field, self.over(scale, denominator) + other.over(scale, denominator), scale, denominator)

    def __neg__(self) -> Bound:
        return self

    def _multiply(self, other: Bound) -> Bound:
        denominator = _product_exponents(self.denominator, other.denominator)
        return Bound(self.field, self.numerator * other.numerator, self.scale * other.scale, denominator)

    def _divide(self, other: Bound) -> Bound:
        index = self.field.denominator(other, other.numerator)
        numerator = self.numerator * self.field.product(other.denominator) * CoefficientSize(0, log2(other.scale))
        return Bound(self.field, numerator, self.scale, _product_exponents(self.denominator, {index: 1}))

    def _equals(self, other: Bound) -> bool:
        return self is other


class BoundMatrix:
    """A matrix, represented by a common bound of all its entries."""

    def __init__(self, field: BoundField, rows: int, columns: int, entry: Bound) -> None:
        self.field = field
        self._rows, self._columns = rows, columns
        self.entry = entry
        entry.is_common = rows * columns > 1

    def nrows(self) -> int:
        return self._rows

    def ncols(self) -> int:
        return self._columns

    def entries(self) -> list[Bound]:
        return [self.entry] * (self._rows * self._columns)

    def __getitem__(self, position: tuple[int, int]) -> Bound:
        return self.entry

    def transpose(self) -> BoundMatrix:
        return BoundMatrix(self.field, self._columns, self._rows, self.entry)

    def __add__(self, other: BoundMatrix) -> BoundMatrix:
        if (self._rows, self._columns) != (other._rows, other._columns):
            raise InputError("found matrices of different sizes in a sum, expected equal sizes")
        return BoundMatrix(self.field, self._rows, self._columns, self.entry + other.entry)

    def __sub__(self, other: BoundMatrix) -> BoundMatrix:
        return self + other

    def __neg__(self) -> BoundMatrix:
        return self

    def __mul__(self, other: Any) -> BoundMatrix:
        if not isinstance(other, BoundMatrix):
            return BoundMatrix(self.field, self._rows, self._columns, self.entry * self.field.convert(other))
        if self._columns != other._rows:
            raise InputError("found matrices of incompatible sizes in a product")
        product = self.entry * other.entry
        product.numerator *= CoefficientSize(0, log2(self._columns))
        return BoundMatrix(self.field, self._rows, other._columns, product)

    def det(self) -> Bound:
        """Bound the determinant, a sum of n! products of n entries."""
        n, entry = self._rows, self.entry
        denominator = {index: n * power for index, power in entry.denominator.items()}
        return Bound(self.field, self._minor_bound(n), entry.scale**n, denominator)

    def solve(self, right: BoundMatrix) -> BoundMatrix:
        """Bound X with self X = right by Cramer's rule: X = d adj(N) right / det N for self = N/d, N over Z[x]."""
        n, entry = self._rows, self.entry
        index = self.field.denominator(self, self._minor_bound(n))
        d = self.field.product(entry.denominator) * CoefficientSize(0, log2(entry.scale))
        inverse_bound = Bound(self.field, self._minor_bound(n - 1) * CoefficientSize(0, log2(n)) * d, 1, {index: 1})
        return BoundMatrix(self.field, n, right._columns, inverse_bound * right.entry)

    def _minor_bound(self, size: int) -> CoefficientSize:
        return self.entry.numerator**size * CoefficientSize(0, math.lgamma(size + 1) / math.log(2) + 1e-9)


def log2(value: fmpz | int) -> float:
    """Return log2 of the absolute value of an integer, rounded up; 0 for 0.

    >>> log2(-8) < 3.001, log2(0)
    (True, 0.0)
    """
    number = abs(int(value))
    if number <= 1:
        return 0.0
    shift = max(0, number.bit_length() - 60)
    return math.log2((number >> shift) + (1 if shift else 0)) + shift + 1e-9


def _lcm_exponents(left: Mapping[int, int], right: Mapping[int, int]) -> dict[int, int]:
    """Return the least common multiple of two products of D_i^k; a product is stored as {i: k, ...}."""
    return {index: max(left.get(index, 0), right.get(index, 0)) for index in {*left, *right}}


def _product_exponents(left: Mapping[int, int], right: Mapping[int, int]) -> dict[int, int]:
    """Return the product of two products of D_i^k; a product is stored as {i: k, ...}."""
    return {index: left.get(index, 0) + right.get(index, 0) for index in {*left, *right}}
