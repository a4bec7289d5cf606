"""Linear algebra with the same functions over each field: solution, determinant, rank, null space.

Matrices are FLINT's own (created by `Field.matrix`), with their operators for products, sums and transposes. This
module has the operations that FLINT lacks, or whose names in FLINT depend on the type of the matrix, and `EntryMatrix`
for rings without FLINT matrices.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Self

from flint import acb_mat, arb_mat, fmpq, fmpq_mat, fmpz, fmpz_mat

from kahanmaps.algebra.fields import Field, operand
from kahanmaps.algebra.integers import content, over_common_denominator
from kahanmaps.algebra.modular_matrices import split_columns
from kahanmaps.errors import PrecisionLost, SingularMatrix


def solve(matrix: Any, right: Any) -> Any:
    """Solve `matrix` X = `right`.

    Raises `SingularMatrix`; over balls also `PrecisionLost`, if the ball of the determinant contains zero.

    >>> solve(fmpq_mat([[1, 2], [3, 4]]), fmpq_mat([[1], [1]]))
    [-1]
    [ 1]
    """
    try:
        return matrix.solve(right)
    except ZeroDivisionError as error:
        if isinstance(matrix, arb_mat | acb_mat) and not matrix.det().is_zero():
            raise PrecisionLost("the determinant cannot be distinguished from zero: use more bits") from error
        raise SingularMatrix("the matrix is singular") from error


def det(matrix: Any) -> Any:
    """Return the determinant, an element of the field."""
    return matrix.det()


def rank(field: Field, matrix: Any) -> int:
    """Return the rank. Raises `PrecisionLost` if the matrix has balls as entries and its rank is uncertain."""
    if isinstance(matrix, arb_mat | acb_mat | EntryMatrix):
        return len(_eliminate(field, matrix)[1])
    if isinstance(matrix, fmpq_mat):
        return int(_integer_rows(matrix).rank())
    return int(matrix.rank())


def nullspace(field: Field, matrix: Any) -> list[tuple[Any, ...]]:
    """Return the basis of { v : `matrix` v = 0 } in echelon form, reduced from the last column to the first.

    Each basis vector belongs to a column without pivot: it is 1 there and 0 at every other column without pivot, so
    the basis depends only on the space. The basis is empty if the rank is the number of columns.

    >>> from kahanmaps.algebra.fields import QQ
    >>> nullspace(QQ, fmpq_mat([[2, 4]]))
    [(-2, 1)]
    """
    columns = matrix.ncols()
    rows: Any = None
    if isinstance(matrix, arb_mat | acb_mat | EntryMatrix):
        rows, pivots = _eliminate(field, matrix)
    elif isinstance(matrix, fmpq_mat):
        integers, denominator, rank_found = _integer_rows(matrix).rref()
        pivots = split_columns(integers, rank_found)[0]
    else:
        echelon_form, rank_found = matrix.rref()
        rows, pivots = echelon_form.tolist(), split_columns(echelon_form, rank_found)[0]
    basis = []
    with field.working():
        for k in (j for j in range(columns) if j not in set(pivots)):
            vector = [field.zero] * columns
            vector[k] = field.one
            for i, pivot in enumerate(pivots):
                vector[pivot] = -rows[i][k] if rows is not None else fmpq(-integers[i, k], denominator)
            basis.append(tuple(vector))
    return basis


def trace(matrix: Any) -> Any:
    """Return the sum of the diagonal entries."""
    total = matrix[0, 0]
    for i in range(1, matrix.nrows()):
        total = total + matrix[i, i]
    return total


def combination_of(weights: Sequence[Any], matrices: Sequence[Any]) -> Any:
    """Return the sum of `weights[k] * matrices[k]`, for at least one matrix."""
    total = matrices[0] * weights[0]
    for weight, matrix in zip(weights[1:], matrices[1:], strict=True):
        if weight != 0:
            total = total + matrix * weight
    return total


def primitive_integers(vector: tuple[fmpq, ...]) -> tuple[fmpz, ...]:
    """Return the coprime integers proportional to a rational vector; the first nonzero integer is positive."""
    integers, _ = over_common_denominator(vector)
    gcd = content(integers)
    if gcd == 0:
        return tuple(integers)
    if next(integer for integer in integers if integer != 0) < 0:
        gcd = -gcd
    return tuple(integer // gcd for integer in integers)


class EntryMatrix(ABC):
    """A matrix stored as the list of its entries, row by row. Subclasses define `det` and `solve`."""

    def __init__(self, field: Any, rows: int, columns: int, entries: Sequence[Any]) -> None:
        self.field = field
        self._rows = rows
        self._columns = columns
        self._entries = list(entries)
        if len(self._entries) != rows * columns:
            raise ValueError(f"found {len(self._entries)} entries for a {rows} x {columns} matrix")

    @abstractmethod
    def det(self) -> Any:
        """Return the determinant."""

    @abstractmethod
    def solve(self, right: Self) -> Self:
        """Return X with self X = right, for any number of columns. Raises ZeroDivisionError if self is singular."""

    def nrows(self) -> int:
        return self._rows

    def ncols(self) -> int:
        return self._columns

    def entries(self) -> list[Any]:
        return list(self._entries)

    def tolist(self) -> list[list[Any]]:
        return [self._entries[i * self._columns : (i + 1) * self._columns] for i in range(self._rows)]

    def __getitem__(self, position: tuple[int, int]) -> Any:
        i, j = position
        if not (0 <= i < self._rows and 0 <= j < self._columns):
            raise IndexError(f"index {i},{j} exceeds matrix dimensions")
        return self._entries[i * self._columns + j]

    def transpose(self) -> Self:
        entries = [self[i, j] for j in range(self._columns) for i in range(self._rows)]
        return type(self)(self.field, self._columns, self._rows, entries)

    def __add__(self, other: Self) -> Self:
        if not isinstance(other, type(self)):
            return NotImplemented
        if (self._rows, self._columns) != (other._rows, other._columns):
            raise ValueError("incompatible shapes for matrix addition")
        return self._with_entries([a + b for a, b in zip(self._entries, other._entries, strict=True)])

    def __neg__(self) -> Self:
        return self._with_entries([-entry for entry in self._entries])

    def __sub__(self, other: Self) -> Self:
        if not isinstance(other, type(self)):
            return NotImplemented
        return self + (-other)

    def __mul__(self, other: Any) -> Self:
        if not isinstance(other, type(self)):
            return self.__rmul__(other)
        if self._columns != other._rows:
            raise ValueError("incompatible shapes for matrix multiplication")
        rows, columns = self.tolist(), other.transpose().tolist()
        entries = [self._dot(row, column) for row in rows for column in columns]
        return type(self)(self.field, self._rows, other._columns, entries)

    @abstractmethod
    def _dot(self, row: Sequence[Any], column: Sequence[Any]) -> Any:
        """Return the entry of a matrix product: a row times a column."""

    def __rmul__(self, other: Any) -> Self:
        factor = operand(self.field, other)
        return NotImplemented if factor is None else self._with_entries([entry * factor for entry in self._entries])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)):
            return NotImplemented
        return (self._rows, self._columns, self._entries) == (other._rows, other._columns, other._entries)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "\n".join(f"[{', '.join(self.field.format(entry) for entry in row)}]" for row in self.tolist())

    def _with_entries(self, entries: Sequence[Any]) -> Self:
        return type(self)(self.field, self._rows, self._columns, entries)


def _integer_rows(matrix: fmpq_mat) -> fmpz_mat:
    """Multiply each row by its common denominator: rank and null space do not change, and the entries stay short."""
    rows = [over_common_denominator(row)[0] for row in matrix.tolist()]
    return fmpz_mat(rows) if rows else fmpz_mat(0, matrix.ncols())


def _eliminate(field: Field, matrix: Any) -> tuple[list[list[Any]], list[int]]:
    """Return the rows and the pivot columns of the reduced echelon form of an `EntryMatrix` or a matrix of balls."""
    with field.working():
        rows: list[list[Any]] = [*matrix.tolist()]
        pivots: list[int] = []
        for column in range(matrix.ncols()):
            target_row = len(pivots)
            candidates = [k for k in range(target_row, len(rows)) if not _is_zero(rows[k][column])]
            if not candidates:
                continue
            pivot_row = candidates[0]
            if hasattr(rows[pivot_row][column], "abs_lower"):  # over balls take the pivot farthest from zero
                pivot_row = max(candidates, key=lambda k: rows[k][column].abs_lower())
                if rows[pivot_row][column].contains(0):
                    raise PrecisionLost("the rank cannot be decided with balls this wide: use more bits")
            rows[target_row], rows[pivot_row] = rows[pivot_row], rows[target_row]
            pivot_entry = rows[target_row][column]
            rows[target_row] = [entry / pivot_entry for entry in rows[target_row]]
            rows[target_row][column] = field.one  # exactly 1; over balls the quotient is only a ball around 1
            for i in range(len(rows)):
                if i != target_row and not _is_zero(rows[i][column]):
                    factor = rows[i][column]
                    rows[i] = [a - factor * b for a, b in zip(rows[i], rows[target_row], strict=True)]
                    rows[i][column] = field.zero
            pivots.append(column)
        return rows, pivots


def _is_zero(entry: Any) -> bool:
    """Whether an entry is certainly zero. Trap: for a ball that contains 0, both == 0 and != 0 are False."""
    return bool(entry == 0)
