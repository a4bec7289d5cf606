"""The table of what survives: what is proved, what is refuted, and that the counterexamples are smallest and right."""

import re
from functools import cache
from pathlib import Path

import pytest
from flint import fmpq, fmpq_mat

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.written.text import parse_polynomial
from kahanmaps.checks.claims import Verdict
from kahanmaps.maps.kahan import KahanMap, KahanMapOver
from kahanmaps.paper.claims.further_claims import STATEMENTS
from kahanmaps.paper.claims.survivors import smallest_counterexample, survivors, table
from kahanmaps.paper.variations import VARIATIONS
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

PAGE = Path(__file__).parent.parent.parent / "docs" / "beyond.md"
FUNCTIONS = {formula: function for function, formula, *_ in STATEMENTS}


@cache
def report():
    return survivors(3)


@pytest.mark.timeout(300)
@pytest.mark.thorough
@pytest.mark.slow
def test_every_cell_is_proved_or_refuted_and_the_page_shows_the_table():
    answers = {
        (formula, name): sign
        for _, formula, *_, signs in STATEMENTS
        for name, sign in zip(VARIATIONS, signs, strict=True)
    }
    found = {(one.place["statement"], one.place["variation"]): one.verdict for one in report().findings}
    words = {"+": Verdict.PROVED, "-": Verdict.REFUTED}
    assert found == {cell: words[sign] for cell, sign in answers.items() if sign != " "}
    assert table(report()) in PAGE.read_text(encoding="utf-8")


@pytest.mark.thorough
@pytest.mark.slow
def test_every_refuted_cell_has_a_counterexample():
    for one in report().findings:
        assert (one.verdict is Verdict.REFUTED) is one.control is (one.witness is not None)
        assert one.witness is None or one.witness.left != one.witness.right


def test_without_a_term_of_lower_degree_the_counterexample_is_none():
    text, witness = smallest_counterexample(FUNCTIONS["eps^{-1} x^T J^{-1} x~ is conserved by f"], "inhomogeneous")
    assert text == "m = 1, H = u1^3 + v1"
    assert witness.point == ("0", "0")


def test_what_holds_has_no_counterexample():
    assert smallest_counterexample(FUNCTIONS["modified H is conserved by f"], "inhomogeneous") is None


def test_the_counterexample_for_a_derogatory_A_by_hand():
    # H = u1^2 u2 + u1 v1 v2 in the order u1, u2, v1, v2, at (1, 0, 0, 0) with eps = 1, as the table has it.
    names = ["u1", "u2", "v1", "v2"]
    J = standard_structure(4)
    system = CubicHamiltonian(parse_polynomial("u1^2*u2 + u1*v1*v2", names), J).system
    x = [fmpq(1), fmpq(0), fmpq(0), fmpq(0)]
    y = KahanMap(system, fmpq(1), QQ).step(x)
    slope = KahanMapOver(system.over(QQ), fmpq(1)).jacobian(x)

    def Pi(point):
        jacobian = fmpq_mat(system.over(QQ).jacobian(point))
        return J - jacobian * jacobian * J

    assert slope * Pi(x) * slope.transpose() != Pi(y)


@pytest.mark.thorough
@pytest.mark.slow
def test_no_counterexample_is_larger_than_its_search():
    for one in report().findings:
        if one.control:
            assert re.match(r"fails for m = [12], H = ", one.evidence.summary)
