"""kahanmaps check-commute, check-integrals, check-measure, check-poisson: reports for people and for scripts.

With --json a check prints one object with the verdict, everything that is needed to do the check again, and a verdict
with evidence for each claim; a refuted claim has a witness that anybody can verify, here by `kahanmaps orbit`.
"""

from fractions import Fraction

import pytest


def claims(report):
    """Claim -> the rest, without the control."""
    return {entry["claim"]: entry for entry in report["claims"] if "control" not in entry}


def image(kahanmaps, system, point, eps):
    """The image of a point under a Kahan map, by `kahanmaps orbit`."""
    command = f"orbit {system} --start={','.join(point)} --eps {eps} --steps 1 --format jsonl"
    return kahanmaps(command).records[-2]["x"]


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


def test_parameters_are_those_of_both_systems_or_of_the_one_that_has_them(kahanmaps):
    linear = "check-commute \"x' = a*y; y' = -x\" \"x' = 3*a*y; y' = -3*x\" --json -p"
    assert kahanmaps(linear, "'a=root of t^2 - 2'").json["verdict"] == "proved"
    same = kahanmaps("check-commute euler_top euler_top -p a1=3 --json").json
    assert same["verdict"] == "proved"
    assert same["document"]["parameters"]["a1"] == same["other_document"]["parameters"]["a1"] == "3"
    assert kahanmaps("check-commute euler_top euler_top -p a1=3").err.startswith("-p a1: set in both systems")
    assert "both" not in kahanmaps("check-commute euler_top euler_top -p a1=3 -q").err


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
    messages = [signs[entry["verdict"]] + entry["claim"].removesuffix(" is conserved") for entry in report["claims"]]
    assert messages == expected.split()
