"""What notebooks show: well-formed, bounded in size, true, and with nothing in it that a name brought along."""

from xml.etree import ElementTree

import pytest
from flint import fmpq_mat
from small_databases import ok, planned

import kahanmaps as km
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import ring
from kahanmaps.checks.claims import Evidence, Finding, Report, Verdict, Witness

EVIL = '<script>alert("x")</script>\x1b[31m'
LARGEST = 100_000  # characters of any representation


def html_of(thing):
    """The representation as a tree; well-formed and bounded, or the test fails."""
    html = thing._repr_html_()
    assert len(html) < LARGEST
    tree = ElementTree.fromstring(f"<div>{html}</div>")
    assert "script" not in {one.tag for one in tree.iter()}
    assert not {one.get("style", "") for one in tree.iter() if "background" in one.get("style", "")}
    return tree


def text_of(thing):
    return "".join(html_of(thing).itertext())


def latex_of(thing):
    latex = thing._repr_latex_()
    assert latex.startswith("$")
    assert latex.endswith("$")
    assert latex.count("{") == latex.count("}")
    assert latex.count(r"\begin") == latex.count(r"\end")
    assert len(latex) < LARGEST
    return latex


@pytest.fixture(scope="module")
def top():
    return km.load("euler_top")


@pytest.fixture(scope="module")
def member():
    return km.draw_with_eigenvalues([1, -2], seed=7)


@pytest.fixture(scope="module")
def huge():
    """Dense, of dimension 20, with numbers of 200 digits."""
    names = [f"x{k}" for k in range(20)]
    number = "7" * 200
    return km.QuadraticSystem.from_text(names, [f"{number}*({' + '.join(names)})^2"] * 20)


# -- systems


def test_a_system_is_shown_as_its_equations(top):
    assert latex_of(top.system) == (
        r"$\displaystyle \begin{aligned} \dot{x_1} &= x_2 x_3 \\ \dot{x_2} &= -2 x_1 x_3 \\ "
        r"\dot{x_3} &= x_1 x_2 \end{aligned}$"
    )


def test_a_huge_system_is_cut_and_what_is_missing_is_told(huge):
    assert "(210 terms, not shown)" in latex_of(huge.scaled("7" * 400))
    assert "(20 equations)" in latex_of(huge)
    assert "(20 equations)" in text_of(km.SystemFile.from_system(huge))
    assert len(latex_of(km.KahanMap(huge, "1/10"))) < 10_000


def test_a_hamiltonian_shows_its_cubic_and_j(member):
    assert latex_of(member.hamiltonians[0]).startswith(r"$\displaystyle \begin{aligned} H &= ")
    skew = km.CubicHamiltonian(parse_polynomial("x^3", ["x", "y"]), fmpq_mat([[0, 2], [-2, 0]]))
    assert r"\begin{pmatrix} 0 & 2 \\ -2 & 0 \end{pmatrix}" in latex_of(skew)
    large = km.CubicHamiltonian(ring([f"x{k}" for k in range(20)]).constant(0), fmpq_mat(20, 20))
    assert "20 rows and 20 columns" in latex_of(large)


def test_a_file_shows_equations_parameters_and_integrals_and_its_name_brings_no_elements_along(top):
    assert EVIL.replace("\x1b", "\\x1b") in text_of(km.SystemFile.from_system(top.system, EVIL))
    text = text_of(top)
    assert "Euler top" in text
    assert "a1 = 1, a2 = -2, a3 = 1" in text
    assert r"\displaystyle -\frac{\varepsilon^2 x_2^2 - 1}{2 \varepsilon^2 x_3^2 + 1}" in text


# -- the family


def test_members_associated_systems_and_the_normal_form_are_shown(member):
    assert "member of the commuting family, m = 2" in text_of(member)
    assert text_of(member.associate([1, -1])).startswith("associated system +-")
    assert "chi(t)" in text_of(km.normal_form(member))


# -- maps and orbits


def test_a_map_shows_the_equation_that_defines_it_and_says_the_time_step():
    system = km.QuadraticSystem.from_text(["x", "y"], ["x*y - 3*x", "x^2 + 1/2"])
    assert latex_of(km.KahanMap(system, "1/10")) == (
        r"$\displaystyle \begin{aligned} "
        r"\frac{\tilde{x} - x}{2 \varepsilon} &= \frac{1}{2} y \tilde{x} + \frac{1}{2} x \tilde{y} "
        r"- \frac{3}{2} x - \frac{3}{2} \tilde{x} \\ "
        r"\frac{\tilde{y} - y}{2 \varepsilon} &= x \tilde{x} + \frac{1}{2} \\ "
        r"\varepsilon &= \text{1/10},\quad \text{time step } 2 \varepsilon = \text{1/5} \end{aligned}$"
    )


def test_an_orbit_that_was_not_walked_is_not_walked_for_its_picture(top, monkeypatch):
    orbit = km.Orbit(km.KahanMap(top.system, "1/10"), [1, 2, 3], 10**9)
    monkeypatch.setattr(km.Orbit, "_images", lambda _: pytest.fail("a step was computed"))
    assert "no point computed yet" in text_of(orbit)


