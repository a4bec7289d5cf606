"""Proofs in normal form, and how a claim is examined: what is evidence, what is not, and what contradicts itself.

A proof is given for a true claim only. A false one raises Contradiction, one that grows beyond the budget is not
proved, and one that compares nothing proves nothing. Every identity that is proved in normal form is falsified here by
a changed right-hand side, which must be refuted both at random points and in normal form.
"""

from dataclasses import replace
from math import prod

import pytest
from helpers import quick, refuses, together
from paper.members import member, named, point, verifier_of

from kahanmaps.checks.certify import Contradiction
from kahanmaps.checks.claims import Certainty
from kahanmaps.paper import verify
from kahanmaps.paper.registry import Claim, ClaimKind, claims, evaluate
from kahanmaps.paper.verify import normal_form_proof

IDENTITIES = [c for c in claims() if c.kind is ClaimKind.EQUAL and not c.misprint and c.symplectic]


@pytest.fixture(autouse=True)
def no_proofs_from_before():
    """Proofs are remembered by the name of the claim, and here names lie."""
    normal_form_proof.cache_clear()
    yield
    normal_form_proof.cache_clear()


def fabricated(function, **more):
    """A claim that is in no list."""

    def told(o):
        """What nobody says"""
        return function(o)

    return Claim("fabricated", 4, "nowhere", "", "0 = 1", told, (), **more)


@pytest.fixture
def only(monkeypatch):
    """Make the list of claims hold one claim only."""

    def register(claim):
        monkeypatch.setattr(verify, "claims", lambda: (claim,))
        return claim

    return register


@pytest.fixture
def examine(only):
    """The finding on a claim for one member."""

    def run(claim, name="m=2, split"):
        normal_form_proof.cache_clear()
        return verifier_of(member(name)).verify_claim(only(claim))

    return run


def true_claim(o):
    yield o.det(o.minus_eps_jac(o.f, o.x)), o.det(o.plus_eps_jac(o.f, o.x))


def false_claim(o):
    yield o.det(o.minus_eps_jac(o.f, o.x)), o.K.one


def nothing(o):
    return iter(())


def test_a_false_claim_is_a_contradiction(only):
    only(fabricated(false_claim))
    refuses("different rational functions in normal form", normal_form_proof, "fabricated", 1, 3, error=Contradiction)


def test_a_claim_that_compares_nothing_has_no_proof(only):
    only(fabricated(nothing))
    assert normal_form_proof("fabricated", 2, 3) is None


@pytest.mark.parametrize(("function", "budget"), [(true_claim, 100), (true_claim, 20), (false_claim, 100)])
def test_beyond_the_budget_there_is_no_proof(function, budget, only, monkeypatch):
    only(fabricated(function))
    monkeypatch.setattr(verify, "PROOF_BUDGET", budget)  # 20: the normal form alone exceeds it
    assert normal_form_proof("fabricated", 2, 3) is None


def test_a_proof_needs_as_many_indeterminates_as_the_normal_form_has(only):
    only(fabricated(lambda o: [(o.dot(o.vector("v"), o.fx), o.dot(o.fx, o.vector("v")))]))
    evidence = normal_form_proof("fabricated", 2, 3)
    assert (evidence.method, evidence.data["blocks"]) == ("symbolic, normal form", 2)
    assert evidence.data["indeterminates"] == 2 * 4 + 1 + 4  # a root and 3 coefficients a block, eps, and v


def changed(claim):
    """The claim with something added to the first of its right-hand sides."""

    def function(o):
        (left, right), *others = claim.function(o)
        shape = (right.nrows(), right.ncols()) if hasattr(right, "nrows") else None
        yield left, right + (o.K.matrix(*shape, [o.K.one] * prod(shape)) if shape else o.eps)
        yield from others

    function.__doc__ = claim.function.__doc__
    return replace(claim, function=function)


@pytest.mark.parametrize("k", quick(range(4), [0]))
def test_a_claim_with_a_changed_side_has_no_proof(k, only):
    for claim in IDENTITIES[k::4]:
        only(changed(claim))
        m = claim.only_m or claim.least_m
        with pytest.raises(Contradiction):
            normal_form_proof(claim.key, claim.blocks_for_proof(m), 2)


@together("claim", IDENTITIES)
def test_a_claim_with_a_changed_side_fails_at_a_point(claim):
    name = "m=3, split" if claim.only_m == 3 else "m=1" if claim.only_m == 1 else "m=2, split"
    assert not evaluate(changed(claim), point(name)).holds


