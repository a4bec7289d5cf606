"""Linear reversing symmetries that are signed permutations: R with f(R x) = -R f(x), so that R Phi R^{-1} = Phi^{-1}.

Source: roberts-vivaldi-2009, where the fixed points of R and Phi R settle how long symmetric cycles are.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from flint import fmpq, fmpq_mat

from kahanmaps.algebra.fields import QQ
from kahanmaps.errors import InputError
from kahanmaps.systems.quadratic import QuadraticSystem


def find_reversor(system: QuadraticSystem) -> fmpq_mat | None:
    """A signed permutation R with R^2 = I and f(R x) = -R f(x), so that R Phi R = Phi^{-1}, or None; exact.

    -I is tried first, which does for homogeneous systems; then sign changes up to dimension 10, and all signed
    permutations up to dimension 5. None says only that there is none of these.

    >>> find_reversor(QuadraticSystem.from_text(["x", "y"], ["y", "6*x^2 - 2"]))
    [1,  0]
    [0, -1]
    """
    n = system.dim
    if is_reversor(system, _signed(range(n), [-1] * n)):
        return _signed(range(n), [-1] * n)
    if n > 10:
        return None
    moves = itertools.permutations(range(n)) if n <= 5 else [tuple(range(n))]
    for move in moves:
        if any(move[move[i]] != i for i in range(n)):
            continue
        for signs in itertools.product((1, -1), repeat=n):
            if all(signs[i] == signs[move[i]] for i in range(n)):
                matrix = _signed(move, signs)
                if is_reversor(system, matrix):
                    return matrix
    return None


def is_reversor(system: QuadraticSystem, matrix: fmpq_mat) -> bool:
    """Whether f(R x) = -R f(x) for this constant matrix R: then R Phi(., eps) = Phi(., -eps) R for every eps. Exact."""
    return system.composed(matrix, [fmpq(0)] * system.dim) == system.transformed(-matrix)


def require_reversor(system: QuadraticSystem, matrix: fmpq_mat) -> None:
    """Raise InputError unless the matrix is an involution that reverses the system."""
    n = system.dim
    if (matrix.nrows(), matrix.ncols()) != (n, n):
        raise InputError(f"found a {matrix.nrows()} x {matrix.ncols()} reversing matrix, expected {n} x {n}")
    if matrix * matrix != QQ.identity(n):
        raise InputError("found a reversing matrix R with R^2 other than I, expected an involution")
    if not is_reversor(system, matrix):
        raise InputError("found a matrix R with f(R x) other than -R f(x): it does not reverse the system")


def _signed(move: Sequence[int], signs: Sequence[int]) -> fmpq_mat:
    n = len(move)
    return fmpq_mat(n, n, [signs[i] if move[i] == j else 0 for i in range(n) for j in range(n)])
