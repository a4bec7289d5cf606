"""kahanmaps find-integrals: formulas that check-integrals accepts, honest words where there are none, no traceback."""

from __future__ import annotations

import json

import pytest
from schema_helpers import mistakes

from kahanmaps.documents.catalog import load
from kahanmaps.version import __version__

OSCILLATOR = "--vars x,y --rhs y --rhs=-x+x^2"
RAMP = "--vars x,y --rhs x --rhs 3*y"


def without_claims(name):
    """The file of the catalogue without its sections [integrals] and [density]."""
    kept, skips = [], False
    for line in load(name).to_toml().splitlines():
        if line.startswith("["):
            skips = line.strip() in ("[integrals]", "[density]")
        if not skips:
            kept.append(line)
    return "\n".join(kept) + "\n"


def test_formulas_verdicts_and_what_was_measured(kahanmaps):
    outcome = kahanmaps("find-integrals nahm_tetrahedral")
    assert outcome.status == 0
    assert outcome.out.splitlines() == [
        "find-integrals: nahm_tetrahedral, every eps (the time step is 2 eps)",
        "I1\tproved\ty*(3*x^2 - y^2)/(4*x^2*eps^2 + 4*y^2*eps^2 - 1)",
        "\trelations of degree 3 along orbits: both sides are the same rational function, for every eps",
        "found\t1 functionally independent; in all 1 independent (1 by theorems: 1 modified Hamiltonian; "
        "measured: relations of degree up to 3 along orbits show no more)",
    ]


def test_symbols(kahanmaps):
    outcome = kahanmaps("find-integrals euler_top --symbolic a1,a2,a3,eps -q")
    assert (outcome.status, outcome.err) == (0, "")
    first = outcome.out.splitlines()[0]
    assert first == "find-integrals: euler_top, every eps (the time step is 2 eps), every a1, a2, a3"
    assert all(f"a{k}" in outcome.out for k in (1, 2, 3))


@pytest.mark.parametrize(
    ("name", "options", "check"),
    [
        ("euler_top", "", ""),
        ("euler_top", "--symbolic a1,a2,a3", "-p a1=3/2 -p a2=5"),
        ("euler_top", "--eps 1/3", "--eps 1/3"),
        pytest.param("dressing_chain_3", "--symbolic b1,b2,b3", "-p b1=7", marks=pytest.mark.slow),
        ("weierstrass", "--symbolic g2", "-p g2=-3/5"),
        ("volterra_periodic_4", "", ""),
        pytest.param("zhukovski_volterra_2", "", "", marks=pytest.mark.slow),
        pytest.param("henon_heiles", "", "", marks=pytest.mark.slow),
        pytest.param("three_wave", "", "--steps 2", marks=pytest.mark.slow),
    ],
)
def test_the_section_is_accepted_by_check_integrals(kahanmaps, tmp_path, name, options, check):
    section = kahanmaps(f"find-integrals {name} --toml", options)
    assert section.status == 0
    path = tmp_path / "system.toml"
    path.write_text(without_claims(name) + section.out)
    report = kahanmaps("check-integrals", path, "--json", check)
    assert report.status == 0
    found = [line.split(" = ")[0] for line in section.out.splitlines() if line[0] == "I"]
    verdicts = {finding["claim"]: finding["verdict"] for finding in report.json["claims"]}
    assert len(found) == load(name).catalog["codimension"]
    assert all(verdicts[f"{one} is conserved"] in ("proved", "supported") for one in found)


def test_formulas_for_one_eps_are_refuted_at_another(kahanmaps, tmp_path):
    section = kahanmaps("find-integrals euler_top --eps 1/3 --toml").out
    assert section.startswith("# for eps = 1/3 only (time step 2 eps = 2/3): check with --eps 1/3\n[integrals]\n")
    path = tmp_path / "system.toml"
    path.write_text(without_claims("euler_top") + section)
    assert kahanmaps("check-integrals", path, "--eps 1/4").status == 1


