"""Pages: what stands in them, that they fetch nothing, that they are the same every time, and hostile names."""

import re
import string
import sys
from html import unescape
from importlib import resources

import pytest
from fontTools.pens.boundsPen import BoundsPen
from fontTools.ttLib import TTFont
from page_helpers import Page, letters_of_formulas, letters_of_the_font, require_sound
from search_helpers import analysis_of

import kahanmaps as km
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report, Witness
from kahanmaps.display.latex import GREEK_NAMES, formula
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.laboratory.preserve.hirota_kimura import SparseRelation
from kahanmaps.paper.verify import VerifyOptions
from kahanmaps.reports.page import font_face, mathml
from kahanmaps.reports.pictures import Pictures
from kahanmaps.reports.report import formulas_of, report_html, write_report

EVIL = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def volterra():
    return analysis_of("lotka_volterra")


@pytest.fixture(scope="module")
def drawn():
    """The page with its pictures."""
    return report_html(analysis_of("lotka_volterra"), command="kahanmaps report lotka_volterra")


@pytest.fixture(scope="module")
def paper():
    member = km.SystemFile.from_member(km.random_member_with_eigenvalues([1, -2], seed=7), "pair")
    return member, km.verify(member, options=VerifyOptions(sections=(5, 8)))


def test_a_page_that_is_not_sound_is_seen():
    for broken in (
        "<p>",
        '<!DOCTYPE html><html lang="en"><h1>a</h1><img src="http://a.b/c.png"/></html>',
        '<!DOCTYPE html><html lang="en"><h1>a</h1><a href="#nowhere">b</a></html>',
        '<!DOCTYPE html><html lang="en"><h1>a</h1><h3>b</h3></html>',
        '<!DOCTYPE html><html lang="en"><h1>a</h1><math><mi>x</mi></math></html>',
        '<!DOCTYPE html><html lang="en"><h1>a</h1><script>1</script></html>',
    ):
        with pytest.raises(AssertionError):
            require_sound(broken)


def test_the_page_of_an_analysis_has_the_verdict_first_and_every_section(drawn, volterra):
    page = require_sound(drawn)
    titles = [title for level, title in page.headings if level == 2]
    assert titles[:3] == ["Verdict", "The system", "What the catalogue says"]
    assert titles[-1] == "How to reproduce this page"
    assert volterra.conclusion.sentence in page.text
    for name, lines in volterra.sections:
        assert name[0].upper() + name[1:] in titles
        for line in lines:
            assert line.status in page.text


def test_formulas_are_mathml_of_exact_latex(volterra):
    page = require_sound(report_html(volterra, pictures=False))
    assert {"x' = -x y + x", "y' = x y - y"} <= set(page.alttexts)
    phi = volterra.densities.densities[0].function
    assert any(rf"\phi = {km.latex_rational_function(phi)}" in text for text in page.alttexts)
    assert "<code>\\" not in page.html, "a formula that was not converted"


def test_relations_are_set_as_they_read_in_the_analysis():
    terms = (("x^2", "1"), ("y^2", "c1"), ("x", "-5/(18*eps^2)"), ("1", "-2"))
    file = km.load("planar_cubic_hamiltonian")
    result = Analysis(file, None, 1.0, 0, relations=(SparseRelation(terms, ("c1",)),))
    html = formulas_of(result)["along orbits x^2 + c1*y^2 - 5/(18*eps^2)*x - 2 = 0"]
    pieces = ["x^2", "{}+ c_1 y^2", r"{}- \frac{5 x}{18 \varepsilon^2}", "{}- 2 = 0"]
    assert re.findall(r"\\\((.*?)\\\)", html) == pieces


def test_pictures_are_inside_with_a_title_each(drawn):
    page = Page(drawn)
    assert {"degrees", "heights", "portrait"} <= set(page.ids)
    assert page.tags.count("svg") == page.tags.count("figure") == 3
    for figure in drawn.split("<figure")[1:]:
        assert "<title>" in figure.split("</figure>")[0]
    assert 'role="img"' in drawn


def test_the_page_says_how_it_was_made(drawn, volterra):
    page = Page(drawn)
    assert "kahanmaps report lotka_volterra" in page.text
    assert f"kahanmaps {km.__version__}" in page.text
    system = km.parse_system(page.text[page.text.index('name = "lotka_volterra"') :].strip(), "page")
    assert system == volterra.file


