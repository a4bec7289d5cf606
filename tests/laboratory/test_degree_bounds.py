"""Positive entropy proved in the plane: bounds that hold, none for integrable maps, and what would make them wrong."""

import random

import pytest
from flint import arb, fmpq, fmpz_mat
from helpers import DIMENSION, quick
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps import GF, QuadraticSystem, degree_growth
from kahanmaps.documents.catalog import load, map_names, names
from kahanmaps.laboratory.growth.curves import reduce_map
from kahanmaps.laboratory.growth.degree_bounds import (
    bound_dynamical_degree,
    degree_above,
    is_birational,
    lower_bound,
    round_up,
)
from kahanmaps.maps.kahan import as_map

PRIME = 2**61 - 1
PLANAR = [name for name in (*names(), *map_names()) if DIMENSION[name] == 2]
INTEGRABLE = [name for name in PLANAR if load(name).catalog["verdict"] != "not integrable"]
POSITIVE = ["lotka_volterra", "hietarinta_viallet", "zander_120", "lotka_volterra_symplectic_euler"]

# of the standard quadratic transformation, on the class of a line and of 11 points
UNIT = fmpz_mat(12, 12, [int(i == j) for i in range(12) for j in range(12)])
QUADRATIC = fmpz_mat(UNIT)
for i, row in enumerate([[2, 1, 1, 1], [-1, 0, -1, -1], [-1, -1, 0, -1], [-1, -1, -1, 0]]):
    for j, entry in enumerate(row):
        QUADRATIC[i, j] = entry


@pytest.mark.parametrize("name", quick(POSITIVE, ["hietarinta_viallet"]))
def test_the_bounds_enclose_the_dynamical_degree_that_is_derived(name):
    growth = degree_growth(load(name).map)
    exact = float(growth.dynamical_degree.digits)
    bounds = growth.dynamical_degree_bounds
    assert 0.9 * exact < float(bounds.lower) < exact <= float(bounds.upper) < 3


@pytest.mark.parametrize("name", quick(INTEGRABLE, ["harmonic", "nahm_tetrahedral", "mcmillan"]))
def test_no_integrable_map_gets_a_bound(name):
    assert bound_dynamical_degree(load(name).map, None, effort=-3) is None


@given(st.integers(1, 10**6), st.integers(7, 200))
def test_the_bound_by_tangents_is_the_largest_degree_that_they_allow(largest, lines):
    D = degree_above(largest, lines)
    assert D >= largest
    assert lines * (D - largest) <= 6 * (D - 1)
    assert lines * (D + 1 - largest) > 6 * D


def test_the_lower_bound_is_attained_on_the_axis():
    """T_n(3) = cosh(n log(3 + sqrt 8)): degrees of a translation along a line, of which nothing is lost."""
    entry = lower_bound(2 * 99**2 - 1, 99, 3)  # T_3(3) = 99, T_6 = 2 T_3^2 - 1
    assert entry.overlaps(3 + arb(8).sqrt())
    assert entry.rad() < 1e-30


@given(st.integers(1, 10**6), st.integers(1, 10**4))
def test_degrees_of_quadratic_growth_are_just_not_enough(c, n):
    below, above = 1 + c * (2 * n) ** 2, 1 + c * n**2
    assert lower_bound(below, above, n) is None
    assert lower_bound(below, above + 1, n) is None
    assert lower_bound(below + 1, above, n) > 1
    assert lower_bound(100, 1, n) is None


@given(st.lists(st.permutations(range(11)), min_size=1, max_size=4))
def test_the_bound_holds_for_compositions_of_quadratic_transformations(permutations):
    """Where no two base points meet degrees are those of a matrix of the Weyl group, here of 11 points.

    A composition of s: (d; m) -> (2 d - m1 - m2 - m3; ...), with permutations between. By the triangle inequality its
    translation length is at most arccosh(D_n)/n for every n, in any of the three kinds of isometries.
    """
    word = UNIT
    for permutation in permutations:
        rows = UNIT.tolist()
        word = QUADRATIC * fmpz_mat([rows[0], *(rows[k + 1] for k in permutation)]) * word
    degrees = [int((word**n)[0, 0]) for n in range(17)]
    above = min((d.acosh() / n).exp().upper() for n, d in enumerate(map(arb, degrees)) if n)
    for n in range(1, 9):
        bound = lower_bound(degrees[2 * n], degrees[n], n)
        assert bound is None or bound.lower() <= above


def test_printed_bounds_are_rounded_outward():
    assert lower_bound(10, 3, 1).contains(2)  # x + 1/x = 9/2 - 2
    assert round_up(arb(2), -1) == "1.999999"
    assert round_up(arb(2).sqrt().lower(), -1) == "1.414213"
    assert round_up(arb(2, 1e-3).lower(), -1) == "1.998999"
    assert round_up(arb(2).sqrt().upper()) == "1.414214"
    assert round_up(arb(2)) == "2"


def test_a_map_that_is_not_birational_is_refused(monkeypatch):
    rng = random.Random(1)
    good = reduce_map(load("mcmillan").map, None, rng)
    assert is_birational(good, rng)
    kahan = as_map(QuadraticSystem.from_text(["x", "y"], ["x", "y^2"]))
    assert not is_birational(kahan.at(GF(PRIME).convert(fmpq(-1)), GF(PRIME)), rng)  # into a line
    monkeypatch.setattr("kahanmaps.laboratory.growth.degree_bounds.is_birational", lambda *_: False)
    assert bound_dynamical_degree(load("lotka_volterra").map, None) is None
    assert bound_dynamical_degree(load("lorenz").map, None) is None  # bounds are for the plane