def test_variables_with_the_names_of_integrals(kahanmaps, tmp_path):
    path = tmp_path / "system.toml"
    path.write_text('variables = ["I1", "I2", "x"]\n[system]\nrhs = ["I2", "-I1", "0"]\n')
    section = kahanmaps("find-integrals", path, "--toml").out
    assert section == '[integrals]\nI1 = "x"\nI2 = "I1^2 + I2^2"\n'
    path.write_text(path.read_text() + section)
    assert kahanmaps("check-integrals", path).status == 0


def test_json_is_one_object_with_all_that_is_needed_to_redo_it(kahanmaps):
    outcome = kahanmaps("find-integrals euler_top --symbolic a1 --seed 5 --json -q")
    found = outcome.json
    assert (outcome.status, outcome.err) == (0, "")
    assert {key: found[key] for key in ("command", "version", "system", "symbols", "eps", "time_step", "seed")} == {
        "command": "find-integrals",
        "version": __version__,
        "system": "euler_top",
        "symbols": ["a1"],
        "eps": "every",
        "time_step": "every",
        "seed": 5,
    }
    assert found["parameters"] == {"a1": "1", "a2": "-2", "a3": "1"}
    assert found["convention"] == "eps is the paper's epsilon, the time step is 2 eps"
    assert (found["found"], found["codimension"], found["reason"], found["note"]) == (2, 2, "", "")
    assert found["relations"]["nullities"] == [0, 2]
    assert [one["verdict"] for one in found["integrals"]] == ["proved", "proved"]
    assert len(found["primes"]) == 2
    assert all(prime.isdigit() for prime in found["primes"])
    assert found["document"]["variables"] == ["x1", "x2", "x3"]
    again = kahanmaps("find-integrals euler_top --symbolic a1 --seed 5 --json -q")
    assert again.json == found


def test_latex(kahanmaps):
    outcome = kahanmaps("find-integrals nahm_tetrahedral --latex")
    assert outcome.out.startswith("I1 = \\frac{")
    assert outcome.status == 0


@pytest.mark.parametrize(("command", "steps"), [(f"{OSCILLATOR} --eps 1", 4), ("--vars x --rhs 1+x^2 --eps 1/2", 4)])
def test_a_map_that_is_periodic_at_this_eps_is_told(kahanmaps, command, steps):
    outcome = kahanmaps(f"find-integrals {command}")
    eps = command.split()[-1]
    note = f"note\torbits close after {steps} steps: at eps = {eps} the map is periodic (measured); "
    assert outcome.status == 0
    assert note + "nothing follows for other eps" in outcome.out.splitlines()
    assert "every eps" not in outcome.out
    assert kahanmaps(f"find-integrals {command} --json").json["relations"]["period"] == steps


@pytest.mark.slow
def test_henon_heiles_at_eps_1(kahanmaps):
    outcome = kahanmaps("find-integrals henon_heiles --eps 1")
    assert "nothing follows for other eps" in outcome.out
    assert "every eps" not in outcome.out


def test_the_zero_system(kahanmaps):
    outcome = kahanmaps("find-integrals --vars x,y --rhs 0 --rhs 0")
    assert outcome.status == 0
    assert "note\torbits close after 1 step at every eps that was tried: the map is periodic (measured)" in outcome.out


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (f"{RAMP} --eps 1", "at eps = 1 the map has no value anywhere: det(I - eps f'(x)) is identically 0"),
        (f"{RAMP} --eps -1/3", "at eps = -1/3 the map is not invertible: det(I + eps f'(x)) is 0 at all images"),
        ("--vars x --rhs x --eps 1", "the map has no value anywhere"),
    ],
)
def test_maps_that_are_none_give_3(kahanmaps, command, words):
    outcome = kahanmaps(f"find-integrals {command}")
    assert outcome.status == 3
    assert outcome.out.splitlines()[1] == "orbits\tnot measured"
    assert words in outcome.out


