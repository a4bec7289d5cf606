"""Points, monomials and series of flows modulo a prime, against exact orbits, FLINT's derivatives and linear algebra by
definition.
"""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from search_helpers import PRIME, system

from kahanmaps import GF, load
from kahanmaps.algebra.modular_matrices import combine, echelon, null_space, rank
from kahanmaps.algebra.polynomials import evaluate, ring
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.laboratory.modular_points import (
    ModularFlow,
    ModularMap,
    NoPoint,
    exponents_up_to,
    gradient_values,
    monomial_values,
)
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import TwoPointBasis, TwoPointMap

SMALL = 101
residues = st.integers(0, SMALL - 1)


def modular(file, eps=7):
    return ModularMap(with_symbols(file), PRIME, eps, seed=0)


@given(st.lists(residues, min_size=3, max_size=3), st.integers(0, 4))
def test_monomials_and_gradients_are_those_of_polynomials(point, degree):
    support, field, context = exponents_up_to(3, degree), GF(SMALL), ring(["x", "y", "z"])
    assert monomial_values(tuple(point), degree, SMALL) == [
        point[0] ** a * point[1] ** b * point[2] ** c % SMALL for a, b, c in support
    ]
    vector = [random.Random(k).randrange(SMALL) for k in range(len(support))]
    polynomial = context.from_dict(dict(zip(support, vector, strict=True)))
    at = [field.convert(c) for c in point]
    expected = [int(evaluate(polynomial.derivative(k), field, at)) for k in range(3)]
    assert gradient_values(vector, tuple(point), degree, SMALL) == (int(evaluate(polynomial, field, at)), expected)


matrices = st.integers(1, 5).flatmap(
    lambda n: st.lists(st.lists(residues, min_size=n, max_size=n), min_size=1, max_size=6)
)


@given(matrices)
def test_null_spaces_by_definition(rows):
    columns = len(rows[0])
    basis = null_space(rows, columns, SMALL)
    assert len(basis) == columns - rank(rows, SMALL) == rank(basis, SMALL)
    assert all(sum(a * b for a, b in zip(row, v, strict=True)) % SMALL == 0 for row in rows for v in basis)
    assert basis == echelon(basis, SMALL)


@given(matrices, st.randoms(use_true_random=False))
def test_the_echelon_form_depends_on_the_span_alone(rows, rng):
    weights = [[rng.randrange(SMALL) for _ in rows] for _ in range(len(rows) + 3)]
    mixed = combine(weights, rows, SMALL)
    if rank(weights, SMALL) == len(rows):
        assert echelon(mixed, SMALL) == echelon(rows, SMALL)
    assert len(echelon(mixed, SMALL)) <= rank(rows, SMALL)


def test_an_orbit_that_closes_has_each_of_its_points_once():
    quarter = modular(system("x y", "y", "-x"), eps=1)
    quarter.random_point = lambda: (1, 2)
    assert quarter.orbit(20) == [(1, 2), (2, PRIME - 1), (PRIME - 1, PRIME - 2), (PRIME - 2, 1)]
    assert len(modular(system("x y", "0", "0")).orbit(20)) == 1
    assert len(modular(load("lorenz")).orbit(20)) == 20


def test_a_map_defined_nowhere_is_reported():
    singular = modular(system("x y", "x", "3*y"), eps=1)
    for look in (lambda: list(singular.pairs(1)), lambda: singular.orbit(3)):
        with pytest.raises(NoPoint, match="not defined at random points"):
            look()
    assert singular.step((1, 1)) is None


@pytest.mark.parametrize("kind", ["map", "flow", "lifted"])
def test_values_before_and_after_a_step_are_multiplied_each_by_its_number(kind):
    f = load("lotka_volterra").system
    map_ = ModularFlow(f, PRIME) if kind == "flow" else ModularMap(f, PRIME, 7)
    map_ = TwoPointMap(map_, TwoPointBasis(1, 1)) if kind == "lifted" else map_
    ((x, image),) = map_.pairs(1)
    plain, weighed = map_.monomials_at_both(x, image, 2), map_.monomials_at_both(x, image, 2, (3, 5))
    for values, more, number in zip(plain, weighed, (3, 5), strict=True):
        assert [number * int(value) % PRIME for value in values] == [int(value) % PRIME for value in more]
    assert plain[0] != plain[1]


def test_the_series_of_a_solution_solve_the_equation():
    """x' = y, y' = -x from (a, b): x = a cos t + b sin t; and monomials are multiplied as series."""
    flow = ModularFlow(system("x y", "y", "-x").system, PRIME)
    rows, (a, b), period = flow.along_orbit(2, 8)
    assert period is None
    support = exponents_up_to(2, 2)
    x, y, xy = ([int(row[support.index(e)]) for row in rows] for e in ((1, 0), (0, 1), (1, 1)))
    assert [(k + 1) * x[k + 1] % PRIME for k in range(7)] == y[:7]
    assert [-(k + 1) * y[k + 1] % PRIME for k in range(7)] == x[:7]
    assert xy == [sum(x[i] * y[k - i] for i in range(k + 1)) % PRIME for k in range(8)]
    assert (x[0], y[0]) == (a, b)
