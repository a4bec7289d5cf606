"""Formulas that were found are certified: an expansion decides, and an undefined formula is undecided. Where the
planes of a member separate, identities are short; they are the same ones.
"""

from functools import partial

import pytest
from flint import fmpq, fmpq_mat
from helpers import points
from hypothesis import given
from search_helpers import integrals_of

from kahanmaps import KahanMap
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Decision
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.laboratory import laboratory as module
from kahanmaps.laboratory.laboratory import Laboratory, separate_planes, verdict_on
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.systems.quadratic import QuadraticSystem

ROTATION = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
LOTKA_VOLTERRA = QuadraticSystem.from_text(["x", "y"], ["x*(1 - y)", "y*(x - 1)"])
integral_verdict, density_verdict = partial(verdict_on, is_density=False), partial(verdict_on, is_density=True)
VERDICTS = {False: integral_verdict, True: density_verdict}


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
    verdict, evidence = VERDICTS[is_density](ROTATION, function("x^2 - y^2 + eps"), eps)
    assert verdict is Certainty.REFUTED
    assert evidence.method == "exact rational point"  # which the expansion asks for


@pytest.mark.parametrize("is_density", [False, True])
def test_a_function_without_values_at_the_eps_in_force_is_undecided(is_density):
    system = LOTKA_VOLTERRA if is_density else ROTATION
    phi = function("x*y/(10*eps - 1)" if is_density else "x/(10*eps - 1)")
    assert VERDICTS[is_density](system, phi, fmpq(1, 10))[0] is Certainty.UNDECIDED
    assert VERDICTS[is_density](system, phi, fmpq(1, 9))[0] is (Certainty.PROVED if is_density else Certainty.REFUTED)


def file_with(rhs: str, **values: str) -> SystemFile:
    parameters = ", ".join(f'{name} = "{value}"' for name, value in values.items())
    return parse_system(f'variables = ["x", "y"]\nparameters = {{ {parameters} }}\n[system]\nrhs = {rhs}\n')


def test_a_density_with_symbols_is_for_those_at_which_it_is_not_zero():
    lines = file_with('["(a*x + b*y + c)*x", "2*(a*x + b*y + c)*y"]', a="1", b="2", c="3")
    (result,) = find_densities(lines, symbols=("a", "b", "c")).densities
    assert result.evidence.summary.endswith("for every eps and every a, b, c where a, b, c are not all 0")
    # The second line is c = a - 1, which is not 0 where the first, a, is.
    lines = file_with('["(a*x + b*y)*x", "2*(a*x + b*y)*y"]', a="1", b="2")
    (result,) = find_densities(lines, symbols=("a",)).densities
    assert result.evidence.summary.endswith("for every eps and every a")


def test_points_support_what_is_too_large_to_expand_for_every_symbol_with_a_bound(monkeypatch):
    monkeypatch.setattr(module, "_BUDGET", 10)
    system = with_symbols(file_with('["a*y", "-a*x"]', a="1"), ["a"])
    I = parse_rational_function("(x^2 + y^2)/(a^2 - 1)", ["x", "y", "a", "eps"])
    verdict, evidence = integral_verdict(system, I, None)
    assert verdict is Certainty.SUPPORTED
    assert "for every eps and every a where a^2 - 1 is not 0; false with probability below 2^-1" in evidence.summary
    # A symbol is drawn like a coordinate: what holds for a = 1 alone is refuted.
    wrong = parse_rational_function("x^2 + a*y^2", ["x", "y", "a", "eps"])
    assert integral_verdict(system, wrong, None)[0] is Certainty.REFUTED


PAPER = load("paper_m2").system
THERE = separate_planes(PAPER)


@given(points(4))
def test_the_map_is_the_same_in_both_coordinates(z):
    def x(place):
        return tuple((THERE.T * fmpq_mat(4, 1, list(place))).entries())

    eps = fmpq(1, 7)
    assert x(KahanMap(THERE.system, eps).step(z)) == KahanMap(PAPER, eps).step(x(z))


@pytest.mark.parametrize("name", ["paper_m3_irreducible", "clebsch_first_flow", "euler_top", "henon_heiles"])
def test_without_planes_over_Q_there_are_no_such_coordinates(name):
    assert separate_planes(load(name).system) is None


def test_integrals_of_members_are_proved_where_their_planes_separate():
    assert [one.verdict for one in integrals_of("paper_m2").integrals] == [Certainty.PROVED] * 2
    assert all(
        one.evidence.summary.endswith("in coordinates in which the planes separate")
        for one in integrals_of("paper_m2").integrals
    )


def test_what_is_not_preserved_is_refuted_there_too(monkeypatch):
    lab, (I, *_) = Laboratory(load("paper_m2")), integrals_of("paper_m2").integrals
    x1 = I.function.numerator.context().gens()[0]
    wrong = RationalFunction(I.function.numerator + x1, I.function.denominator)
    assert lab.verdict_on(wrong)[0] is Certainty.REFUTED
    # Even where random points let everything pass.
    passed = Decision(Certainty.SUPPORTED, Evidence("random points over GF(p)", "held"))
    monkeypatch.setattr(module, "decide", lambda identity, seed: passed)
    assert lab.verdict_on(wrong)[0] is Certainty.REFUTED
    assert lab.verdict_on(I.function)[0] is Certainty.PROVED