def test_without_matplotlib_the_page_says_what_to_install(volterra, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    page = require_sound(report_html(volterra))
    assert "svg" not in page.tags
    assert "pip install 'kahanmaps[plot]'" in page.text


def test_a_portrait_says_which_orbits_ended_and_what_lies_outside():
    nowhere = km.QuadraticSystem.from_text(["x"], ["x"])  # at eps = 1
    html = Pictures().portrait(km.SystemFile.from_system(nowhere), 1)
    assert "16 of 16 orbits ended early: met a singular matrix I - eps f&#x27;." in html
    riccati = km.QuadraticSystem.from_text(["x"], ["x^2 + 1"])
    assert "points lie outside the window" in Pictures().portrait(km.SystemFile.from_system(riccati), "1/20")
    harmonic = Pictures().portrait(km.load("harmonic"), "1/20")
    assert "ended early" not in harmonic
    assert "outside" not in harmonic


def test_a_system_with_an_algebraic_parameter_is_drawn_around_its_fixed_points():
    field = "x' = x*(a - y); y' = y*(x - 1)"
    html = Pictures().portrait(km.System(field, a="root of t^2 - 2 near 1.4"), None)
    assert "separatrix" in html
    assert "outside" not in html
    which = Pictures().portrait(km.System(field, a="root of t^2 - 2"), None)
    assert "floating point: not drawn, for a root of t^2 - 2 may be -1.41421, 1.41421" in which


def test_browsers_are_told_to_run_no_script_and_to_load_nothing(drawn):
    policy = re.search('<meta http-equiv="Content-Security-Policy" content="([^"]*)"/>', drawn)[1]
    assert policy.startswith("default-src 'none'; ")
    assert policy.endswith("; script-src 'none'")
    assert re.fullmatch(r'@font-face {[^{}]*url\(data:font/woff;base64,[\w+/=]+\) format\("woff"\); }', font_face())
    assert font_face() in drawn


def test_names_and_titles_are_text(volterra):
    analysis = Analysis(km.SystemFile.from_system(volterra.file.system, EVIL), None, 1.0, 0, skipped=[EVIL])
    page = require_sound(report_html(analysis, title=EVIL, command=EVIL, pictures=False))
    assert page.text.count(EVIL) >= 4


@pytest.mark.parametrize("pictures", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_degenerate_systems_have_pages(pictures):
    for rhs in ("0", "x", "1", "x^2"):
        analysis = km.analyze(km.SystemFile.from_system(km.QuadraticSystem.from_text(["x"], [rhs])))
        require_sound(report_html(analysis, pictures=pictures))


def test_the_paper_is_laid_out_by_section_with_its_evidence_folded(paper):
    file, report = paper
    page = require_sound(report_html(report, file=file, pictures=False))
    assert {"section-5", "section-8"} <= set(page.ids)
    assert page.tags.count("details") >= len(report.findings)
    for finding in report.findings:
        assert f"claim-{finding.place['key']}" in page.ids
        assert finding.evidence.summary[:60] in page.text
    assert "misprint" in page.text


def test_a_refuted_claim_stands_open_and_a_control_does_not():
    file = km.parse_system('variables = ["x"]\n[system]\nrhs = ["x^2"]\n[integrals]\nI = "x"', "wrong")
    html = report_html(km.check_integrals(file), file=file, pictures=False)
    assert html.count('open="open"') == 1
    pair = km.SystemFile.from_member(km.random_member_with_eigenvalues([1, -2], seed=7))
    html = report_html(km.check_commute(pair), file=pair, pictures=False)
    assert "as expected" in Page(html).text
    assert 'open="open"' not in html


def test_a_page_shows_whole_claims_and_the_length_of_what_is_cut():
    numbers = tuple(f"{k}{'7' * 300}" for k in range(1, 13))
    witness = Witness(numbers, numbers[0], numbers, numbers, "left", "right", vectors=dict.fromkeys("abcdef", numbers))
    also = tuple(Evidence("exact", f"a further reason, number {k}") for k in range(9))
    decided = Evidence("theorem", "", {"theorem": "T", "hypotheses": [f"hypothesis {k}" for k in range(20)]})
    finding = Finding("c", Certainty.REFUTED, decided, also, witness, formula="x" * 7_000)
    page = require_sound(report_html(Report("commute", (finding,)), pictures=False))
    for number in numbers:
        assert page.text.count(number) >= 9
    for evidence in also:
        assert evidence.summary in page.text
    assert "hypothesis 19" in page.text
    assert "(7000 characters)" in page.text


def test_a_page_names_the_second_system_its_eps_and_an_orbit_that_ended_early():
    top = km.load("euler_top")
    page = require_sound(report_html(km.check_commute(top, top, km.Settings(eps="1/10"), eps2="1/7"), pictures=False))
    assert "euler_top, euler_top, eps = 1/10 (time step 2 eps = 1/5), second map at eps2 = 1/7" in page.text
    settings = km.Settings(eps="1/10", start=(1, "1/2"), steps=60, max_digits=200, orbit_is_requested=True)
    report = km.check_integrals(km.load("planar_cubic_hamiltonian"), settings)
    assert "The requested orbit ended early" in require_sound(report_html(report, pictures=False)).text
    assert "ended early" in report._repr_html_()
    assert "ended early" not in report_html(km.check_integrals(top), pictures=False)


def test_a_page_is_written_whole_or_not_at_all(tmp_path, monkeypatch, volterra):
    path = tmp_path / "page.html"
    write_report(path, volterra, pictures=False)
    before = path.read_bytes()

    def killed(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", killed)
    with pytest.raises(KeyboardInterrupt):
        write_report(path, volterra, pictures=False, title="another")
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["page.html"]


def test_the_font_has_every_letter_of_formulas():
    names = [*string.ascii_letters, *GREEK_NAMES.split("|"), "eps", "my_name12"]
    polynomial = km.parse_polynomial("123456789/70" + "".join(f"+{name}^2-{name}" for name in names), names)
    html = formula(polynomial, "x1'") + formula(polynomial, "y", characters=9)
    formulas = "".join(mathml(unescape(piece)) for piece in re.findall(r"\\\((.*?)\\\)", html))
    assert letters_of_formulas(formulas) - letters_of_the_font() == set()
    assert letters_of_formulas("<math><mi>я</mi></math>") - letters_of_the_font() == {"я"}


def test_primes_are_drawn_to_stand_in_an_exponent():
    """They begin near the base line; the ordinary ones are raised already, and would be raised twice."""
    with (resources.files("kahanmaps.reports") / "fonts" / "kahanmaps-math.woff").open("rb") as file:
        font = TTFont(file)
        pen = BoundsPen(font.getGlyphSet())
        font.getGlyphSet()[font.getBestCmap()[ord("′")]].draw(pen)
    x_height = 430  # of Latin Modern, in thousandths; there its ordinary prime begins
    assert pen.bounds is not None
    assert pen.bounds[1] < x_height / 2
