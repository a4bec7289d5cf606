"""verify: what it says of whole members, of broken input and of members that are not generic.

For a member with distinct roots every claim is proved, m = 7 and 8 aside, and misprints are refuted. Beside each proof
stand random points over GF(p) with an error bound. Where chi has repeated roots, claims that need distinct ones are
undecided and say why; nothing is refuted there but misprints. In
the table of what survives beyond the paper everything is proved, or refuted by a smallest counterexample.
"""

import random
import re
from dataclasses import replace
from pathlib import Path

import pytest
from flint import fmpq_mat, fmpq_poly
from helpers import quick
from paper.members import LARGE_SPECTRA, SPECTRA, file, member, verifier_of

from kahanmaps import Certainty, FamilyMember, Settings, SystemFile, parse_polynomial
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.paper import specialize
from kahanmaps.paper import verify as verify_module
from kahanmaps.paper.claims.beyond_table import beyond_table, smallest_counterexample, table
from kahanmaps.paper.claims.further_claims import STATEMENTS
from kahanmaps.paper.controls import CONTROLS
from kahanmaps.paper.registry import ClaimKind, claims
from kahanmaps.paper.variations import VARIATIONS
from kahanmaps.paper.verify import Verifier, VerifyOptions, verify

PROVED, REFUTED, SUPPORTED, UNDECIDED = Certainty.PROVED, Certainty.REFUTED, Certainty.SUPPORTED, Certainty.UNDECIDED
QUICK = ("m=1", "m=2, split")
LONGER = [pytest.mark.slow, pytest.mark.timeout(900)]
LARGE = [name for name in (*SPECTRA, *LARGE_SPECTRA) if name[:3] not in ("m=1", "m=2", "m=3")]
CASES = quick([name for name in SPECTRA if name not in LARGE], QUICK)
over_members = pytest.mark.parametrize("name", [*CASES, *(pytest.param(name, marks=LONGER) for name in LARGE)])
SIXTH = VerifyOptions(sections=(6,))


def by_key(report):
    return {finding.place["key"]: finding for finding in report.findings if "key" in finding.place}


def keys(report, verdict):
    return {key for key, finding in by_key(report).items() if finding.verdict is verdict}


# What `verify` says without --beyond: not the statements asked of variations.
STATED = [claim for claim in claims() if not claim.variation]
# Claims about systems without any structure, and about the coordinates themselves.
WITHOUT_NORMAL_FORM = {claim.key for claim in claims() if not claim.symplectic}
FORMAL = {claim.key for claim in claims() if claim.formal is not None}


def stated(m):
    return [claim.key for claim in STATED if claim.makes_sense(m)]


def misprints(m):
    return {claim.key for claim in claims() if claim.misprint and claim.makes_sense(m)}


@over_members
def test_every_claim_but_misprints_is_proved_for_a_member_with_distinct_roots(name):
    # One report, and what it has to be: neighbours would compute it again in another process.
    report, wrong = verify(file(name)), misprints(member(name).m)
    result = by_key(report)
    assert [finding.place["key"] for finding in report.findings] == stated(member(name).m)
    assert keys(report, REFUTED) == wrong
    assert keys(report, PROVED) == set(result) - wrong
    assert (report.verdict, report.holds) == (PROVED, True)
    for key in wrong:
        assert result[key].control
        assert result[key].place["misprint"]
        assert result[key].witness.left != result[key].witness.right


@pytest.mark.parametrize("requested", [1, 300])
def test_beside_a_proof_stand_random_points_with_the_error_bound_asked_for(requested):
    for finding in verify(file("m=2, irreducible"), Settings(error_bits=requested), SIXTH).findings:
        (points,) = [evidence for evidence in finding.also if evidence.method == "random points over GF(p)"]
        assert int(points.data["error_bound"].removeprefix("2^-")) >= requested


@pytest.mark.parametrize("name", quick(["m=3, irreducible", "m=2, complex"], ["m=2, complex"]))
def test_claims_about_one_block_hold_over_the_algebra_of_all_roots(name):
    report = verify(file(name), options=SIXTH)
    assert "exact over Q[t]/chi" in [evidence.method for evidence in by_key(report)["commutativity"].also]


