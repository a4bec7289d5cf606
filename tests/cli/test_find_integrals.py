"""kahanmaps find-integrals: formulas that check-integrals accepts, honest words where there are none, no traceback."""

import json

import pytest
from schema_helpers import mistakes

from kahanmaps.documents.catalog import load
from kahanmaps.version import __version__


def without_claims(name):
    """The file of the catalogue without its sections [integrals] and [density]."""
    kept, skips = [], False
    for line in load(name).to_toml().splitlines():
        if line.startswith("["):
            skips = line.strip() in ("[integrals]", "[density]")
        if not skips:
            kept.append(line)
    return "\n".join(kept) + "\n"


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
