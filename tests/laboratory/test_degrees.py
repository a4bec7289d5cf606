"""Degrees of iterates: known sequences, an implementation of its own with gcds, and maps that are not there.

The sequences were computed by others, modulo two primes each, or are in the literature: 2 n^2 + 1 of the Euler top,
1 + sqrt 2, and the tribonacci number of zander-2021.
"""

import random
from dataclasses import replace

import pytest
from helpers import DIMENSION, quick
from search_helpers import polynomial_degrees

from kahanmaps import Budget, DegreeGrowth, QuadraticSystem, TimeLimit, degree_growth, load, names
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth import curves
from kahanmaps.laboratory.singular.singularities import Patterns

DAILY = ["riccati", "weierstrass", "euler_top", "henon_heiles", "zander_120", "paper_m3"]
OPEN = Patterns((), None, False, "not looked at")


@pytest.mark.parametrize("name", quick(names(), DAILY))
def test_the_degrees_of_the_catalogue(name):
    known = load(name).catalog["degrees"]
    growth = degree_growth(load(name).system, max_terms=len(known), seed=5)
    assert (list(growth.degrees), growth.ended, growth.notes) == ([1, *known], "terms", ())


@pytest.mark.parametrize("seed", range(3))
def test_polynomials_with_gcds_give_the_same_for_random_systems(seed):
    rng = random.Random(seed)
    names = ["x", "y", "z"][: 1 + seed % 3]
    monomials = [*names, *(f"{a}*{b}" for a in names for b in names), "1"]
    rhs = ["+".join(f"({rng.randint(-2, 2)})*{m}" for m in monomials) for _ in names]
    system = QuadraticSystem.from_text(names, rhs)
    assert list(degree_growth(system, max_terms=3).degrees[1:]) == polynomial_degrees(system, 3, seed)


@pytest.mark.parametrize(
    "name", quick([n for n in names() if DIMENSION[n] <= 5], ["euler_top", "weierstrass", "volterra_periodic_4"])
)
def test_minors_and_power_series_walk_the_same_curves(name, monkeypatch):
    """Two implementations of one step; the minors serve up to dimension 5, the series above."""
    file = load(name)
    terms = 4 if file.system.dim > 3 else 6
    for eps in (None, "2/7"):
        monkeypatch.setattr(curves, "_MAX_MINORS_DIMENSION", 5)
        by_minors = degree_growth(file.system, eps, max_terms=terms)
        monkeypatch.setattr(curves, "_MAX_MINORS_DIMENSION", 0)
        assert degree_growth(file.system, eps, max_terms=terms).degrees == by_minors.degrees
        assert len(by_minors.degrees) == terms + 1


def test_minors_above_a_common_factor_that_a_mixture_has_by_chance(monkeypatch):
    """Its quotients are no polynomials: then every entry is taken."""
    expected = degree_growth(load("weierstrass").system, max_terms=5).degrees
    monkeypatch.setattr(curves.Line, "_random_combination", lambda self, entries: 0 * entries[0])
    assert degree_growth(load("weierstrass").system, max_terms=5).degrees == expected


def with_degrees(*degrees):
    return DegreeGrowth(degrees, None, "terms", "", 0, (), ())


