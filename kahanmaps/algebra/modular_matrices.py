"""Linear algebra modulo a prime below 2^63, on lists of residues."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import nmod_mat


def integers(matrix: nmod_mat) -> list[list[int]]:
    """The rows of a matrix modulo a prime as residues."""
    return [[int(entry) for entry in row] for row in matrix.tolist()]


def null_space(rows: Sequence[Sequence[int]], columns: int, prime: int) -> list[list[int]]:
    """The canonical basis (reduced echelon form) of the vectors that all rows annihilate, modulo a prime."""
    if not rows:
        return [[int(i == j) for j in range(columns)] for i in range(columns)]
    basis, nullity = nmod_mat(rows, prime).nullspace()
    return kernel_vectors(basis, nullity, prime)


def kernel_vectors(kernel: nmod_mat, nullity: int, prime: int) -> list[list[int]]:
    """The canonical basis of the span of the first columns of what `nmod_mat.nullspace` gives."""
    # The matrix is a square one, nearly all of it zeros that need not become integers of Python.
    return echelon([[int(kernel[i, k]) for i in range(kernel.nrows())] for k in range(nullity)], prime)


def echelon(vectors: Sequence[Sequence[int]], prime: int) -> list[list[int]]:
    """The reduced echelon basis of the span of vectors modulo a prime."""
    if not vectors:
        return []
    matrix, rank = nmod_mat(vectors, prime).rref()
    return integers(matrix)[:rank]


def combine(weights: Sequence[Sequence[int]], vectors: Sequence[Sequence[int]], prime: int) -> list[list[int]]:
    """The combinations sum_k w_k v_k of vectors modulo a prime, one for each row w of weights."""
    return integers(nmod_mat(weights, prime) * nmod_mat(vectors, prime)) if weights and vectors else []


def pivots(rows: Sequence[Sequence[Any]]) -> list[int]:
    """Where the rows of an echelon form have their first entries: columns that those before them do not span.

    >>> pivots(echelon([[1, 2, 0], [2, 4, 1]], 7))
    [0, 2]
    """
    return [next(k for k, entry in enumerate(row) if entry) for row in rows]


def rank(vectors: Sequence[Sequence[int]], prime: int) -> int:
    """The rank of vectors modulo a prime."""
    return int(nmod_mat(vectors, prime).rank()) if vectors else 0
