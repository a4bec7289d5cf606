"""Verdicts, findings and reports: how verdicts combine, what a control is, and the JSON that scripts rely on.

The verdict of a report is the weakest of its claims, controls left out.
"""

import json
from fractions import Fraction

import pytest
from check_helpers import QUICK, file_of, hamiltonian_of, system_of

from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report, Witness, combined
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure, check_poisson
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.files import SystemFile
from kahanmaps.family.random_members import random_member_with_eigenvalues
from kahanmaps.maps.convention import CONVENTION
from kahanmaps.version import __version__

P, R, S, U = Certainty.PROVED, Certainty.REFUTED, Certainty.SUPPORTED, Certainty.UNDECIDED

WITNESS = Witness(("1/2", "0"), "1/10", ("1",), ("2",), "I(x~)", "I(x)")


def finding(verdict: Certainty, control: bool = False) -> Finding:
    witness = WITNESS if verdict is R else None
    return Finding("a claim", verdict, Evidence("method", "why"), witness=witness, control=control)


@pytest.mark.parametrize(("verdict", "holds"), [(P, True), (S, True), (R, False), (U, None)])
def test_a_verdict_says_whether_the_claim_holds(verdict, holds):
    assert verdict.holds is holds


@pytest.mark.parametrize("result", [*Certainty, finding(R), Report("integrals", (finding(P),))])
def test_a_result_has_no_truth_value_and_says_what_to_ask_instead(result):
    with pytest.raises(TypeError, match=r"truth value of a (Certainty|Finding|Report) is ambiguous: use \.holds"):
        bool(result)
    assert result.holds in (True, False, None)


# By hand: refuted before undecided before supported before proved.
@pytest.mark.parametrize(("verdicts", "expected"), [([P], P), ([P, S], S), ([S, U], U), ([P, S, U, R], R), ([], U)])
def test_verdicts_combine_to_the_weakest(verdicts, expected):
    assert combined(verdicts) is expected


def test_the_json_of_a_refuted_control_shows_the_witness_and_what_was_expected():
    finding = Finding(
        "c", R, Evidence("m", "s"), (Evidence("orbit", "too"),), WITNESS, "a = b", "somebody", control=True
    )
    assert finding.to_json() == {
        "claim": "c",
        "verdict": "refuted",
        "evidence": {"method": "m", "summary": "s"},
        "witness": {
            "point": ["1/2", "0"],
            "eps": "1/10",
            "field": "QQ",
            "left": {"is": "I(x~)", "value": ["1"]},
            "right": {"is": "I(x)", "value": ["2"]},
        },
        "further_evidence": [{"method": "orbit", "summary": "too"}],
        "formula": "a = b",
        "source": "somebody",
        "control": True,
        "expected": "refuted",
    }


LOTKA_VOLTERRA = file_of(system_of("x y", "x*(2 - y)", "y*(3*x - 1)"), I="x*y/(1 - eps^2*x)", phi="x*y")
MEMBER = SystemFile.from_member(random_member_with_eigenvalues([1, -2], seed=3))
PLANE = SystemFile.from_hamiltonian(hamiltonian_of("q p", "q^3/3 + p^2/2"))
REPORTS = {
    "commute, member": lambda settings: check_commute(MEMBER, None, settings),
    "commute, pair": lambda settings: check_commute(PLANE, LOTKA_VOLTERRA, settings),
    "integrals": lambda settings: check_integrals(LOTKA_VOLTERRA, settings),
    "measure": lambda settings: check_measure(LOTKA_VOLTERRA, settings),
    "poisson": lambda settings: check_poisson(PLANE, settings),
}
over_reports = pytest.mark.parametrize("run", REPORTS.values(), ids=REPORTS)


@over_reports
def test_every_report_is_plain_data_for_every_eps_with_a_witness_where_it_is_refuted(run):
    report = run(QUICK)
    plain = report.to_json()
    assert json.loads(json.dumps(plain)) == plain
    assert (plain["eps"], plain["time_step"]) == ("every", "every")
    assert 0 < Fraction(plain["orbit"]["eps"]) < 1
    assert all((finding.witness is not None) == (finding.verdict is R) for finding in report.findings)


@over_reports
def test_every_report_carries_what_is_needed_to_run_it_again(run):
    plain = run(Settings(eps="1/3", steps=2, seed=5, error_bits=60)).to_json()
    expected = {"version": __version__, "eps": "1/3", "time_step": "2/3", "convention": CONVENTION}
    expected |= {"arithmetic": "exact", "seed": 5, "error_bits": 60}
    assert {name: plain[name] for name in expected} == expected
    assert plain["system"]


@over_reports
def test_every_report_comes_out_the_same_from_the_same_seed_and_its_orbit_from_its_own_start(run):
    first = run(Settings(steps=2, seed=11)).to_json()
    assert run(Settings(steps=2, seed=11)).to_json() == first
    orbit = first["orbit"]
    assert run(Settings(steps=2, eps=orbit["eps"], start=orbit["start"], seed=12)).to_json()["orbit"] == orbit


@pytest.mark.parametrize("name", ["commute, member", "measure", "poisson"])
def test_what_is_proved_has_no_bound_for_an_error_and_what_is_supported_the_one_asked_for(name):
    report = REPORTS[name](Settings(steps=1, error_bits=200))
    for entry in report.findings:
        for evidence in (entry.evidence, *entry.also):
            bound = evidence.data.get("error_bound")
            assert (bound is not None) == ("false with probability" in evidence.summary)
            assert bound is None or (entry.verdict is S and int(bound.removeprefix("2^-")) >= 200)
    assert {finding.verdict for finding in report.findings} & {P, S}
