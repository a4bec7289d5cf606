"""Linear algebra under one name over each field: solve, determinant, rank, null space.

Matrices are FLINT's own (`Field.matrix` makes them); products, sums and transposes are their operators. This file
gives the operations that FLINT spells differently, or lacks, from one kind of matrix to the next.
"""

from __future__ import annotations

from typing import Any

from flint import arb_mat, fmpq, fmpq_mat, fmpz, fmpz_mat

from kahanmaps.algebra.fields import Field
from kahanmaps.errors import PrecisionLost, SingularMatrix


def solve(matrix: Any, right: Any) -> Any:
    """The solution X of `matrix` X = `right`.

    Raises `SingularMatrix`, or `PrecisionLost` over balls, where a determinant that may be zero decides nothing.

    >>> solve(fmpq_mat([[1, 2], [3, 4]]), fmpq_mat([[1], [1]]))
    [-1]
    [ 1]
    """
    try:
        return matrix.solve(right)
    except ZeroDivisionError as error:
        if isinstance(matrix, arb_mat) and not matrix.det().is_zero():
            raise PrecisionLost("the determinant cannot be told from zero: ask for more bits") from error
        raise SingularMatrix("the matrix is singular") from error


def det(matrix: Any) -> Any:
    """The determinant, an element of the field."""
    return matrix.det()


def rank(field: Field, matrix: Any) -> int:
    """The rank. Over balls: certain, or `PrecisionLost`."""
    if isinstance(matrix, arb_mat):
        return len(_eliminate_balls(field, matrix)[1])
    if isinstance(matrix, fmpq_mat):
        return int(_integer_rows(matrix).rank())
    return int(matrix.rank())


def nullspace(field: Field, matrix: Any) -> list[tuple[Any, ...]]:
    """The basis of { v : `matrix` v = 0 } that is in reduced echelon form from the right.

    Each basis vector belongs to a column without pivot: it has a one there and a zero at every other such column, so
    the basis is determined by the space alone. Empty for a matrix of full column rank.

    >>> from kahanmaps.algebra.fields import QQ
    >>> nullspace(QQ, fmpq_mat([[2, 4]]))
    [(-2, 1)]
    """
    columns = matrix.ncols()
    reduced, pivots = _reduced_echelon(field, matrix)
    basis = []
    with field.working():
        for free in (j for j in range(columns) if j not in set(pivots)):
            vector = [field.zero] * columns
            vector[free] = field.one
            for i, pivot in enumerate(pivots):
                vector[pivot] = -reduced(i, free)
            basis.append(tuple(vector))
    return basis


def trace(matrix: Any) -> Any:
    """The sum of the diagonal entries."""
    total = matrix[0, 0]
    for i in range(1, matrix.nrows()):
        total = total + matrix[i, i]
    return total


def primitive_integers(vector: tuple[fmpq, ...]) -> tuple[fmpz, ...]:
    """The coprime integers proportional to a rational vector, the first that is not zero positive."""
    below = fmpz(1)
    for entry in vector:
        below = below.lcm(entry.q)
    integers = [entry.p * (below // entry.q) for entry in vector]
    content = fmpz(0)
    for integer in integers:
        content = content.gcd(integer)
    if content == 0:
        return tuple(integers)
    if next(integer for integer in integers if integer != 0) < 0:
        content = -content
    return tuple(integer // content for integer in integers)


def _integer_rows(matrix: fmpq_mat) -> fmpz_mat:
    """The matrix with each row multiplied by its own denominator: same rank, same null space, smaller than by one."""
    rows = []
    for row in matrix.tolist():
        below = fmpz(1)
        for entry in row:
            below = below.lcm(entry.q)
        rows.append([entry.p * (below // entry.q) for entry in row])
    return fmpz_mat(rows) if rows else fmpz_mat(0, matrix.ncols())


def _reduced_echelon(field: Field, matrix: Any) -> tuple[Any, list[int]]:
    """Entries (as a function of row and column) of the reduced echelon form, and its pivot columns."""
    if isinstance(matrix, arb_mat):
        rows, pivots = _eliminate_balls(field, matrix)
        return (lambda i, j: rows[i][j]), pivots
    below: Any = None
    if isinstance(matrix, fmpq_mat):
        reduced, below, rank_found = _integer_rows(matrix).rref()
    else:
        reduced, rank_found = matrix.rref()
    pivots = []
    column = 0
    for i in range(rank_found):
        while reduced[i, column] == 0:
            column += 1
        pivots.append(column)
        column += 1
    if below is not None:
        return (lambda i, j: fmpq(reduced[i, j], below)), pivots
    return (lambda i, j: reduced[i, j]), pivots


def _eliminate_balls(field: Field, matrix: arb_mat) -> tuple[list[list[Any]], list[int]]:
    """Gauss-Jordan with the pivot farthest from zero; where no pivot is certain, all must be zero exactly."""
    with field.working():
        rows = matrix.tolist()
        pivots: list[int] = []
        for column in range(matrix.ncols()):
            top = len(pivots)
            if top == len(rows):
                break
            best = max(range(top, len(rows)), key=lambda i: rows[i][column].abs_lower())
            if rows[best][column].contains(0):
                if all(rows[i][column].is_zero() for i in range(top, len(rows))):
                    continue
                raise PrecisionLost("the rank cannot be decided with balls this wide: ask for more bits")
            rows[top], rows[best] = rows[best], rows[top]
            lead = rows[top][column]
            rows[top] = [entry / lead for entry in rows[top]]
            rows[top][column] = field.one  # exactly: lead / lead is only a ball around it
            for i in range(len(rows)):
                if i != top and not rows[i][column].is_zero():
                    factor = rows[i][column]
                    rows[i] = [a - factor * b for a, b in zip(rows[i], rows[top], strict=True)]
                    rows[i][column] = field.zero
            pivots.append(column)
        return rows, pivots