def test_integrals_without_a_formula_give_3(kahanmaps, monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.preserve.iterates.LIFTS", ())
    outcome = kahanmaps("find-integrals clebsch_first_flow --max-degree 2 --json")
    assert (outcome.status, outcome.json["found"], outcome.json["codimension"]) == (3, 1, 4)
    assert "3 of the 4 independent integrals have no closed form P/Q" in outcome.json["reason"]


def test_integrals_in_iterates_are_shown_with_the_others(kahanmaps):
    outcome = kahanmaps("find-integrals lagrange_top --max-degree 2 --json")
    assert (outcome.status, outcome.json["found"], len(outcome.json["in_iterates"])) == (0, 4, 1)
    [one] = outcome.json["in_iterates"]
    assert one["name"] == "I4"
    assert "p1*m1~*eps^2" in one["integral"]
    assert r"\tilde{p_1}" in one["latex"]
    assert f"# I4: {one['integral']}" in kahanmaps("find-integrals lagrange_top --max-degree 2 --toml").out


def test_too_little_time_gives_3(kahanmaps):
    outcome = kahanmaps("find-integrals lorenz --max-degree 20 --seconds 1")
    assert outcome.status == 3
    assert "and more were not tried: too many unknowns or too little time" in outcome.out


def test_bases_of_given_polynomials(kahanmaps):
    outcome = kahanmaps(
        "find-integrals lagrange_top --monomials 'm1^2+m2^2,m1*p1+m2*p2,p1^2+p2^2,p3^2,p3,1' --monomials m3,1"
    )
    lines = outcome.out.splitlines()
    assert outcome.status == 0
    assert lines[0] == (
        "Hirota-Kimura bases: lagrange_top, generic eps, measured on two orbits modulo each of two primes"
    )
    assert [line.split("\t")[0] for line in lines if line.startswith("dim")][1] == "dimension 1"
    assert "\tcoefficients that are integrals: 1" in lines


def test_bases_in_json(kahanmaps):
    found = kahanmaps("find-integrals euler_top --monomials x1^2,x2^2,x3^2,1 --eps 1/3 --json").json
    assert (found["command"], found["eps"], found["time_step"], found["version"]) == (
        "hirota-kimura",
        "1/3",
        "2/3",
        __version__,
    )
    assert found["bases"][0]["dimension"] == 2
    assert (found["note"], found["reason"], len(found["primes"])) == ("", "", 2)


def test_bases_where_orbits_close_or_are_none(kahanmaps):
    closes = kahanmaps(f"find-integrals {OSCILLATOR} --eps 1 --monomials x^2,y^2,x,y,1")
    assert (closes.status, "nothing follows for other eps" in closes.out) == (0, True)
    none = kahanmaps(f"find-integrals {RAMP} --eps 1 --monomials x,y")
    assert (none.status, "no value anywhere" in none.out) == (3, True)


def test_symbols_in_a_family_file_are_refused(kahanmaps, tmp_path):
    path = tmp_path / "member.toml"
    path.write_text(load("paper_m2").to_toml().replace("[family]", '[parameters]\nt = "1"\n[family]'))
    outcome = kahanmaps("find-integrals", path, "--symbolic t")
    assert (outcome.status, "write the system as [hamiltonian]" in outcome.err) == (2, True)


def test_integrals_of_the_flow(kahanmaps):
    lines = kahanmaps("find-integrals henon_heiles --flow --max-degree 3 -q").out.splitlines()
    assert lines[0] == "find-integrals: henon_heiles, the flow x' = f(x)"
    assert lines[1].startswith("F1\tproved\t6*q1^2*q2 - 2*q2^3")
    record = json.loads(kahanmaps("find-integrals euler_top --flow --json -q").out)
    assert record["flow"] is True
    assert [one["combination"] for one in record["beside_map"]["limits"]] == ["(I1 + 1)/eps^2", "(-I2/2 + 1/2)/eps^2"]
    assert mistakes("find-integrals", record) == []
    assert "flow" not in json.loads(kahanmaps("find-integrals euler_top --json -q").out)
    for option in ("--toml", "--darboux 2 --latex", "--monomials x1,1"):
        assert kahanmaps(f"find-integrals euler_top --flow {option}").status == 2
    assert kahanmaps("find-integrals lyness --flow").status == 2