def test_an_orbit_shows_its_first_points_the_last_one_and_its_end(top):
    orbit = km.Orbit(km.KahanMap(top.system, "1/10"), ["1/2", "1/3", 1], 12)
    points = list(orbit)
    rows = [["".join(cell.itertext()) for cell in row] for row in html_of(orbit).iter("tr")]
    assert rows[0] == ["step", "x1", "x2", "x3", "digits"]
    assert [row[0] for row in rows[1:]] == ["0", "1", "2", "…", "12"]
    assert rows[1][1:4] == points[0].text
    assert text_of(orbit).strip().endswith("✓ completed: 12 steps")


def test_a_singular_orbit_and_one_over_budget_are_shown():
    singular = km.Orbit(km.KahanMap(km.QuadraticSystem.from_text(["x"], ["x^2"]), "1/2"), [1], 5)
    list(singular)
    assert "singular" in text_of(singular)
    heights = km.Orbit(km.KahanMap(km.load("henon_heiles").system, "1/10"), ["1/2", "1/3", 1, 1], 50, max_digits=9000)
    list(heights)
    assert "(long)" in text_of(heights)
    assert "budget" in text_of(heights)


# -- checks


def test_a_report_shows_each_claim_with_its_verdict_and_its_witness(top):
    file = km.parse_system('variables = ["x"]\n[system]\nrhs = ["x^2"]\n[integrals]\nI = "x"', "wrong")
    text = text_of(km.check_integrals(file))
    assert "✗ refuted" in text
    assert "I(x~) = " in text
    assert "✓ proved" in text_of(km.check_integrals(top))


def test_the_report_of_verify_is_shown_by_sections():
    member = km.SystemFile.from_member(km.draw_with_eigenvalues([1, -2], seed=1))
    text = text_of(km.verify(member, options=km.VerifyOptions(sections=(5, 8))))
    assert "Section 8. " in text
    assert "misprint" in text


def test_hostile_and_huge_findings_are_escaped_and_cut():
    long = "9" * 10**6
    witness = Witness((long,) * 50, long, (EVIL,), (long,), EVIL, EVIL, EVIL, {EVIL: (long,)})
    evidence = Evidence(EVIL, long, {"hypotheses": [long] * 99, "theorem": EVIL})
    place = {"misprint": EVIL, "broken": long, "section": 3, "section_title": EVIL}
    finding = Finding(EVIL + long, Verdict.REFUTED, evidence, (evidence,) * 99, witness, long, EVIL, place=place)
    html_of(finding)
    html_of(Report(EVIL, (finding,) * 1000, {"system": EVIL, "eps": long, "time_step": long}, [EVIL] * 100))


# -- the laboratory


@pytest.fixture(scope="module")
def analysis():
    return km.analyze(km.load("lotka_volterra"))


def test_an_analysis_shows_the_verdict_before_the_statements_and_each_part_by_itself(analysis):
    text = text_of(analysis)
    assert text.index("not integrable") < text.index("dx/phi is invariant")
    assert "the time step is 2 eps" in text
    for part in ("integrals", "densities", "degrees", "heights", "symmetries", "commuting", "hamiltonian"):
        assert text_of(getattr(analysis, part)).strip(), part


def test_integrals_are_shown_as_formulas(top):
    found = text_of(km.find_integrals(top))
    assert r"\displaystyle I_1 = " in found
    assert "2 found; in all 2 independent (measured: relations of degree up to 2 along orbits show 2)" in found


def test_darboux_polynomials_a_census_and_a_period_are_shown(member):
    assert "cofactor" in text_of(km.darboux_polynomials(km.load("lotka_volterra"), 1))
    assert "GF(31)" in text_of(km.cycle_census(km.load("lotka_volterra").system, "1/10", 31))
    period = km.orbit_period(km.normal_form(member), "1/10", ["1/2", "-1/5", 0, 1], 10007)
    assert "period" in text_of(period)


# -- batches


def test_a_store_shows_its_experiments_and_says_when_it_is_closed(tmp_path):
    with km.Store.open(planned(tmp_path / "a.db", 1, 2, records=[ok(1, verdict="proved")]), readonly=True) as store:
        assert "missing" in text_of(store)
        assert "1 ✓ proved" in text_of(store)
    assert "has been closed" in text_of(store)


def test_maps_as_data_show_their_equations():
    top = km.Kahan(km.QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"]))
    assert top._repr_latex_() == top.system._repr_latex_()
    lyness = km.explicit_map(["x"], [km.parse_rational_function("1/(eps + x)", ["x", "eps"])])
    text = lyness._repr_latex_()
    assert r"\varepsilon" in text
    assert "&= 0" in text
    many = [km.parse_rational_function(f"x{k}", [*(f"x{i}" for i in range(30)), "eps"]) for k in range(30)]
    assert r"\vdots" in km.explicit_map([f"x{i}" for i in range(30)], many)._repr_latex_()
