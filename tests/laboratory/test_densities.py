"""Invariant measures found from the right-hand sides alone: those of the literature up to integrals, and no others."""

from functools import partial

import pytest
from flint import fmpq
from helpers import DIMENSION, quick
from search_helpers import is_density, random_system, system

from kahanmaps import Certainty, KahanMap, System, find_densities, load, names, parse_rational_function
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.laboratory.laboratory import Laboratory, verdict_on
from kahanmaps.laboratory.preserve import densities as module

density_verdict = partial(verdict_on, is_density=True)

# lorenz and kirchhoff_generic: searched as far as dimension and time allow, nothing found
WITHOUT = ("lorenz", "kirchhoff_generic")
SMALL_ONES = [name for name in names() if DIMENSION[name] <= 4 and name not in WITHOUT]


@pytest.mark.parametrize("name", quick(SMALL_ONES, SMALL_ONES[::3]))
def test_densities_satisfy_the_definition_exactly(name):
    file = load(name)
    result = find_densities(file)
    assert result.densities
    assert result.reason == result.note == ""
    for density in result.densities:
        assert density.verdict is Certainty.PROVED
        assert all(is_density(file, density.text, eps) for eps in ("1/10", "-2/3"))


def test_of_hamiltonian_systems_the_determinant_is_taken():
    search = find_densities(load("henon_heiles"))
    assert [(density.text, density.evidence.method) for density in search.densities] == [
        ("4*q1^2*eps^4 + 4*q2^2*eps^4 - eps^4 - 2*eps^2 - 1", "theorem")
    ]
    assert search.degree == 2  # in the variables
    # a factor that depends on eps alone is left out
    assert [density.text for density in find_densities(load("harmonic")).densities] == ["1"]
    # not where a smaller degree was asked for
    assert find_densities(load("nahm_tetrahedral"), max_degree=1).densities == ()


def test_maps_that_are_not_invertible_have_no_density():
    # all images are the origin: phi(x~) det(I - eps f') = phi det(I + eps f'(x~)) says 0 = 0 for phi = x
    file = system("x y", "-x", "-y")
    search = find_densities(file, eps=1)
    assert (search.densities, "not invertible" in search.reason) == ((), True)
    function = parse_rational_function("x", ["x", "y", "eps"])
    assert density_verdict(with_symbols(file), function, fmpq(1))[0] is Certainty.UNDECIDED
    assert "the map is defined nowhere" in find_densities(system("x y", "x", "3*y"), eps=1).reason


def test_the_check_by_definition_refutes_a_wrong_density():
    assert not is_density(load("lotka_volterra"), "x*y + x", "1/10")


def test_the_theorem_needs_a_determinant_that_is_a_polynomial_and_not_0(monkeypatch):
    saddle = system("x y", "x", "-y")  # det(I - eps f') = 1 - eps^2
    assert module._find_hamiltonian_density(Laboratory(saddle, (), fmpq(1))) is None
    result = module._find_hamiltonian_density(Laboratory(load("henon_heiles"), (), fmpq(1, 2)))
    assert (result.verdict, result.function.denominator) == (Certainty.PROVED, 1)
    points = (fmpq(3), fmpq(-2), fmpq(5), fmpq(7)), (fmpq(0),) * 4
    determinants = [KahanMap(load("henon_heiles").system, "1/2").determinant(x) for x in points]
    values = [result.function.numerator(*x, fmpq(1, 2)) for x in points]
    assert values[0] * determinants[1] == values[1] * determinants[0] != 0
    assert module._find_hamiltonian_density(Laboratory(load("lorenz"), (), fmpq(1, 2))) is None
    monkeypatch.setattr(module, "determinant_polynomial", lambda _: None)
    assert module._find_hamiltonian_density(Laboratory(load("henon_heiles"), (), fmpq(1, 2))) is None


def test_factors_of_integrals_make_a_density_of_a_degree_that_is_not_searched(monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.preserve.densities._MAX_DEGREE", 3)
    top = System("x' = y*z; y' = -3*x*z; z' = 2*x*y")
    search = find_densities(top)
    assert [(density.degree(3), density.verdict) for density in search.densities] == [(4, Certainty.PROVED)]
    assert search.degree == 4
    assert find_densities(top, integrals=()).densities == ()


def test_random_systems_have_none():
    search = find_densities(random_system(2, 0), max_degree=5)
    assert (search.densities, search.degree, search.toml_section()) == ((), 5, "")
    assert search.reason == "no polynomial of degree at most 5, and no product of powers of known ones, is a density"
