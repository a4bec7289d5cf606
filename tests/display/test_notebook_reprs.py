"""What notebooks show: well-formed, bounded in size, true, and with nothing in it that a name brought along."""

from xml.etree import ElementTree

import pytest
from flint import fmpq_mat
from helpers import CHARACTERS
from hypothesis import given
from hypothesis import strategies as st
from search_helpers import analysis_of
from small_databases import ok, planned

import kahanmaps as km
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import ring
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report, Witness
from kahanmaps.display import markup

EVIL = '<script>alert("x")</script>\x1b[31m'
LARGEST = 100_000  # characters of any representation
TOP, MEMBER = km.load("euler_top"), km.random_member_with_eigenvalues([1, -2], seed=7)
# Dense, of dimension 20, with numbers of 200 digits.
NAMES = [f"x{k}" for k in range(20)]
HUGE = km.QuadraticSystem.from_text(NAMES, [f"{'7' * 200}*({' + '.join(NAMES)})^2"] * 20)


def html_of(thing):
    """The representation as a tree; well-formed and bounded, or the test fails."""
    html = thing._repr_html_()
    assert len(html) < LARGEST
    tree = ElementTree.fromstring(f"<div>{html}</div>")
    assert "script" not in {entry.tag for entry in tree.iter()}
    assert not {entry.get("style", "") for entry in tree.iter() if "background" in entry.get("style", "")}
    return tree


def text_of(thing):
    return "".join(html_of(thing).itertext())


def walked(*arguments, **options):
    """An orbit, all of whose points were computed."""
    orbit = km.orbit(*arguments, **options)
    list(orbit)
    return orbit


WRONG = 'variables = ["x"]\n[system]\nrhs = ["x^2"]\n[integrals]\nI = "x"'
MANY = [km.parse_rational_function(f"x{k}", [*(f"x{i}" for i in range(30)), "eps"]) for k in range(30)]
LATEX = {  # a value, and what its formula contains
    "a system": (
        lambda: TOP.system,
        r"\begin{aligned} \dot{x_1} &= x_2 x_3 \\ \dot{x_2} &= -2 x_1 x_3 \\ \dot{x_3} &=",
    ),
    "a system with long terms": (lambda: HUGE.scaled("7" * 400), "(210 terms, not shown)"),
    "a system with many equations": (lambda: HUGE, "(20 equations)"),
    "a Hamiltonian": (lambda: MEMBER.hamiltonians[0], r"$\displaystyle \begin{aligned} H &= "),
    "another J": (
        lambda: km.CubicHamiltonian(parse_polynomial("x^3", ["x", "y"]), fmpq_mat([[0, 2], [-2, 0]])),
        r"\begin{pmatrix} 0 & 2 \\ -2 & 0 \end{pmatrix}",
    ),
    "a large J": (lambda: km.CubicHamiltonian(ring(NAMES).constant(0), fmpq_mat(20, 20)), "20 rows and 20 columns"),
    "a map": (
        lambda: km.map("x' = x*y - 3*x; y' = x^2 + 1/2", "1/10"),
        r"\frac{\tilde{x} - x}{2 \varepsilon} &= \frac{1}{2} y \tilde{x} + \frac{1}{2} x \tilde{y} "
        r"- \frac{3}{2} x - \frac{3}{2} \tilde{x} \\ "
        r"\frac{\tilde{y} - y}{2 \varepsilon} &= x \tilde{x} + \frac{1}{2} \\ "
        r"\varepsilon &= \text{1/10},\quad \text{time step } 2 \varepsilon = \text{1/5} \end{aligned}$",
    ),
    "a huge map": (lambda: km.KahanMap(HUGE, "1/10"), "(20 equations)"),
    "a Kahan map as data": (lambda: km.KahanFamily(TOP.system), TOP.system._repr_latex_()),
    "an explicit map": (
        lambda: km.explicit_map(["x"], [km.parse_rational_function("1/(eps + x)", ["x", "eps"])]),
        r"\varepsilon",
    ),
    "a map of many equations": (lambda: km.explicit_map([f"x{i}" for i in range(30)], MANY), r"\vdots"),
}


@pytest.mark.parametrize(("make", "words"), LATEX.values(), ids=LATEX.keys())
def test_formulas_are_whole_bounded_and_show_what_they_are_of(make, words):
    latex = make()._repr_latex_()
    assert words in latex
    assert latex[0] == latex[-1] == "$"
    assert latex.count("{") == latex.count("}")
    assert latex.count(r"\begin") == latex.count(r"\end")
    assert len(latex) < LARGEST