@pytest.mark.parametrize("name", quick(["m=2, complex", "m=3, irreducible", "m=3, split"], ["m=2, complex"]))
def test_complex_balls_overlap_to_within_a_few_bits(name):
    report = verify(file(name), options=VerifyOptions(sections=(6,), ball_bits=200))
    for finding in report.findings:
        (balls,) = [evidence for evidence in finding.also if evidence.method == "complex balls"]
        assert balls.data["bits"] == 200
        assert balls.data["pairs"] > 0
        assert int(balls.summary.split("2^-")[1]) > 100


@pytest.mark.parametrize("section", quick(range(1, 11), [4, 10]))
def test_a_section_alone_has_its_claims_in_the_order_of_the_paper(section):
    report = verify(file("m=2, split"), options=VerifyOptions(sections=(section,)))
    expected = [claim.key for claim in STATED if claim.makes_sense(2) and claim.section == section]
    assert [finding.place["key"] for finding in report.findings] == expected


def test_at_one_eps_everything_holds_as_well():
    report = verify(file("m=2, split"), Settings(eps="1/10"))
    assert (report.holds, report.context["eps"]) == (True, "1/10")
    assert keys(report, SUPPORTED) <= WITHOUT_NORMAL_FORM
    for key in misprints(2):
        assert by_key(report)[key].witness.eps == "1/10"


@pytest.mark.parametrize("order", quick([1, 3, 6], [6]))
def test_the_series_of_the_integrals_is_proved_to_the_order_asked_for(order):
    report = verify(file("m=2, split"), options=VerifyOptions(sections=(7,), order=order))
    assert by_key(report)["series-of-the-integrals"].verdict is PROVED
    assert report.context["order"] == order


@over_members
def test_every_control_is_refuted_at_a_witness(name):
    report = verify(file(name), options=VerifyOptions(controls=True))
    *findings, last = report.findings
    assert {finding.place["key"] for finding in findings} == set(stated(member(name).m))
    assert all(one.verdict is REFUTED and one.control and one.witness is not None for one in findings)
    assert last.verdict is report.verdict is PROVED


def test_a_claim_that_no_control_refutes_is_reported(monkeypatch):
    # The control "eps" without its effect: the claim that only it refutes is no check any more.
    monkeypatch.setitem(CONTROLS, "eps", replace(CONTROLS["eps"], function=lambda o: o.replace()))
    report = verify(file("m=2, split"), options=VerifyOptions(sections=(6,), controls=True))
    assert verify_module.NOTE_ON_PROOFS not in report.notes
    assert verify_module.NOTE_ON_PROOFS in verify(file("m=2, split"), options=SIXTH).notes
    assert report.verdict is UNDECIDED
    assert report.findings[-1].evidence.summary == "no control refutes jacobians-at-the-images"


REPEATED = {
    "(t-1)^2 (t+2)": random_member_with_chi(fmpq_poly([2, -3, 0, 1]), seed=3),
    "(t-1)^2": random_member_with_chi(fmpq_poly([1, -2, 1]), seed=3),
    "1, 1, 2": random_member_with_eigenvalues([1, 1, 2], seed=3),
    "1, 1": random_member_with_eigenvalues([1, 1], seed=3),
}
over_repeated = pytest.mark.parametrize("name", quick(REPEATED, ["1, 1"]))


@over_repeated
def test_claims_that_need_distinct_roots_are_undecided_and_nothing_is_refuted_but_misprints(name):
    report, m = verify(SystemFile.from_member(REPEATED[name])), REPEATED[name].m
    assert keys(report, REFUTED) <= misprints(m)
    assert report.verdict is UNDECIDED
    for claim in (claim for claim in STATED if claim.makes_sense(m)):
        bounds, uses_roots = specialize.bound_objects(REPEATED[name], None, 3), False
        if claim.kind is ClaimKind.EQUAL:
            uses_roots = bool(list(claim.function(bounds))) and "roots" in bounds.used
        if claim.distinct_roots or uses_roots:
            result = by_key(report)[claim.key]
            assert (result.verdict, result.evidence.method) == (UNDECIDED, "outside the hypotheses")
            assert "repeated roots" in result.evidence.summary


