"""Aronhold's invariants against the invariants of Weierstrass curves and of Hesse's pencil."""

import random
from itertools import combinations_with_replacement

import pytest
from flint import fmpq, fmpq_mat

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.ternary_cubics import aronhold_invariants

INDICES = list(combinations_with_replacement(range(3), 3))


def cubic(**coefficients):
    """The symmetric tensor with these entries; x, y, z are the indices 0, 1, 2."""
    names = {"".join("xyz"[k] for k in index): index for index in INDICES}
    return {index: fmpq(0) for index in INDICES} | {names[name]: fmpq(value) for name, value in coefficients.items()}


@pytest.mark.parametrize(("a", "b"), [(fmpq(-2), fmpq(3)), (fmpq(1, 7), fmpq(-5)), (fmpq(0), fmpq(1)), (fmpq(-3), 2)])
def test_they_give_the_j_invariant_of_a_weierstrass_curve(a, b):
    """y^2 z = x^3 + a x z^2 + b z^3, singular for a = -3, b = 2."""
    S, T = aronhold_invariants(QQ, cubic(xxx=1, xzz=a / 3, zzz=b, yyz=fmpq(-1, 3)))
    discriminant = T * T + 64 * S**3
    assert (discriminant == 0) is (4 * a**3 + 27 * b * b == 0)
    assert 110592 * S**3 * (4 * a**3 + 27 * b * b) == 6912 * a**3 * discriminant


def test_they_are_invariants_of_degree_4_and_6():
    """A change of variables with determinant d multiplies them by d^4 and d^6."""
    rng = random.Random(5)
    F = {index: fmpq(rng.randint(-5, 5)) for index in INDICES}
    g = [[fmpq(rng.randint(-3, 3)) for _ in range(3)] for _ in range(3)]
    tensor = {(i, j, k): F[tuple(sorted((i, j, k)))] for i in range(3) for j in range(3) for k in range(3)}
    moved = {
        (a, b, c): sum(value * g[i][a] * g[j][b] * g[k][c] for (i, j, k), value in tensor.items())
        for a, b, c in INDICES
    }
    det = fmpq_mat(g).det()
    assert det != 0
    S, T = aronhold_invariants(QQ, F)
    assert aronhold_invariants(QQ, moved) == (S * det**4, T * det**6)
