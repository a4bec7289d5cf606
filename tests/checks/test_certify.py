"""One claim from start to end: what decides where proof, random points and an orbit all have their say.

Proof comes first, and is tried all the same: a proved claim that fails at a random point or on an orbit is an error of
the library, and is raised as one. Without proof random points decide, and an orbit can refute what they let pass.
"""

import pytest
from flint import fmpq

from kahanmaps.checks import certify as certify_module
from kahanmaps.checks import theorems
from kahanmaps.checks.certify import Contradiction, certify
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Decision, Identity
from kahanmaps.checks.settings import OrbitRun, Settings
from kahanmaps.errors import SingularStep
from kahanmaps.maps.orbits.iteration import OrbitEnd

PROVED, REFUTED, SUPPORTED, UNDECIDED = Certainty.PROVED, Certainty.REFUTED, Certainty.SUPPORTED, Certainty.UNDECIDED
PROOF = theorems.evidence("Theorem 1", [("a hypothesis", True)])


def identity_of(right) -> Identity:
    """x = right(x, field)."""
    return Identity(1, lambda field, point, eps: ([point[0]], [right(point[0], field)]), None, seed_data=())


TRUE = identity_of(lambda x, field: x)
FALSE = identity_of(lambda x, field: x + field.one)
# True at 1 and 2, on an orbit that random points do not meet.
FALSE_BUT_ON_AN_ORBIT = identity_of(lambda x, field: x + (x - field.one) * (x - field.convert(2)))
POLE_FIRST = Identity(
    1, lambda field, point, eps: None if point[0] == field.one else ([point[0]], [field.convert(2)]), None, seed_data=()
)


def orbit(*points: int) -> OrbitRun:
    run = tuple((fmpq(x),) for x in points)
    return OrbitRun(run[0], run, fmpq(1, 10), OrbitEnd("completed", len(points) - 1, f"{len(points) - 1} steps"))


def undefined(field, point, eps):
    raise SingularStep("no value")


NOWHERE = Identity(1, undefined, None, seed_data=())


@pytest.fixture
def blind(monkeypatch):
    """Random points that let everything pass."""
    held = Decision(SUPPORTED, Evidence("random points over GF(p)", "held"))
    monkeypatch.setattr(certify_module, "decide", lambda *arguments: held)
    monkeypatch.setattr(certify_module, "expansion", lambda *_: None)


def test_a_proof_decides_and_the_points_stand_beside_it():
    finding = certify("c", TRUE, Settings(), PROOF, orbit(1, 2))
    assert (finding.verdict, finding.evidence) == (PROVED, PROOF)
    assert [evidence.method for evidence in finding.also] == ["random points over GF(p)", "exact orbit"]


def test_a_proved_claim_that_fails_at_a_random_point_is_a_contradiction():
    with pytest.raises(Contradiction, match="c: Theorem 1 applies: a hypothesis, but it fails at a rational point"):
        certify("c", FALSE, Settings(), PROOF)


def test_a_proved_claim_that_fails_on_the_orbit_is_a_contradiction(blind):
    with pytest.raises(Contradiction, match="but it fails at step 0 of an exact orbit"):
        certify("c", FALSE, Settings(), PROOF, orbit(1, 2))


def test_a_claim_proved_by_expansion_that_fails_on_the_orbit_is_a_contradiction(blind, monkeypatch):
    expanded = Evidence("expansion", "both sides are the same")
    monkeypatch.setattr(certify_module, "expansion", lambda *_: expanded)
    assert certify("c", TRUE, Settings(), None, orbit(1, 2)).evidence == expanded
    with pytest.raises(Contradiction, match="both sides are the same, but it fails at step 0"):
        certify("c", FALSE, Settings(), None, orbit(1, 2))


def test_a_theorem_proves_nothing_of_what_is_defined_nowhere():
    finding = certify("c", NOWHERE, Settings(), PROOF)
    assert (finding.verdict, finding.also) == (UNDECIDED, ())
    assert "not defined at any" in finding.evidence.summary


def test_a_claim_that_fails_at_random_points_is_refuted_whatever_the_orbit_says():
    finding = certify("c", FALSE_BUT_ON_AN_ORBIT, Settings(), None, orbit(1, 2, 1))
    assert finding.verdict is REFUTED
    assert finding.evidence.method == "exact rational point"
    assert finding.also[0].summary == "held exactly at 3 points of an orbit, eps = 1/10"
    (x,) = finding.witness.point
    assert x not in ("1", "2")


def test_an_orbit_refutes_what_random_points_let_pass(blind):
    finding = certify("c", FALSE, Settings(), None, orbit(1, 2))
    assert finding.verdict is REFUTED
    assert finding.evidence.summary == "fails at step 0 of an exact orbit"
    assert (finding.witness.point, finding.witness.left, finding.witness.right) == (("1",), ("1",), ("2",))
    assert finding.witness.eps == "1/10"


@pytest.mark.parametrize(
    ("points", "summary"),
    [
        ((2, 2), "held exactly at 2 points of an orbit, eps = 1/10"),
        ((1, 2), "held exactly at 1 point of an orbit, eps = 1/10, undefined at 1"),
        ((1,), "could not be tried at any point of an orbit, eps = 1/10, undefined at 1"),
    ],
)
def test_an_orbit_says_at_how_many_points_a_claim_held(points, summary, blind):
    assert certify("c", POLE_FIRST, Settings(), None, orbit(*points)).also[-1].summary == summary


@pytest.mark.parametrize(
    ("identity", "control", "verdict"), [(FALSE, False, REFUTED), (NOWHERE, False, UNDECIDED), (TRUE, True, SUPPORTED)]
)
def test_what_fails_or_is_nowhere_defined_is_not_expanded_and_no_control_is(identity, control, verdict, monkeypatch):
    monkeypatch.setattr(certify_module, "expansion", lambda *_: pytest.fail("it was expanded"))
    assert certify("c", identity, Settings(), control=control).verdict is verdict