def of_two_planes(H):
    """The member of A = diag(1, 2, 1, 2) with this Hamiltonian: one in x1, x3 plus one in x2, x4."""
    A = fmpq_mat(4, 4, [1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2])
    return FamilyMember(A, parse_polynomial(H, ["x1", "x2", "x3", "x4"]))


def test_identities_are_proved_for_a_special_member_and_what_is_said_in_general_only_is_not_refuted():
    """Distinct roots, but H vanishes on the second block: nothing moves there."""
    report = verify(SystemFile.from_member(of_two_planes("x1^3 + x1*x3^2")))
    assert keys(report, REFUTED) <= misprints(2)
    assert "hamiltonians-are-independent" in keys(report, UNDECIDED)
    evidence = by_key(report)["hamiltonians-are-independent"].evidence
    assert (evidence.method, evidence.data["points"]) == ("special member", 4)
    assert "H vanishes on the eigenspaces of the roots of t - 2" in evidence.summary
    identities = {c.key for c in STATED if c.kind is ClaimKind.EQUAL and c.makes_sense(2) and not c.misprint}
    assert identities - WITHOUT_NORMAL_FORM <= keys(report, PROVED)
    assert identities <= keys(report, PROVED) | keys(report, SUPPORTED)


def test_statements_that_something_differs_are_proved_where_the_roots_are_irrational():
    """chi = t^2 - 2: what needs the roots is shown at a point over a prime field in which chi splits."""
    verifier = verifier_of(random_member_with_chi(fmpq_poly([-2, 0, 1]), 1))
    claims_of_2 = (claim for claim in STATED if claim.kind is not ClaimKind.EQUAL and claim.makes_sense(2))
    results = [verifier.verify_claim(claim) for claim in claims_of_2]
    assert len(results) > 10
    assert {finding.verdict for finding in results} == {PROVED}
    assert {finding.evidence.method for finding in results} == {"exact rational point", "point over GF(p)"}


@pytest.mark.parametrize(
    ("chi", "degrees"),
    [
        ([2, -3, 1], (1, 1)),  # the roots are rational
        ([-2, 0, 1], (1, 2)),
        ([-2, 0, 0, 1], (1, 6)),
        ([2, 0, -3, 0, 1], (1, 2)),  # (t^2 - 1)(t^2 - 2)
        ([6, 0, -5, 0, 1], (1, 4)),  # (t^2 - 2)(t^2 - 3)
    ],
)
def test_the_degree_of_the_splitting_field_counts_where_roots_are_needed(chi, degrees):
    member = random_member_with_chi(fmpq_poly(chi), 1)
    verifier = verifier_of(member)
    assert (verifier.conjugates(False), verifier.conjugates(True)) == degrees


@pytest.mark.parametrize(
    ("H", "reason"),
    [
        ("x1^3 + x1*x3^2 + x2^3", "H is the cube of a linear form on the eigenspaces of the roots of t - 2"),
        ("x1^3 + x2^3", "H is the cube of a linear form on the eigenspaces of the roots of t^2 - 3*t + 2"),
        ("x1^3 + x1*x3^2", "H vanishes on the eigenspaces of the roots of t - 2"),
        ("x1^3 + x1*x3^2 + x2^3 + x2*x4^2", "its A or H is special"),
    ],
)
def test_what_is_special_about_a_member_is_said(H, reason):
    assert verifier_of(of_two_planes(H)).what_is_special() == reason


def test_the_zero_hamiltonian_refutes_nothing():
    report = verify(SystemFile.from_member(of_two_planes("x1 - x1")), options=VerifyOptions(sections=(1, 3, 7, 8)))
    assert keys(report, REFUTED) <= misprints(2)
    messages = {key: finding.evidence.summary for key, finding in by_key(report).items()}
    assert "both sides agree at 4 random points" in messages["associated-fields-are-pairwise-different"]
    assert "not attained at 4 random points" in messages["hamiltonians-are-independent"]
    silent = [finding for finding in report.findings if "the misprint does not show" in finding.evidence.summary]
    special = [finding for finding in report.findings if finding.evidence.method == "special member"]
    assert silent
    assert not any(finding.applies for finding in [*silent, *special])