@pytest.mark.parametrize("n", [6, 30])
def test_exponential_growth_looks_exponential_and_polynomial_growth_does_not(n):
    for rate in (1.5, 2, 6):
        assert with_degrees(*(1 + round(10 * rate**k) for k in range(n + 1))).looks_exponential
    for power in (1, 3, 9):
        assert not with_degrees(*(1 + k**power for k in range(n + 1))).looks_exponential
        assert not with_degrees(*(1 + -(-(k**power) * 3 // 4) for k in range(n + 1))).looks_exponential


@pytest.mark.parametrize("largest", [0, 5])
def test_the_largest_degree_is_reached_exactly_by_series_and_by_minors(largest, monkeypatch):
    """Degrees 1, 3, 7, 17: a bound of 17 admits the last one and a bound of 16 does not."""
    monkeypatch.setattr(curves, "_MAX_MINORS_DIMENSION", largest)
    system = load("henon_heiles").system
    assert degree_growth(system, max_terms=3, max_degree=17, patterns=OPEN).degrees == (1, 3, 7, 17)
    growth = degree_growth(system, max_terms=3, max_degree=16, patterns=OPEN)
    assert (growth.degrees, growth.ended) == ((1, 3, 7), "degree")
    assert growth.message == "the degree of iterate 3 is above 16"


@pytest.mark.parametrize(
    ("rhs", "eps", "degrees", "ended"),
    [
        (["0"], None, (1,) * 8, "proved"),
        (["x"], 1, (1,), "singular"),
        (["x"], -1, (1, 0), "constant"),
        (["x^2", "y"], 1, (1,), "singular"),
    ],
)
def test_degenerate_maps_are_values(rhs, eps, degrees, ended):
    growth = degree_growth(QuadraticSystem.from_text(["x", "y"][: len(rhs)], rhs), eps)
    assert (growth.degrees, growth.ended) == (degrees, ended)
    assert growth.text
    assert growth.growth is {"constant": Growth.ZERO, "singular": Growth.UNKNOWN}.get(ended, Growth.BOUNDED)


def test_the_budget_is_a_limit():
    growth = degree_growth(load("henon_heiles").system, effort=Budget(100_000))
    assert (growth.ended, growth.degrees, growth.growth) == ("budget", (1, 3, 7, 17, 39, 93, 215, 495), Growth.UNKNOWN)
    assert growth.message == "work limit reached at iterate 8; raise --effort"
    known = degree_growth(load("lotka_volterra").system).patterns
    growth = degree_growth(load("lotka_volterra").system, effort=Budget(10_000), patterns=known)
    assert (growth.ended, growth.dynamical_degree_bounds) == ("derived", None)
    assert growth.notes == ("work limit reached before bounds of the dynamical degree were proved; raise --effort",)
    growth = degree_growth(load("riccati").system, effort=Budget(2_000), max_terms=10_000)
    assert (growth.ended, growth.growth) == ("budget", Growth.BOUNDED)


def test_a_time_limit_keeps_the_degrees_that_were_measured():
    def stop(sentence):
        if sentence.startswith("degrees: iterate 5"):
            raise TimeLimit("the time limit of 1 s is over")

    growth = degree_growth(load("henon_heiles").system, progress=stop)
    assert (growth.ended, growth.degrees) == ("stopped", (1, 3, 7, 17, 39))
    assert growth.message == "the time limit of 1 s is over at iterate 5"
    assert len(growth.to_json()["lines"]) == 2

    def stop_later(sentence):
        if sentence.startswith("dynamical degree"):
            raise TimeLimit("the time limit of 1 s is over")

    short = {"max_terms": 6, "patterns": OPEN}
    growth = degree_growth(load("lotka_volterra").system, progress=stop_later, **short)
    complete = degree_growth(load("lotka_volterra").system, **short)
    message = f"{complete.message}; the time limit of 1 s is over"
    assert growth == replace(complete, dynamical_degree_bounds=None, message=message)
    with pytest.raises(TimeLimit):  # a stage of something else, which ends as well
        degree_growth(load("henon_heiles").system, effort=Budget(1e9), progress=stop)


def test_lines_in_special_position_are_replaced(monkeypatch):
    """Modulo 101 every line has a good chance to be special; larger degrees win, and it is told."""
    primes = iter([101, 101, 103, 107, 2**61 - 1, 2**61 - 1, 2**61 - 1, 2**61 - 1, 2**61 - 1])
    monkeypatch.setattr(curves, "random_prime", lambda _: next(primes))
    growth = degree_growth(load("euler_top").system, max_terms=7, seed=1)
    assert growth.degrees == (1, 3, 9, 19, 33, 51, 73, 99)
    assert any("was replaced by another" in note for note in growth.notes)