HTML = {  # a value, and what its text contains
    "a huge file": (lambda: km.SystemFile.from_system(HUGE), ["(20 equations)"]),
    "a hostile name": (lambda: km.SystemFile.from_system(TOP.system, EVIL), [EVIL.replace("\x1b", "\\x1b")]),
    "a file": (lambda: TOP, ["Euler top", "a1 = 1, a2 = -2, a3 = 1", r"-\frac{\varepsilon^2 x_2^2 - 1}{2 \vareps"]),
    "a member": (lambda: MEMBER, ["member of the commuting family, m = 2"]),
    "an associated system": (lambda: MEMBER.associate([1, -1]), ["associated system +-"]),
    "a normal form": (lambda: km.normal_form(MEMBER), ["chi(t)"]),
    "a singular orbit": (lambda: walked("x' = x^2", [1], "1/2", 5), ["singular"]),
    "an orbit over its budget": (
        lambda: walked("henon_heiles", ["1/2", "1/3", 1, 1], "1/10", 50, max_digits=9000),
        ["(long)", "budget"],
    ),
    "a refutation": (lambda: km.check_integrals(km.parse_system(WRONG, "wrong")), ["✗ refuted", "I(x~) = "]),
    "a proof": (lambda: km.check_integrals(TOP), ["✓ proved"]),
    "verify": (
        lambda: km.verify(km.SystemFile.from_member(MEMBER), options=km.VerifyOptions(sections=(5, 8))),
        ["Section 8. ", "misprint"],
    ),
    "integrals": (lambda: km.find_integrals(TOP), [r"\displaystyle I_1 = ", "2 found; there are 2 in all (measured: "]),
    "Darboux polynomials": (lambda: km.darboux_polynomials(km.load("lotka_volterra"), 1), ["cofactor"]),
    "a census": (lambda: km.cycle_census(km.load("lotka_volterra").system, "1/10", 31), ["GF(31)"]),
    "a period": (lambda: km.orbit_period(km.normal_form(MEMBER), "1/10", ["1/2", "-1/5", 0, 1], 10007), ["period"]),
}


@pytest.mark.parametrize(("make", "words"), HTML.values(), ids=HTML.keys())
def test_values_say_in_words_what_they_are(make, words):
    text = text_of(make())
    assert [word for word in words if word not in text] == []


@pytest.mark.parametrize(
    "part", ["integrals", "densities", "degrees", "heights", "symmetries", "commuting", "hamiltonian"]
)
def test_each_part_of_an_analysis_is_shown_by_itself(part):
    assert text_of(getattr(analysis_of("lotka_volterra"), part)).strip()


def test_an_analysis_shows_the_verdict_before_the_statements():
    text = text_of(analysis_of("lotka_volterra"))
    assert text.index("not integrable") < text.index("dx/phi is invariant")
    assert "the time step is 2 eps" in text


def test_an_orbit_that_was_not_walked_is_not_walked_for_its_picture(monkeypatch):
    orbit = km.Orbit(km.KahanMap(TOP.system, "1/10"), [1, 2, 3], 10**9)
    monkeypatch.setattr(km.Orbit, "_images", lambda _: pytest.fail("a step was computed"))
    assert "no point computed yet" in text_of(orbit)


def test_an_orbit_shows_its_first_points_the_last_one_and_its_end():
    orbit = km.Orbit(km.KahanMap(TOP.system, "1/10"), ["1/2", "1/3", 1], 12)
    points = list(orbit)
    rows = [["".join(cell.itertext()) for cell in row] for row in html_of(orbit).iter("tr")]
    assert rows[0] == ["step", "x1", "x2", "x3", "digits"]
    assert [row[0] for row in rows[1:]] == ["0", "1", "2", "…", "12"]
    assert rows[1][1:4] == points[0].text
    assert text_of(orbit).strip().endswith("✓ completed: 12 steps")


def test_hostile_and_huge_findings_are_escaped_and_cut():
    long = "9" * 10**6
    witness = Witness((long,) * 50, long, (EVIL,), (long,), EVIL, EVIL, EVIL, {EVIL: (long,)})
    evidence = Evidence(EVIL, long, {"hypotheses": [long] * 99, "theorem": EVIL})
    place = {"misprint": EVIL, "violation": long, "section": 3, "section_title": EVIL}
    finding = Finding(EVIL + long, Certainty.REFUTED, evidence, (evidence,) * 99, witness, long, EVIL, place=place)
    html_of(finding)
    html_of(Report(EVIL, (finding,) * 1000, {"system": EVIL, "eps": long, "time_step": long}, [EVIL] * 100))


def test_a_store_shows_its_experiments_and_says_when_it_is_closed(tmp_path):
    with km.Store.open(planned(tmp_path / "a.db", 1, 2, records=[ok(1, verdict="proved")]), readonly=True) as store:
        assert "missing" in text_of(store)
        assert "1 ✓ proved" in text_of(store)
    assert "has been closed" in text_of(store)


HOSTILE = '<script>alert("x")</script>&amp;\x00\x1b[31m\ud800\'"'


def well_formed(html):
    return ElementTree.fromstring(f"<div>{html}</div>")


@given(st.text(CHARACTERS))
def test_every_text_is_well_formed_once_it_is_escaped(text):
    assert list(well_formed(markup.escape(text))) == []


@pytest.mark.parametrize(
    "html",
    [
        markup.table([HOSTILE], [["<b>1</b>"]], HOSTILE),
        markup.definitions([(HOSTILE, "1")]),
        markup.block(HOSTILE, "<p>1</p>", HOSTILE),
        markup.verdict(HOSTILE),
        markup.bullet_list([markup.escape(HOSTILE)]),
    ],
)
def test_no_text_becomes_an_element(html):
    assert "script" not in {entry.tag for entry in well_formed(html).iter()}
    assert "alert" in "".join(well_formed(html).itertext())


@pytest.mark.parametrize("word", ["proved", "refuted", "supported", "measured", "undecided", "completed"])
def test_a_verdict_is_a_word_with_a_mark_and_not_only_a_colour(word):
    text = "".join(well_formed(markup.verdict(word)).itertext())
    assert text.endswith(f" {word}")
    assert len(text) == len(word) + 2


def test_short_text_stays_and_long_text_says_its_length():
    assert markup.abbreviate("x" * 60) == "x" * 60
    assert markup.abbreviate("1" * 5000).endswith("(5000 characters)")
    assert len(markup.abbreviate("1" * 5000)) < 90
