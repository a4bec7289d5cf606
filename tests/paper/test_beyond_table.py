"""The table of what survives: what is proved, what is refuted, and that the counterexamples are smallest and right."""

import re
from pathlib import Path

import pytest

from kahanmaps.checks.claims import Certainty
from kahanmaps.paper.claims.beyond_table import beyond_table, smallest_counterexample, table
from kahanmaps.paper.claims.further_claims import STATEMENTS
from kahanmaps.paper.variations import VARIATIONS

PAGE = Path(__file__).parent.parent.parent / "docs" / "beyond.md"
FUNCTIONS = {formula: function for function, formula, *_ in STATEMENTS}


@pytest.mark.timeout(300)
@pytest.mark.slow
def test_every_cell_is_proved_or_refuted_by_a_counterexample_and_the_page_shows_the_table():
    report = beyond_table(3)
    answers = {
        (formula, name): sign
        for _, formula, *_, signs in STATEMENTS
        for name, sign in zip(VARIATIONS, signs, strict=True)
    }
    results = {(finding.place["statement"], finding.place["variation"]): finding.verdict for finding in report.findings}
    words = {"+": Certainty.PROVED, "-": Certainty.REFUTED}
    assert results == {cell: words[sign] for cell, sign in answers.items() if sign != " "}
    assert table(report) in PAGE.read_text(encoding="utf-8")
    for entry in report.findings:
        assert (entry.verdict is Certainty.REFUTED) is entry.control is (entry.witness is not None)
        assert entry.witness is None or entry.witness.left != entry.witness.right


def test_formulas_of_the_table_are_code_so_that_markdown_prints_their_stars():
    text = table(beyond_table(1))
    assert "u1^2*v1" in text
    outside_code = re.sub(r"`[^`]*`", "", text)
    assert not re.search(r"(?<!^)\*|_", outside_code, re.MULTILINE)  # only the stars of the list are left


def test_without_a_term_of_lower_degree_the_counterexample_is_none():
    text, witness = smallest_counterexample(FUNCTIONS["eps^{-1} x^T J^{-1} x~ is conserved by f"], "inhomogeneous")
    assert text == "m = 1, H = u1^3 + v1"
    assert witness.point == ("0", "0")


@pytest.mark.slow
def test_what_holds_has_no_counterexample():
    assert smallest_counterexample(FUNCTIONS["modified H is conserved by f"], "inhomogeneous") is None
