"""Dual numbers K[d]/(d^2) over any field K: exact derivatives of computations with field operations.

f(x + d v) = f(x) + d f'(x) v, so the slope (the coefficient of d) is the derivative at x in direction v. K may itself
be a ring of dual numbers: if e^2 = 0, the coefficient of d e in f(x + d v + e w) is the second derivative of f at x
along v and w. A matrix M0 + d M1 is stored as two matrices over K. FLINT computes with them if it has matrices over K.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any

from kahanmaps.algebra.fields import Element, Field, operand
from kahanmaps.algebra.matrices import EntryMatrix, solve, trace
from kahanmaps.errors import InputError, PrecisionLost, SingularMatrix


class DualField(Field):
    """The dual numbers value + d slope over the field `base`, d^2 = 0: elements are `Dual`, matrices `DualMatrix`.

    It has all methods of `Field`, but is not a field: value + d slope is invertible only if its value is, and
    an element with value 0 need not be zero. `convert` accepts what `base` accepts, and returns constants (slope 0).

    >>> from kahanmaps.algebra.fields import QQ
    >>> x = DualField(QQ).dual(3, 1)
    >>> (x**2 / (x + 1)).slope  # (x^2 + 2 x)/(x + 1)^2
    15/16
    """

    def __init__(self, base: Field) -> None:
        self.base = base
        self.name = f"DualField({base})"
        self.characteristic = base.characteristic
        self.exact = base.exact

    def dual(self, value: Any, slope: Any) -> Dual:
        """Return the element value + d slope."""
        return Dual(self, self.base.convert(value), self.base.convert(slope))

    @property
    def zero(self) -> Dual:
        return Dual(self, self.base.zero, self.base.zero)

    @property
    def one(self) -> Dual:
        return Dual(self, self.base.one, self.base.zero)

    def convert(self, value: Any) -> Dual:
        if isinstance(value, Dual) and value.field == self:
            return value
        return Dual(self, self.base.convert(value), self.base.zero)

    def format(self, element: Dual) -> str:
        """Return `value + d*(slope)`, both in the format of `base`."""
        return f"{self.base.format(element.value)} + d*({self.base.format(element.slope)})"

    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> DualMatrix:
        elements = [self.convert(entry) for entry in entries]
        return DualMatrix(
            self,
            self.base.matrix(rows, columns, [element.value for element in elements]),
            self.base.matrix(rows, columns, [element.slope for element in elements]),
        )

    def lift_matrix(self, matrix: Any) -> DualMatrix:
        """Return a matrix over `base` as a matrix over the dual numbers with slope 0."""
        rows, columns = matrix.nrows(), matrix.ncols()
        return DualMatrix(self, matrix, self.base.matrix(rows, columns, [self.base.zero] * (rows * columns)))

    def convert_matrix(self, matrix: Any) -> DualMatrix:
        return self.lift_matrix(self.base.convert_matrix(matrix))

    def is_zero(self, element: Dual) -> bool:
        return self.base.is_zero(element.value) and self.base.is_zero(element.slope)

    def equal(self, left: Dual, right: Dual) -> bool:
        return self.base.equal(left.value, right.value) and self.base.equal(left.slope, right.slope)

    def working(self) -> AbstractContextManager[Any]:
        return self.base.working()

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, DualField) and other.base == self.base)

    def __hash__(self) -> int:
        return hash(("dual", self.base))


class Dual(Element):
    """The dual number value + d slope, d^2 = 0."""

    __slots__ = ("slope", "value")

    def __init__(self, field: DualField, value: Any, slope: Any) -> None:
        self.field = field
        self.value = value
        self.slope = slope

    def _add(self, other: Dual) -> Dual:
        return Dual(self.field, self.value + other.value, self.slope + other.slope)

    def __neg__(self) -> Dual:
        return Dual(self.field, -self.value, -self.slope)

    def _multiply(self, other: Dual) -> Dual:
        return Dual(self.field, self.value * other.value, self.value * other.slope + self.slope * other.value)

    def _divide(self, other: Dual) -> Dual:
        if self.field.base.is_zero(other.value):  # balls of FLINT divide by zero without an error
            raise ZeroDivisionError("division by a dual number with value 0")
        value = self.value / other.value
        return Dual(self.field, value, (self.slope - value * other.slope) / other.value)

    def _equals(self, other: Dual) -> bool:
        return bool(self.value == other.value and self.slope == other.slope)


class DualMatrix:
    """The matrix value + d slope; `value` and `slope` are matrices of one size over the base of `field`."""

    def __init__(self, field: DualField, value: Any, slope: Any) -> None:
        if (value.nrows(), value.ncols()) != (slope.nrows(), slope.ncols()):
            raise ValueError("value and slope of a matrix have different sizes")
        self.field = field
        self.value = value
        self.slope = slope

    def nrows(self) -> int:
        return int(self.value.nrows())

    def ncols(self) -> int:
        return int(self.value.ncols())

    def entries(self) -> list[Dual]:
        pairs = zip(self.value.entries(), self.slope.entries(), strict=True)
        return [Dual(self.field, value, slope) for value, slope in pairs]

    def tolist(self) -> list[list[Dual]]:
        entries, columns = self.entries(), self.ncols()
        return [entries[i * columns : (i + 1) * columns] for i in range(self.nrows())]

    def __getitem__(self, position: tuple[int, int]) -> Dual:
        return Dual(self.field, self.value[position], self.slope[position])

    def transpose(self) -> DualMatrix:
        return DualMatrix(self.field, self.value.transpose(), self.slope.transpose())

    def __add__(self, other: DualMatrix) -> DualMatrix:
        if not isinstance(other, DualMatrix):
            return NotImplemented
        self._require_same_field(other)
        return DualMatrix(self.field, self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: DualMatrix) -> DualMatrix:
        if not isinstance(other, DualMatrix):
            return NotImplemented
        self._require_same_field(other)
        return DualMatrix(self.field, self.value - other.value, self.slope - other.slope)

    def __neg__(self) -> DualMatrix:
        return DualMatrix(self.field, -self.value, -self.slope)

    def __mul__(self, other: Any) -> DualMatrix:
        if isinstance(other, DualMatrix):
            self._require_same_field(other)
        else:
            other = operand(self.field, other)
            if other is None:
                return NotImplemented
        return DualMatrix(self.field, self.value * other.value, self.value * other.slope + self.slope * other.value)

    def __rmul__(self, other: Any) -> DualMatrix:
        return self.__mul__(other)

    def det(self) -> Dual:
        """Return det(M0 + d M1) = det M0 (1 + d tr(M0^{-1} M1)); `_slope_of_det` gives the slope if M0 is singular."""
        value = self.value.det()
        if isinstance(self.value, EntryMatrix):  # n determinants are faster than a linear system here
            return Dual(self.field, value, self._slope_of_det())
        try:
            quotient = solve(self.value, self.slope)
        except (SingularMatrix, PrecisionLost):
            return Dual(self.field, value, self._slope_of_det())
        return Dual(self.field, value, value * trace(quotient))

    def _slope_of_det(self) -> Any:
        """Return the slope of det(M0 + d M1), the sum over j of det M0 with column j replaced by that of M1."""
        n, total = self.nrows(), self.field.base.zero
        value, slope = self.value.entries(), self.slope.entries()
        for k in range(n):
            entries = [slope[i] if i % n == k else value[i] for i in range(n * n)]
            total = total + self.field.base.matrix(n, n, entries).det()
        return total

    def solve(self, right: DualMatrix) -> DualMatrix:
        """Solve self X = right. Raises SingularMatrix (a ZeroDivisionError) if `self.value` has no inverse."""
        self._require_same_field(right)
        value = solve(self.value, right.value)
        return DualMatrix(self.field, value, solve(self.value, right.slope - self.slope * value))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, DualMatrix) or other.field != self.field:
            return NotImplemented
        return bool(self.value == other.value and self.slope == other.slope)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "\n".join(f"[{', '.join(self.field.format(entry) for entry in row)}]" for row in self.tolist())

    def _require_same_field(self, other: DualMatrix) -> None:
        if other.field != self.field:
            raise InputError(f"found a matrix over {other.field}, expected one over {self.field}")
