"""The components of the zeros of forms over GF(p), told apart by factors on surfaces."""

import pytest
from flint import Ordering, fmpq_mpoly_ctx, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.documents.catalog import load
from kahanmaps.laboratory.singular.exceptional import components

NAMES = ("x1", "x2", "x3", "z")
X1, X2, X3, Z = fmpq_mpoly_ctx.get(NAMES, Ordering.degrevlex).gens()
DIRECTION = (31, 41, 59, 26)


def components_on(form, p, curve, direction=DIRECTION, at_image=False):
    equation = load("euler_top").map.at(1, GF(p)).equations[0]
    return components(equation, [(form, at_image)], [nmod_poly(list(entry), p) for entry in curve], direction)


@pytest.mark.parametrize(("p", "degrees"), [(1000033, [1, 1, 2]), (1000003, [2, 2])])
def test_a_form_splits_modulo_primes_with_a_root_of_minus_one(p, degrees):
    curve = [(1, 2), (3, 4), (5, 6), (7, 8)]
    some = components_on((X1**2 + X2**2) * (X1 * X3 + Z**2) ** 3, p, curve)
    assert sorted(entry.degree for entry in some) == degrees
    assert sorted(entry.exponents for entry in some if entry.degree == 1) == [(1,)] * degrees.count(1)
    assert (3,) in [entry.exponents for entry in some]
    assert all(entry.order == 0 for entry in some)


def test_orders_along_a_curve_are_those_of_each_component():
    """X1 = X2 t^0 + t^3 has the order 3 on X1 = X2, 1 on X1 + X2 - 2 Z, and 0 on X3."""
    curve = [(1, 1, 0, 1), (1, 1), (5,), (1,)]
    orders = {entry.order for entry in components_on((X1**2 - X2**2) * (X1 + X2 - 2 * Z) * X3, 1000033, curve)}
    assert orders == {0, 1, 3}
    assert [entry.order for entry in components_on(X1 - X2, 1000033, [(1, 1), (1, 1), (5,), (1,)])] == [
        None
    ]  # it lies there


def test_roots_are_points_of_the_component():
    p = 1000033
    curve = [(1, 2), (3, 4), (5, 6), (7, 8)]
    for item in components_on((X1**2 + X2**2) * X3, p, curve):
        for t in range(5):
            for u in item.roots(t):
                x1, x2, x3, _ = ((a + b * t + u * w) % p for (a, b), w in zip(curve, DIRECTION, strict=True))
                assert (x1**2 + x2**2) * x3 % p == 0
    assert not any(entry.roots(t) for entry in components_on(X1**2 + X2**2, 1000003, curve) for t in range(5))
