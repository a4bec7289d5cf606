"""The algebra Q[t]/chi for a squarefree chi: computation with all roots of chi at once, without a splitting field.

An identity holds for the class of t if and only if it holds for every root of chi in any field. The algebra is a
product of fields, one for each irreducible factor of chi. An element that is zero in some but not all of these fields
is a zero divisor, neither zero nor invertible.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_poly, fmpz

from kahanmaps.algebra.fields import Element, Field, rational
from kahanmaps.algebra.matrices import EntryMatrix, trace
from kahanmaps.algebra.printing import format_univariate
from kahanmaps.errors import InputError

# Above _LONG_BITS bits, a quotient is computed by a linear system instead of Euclid's algorithm. Above
# _MIN_KARATSUBA_BITS, a product of polynomials with few terms is computed by Karatsuba's formula instead of FLINT.
_LONG_BITS, _MIN_KARATSUBA_BITS = 2000, 8000
_MAX_KARATSUBA_TERMS = 6


class EtaleAlgebra(Field):
    """Q[t]/chi for a monic squarefree `chi`. Elements are `EtaleElement`, matrices `EtaleMatrix`.

    It has all methods of `Field`, but is a field only for irreducible chi.

    >>> K = EtaleAlgebra(fmpq_poly([-2, 0, 1]))
    >>> t = K.generator
    >>> 1 / (t + 1), K.norm(t + 1)
    (t - 1, -1)
    """

    characteristic = 0

    def __init__(self, chi: fmpq_poly) -> None:
        if not isinstance(chi, fmpq_poly):
            raise InputError(f"found {chi!r} of type {type(chi).__name__}, expected an fmpq_poly")
        if chi.degree() < 1 or chi.leading_coefficient() != 1:
            raise InputError(f"found chi = {format_univariate(chi)}, expected a monic polynomial, not constant")
        if chi.gcd(chi.derivative()).degree() > 0:
            raise InputError(f"found chi = {format_univariate(chi)}, expected a polynomial without repeated roots")
        self.chi = chi
        self.degree = int(chi.degree())
        self.name = f"QQ[t]/({format_univariate(chi)})"

    @property
    def zero(self) -> EtaleElement:
        return EtaleElement(self, fmpq_poly([0]))

    @property
    def one(self) -> EtaleElement:
        return EtaleElement(self, fmpq_poly([1]))

    @property
    def generator(self) -> EtaleElement:
        """The class of t, a root of chi."""
        return self.convert(fmpq_poly([0, 1]))

    def convert(self, value: Any) -> EtaleElement:
        """Convert an exact number, a polynomial in t (fmpq_poly) or an element of this algebra to an element."""
        if isinstance(value, EtaleElement):
            if value.field == self:
                return value
            raise InputError(f"found an element of {value.field}, expected one of {self}")
        if isinstance(value, fmpq_poly):
            return EtaleElement(self, value % self.chi)
        return EtaleElement(self, fmpq_poly([rational(value)]))

    def format(self, element: EtaleElement) -> str:
        return format_univariate(element.polynomial)

    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> EtaleMatrix:
        return EtaleMatrix(self, rows, columns, [self.convert(entry) for entry in entries])

    def is_zero(self, element: EtaleElement) -> bool:
        return bool(element.polynomial.is_zero())

    def trace(self, element: EtaleElement) -> fmpq:
        """Return the sum of the values of the element at the roots of chi."""
        total = fmpq(0)
        for coefficient, power_sum in zip(element.polynomial.coeffs(), self._power_sums, strict=False):
            total += coefficient * power_sum
        return total

    def norm(self, element: EtaleElement) -> fmpq:
        """Return the product of the values of the element at the roots of chi."""
        return self.chi.resultant(element.polynomial)

    @cached_property
    def _power_sums(self) -> tuple[fmpq, ...]:
        """The traces of 1, t, ..., t^(degree - 1)."""
        return tuple(trace((self.generator**k).matrix) for k in range(self.degree))

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, EtaleAlgebra) and bool(other.chi == self.chi))

    def __hash__(self) -> int:
        return hash(self.name)


class EtaleElement(Element):
    """The class of `polynomial` modulo chi, stored as the reduced polynomial."""

    __slots__ = ("polynomial",)

    def __init__(self, field: EtaleAlgebra, polynomial: fmpq_poly) -> None:
        self.field = field
        self.polynomial = polynomial

    @property
    def coefficients(self) -> list[fmpq]:
        """The coordinates of this element in the basis 1, t, ..., t^(degree - 1)."""
        return [self.polynomial[k] for k in range(self.field.degree)]

    @property
    def matrix(self) -> fmpq_mat:
        """The matrix of the multiplication by this element, in the basis 1, t, ..., t^(degree - 1)."""
        element, columns = self, []
        for _ in range(self.field.degree):
            columns.append(element.coefficients)
            element = element * self.field.generator
        return fmpq_mat(columns).transpose()

    def _add(self, other: EtaleElement) -> EtaleElement:
        return EtaleElement(self.field, self.polynomial + other.polynomial)

    def __neg__(self) -> EtaleElement:
        return EtaleElement(self.field, -self.polynomial)

    def _multiply(self, other: EtaleElement) -> EtaleElement:
        f, g = self.polynomial, other.polynomial
        # Only the constant coefficients are tested for length: if others are shorter, the product is merely slower.
        is_long = f[0].p.bit_length() > _MIN_KARATSUBA_BITS and g[0].p.bit_length() > _MIN_KARATSUBA_BITS
        product = _karatsuba_product(f, g) if is_long and self.field.degree <= _MAX_KARATSUBA_TERMS else f * g
        return EtaleElement(self.field, product % self.field.chi)

    def _divide(self, other: EtaleElement) -> EtaleElement:
        if max((max(c.p.bit_length(), c.q.bit_length()) for c in other.polynomial.coeffs()), default=0) > _LONG_BITS:
            # A linear system over Q is ten times as fast as Euclid's algorithm for long coefficients.
            try:
                solution = other.matrix.solve(fmpq_mat(self.field.degree, 1, self.coefficients))
            except ZeroDivisionError as error:
                raise ZeroDivisionError(f"division by a zero divisor in {self.field}") from error
            return EtaleElement(self.field, fmpq_poly(solution.entries()))
        gcd, inverse, _ = other.polynomial.xgcd(self.field.chi)
        if gcd.degree() != 0:
            divisor_text = "zero" if self.field.is_zero(other) else f"{other}, a zero divisor in {self.field}"
            raise ZeroDivisionError(f"division by {divisor_text}")
        return EtaleElement(self.field, self.polynomial * inverse % self.field.chi)

    def _equals(self, other: EtaleElement) -> bool:
        return bool(self.polynomial == other.polynomial)


def _karatsuba_product(f: fmpq_poly, g: fmpq_poly) -> fmpq_poly:
    """Multiply f = sum of a_i t^i and g = sum of b_i t^i, polynomials with few long coefficients.

    FLINT multiplies all pairs of coefficients, which takes two products for each pair i < j. By

        a_i b_j + a_j b_i = (a_i + a_j)(b_i + b_j) - a_i b_i - a_j b_j

    one product suffices for each pair (Karatsuba).
    """
    count = max(f.length(), g.length())
    a, b = ([numerator[k] for k in range(count)] for numerator in (f.numer(), g.numer()))
    diagonal = [x * y for x, y in zip(a, b, strict=True)]
    terms = [fmpz(0)] * (2 * count - 1)
    for i in range(count):
        terms[2 * i] += diagonal[i]
        for j in range(i):
            terms[i + j] += (a[i] + a[j]) * (b[i] + b[j]) - diagonal[i] - diagonal[j]
    return fmpq_poly(terms, f.denom() * g.denom())


class EtaleMatrix(EntryMatrix):
    """A matrix over an `EtaleAlgebra`. Elimination is not used: a nonzero pivot may be a zero divisor."""

    def det(self) -> EtaleElement:
        """Compute the determinant by the Faddeev-LeVerrier recursion, which divides by integers only."""
        n = self._rows
        if n != self._columns:
            raise ValueError("matrix must be square")
        if n == 0:
            one: EtaleElement = self.field.one
            return one
        power: EtaleMatrix = self
        coefficient: EtaleElement = trace(self)
        for k in range(2, n + 1):
            power = self * (power - self.field.identity(n) * coefficient)
            coefficient = trace(power) / k
        return coefficient if n % 2 else -coefficient

    def solve(self, right: EtaleMatrix) -> EtaleMatrix:
        """Solve self X = right as a linear system over Q.

        Raises ZeroDivisionError if the determinant is not a unit.
        """
        if self._rows != self._columns or self._rows != right._rows:
            raise ValueError("matrix must be square, and the right side of the same height")
        size, degree, columns = self._rows * self.field.degree, self.field.degree, right._columns
        entries: list[fmpq] = []
        for row in self.tolist():
            blocks = [entry.matrix.tolist() for entry in row]
            entries += [number for k in range(degree) for block in blocks for number in block[k]]
        right_entries = [entry.polynomial[k] for row in right.tolist() for k in range(degree) for entry in row]
        coefficients = fmpq_mat(size, size, entries).solve(fmpq_mat(size, columns, right_entries))
        solution = [
            EtaleElement(self.field, fmpq_poly([coefficients[i * degree + k, j] for k in range(degree)]))
            for i in range(self._rows)
            for j in range(columns)
        ]
        return EtaleMatrix(self.field, self._rows, columns, solution)

    def _dot(self, row: Sequence[EtaleElement], column: Sequence[EtaleElement]) -> EtaleElement:
        total = fmpq_poly([0])
        for a, b in zip(row, column, strict=True):
            total += a.polynomial * b.polynomial
        return EtaleElement(self.field, total % self.field.chi)
