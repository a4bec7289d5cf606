"""kahanmaps report: pages of an analysis, of verify and of checks; what is refused; exit statuses."""

import sys

import pytest
from page_helpers import require_sound

from kahanmaps.reports.page import page_template

SMALL = "report --vars x,y --rhs 'x*y' --rhs=-x^2 --no-pictures"


def test_a_page_on_standard_output_is_all_there_is_and_equations_are_its_title(once):
    outcome = once(SMALL)
    page = require_sound(outcome.out)
    assert (outcome.status, outcome.err) == (0, "")
    assert "kahanmaps report --vars x,y --rhs 'x*y' '--rhs=-x^2' --no-pictures" in page.text
    assert page.headings[0] == (1, "x' = x*y, y' = -x^2")


def test_the_paper_for_a_member_drawn_and_given(kahanmaps, pair):
    drawn = kahanmaps("report --from verify --m 1 --section 6 --no-pictures")
    assert drawn.status == 0
    assert "section-6" in require_sound(drawn.out).ids
    given = kahanmaps("report", pair, "--from verify --section 6 --no-pictures")
    assert "pair, every eps" in require_sound(given.out).text


def test_a_refuted_claim_gives_status_1_and_a_page_all_the_same(kahanmaps, tmp_path):
    (tmp_path / "a.toml").write_text('variables = ["x"]\n[system]\nrhs = ["x^2"]\n[integrals]\nI = "x"\n')
    outcome = kahanmaps("report", tmp_path / "a.toml", "--from checks --no-pictures")
    assert outcome.status == 1
    assert "✗ refuted" in require_sound(outcome.out).text


@pytest.mark.parametrize("library", ["jinja2", "latex2mathml.converter"])
def test_what_to_install_is_said_before_the_work(kahanmaps, monkeypatch, library):
    monkeypatch.setitem(sys.modules, library, None)
    page_template.cache_clear()
    monkeypatch.setattr("kahanmaps.laboratory.analysis.analyze", lambda *_, **__: pytest.fail("it was analysed"))
    outcome = kahanmaps(SMALL, "-o page.html")
    assert outcome.status == 2
    assert "pip install 'kahanmaps[report]'" in outcome.err
