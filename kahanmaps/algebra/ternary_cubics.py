"""Aronhold's invariants S and T of a ternary cubic form, which determine the j-invariant of the plane curve."""

from __future__ import annotations

import itertools
from collections import Counter
from typing import Any

from flint import fmpq

from kahanmaps.algebra.duals import DualField
from kahanmaps.algebra.fields import Field

Cubic = dict[tuple[int, int, int], Any]


def aronhold_invariants(K: Field, cubic: Cubic) -> tuple[Any, Any]:
    """Return the invariants S and T of F = sum of a_ijk X_i X_j X_k, of degrees 4 and 6 in the coefficients.

    The curve F = 0 is singular if and only if T^2 + 64 S^3 = 0, and j = 110592 S^3/(T^2 + 64 S^3).

    Args:
        K: the field of the coefficients.
        cubic: a_ijk for 0 <= i <= j <= k <= 2, the entries of the symmetric tensor.

    Source: salmon-1879, normalized to S = m - m^4 and T = 1 - 20 m^3 - 8 m^6 for X^3 + Y^3 + Z^3 + 6 m X Y Z.

    >>> from kahanmaps.algebra.fields import QQ
    >>> m = fmpq(2)
    >>> a = {index: fmpq(0) for index in itertools.combinations_with_replacement(range(3), 3)}
    >>> aronhold_invariants(QQ, {**a, (0, 0, 0): fmpq(1), (1, 1, 1): fmpq(1), (2, 2, 2): fmpq(1), (0, 1, 2): m})
    (-14, -671)
    """
    # Salmon's formula for S, evaluated at the cubic F + 6 d Hess F over dual numbers: its value is S + d T for d^2 = 0.
    dual, six, covariant = DualField(K), K.convert(fmpq(6)), hessian(K, cubic)
    two, three = dual.convert(fmpq(2)), dual.convert(fmpq(3))
    F: Cubic = {index: dual.dual(a, six * covariant[index]) for index, a in cubic.items()}
    a, b, c, m = F[0, 0, 0], F[1, 1, 1], F[2, 2, 2], F[0, 1, 2]
    a2, a3, b1 = F[0, 0, 1], F[0, 0, 2], F[0, 1, 1]
    b3, c1, c2 = F[1, 1, 2], F[0, 2, 2], F[1, 2, 2]
    p, q, r, m2 = b1 * c1, c2 * a2, a3 * b3, m * m
    S = (
        a * b * c * m
        - (b * c * a2 * a3 + c * a * b1 * b3 + a * b * c1 * c2)
        - m * (a * b3 * c2 + b * c1 * a3 + c * a2 * b1)
        + (a * b1 * c2 * c2 + a * c1 * b3 * b3 + b * a2 * c1 * c1 + b * c2 * a3 * a3 + c * b3 * a2 * a2)
        + c * a3 * b1 * b1
        - m2 * m2
        + two * m2 * (p + q + r)
        - three * m * (a2 * b3 * c1 + a3 * b1 * c2)
        - (p * p + q * q + r * r)
        + (q * r + r * p + p * q)
    )
    return S.value, S.slope


def hessian(K: Field, cubic: Cubic) -> Cubic:
    """Return the determinant of the second derivatives of a cubic, divided by 216; it is a ternary cubic again."""
    derivatives = {(i, j): [cubic[_sorted_indices(i, j, k)] for k in range(3)] for i in range(3) for j in range(3)}
    coefficients = dict.fromkeys(cubic, K.zero)
    for p in itertools.permutations(range(3)):
        is_even = p in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        rows = [derivatives[i, p[i]] for i in range(3)]
        for k in itertools.product(range(3), repeat=3):
            term = rows[0][k[0]] * rows[1][k[1]] * rows[2][k[2]]
            index = _sorted_indices(*k)
            coefficients[index] = coefficients[index] + term if is_even else coefficients[index] - term
    # The coefficient of X_i X_j X_k is the entry a_ijk times the number of distinct orders of the indices.
    multiplicities = {index: {1: 1, 2: 3, 3: 6}[len(Counter(index))] for index in coefficients}
    return {index: value * K.convert(fmpq(1, multiplicities[index])) for index, value in coefficients.items()}


def _sorted_indices(i: int, j: int, k: int) -> tuple[int, int, int]:
    a, b, c = sorted((i, j, k))
    return a, b, c
