"""Formulas that were found are certified: an expansion decides, and an undefined formula is undecided. Where the
planes of a member separate, identities are short; they are the same ones.
"""

import pytest
from flint import fmpq, fmpq_mat
from helpers import points
from hypothesis import given
from search_helpers import integrals_of, system

from kahanmaps import KahanMap, find_densities, load, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Decision
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.laboratory import laboratory as module
from kahanmaps.laboratory.laboratory import Laboratory, separate_planes, verdict_on

ROTATION = load("harmonic").system


def function(text: str):
    return parse_rational_function(text, ["x", "y", "eps"])


@pytest.fixture
def blind(monkeypatch):
    """Random points that let everything pass."""
    passed = Decision(Certainty.SUPPORTED, Evidence("random points over GF(p)", "held"))
    monkeypatch.setattr(module, "decide", lambda identity, seed: passed)


@pytest.mark.parametrize("is_density", [False, True])
@pytest.mark.parametrize("eps", [None, fmpq(1, 3)])
def test_an_expansion_refutes_what_random_points_let_pass(blind, is_density, eps):
    verdict, evidence = verdict_on(ROTATION, function("x^2 - y^2 + eps"), eps, is_density=is_density)
    assert verdict is Certainty.REFUTED
    assert evidence.method == "exact rational point"  # which the expansion asks for


@pytest.mark.parametrize("is_density", [False, True])
def test_a_function_without_values_at_the_eps_in_force_is_undecided(is_density):
    f = load("lotka_volterra").system if is_density else ROTATION
    phi = function("x*y/(10*eps - 1)" if is_density else "x/(10*eps - 1)")
    verdicts = [verdict_on(f, phi, fmpq(1, k), is_density=is_density)[0] for k in (10, 9)]
    assert verdicts == [Certainty.UNDECIDED, Certainty.PROVED if is_density else Certainty.REFUTED]


def test_a_density_with_symbols_is_for_those_at_which_it_is_not_zero():
    lines = system("x y", "(a*x + b*y + c)*x", "2*(a*x + b*y + c)*y", a=1, b=2, c=3)
    (result,) = find_densities(lines, symbols=("a", "b", "c")).densities
    assert result.evidence.summary.endswith("for every eps and every a, b, c where a, b, c are not all 0")
    # The second line is c = a - 1, which is not 0 where the first, a, is.
    lines = system("x y", "(a*x + b*y)*x", "2*(a*x + b*y)*y", a=1, b=2)
    (result,) = find_densities(lines, symbols=("a",)).densities
    assert result.evidence.summary.endswith("for every eps and every a")


def test_points_support_what_is_too_large_to_expand_for_every_symbol_with_a_bound(monkeypatch):
    monkeypatch.setattr(module, "_BUDGET", 10)
    turning = with_symbols(system("x y", "a*y", "-a*x", a=1), ["a"])
    I = parse_rational_function("(x^2 + y^2)/(a^2 - 1)", ["x", "y", "a", "eps"])
    verdict, evidence = verdict_on(turning, I, None, is_density=False)
    assert verdict is Certainty.SUPPORTED
    assert "for every eps and every a where a^2 - 1 is not 0; false with probability below 2^-1" in evidence.summary
    # A symbol is drawn like a coordinate: what holds for a = 1 alone is refuted.
    wrong = parse_rational_function("x^2 + a*y^2", ["x", "y", "a", "eps"])
    assert verdict_on(turning, wrong, None, is_density=False)[0] is Certainty.REFUTED


PAPER = load("paper_m2").system
THERE = separate_planes(PAPER)


@given(points(4))
def test_the_map_is_the_same_in_both_coordinates(z):
    there = KahanMap(THERE.system, fmpq(1, 7))
    x, image = (tuple((THERE.T * fmpq_mat(4, 1, [*place])).entries()) for place in (z, there.step(z)))
    assert image == KahanMap(PAPER, there.eps).step(x)


@pytest.mark.parametrize("name", ["paper_m3_irreducible", "clebsch_first_flow", "euler_top", "henon_heiles"])
def test_without_planes_over_Q_there_are_no_such_coordinates(name):
    assert separate_planes(load(name).system) is None


def test_integrals_of_members_are_proved_where_their_planes_separate():
    first, second = integrals_of("paper_m2").integrals
    for one in (first, second):
        assert one.verdict is Certainty.PROVED
        assert one.evidence.summary.endswith("in coordinates in which the planes separate")


def test_what_is_not_preserved_is_refuted_there_too(request):
    lab, (I, *_) = Laboratory(load("paper_m2")), integrals_of("paper_m2").integrals
    x1 = I.function.numerator.context().gens()[0]
    wrong = RationalFunction(I.function.numerator + x1, I.function.denominator)
    assert lab.verdict_on(wrong)[0] is Certainty.REFUTED
    request.getfixturevalue("blind")
    assert lab.verdict_on(wrong)[0] is Certainty.REFUTED
    assert lab.verdict_on(I.function)[0] is Certainty.PROVED
