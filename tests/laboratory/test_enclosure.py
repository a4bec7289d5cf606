"""Positive entropy proved in the plane: bounds that hold, none for integrable maps, and what would make them wrong."""

import random

import pytest
from flint import arb, fmpq
from helpers import DIMENSION, quick
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF
from kahanmaps.documents.catalog import load, map_names, names
from kahanmaps.laboratory.growth.curves import reduced
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.growth.enclosure import degree_above, enclose, is_birational, lower_bound
from kahanmaps.maps.kahan import as_map
from kahanmaps.systems.quadratic import QuadraticSystem

PRIME = 2**61 - 1
PLANAR = [name for name in (*names(), *map_names()) if DIMENSION[name] == 2]
POSITIVE = ["lotka_volterra", "fibonacci", "hietarinta_viallet", "zander_120", "lotka_volterra_symplectic_euler"]


@pytest.mark.parametrize("name", quick(POSITIVE, ["fibonacci"]))
def test_the_bounds_enclose_the_dynamical_degree_that_is_explained(name):
    found = degree_growth(load(name).map, seconds=20)
    exact = float(found.dynamical_degree.digits)
    assert 1.2 < float(found.enclosure.lower) < exact <= float(found.enclosure.upper) < 3


@pytest.mark.parametrize(
    "name", quick([name for name in PLANAR if name not in POSITIVE], ["harmonic", "nahm_tetrahedral", "mcmillan"])
)
def test_no_map_of_slow_growth_gets_a_bound(name):
    assert enclose(load(name).map, None, seconds=0.2) is None


@given(st.integers(1, 10**6), st.integers(7, 200))
def test_the_bound_by_tangents_is_the_largest_degree_that_they_allow(largest, lines):
    D = degree_above(largest, lines)
    assert D >= largest
    assert lines * (D - largest) <= 6 * (D - 1)
    assert lines * (D + 1 - largest) > 6 * D


def test_the_lower_bound_is_that_of_the_distances():
    """cosh of the distance is the degree: from T_2n(x) and T_n(x), x = 3, it is (x + sqrt(x^2 - 1))/4^(1/n)."""
    one = lower_bound(2 * 99**2 - 1, 99, 3)  # T_3(3) = 99, T_6 = 2 T_3^2 - 1
    assert abs(float(one) - float((3 + arb(8).sqrt()) / arb(4).root(3))) < 1e-12
    assert lower_bound(40, 10, 1) > 1
    assert not lower_bound(39, 10, 1) > 1


def test_a_map_that_is_not_birational_is_refused(monkeypatch):
    rng = random.Random(1)
    good = reduced(load("mcmillan").map, None, rng)
    assert is_birational(good, rng)
    kahan = as_map(QuadraticSystem.from_text(["x", "y"], ["x", "y^2"]))
    assert not is_birational(kahan.at(GF(PRIME).convert(fmpq(-1)), GF(PRIME)), rng)  # into a line
    monkeypatch.setattr("kahanmaps.laboratory.growth.enclosure.is_birational", lambda *_: False)
    assert enclose(load("lotka_volterra").map, None) is None


def test_dimension_3_has_no_bounds():
    assert enclose(load("lorenz").map, None) is None
