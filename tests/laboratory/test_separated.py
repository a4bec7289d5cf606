"""Where the planes of a member separate, its identities are short; they are the same ones."""

from functools import cache

import pytest
from flint import fmpq, fmpq_mat
from helpers import points
from hypothesis import given

from kahanmaps import KahanMap
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Decision
from kahanmaps.documents.catalog import load
from kahanmaps.laboratory import laboratory as module
from kahanmaps.laboratory.laboratory import Laboratory, separated
from kahanmaps.laboratory.preserve.integrals import find_integrals

PAPER = load("paper_m3").system
THERE = separated(PAPER)


@cache
def integrals():
    return find_integrals(load("paper_m3")).integrals


@given(points(6))
def test_the_map_is_the_same_in_both_coordinates(z):
    def x(place):
        return tuple((THERE.T * fmpq_mat(6, 1, list(place))).entries())

    eps = fmpq(1, 7)
    assert x(KahanMap(THERE.system, eps).step(z)) == KahanMap(PAPER, eps).step(x(z))


@pytest.mark.parametrize("name", ["paper_m3_irreducible", "clebsch_first_flow", "euler_top", "henon_heiles"])
def test_without_planes_over_Q_there_are_no_such_coordinates(name):
    assert separated(load(name).system) is None


def test_integrals_of_members_are_proved_where_their_planes_separate():
    assert [integral.verdict for integral in integrals()] == [Certainty.PROVED] * 3
    assert all(
        integral.evidence.summary.endswith("in coordinates in which the planes separate") for integral in integrals()
    )


def test_what_is_not_preserved_is_refuted_there_too(monkeypatch):
    lab, (I, *_) = Laboratory(load("paper_m3")), integrals()
    x1 = I.function.numerator.context().gens()[0]
    wrong = RationalFunction(I.function.numerator + x1, I.function.denominator)
    assert lab.verdict_on(wrong)[0] is Certainty.REFUTED
    # Even where random points let everything pass.
    passed = Decision(Certainty.SUPPORTED, Evidence("random points over GF(p)", "held"))
    monkeypatch.setattr(module, "decide", lambda identity, seed: passed)
    assert lab.verdict_on(wrong)[0] is Certainty.REFUTED
    assert lab.verdict_on(I.function)[0] is Certainty.PROVED