def test_the_signs_of_a_file_choose_the_system_that_is_examined(monkeypatch):
    examined = []
    original = Verifier.__init__

    def spy(self, result, *arguments):
        examined.append(result)
        original(self, result, *arguments)

    monkeypatch.setattr(Verifier, "__init__", spy)
    plain = member("m=2, split")
    signed = FamilyMember(plain.A, plain.H, (1, -1))
    assert verify(SystemFile.from_member(signed), options=VerifyOptions(sections=(4,))).verdict is PROVED
    assert (examined[0].H, examined[0].A) == (signed.chosen.K, plain.A)
    assert examined[0].H != plain.H


@pytest.mark.parametrize("m", quick([1, 2, 3], [1]))
def test_every_claim_is_proved_for_the_member_in_general(m):
    report = verify(m=m)
    assert keys(report, REFUTED) == misprints(m)
    assert keys(report, UNDECIDED) == set()
    assert keys(report, SUPPORTED) <= WITHOUT_NORMAL_FORM - FORMAL


def test_controls_refute_the_claims_for_the_member_in_general():
    report = verify(m=2, options=VerifyOptions(controls=True))
    assert report.verdict is PROVED
    assert all(finding.verdict is REFUTED for finding in report.findings[:-1])


@pytest.mark.parametrize("m", [6, 7, 9])
def test_of_many_sign_vectors_all_single_flips_are_tried_and_up_to_four_others(m):
    samples = [specialize.sign_sample(m, random.Random(seed)) for seed in range(20)]
    if m == 6:
        assert samples == [None] * 20
        return
    flips = tuple(tuple(-1 if j == i else 1 for j in range(m)) for i in range(m))
    assert {sample[:m] for sample in samples} == {flips}
    assert max(len(sample) for sample in samples) == m + 4
    for others in (sample[m:] for sample in samples):
        assert len({*others, *flips}) == m + len(others)
        assert all(len(signs) == m and signs[0] == 1 and set(signs) == {1, -1} for signs in others)


PAGE = Path(__file__).parents[2] / "docs" / "beyond.md"
FUNCTIONS = {formula: function for function, formula, *_ in STATEMENTS}


@pytest.mark.timeout(300)
@pytest.mark.slow
def test_every_cell_is_proved_or_refuted_by_a_counterexample_and_the_page_shows_the_table():
    report = beyond_table(3)
    answers = {
        (formula, name): sign
        for _, formula, *_, signs in STATEMENTS
        for name, sign in zip(VARIATIONS, signs, strict=True)
    }
    results = {(finding.place["statement"], finding.place["variation"]): finding.verdict for finding in report.findings}
    words = {"+": PROVED, "-": REFUTED}
    assert results == {cell: words[sign] for cell, sign in answers.items() if sign != " "}
    assert table(report) in PAGE.read_text(encoding="utf-8")
    for entry in report.findings:
        assert (entry.verdict is REFUTED) is entry.control is (entry.witness is not None)
        assert entry.witness is None or entry.witness.left != entry.witness.right


def test_formulas_of_the_table_are_code_so_that_markdown_prints_their_stars():
    text = table(beyond_table(1))
    assert "u1^2*v1" in text
    outside_code = re.sub(r"`[^`]*`", "", text)
    assert not re.search(r"(?<!^)\*|_", outside_code, re.MULTILINE)  # only the stars of the list are left


def test_without_a_term_of_lower_degree_the_counterexample_is_none():
    text, witness = smallest_counterexample(FUNCTIONS["eps^{-1} x^T J^{-1} x~ is conserved by f"], "inhomogeneous")
    assert text == "m = 1, H = u1^3 + v1"
    assert witness.point == ("0", "0")


@pytest.mark.slow
def test_what_holds_has_no_counterexample():
    assert smallest_counterexample(FUNCTIONS["modified H is conserved by f"], "inhomogeneous") is None
