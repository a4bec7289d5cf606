"""Rows of the equation M(x) x~ = r(x) whose left side does not depend on x, solved once and for all.

On integers over one denominator such a row of M is a power of the denominator times constants, which would go into the
determinant. Mechanical systems q' = p, p' = F(q) have it in half of their rows, polynomial maps in all of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq_mat, fmpz, fmpz_mat


class ConstantRows:
    """Rows A x~ = r of a system with integers, `rows` their places in it; A has rational entries and independent rows.

    With A = (A_1 | A_2) up to the order of columns, A_1 invertible, x~_1 = A_1^{-1} r - A_1^{-1} A_2 x~_2 goes into the
    other rows.
    """

    def __init__(self, rows: Sequence[int], A: fmpq_mat) -> None:
        n, places = A.ncols(), range(A.nrows())
        reduced, rank = A.rref()
        self._rows = list(rows)
        self._columns = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
        self._others = [i for i in range(n) if i not in self._rows]
        self._free = [j for j in range(n) if j not in self._columns]
        solved = fmpq_mat([[A[i, j] for j in self._columns] for i in places]).inv()
        both = [[*solved.tolist()[i], *(reduced[i, j] for j in self._free)] for i in places]
        integers, self._below = fmpq_mat(both).numer_denom()
        self._solved = _part(integers, places, places)
        self._rest = _part(integers, places, range(len(places), n))

    def without(self, matrix: fmpz_mat, right: fmpz_mat, scale: fmpz) -> tuple[fmpz_mat, fmpz_mat]:
        """The system that is left for the other coordinates, times `scale`; it may be empty.

        `scale` stands in front of A in the matrix, and times it are all coordinates that are solved for.
        """
        known = self._solved * _part(right, self._rows, [0])
        bound, free = _part(matrix, self._others, self._columns), _part(matrix, self._others, self._free)
        side = _part(right, self._others, [0]) * (scale * self._below) - bound * known
        return free * self._below - bound * self._rest, side

    def whole(
        self, right: fmpz_mat, scale: fmpz, numerators: Sequence[fmpz], denominator: fmpz
    ) -> tuple[list[fmpz], fmpz]:
        """Numerators and denominator of the solution, perhaps with a factor in common, from that of what was left."""
        free = fmpz_mat(len(numerators), 1, list(numerators))
        bound = self._solved * _part(right, self._rows, [0]) * denominator - self._rest * free
        found = dict(zip(self._columns, bound.entries(), strict=True))
        found |= {j: entry * self._below for j, entry in zip(self._free, numerators, strict=True)}
        return [found[j] for j in range(len(found))], scale * denominator * self._below


def _part(matrix: fmpz_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpz_mat:
    return fmpz_mat(len(rows), len(columns), [matrix[i, j] for i in rows for j in columns])