SIGNS = {
    "(27) f'^T J = J f'": lambda o: [(o.df.transpose() * o.J, o.J * o.df)],
    "(31) g' g = -f' f": lambda o: [(o.jac(o.g_i(0), o.x) * o.value(o.g_i(0), o.x), -(o.df * o.fx))],
    "(46) with B_i for B_i^T": lambda o: [
        (o.df * o.df, o.sum([o.I * o.p0(o.x), *(o.B(i) * o.q(i, o.x) for i in o.each)]))
    ],
    "(94) nabla K~ = nabla H~": lambda o: [
        (
            o.slope(lambda o, x: o.integral(o.g_i(0), x), o.x, o.vector("v")),
            o.slope(lambda o, x: o.integral(o.f, x), o.x, o.vector("v")),
        )
    ],
}


@pytest.mark.parametrize("function", SIGNS.values(), ids=SIGNS.keys())
def test_a_display_with_a_sign_or_a_letter_changed_is_refuted_with_a_witness(function, examine):
    # With A = B the transposed matrix of (46) is seen for a member that is not in normal form only.
    finding = examine(fabricated(function))
    assert finding.verdict is Certainty.REFUTED
    assert finding.evidence.method == "exact rational point"
    assert finding.witness.left != finding.witness.right


def test_a_true_claim_is_proved_with_points_beside(examine):
    finding = examine(fabricated(true_claim))
    assert finding.verdict is Certainty.PROVED
    assert [evidence.method for evidence in finding.also] == ["random points over GF(p)"]


def test_without_a_proof_a_true_claim_is_supported(monkeypatch, examine):
    monkeypatch.setattr(verify, "normal_form_proof", lambda *_: None)
    monkeypatch.setattr(verify, "PROOF_BUDGET", 100)
    finding = examine(named("invariant-measure"))
    assert finding.verdict is Certainty.SUPPORTED
    assert int(finding.evidence.data["error_bound"].removeprefix("2^-")) >= 100


def test_a_claim_that_holds_at_points_but_not_in_normal_form_is_a_contradiction(monkeypatch, examine):
    original = verify.specialize.normal_form_objects

    def broken(*arguments):
        o = original(*arguments)
        o.J = o.J + o.I
        return o

    monkeypatch.setattr(verify.specialize, "normal_form_objects", broken)
    finding = examine(fabricated(lambda o: [(o.dot(o.x, o.J * o.x), o.K.zero)]))
    assert (finding.verdict, finding.evidence.method) == (Certainty.REFUTED, "contradiction")
    assert finding.witness is not None


def test_a_claim_that_compares_nothing_is_undecided(examine):
    finding = examine(fabricated(nothing))
    assert finding.verdict is Certainty.UNDECIDED
    assert "nothing to compare" in finding.evidence.summary


def test_where_the_roots_are_not_rational_the_witness_is_over_a_prime_field(examine):
    finding = examine(fabricated(lambda o: [(o.B(0), o.I)]), "m=2, irreducible")
    assert finding.verdict is Certainty.REFUTED
    assert finding.evidence.method == "point over GF(p)"
    assert finding.witness.field.startswith("GF(")


def test_different_sides_are_proved_different_by_a_point(examine):
    finding = examine(fabricated(false_claim, kind=ClaimKind.DIFFERENT))
    assert finding.verdict is Certainty.PROVED
    where = finding.evidence.summary.removeprefix("both sides differ at ")
    method = {"an exact rational point": "exact rational point"}.get(where, "point over GF(p)")
    assert (finding.evidence.method, where.startswith("a point over GF(")) == (method, method == "point over GF(p)")


@pytest.mark.parametrize("pairs", [true_claim, lambda o: [*false_claim(o), *true_claim(o)]])
def test_one_pair_that_agrees_refutes_that_all_differ(pairs, examine):
    assert examine(fabricated(pairs, kind=ClaimKind.DIFFERENT)).verdict is Certainty.REFUTED


def test_a_rank_that_is_attained_is_proved_at_a_rational_point_and_another_refuted(examine):
    finding = examine(fabricated(lambda o: [(o.rank(o.df), o.n)], kind=ClaimKind.ATTAINED))
    assert (finding.verdict, finding.evidence.method) == (Certainty.PROVED, "exact rational point")
    finding = examine(fabricated(lambda o: [(o.rank(o.df), o.n + 1)], kind=ClaimKind.ATTAINED))
    assert finding.verdict is Certainty.REFUTED
    assert (finding.witness.left, finding.witness.right) == (("4",), ("5",))


def test_a_false_claim_is_refuted_for_the_member_in_general():
    assert verifier_of(None, 2).verify_claim(fabricated(false_claim)).verdict is Certainty.REFUTED
