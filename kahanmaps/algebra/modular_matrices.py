"""Linear algebra modulo a prime below 2^63, on lists of residues."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import fmpz_mat, nmod, nmod_mat

from kahanmaps.algebra.work import count_work


def matrix(rows: Sequence[Sequence[Any]], prime: int) -> nmod_mat:
    """Return the matrix modulo a prime with these rows (at least one) of integers or residues."""
    count_work(2 + 0.3 * len(rows) * len(rows[0]))
    if rows[0] and isinstance(rows[0][0], nmod):
        return nmod_mat(rows, prime)
    return nmod_mat(fmpz_mat(rows), prime)  # twice as fast as nmod_mat(rows, prime)


def reduced_echelon_form(A: nmod_mat) -> tuple[nmod_mat, int]:
    """Return the reduced echelon form of a matrix modulo a prime, and its rank."""
    _count_elimination(A)
    form, rank = A.rref()
    return form, int(rank)


def _count_elimination(A: nmod_mat) -> None:
    count_work(10 + A.nrows() * A.ncols() * min(A.nrows(), A.ncols()) / 1500)


def multiply(A: nmod_mat, B: nmod_mat) -> nmod_mat:
    """Return the product of two matrices modulo a prime."""
    count_work(1 + A.nrows() * A.ncols() * B.ncols() / 1000)
    return A * B


def determinant(A: nmod_mat) -> int:
    """Return the determinant of a square matrix modulo a prime."""
    _count_elimination(A)
    return int(A.det())


def integers(A: nmod_mat) -> list[list[int]]:
    """Return the rows of a matrix modulo a prime as integers."""
    count_work(A.nrows() * A.ncols() / 2)
    return [list(map(int, row)) for row in A.tolist()]


def null_space(rows: Sequence[Sequence[Any]], columns: int, prime: int) -> list[list[int]]:
    """Return the reduced echelon basis of the null space of the matrix with these rows, modulo a prime."""
    if not rows:
        return [[int(i == j) for j in range(columns)] for i in range(columns)]
    form, rank = reduced_echelon_form(matrix([row[::-1] for row in rows], prime))
    return [vector[::-1] for vector in reversed(kernel(form, rank))]


def split_columns(form: Any, rank: int) -> tuple[list[int], list[int]]:
    """Return the pivot columns of a reduced echelon form of this rank, and its other columns.

    >>> split_columns(*nmod_mat([[0, 2, 4, 0], [0, 1, 2, 3]], 7).rref())
    ([1, 3], [0, 2])
    """
    pivot_columns, k = list[int](), 0
    for i in range(rank):
        while not form[i, k]:
            k += 1
        pivot_columns.append(k)
        k += 1
    return pivot_columns, sorted(set(range(form.ncols())).difference(pivot_columns))


def kernel(form: nmod_mat, rank: int) -> list[list[int]]:
    """Return a basis of the null space of a reduced echelon form: for each free column a vector that is 1 there.

    >>> kernel(nmod_mat([[1, 2, 0], [0, 0, 1]], 7), 2)
    [[5, 1, 0]]
    """
    prime, (pivot_columns, free_columns) = form.modulus(), split_columns(form, rank)
    count_work(len(free_columns) * (len(pivot_columns) / 3 + form.ncols() / 50))
    basis = []
    for k in free_columns:
        vector = [0] * form.ncols()
        vector[k] = 1
        for i, j in enumerate(pivot_columns):
            if j > k:
                break
            vector[j] = -int(form[i, k]) % prime
        basis.append(vector)
    return basis


def echelon(vectors: Sequence[Sequence[int]], prime: int) -> list[list[int]]:
    """Return the reduced echelon basis of the span of vectors modulo a prime."""
    if not vectors:
        return []
    form, rank = reduced_echelon_form(matrix(vectors, prime))
    return integers(form)[:rank]


def combine(weights: Sequence[Sequence[int]], vectors: Sequence[Sequence[int]], prime: int) -> list[list[int]]:
    """Return the combinations sum_k w_k v_k of vectors modulo a prime, one for each row w of weights."""
    return integers(multiply(matrix(weights, prime), matrix(vectors, prime))) if weights and vectors else []


def pivots(rows: Sequence[Sequence[Any]]) -> list[int]:
    """Return the pivot columns of an echelon form: the positions of the first nonzero entry of each row.

    >>> pivots(echelon([[1, 2, 0], [2, 4, 1]], 7))
    [0, 2]
    """
    return [next(k for k, entry in enumerate(row) if entry) for row in rows]


def rank(vectors: Sequence[Sequence[Any]], prime: int) -> int:
    """Return the rank of vectors modulo a prime."""
    if not vectors:
        return 0
    A = matrix(vectors, prime)
    _count_elimination(A)
    return int(A.rank())
