"""One claim from start to end: what decides where proof, random points and an orbit all have their say.

Proof comes first, and is tried all the same: a proved claim that fails at a random point or on an orbit is an error of
the library, and is raised as one.
"""

from dataclasses import replace

import pytest
from flint import fmpq

from kahanmaps import QuadraticSystem, load, parse_rational_function
from kahanmaps.algebra.functions import FunctionField
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks import certify as certify_module
from kahanmaps.checks import theorems
from kahanmaps.checks.certify import Contradiction, NotEqual, certify, expansion
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.conserve import check_integrals, conservation
from kahanmaps.checks.decide import Decision, Identity
from kahanmaps.checks.settings import OrbitRun, Settings
from kahanmaps.errors import SingularStep
from kahanmaps.invariants.integrals_and_densities import ClaimedIntegral
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
HELD = Decision(SUPPORTED, Evidence("random points over GF(p)", "held"))


@pytest.fixture
def blind(monkeypatch):
    """Random points that let everything pass."""
    monkeypatch.setattr(certify_module, "decide", lambda *arguments: HELD)
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


# Proof by expansion: it proves what is true, refuses what is false, and gives up where its budget ends.

TOP = QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"])
CONSERVED = "(1 - eps^2*y^2)/(1 + 2*eps^2*z^2)"
AT_ONE_TENTH = "(1 - y^2/100)/(1 + 2*z^2/100)"


def conserved(claim: str, eps: fmpq | None):
    return conservation(TOP, ClaimedIntegral("I", parse_rational_function(claim, ["x", "y", "z", "eps"])), eps)


def test_a_conserved_quantity_is_proved_for_every_eps_and_a_small_budget_ends_without_an_answer():
    assert expansion(conserved(CONSERVED, None)).data["eps"] == "every"
    assert expansion(conserved(CONSERVED, None), budget=100) is None
    assert expansion(conserved(AT_ONE_TENTH, fmpq(1, 10))).data["eps"] == "1/10"


@pytest.mark.parametrize(
    ("claim", "eps"),
    [
        (AT_ONE_TENTH, None),
        (AT_ONE_TENTH, fmpq(1, 9)),
        (f"{CONSERVED} + eps^9*x", None),
        ("(1 - eps^2*y^2)/(1 + 2*eps^2*z^2 + 1/10^40*x^2)", None),
        ("(1 - 2*eps^2*y^2)/(1 + 2*eps^2*z^2)", None),
    ],
)
def test_a_quantity_that_is_not_conserved_at_an_eps_is_never_proved_there(claim, eps):
    with pytest.raises(NotEqual):
        expansion(conserved(claim, eps))


@pytest.mark.parametrize("wrong", [(0,), (2,)])
def test_all_components_have_to_agree(wrong):
    right = Identity(3, lambda field, x, eps: (list(x), list(x)), None, seed_data=())

    def sides(field, x, eps):
        return list(x), [x[k] + field.one if k in wrong else x[k] for k in range(3)]

    assert expansion(right) is not None
    with pytest.raises(NotEqual):
        expansion(replace(right, sides=sides))


def test_eps_is_scaled_out_only_where_the_map_and_the_claim_scale():
    assert conserved(CONSERVED, None).scales_with_eps
    true_for_eps_1_only = conserved("(1 - y^2)/(1 + 2*z^2)", None)
    assert not true_for_eps_1_only.scales_with_eps
    with pytest.raises(NotEqual):
        expansion(true_for_eps_1_only)
    assert expansion(replace(true_for_eps_1_only, eps=fmpq(1))) is not None
    pendulum = QuadraticSystem.from_text(["x", "y"], ["y", "-x + x^2"])
    energy = ClaimedIntegral("H", parse_rational_function("x^2 + y^2", ["x", "y", "eps"]))
    assert not conservation(pendulum, energy, None).scales_with_eps


@pytest.mark.slow
def test_the_integrals_of_the_member_in_dimension_6_are_proved_and_changed_ones_refuted():
    file = load("paper_m3")
    assert check_integrals(file).verdict is Certainty.PROVED
    changed = {name: f"{function.numerator + 1}" for name, function in file.integrals.items()}
    assert {finding.verdict for finding in check_integrals(file, extra=changed).findings} == {Certainty.REFUTED}


@pytest.mark.parametrize("k", [0, 2])
def test_every_eps_is_not_an_eps_that_equals_a_coordinate(k):
    """eps = x_k holds where eps is that coordinate, and eps x_k = x_k eps everywhere."""
    with pytest.raises(NotEqual):
        expansion(Identity(3, lambda field, x, eps: ([eps], [x[k]]), None, seed_data=()))
    with pytest.raises(NotEqual):
        expansion(Identity(3, lambda field, x, eps: ([eps * eps], [x[k] * eps]), None, seed_data=()))
    evidence = expansion(Identity(3, lambda field, x, eps: ([eps * x[k]], [x[k] * eps]), None, seed_data=()))
    assert evidence.data["eps"] == "every"


def test_an_expansion_refutes_what_random_points_let_pass(monkeypatch):
    monkeypatch.setattr(certify_module, "decide", lambda *arguments: HELD)
    claim = ClaimedIntegral("I", parse_rational_function("x^2 + y^2 + z^2", ["x", "y", "z", "eps"]))
    finding = certify("I is conserved", conservation(TOP, claim, None), Settings())
    assert finding.verdict is Certainty.REFUTED
    assert finding.evidence.method == "exact rational point"
    assert finding.witness.left != finding.witness.right


@pytest.mark.parametrize(("upper", "lower"), [(3, 1), (1, 3), (2, 2)])
def test_powers_of_a_denominator_cancel_in_a_quotient_of_values(upper, lower):
    """Numerator^a over numerator^b at N/D is N^(a - b)/D^(a - b), whichever power is larger."""
    field = FunctionField(["x", "y"])
    x, y = field.variables
    point = (x / (x + y), y)
    u = field.context.gen(0)
    quotient = RationalFunction(u**upper + 1, u**lower + 2).value(field, point)
    inverse = (x + y) / x
    expected = (1 / inverse) ** upper + 1, (1 / inverse) ** lower + 2
    assert field.equal(quotient * expected[1], expected[0])
    assert not field.equal(quotient * expected[1], expected[0] + 1)
