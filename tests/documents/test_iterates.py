"""Formulas with x~ in text: what they mean, that what is printed is read, and what is refused."""

import re

import pytest
from flint import fmpq
from helpers import refuses, together

import kahanmaps as km
from kahanmaps.checks.claims import Certainty
from kahanmaps.documents.iterates import parse_with_iterates

ROTATION = "x' = y; y' = -x"


@together(
    "text, words",
    [
        ("F0*x~, F0", "expected what a letter stands for"),
        ("F0*x~, x = y", "no names that are already in use"),
        ("F0*x~, F0 = x, F0 = y", "expected each of them once"),
        ("F0~, F0 = F1, F1 = x", "unknown name 'F1'"),
        ("F0~, F0 = x/y", "division"),
        ("x" + "~" * 17, "expected at most 16"),
        ("x" + "~" * 100_000, "expected at most 16"),
        ("~x", "found the character '~'"),
        ("x ~", "found the character '~'"),
        ("eps~", "unknown name 'eps~'"),
        ("z~", "unknown name 'z~'"),
        ("F~^64, F = " + "+".join(f"x^{k}" for k in range(1, 30)), "too many terms"),
    ],
)
def test_what_is_no_formula_is_refused(text, words):
    refuses(re.escape(words), parse_with_iterates, text, ("x", "y"), ("a", "eps"), {"c": fmpq(3)})


# I(x, x~) of a rotation is the sine of its angle times the energy, and moved by one of its summands it is not kept.
@pytest.mark.parametrize(
    ("claim", "verdict"),
    [
        ("x*y~ - y*x~", Certainty.PROVED),
        ("x*y~~ - y*x~~", Certainty.PROVED),
        ("(x*y~ - y*x~)/(x*x~ + y*y~)", Certainty.PROVED),
        ("F*G~ - G*F~, F = x, G = y", Certainty.PROVED),
        ("x*y~ + y*x~", Certainty.REFUTED),
        ("x~", Certainty.REFUTED),
        ("x*y~ - 2*y*x~", Certainty.REFUTED),
    ],
)
@pytest.mark.parametrize("eps", [None, "2/7"])
def test_claims_with_images_are_checked(claim, verdict, eps):
    report = km.check_integrals(km.System(ROTATION), km.Settings(eps=eps), {"I": claim})
    assert report.findings[-1].verdict is verdict


def test_a_witness_is_one_along_its_orbit():
    report = km.check_integrals(km.System("x' = y; y' = x^2 - x"), km.Settings(eps="1/3"), {"I": "x*y~ - y*x~"})
    witness = report.findings[-1].witness
    phi = km.System("x' = y; y' = x^2 - x").at("1/3")
    x = [fmpq(*map(int, entry.split("/"))) for entry in witness.point]
    back, image = phi.inverse(x), phi(x)
    assert [str(x[0] * image[1] - x[1] * image[0])] == list(witness.left)
    assert [str(back[0] * x[1] - back[1] * x[0])] == list(witness.right)


TOML = """
[system]
rhs = "x' = y; y' = -x"
[integrals]
I = "x^2 + y^2"
A = "x*y~ - y*x~"
"""


def test_a_file_may_claim_them_and_is_written_with_them():
    file = km.parse_system(TOML)
    assert (list(file.integrals), list(file.integrals_in_iterates)) == (["I"], ["A"])
    assert km.parse_system(file.to_toml()) == file
    assert [str(finding.verdict) for finding in km.check_integrals(file).findings] == ["proved", "proved"]
    refuted = km.parse_system(TOML.replace("x*y~ - y", "x*y~ + y"))
    assert refuted != file
    assert [str(finding.verdict) for finding in km.check_integrals(refuted).findings] == ["proved", "refuted"]


@pytest.mark.slow
def test_what_the_search_prints_is_a_claim_that_holds():
    search = km.find_integrals(km.load("lagrange_top"))
    assert len(search.in_iterates) == 1
    text = km.load("lagrange_top").to_toml().partition("[integrals]")[0] + search.toml_section()
    report = km.check_integrals(km.parse_system(text))
    assert [finding.claim.split()[0] for finding in report.findings] == [f"I{k}" for k in range(1, 5)]
    assert report.verdict is Certainty.PROVED
