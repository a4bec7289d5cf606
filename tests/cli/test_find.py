"""The commands find-...: what they print is accepted by the checks and can be pasted, JSON has all that is needed to
search again, and what stays open gives 3.
"""

import re
import shlex

import pytest
from helpers import together

from kahanmaps.documents.catalog import load


def without_claims(name):
    """The file of the catalogue without its sections [integrals] and [density]."""
    return re.sub(r"^\[(integrals|density)\]\n([^\[].*\n|\n)*", "", load(name).to_toml(), flags=re.MULTILINE)


@pytest.mark.parametrize(
    ("find", "check", "count"),
    [
        ("find-integrals euler_top --symbolic a1,a2,a3", "check-integrals -p a1=3/2 -p a2=5", 2),
        ("find-integrals euler_top --eps 1/3", "check-integrals --eps 1/3", 2),
        ("find-integrals volterra_periodic_4", "check-integrals", 3),
        pytest.param("find-integrals henon_heiles", "check-integrals", 1, marks=pytest.mark.slow),
        pytest.param("find-integrals three_wave", "check-integrals --steps 2", 3, marks=pytest.mark.slow),
        ("find-density dressing_chain_3 --symbolic b1,b2,b3", "check-measure -p b1=7", 1),
        ("find-density euler_top --eps 1/3", "check-measure --eps 1/3", 1),
        ("find-density henon_heiles", "check-measure --steps 3", 1),
    ],
)
def test_what_is_computed_is_accepted_by_its_check(kahanmaps, tmp_path, find, check, count):
    section = kahanmaps(find, "--toml")
    assert section.status == 0
    path = tmp_path / "system.toml"
    path.write_text(without_claims(find.split()[1]) + section.out)
    command, *options = check.split()
    report = kahanmaps(command, path, "--json", *options)
    assert report.status == 0
    names = [line.split(" = ")[0] for line in section.out.splitlines() if " = " in line and line[0] in "Ip"]
    assert len(names) == count
    verdicts = {finding["claim"]: finding["verdict"] for finding in report.json["claims"]}
    assert all(verdict in ("proved", "supported") for verdict in verdicts.values())
    assert "density" in find or {f"{name} is conserved" for name in names} <= set(verdicts)


@pytest.mark.parametrize(("find", "check"), [("integrals", "integrals"), ("density", "measure")])
def test_what_is_for_one_eps_is_refuted_at_another(kahanmaps, tmp_path, find, check):
    section = kahanmaps(f"find-{find} euler_top --eps 1/3 --toml").out
    assert section.startswith("# for eps = 1/3 only (time step 2 eps = 2/3): check with --eps 1/3\n[")
    path = tmp_path / "system.toml"
    path.write_text(without_claims("euler_top") + section)
    assert kahanmaps(f"check-{check}", path, "--eps 1/4").status == 1


@pytest.mark.parametrize("options", ["--eps 1/3", "--degree 3 --denominator x"])
def test_tensors_are_accepted_by_check_poisson_for_their_system_only(kahanmaps, tmp_path, options):
    section = kahanmaps("find-poisson lotka_volterra --toml", options)
    path = tmp_path / "p.toml"
    path.write_text(section.out)
    eps = options if "eps" in options else ""
    report = kahanmaps("check-poisson lotka_volterra --json --tensor", path, eps)
    assert (section.status, report.status, report.json["verdict"]) == (0, 0, "proved")
    assert kahanmaps("check-poisson weierstrass --json --tensor", path, eps).status == 1


def test_the_commuting_systems_of_a_member_that_does_not_say_so_can_be_pasted(kahanmaps):
    rhs = " ".join(f"--rhs='{text}'" for text in kahanmaps("systems paper_m2 --json").json["rhs"])
    out = kahanmaps(f"find-commuting --vars x1,x2,x3,x4 {rhs}").out.splitlines()
    assert out[0].startswith("# find-commuting: inline, fields g = B f ")
    results = [line.split("\t")[2] for line in out if line.startswith("proved\tg and -g")]
    assert len(results) == 3  # 9 solutions: 0, f, -f and three pairs
    outcome = kahanmaps("check-commute", *(f"'{word}'" for word in shlex.split(results[0])), "paper_m2 --json")
    assert (outcome.status, outcome.json["holds"]) == (0, True)


def test_integrals_without_a_formula_give_3(kahanmaps, monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.preserve.iterates.TWO_POINT_BASES", ())
    outcome = kahanmaps("find-integrals clebsch_first_flow --max-degree 2 --json")
    assert (outcome.status, outcome.json["found"], outcome.json["codimension"]) == (3, 1, 4)
    assert "3 of the 4 independent integrals have no closed form P/Q" in outcome.json["reason"]


def test_parameters_are_those_of_both_systems_or_of_the_one_that_has_them(kahanmaps):
    linear = "check-commute \"x' = a*y; y' = -x\" \"x' = 3*a*y; y' = -3*x\" --json -p"
    assert kahanmaps(linear, "'a=root of t^2 - 2'").json["verdict"] == "proved"
    same = kahanmaps("check-commute euler_top euler_top -p a1=3 --json").json
    assert same["verdict"] == "proved"
    assert same["document"]["parameters"]["a1"] == same["other_document"]["parameters"]["a1"] == "3"
    assert kahanmaps("check-commute euler_top euler_top -p a1=3").err.startswith("-p a1: set in both systems")
    assert "both" not in kahanmaps("check-commute euler_top euler_top -p a1=3 -q").err


@together(
    "options, expected",
    [
        ("", "F1 F2"),
        ("--integral known", "F1 F2"),
        ("--integral F2", "F2"),
        ("--integral F2 --integral known", "F2 F1"),
        ("--integral F1=x1", "-F1"),
        ("--integral G=x1 --integral x2 --integral 1/x3", "-G -I1 -I2"),
        ("--integral G=x1 --integral known --integral x2", "-G -I1 F1 F2"),
    ],
)
def test_given_integrals_are_checked_first_and_those_known_where_they_are_named(kahanmaps, options, expected):
    claims = kahanmaps(f"check-integrals euler_top {options} --json").json["claims"]
    signs = {"refuted": "-", "proved": ""}
    assert [signs[one["verdict"]] + one["claim"].removesuffix(" is conserved") for one in claims] == expected.split()
