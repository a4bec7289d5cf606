"""kahanmaps check-commute, check-integrals, check-measure, check-poisson: reports for people and for scripts.

With --json a check prints one object with the verdict, everything that is needed to do the check again, and a verdict
with evidence for each claim; a refuted claim has a witness that anybody can verify, here by `kahanmaps orbit`.
"""

import shlex
from fractions import Fraction

import pytest
from cli_helpers import terminal


def claims(report):
    """Claim -> the rest, without the control."""
    return {found["claim"]: found for found in report["claims"] if "control" not in found}


def image(kahanmaps, system, point, eps):
    """The image of a point under a Kahan map, by `kahanmaps orbit`."""
    command = f"orbit {system} --start={','.join(point)} --eps {eps} --steps 1 --format jsonl"
    return kahanmaps(command).records[-2]["x"]


# Doing it again


def test_the_seed_draws_the_start(kahanmaps):
    first, second, third = (
        kahanmaps(f"check-integrals euler_top --seed {seed} --json").json["orbit"]["start"] for seed in (1, 2, 1)
    )
    assert first == third != second


def test_a_witness_of_an_integral_is_verified_by_an_orbit(kahanmaps):
    claim = claims(kahanmaps("check-integrals euler_top --integral s=x1-x2/3 --json").json)["s is conserved"]
    witness = claim["witness"]
    assert witness["field"] == "QQ"
    before = [Fraction(entry) for entry in witness["point"]]
    after = [Fraction(entry) for entry in image(kahanmaps, "euler_top", witness["point"], witness["eps"])]
    assert [Fraction(text) for text in witness["right"]["value"]] == [before[0] - before[1] / 3]
    assert [Fraction(text) for text in witness["left"]["value"]] == [after[0] - after[1] / 3]


def test_a_witness_of_maps_that_do_not_commute_is_verified_by_orbits(kahanmaps):
    (claim,) = kahanmaps("check-commute euler_top lorenz --json").json["claims"]
    x, eps = claim["witness"]["point"], claim["witness"]["eps"]
    f_first = image(kahanmaps, "lorenz", image(kahanmaps, "euler_top", x, eps), eps)
    g_first = image(kahanmaps, "euler_top", image(kahanmaps, "lorenz", x, eps), eps)
    assert claim["witness"]["left"] == {"is": "Phi_g(Phi_f(x))", "value": f_first}
    assert claim["witness"]["right"] == {"is": "Phi_f(Phi_g(x))", "value": g_first}


# check-commute


def test_parameters_are_those_of_both_systems_or_of_the_one_that_has_them(kahanmaps):
    linear = "check-commute \"x' = a*y; y' = -x\" \"x' = 3*a*y; y' = -3*x\" --json -p"
    assert kahanmaps(linear, "'a=root of t^2 - 2'").json["verdict"] == "proved"
    same = kahanmaps("check-commute euler_top euler_top -p a1=3 --json").json
    assert same["verdict"] == "proved"
    assert same["document"]["parameters"]["a1"] == same["other_document"]["parameters"]["a1"] == "3"
    assert kahanmaps("check-commute euler_top euler_top -p a1=3").err.startswith("-p a1: set in both systems")
    assert "both" not in kahanmaps("check-commute euler_top euler_top -p a1=3 -q").err


# check-integrals


@pytest.mark.parametrize(
    ("options", "expected"),
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
def test_integrals_of_the_command_line_are_checked_first_and_those_known_where_they_are_named(
    kahanmaps, options, expected
):
    report = kahanmaps(f"check-integrals euler_top {options} --json").json
    signs = {"refuted": "-", "proved": ""}
    told = [signs[one["verdict"]] + one["claim"].removesuffix(" is conserved") for one in report["claims"]]
    assert told == expected.split()


def test_an_integral_without_a_name_does_not_take_one_of_the_file(kahanmaps, tmp_path):
    path = tmp_path / "a.toml"
    path.write_text('variables = ["x"]\n[system]\nrhs = ["0"]\n[integrals]\nI1 = "x"\nI3 = "2*x"\n')
    report = kahanmaps(
        "check-integrals", path, "--integral x^2 --integral x^3 --integral E=1/x --integral known --json"
    ).json
    formulas = {claim: found["formula"] for claim, found in claims(report).items()}
    assert formulas == {
        "I1 is conserved": "x",
        "I3 is conserved": "2*x",
        "I2 is conserved": "x^2",
        "I4 is conserved": "x^3",
        "E is conserved": "1/x",
    }


# For people


@pytest.mark.parametrize(
    "command", ["check-commute paper_m2", "check-integrals euler_top --integral x1", "check-poisson henon_heiles"]
)
def test_a_pipe_gets_plain_lines(kahanmaps, command):
    lines = kahanmaps(command).out.splitlines()
    report = kahanmaps(f"{command} --json").json
    assert lines[0].startswith(f"{report['check']}: {report['system']}")
    told = [line.split("\t")[1] for line in lines[1:-1] if not line.startswith(("\t", "note\t"))]
    assert told == [claim["claim"] for claim in report["claims"]]
    assert lines[-1] == f"verdict\t{report['verdict']}"


def test_all_evidence_is_shown_on_a_terminal_when_asked_for(kahanmaps):
    command = "check-integrals henon_heiles"
    shown = " ".join(terminal(*shlex.split(f"{command} -v"), columns=5000).out.replace("│", " ").split())
    for line in kahanmaps(command).out.splitlines()[1:-1]:
        assert " ".join(line.split("\t")[-1].split()) in shown
