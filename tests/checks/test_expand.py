"""Proof by expansion: it proves what is true, refuses what is false, and gives up where its budget ends."""

from dataclasses import replace

import pytest
from flint import fmpq

from kahanmaps import QuadraticSystem, load, parse_rational_function
from kahanmaps.algebra.functions import FunctionField
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks import certify
from kahanmaps.checks.certify import NotEqual, expansion
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.conserve import check_integrals, conservation
from kahanmaps.checks.decide import Decision, Identity
from kahanmaps.checks.settings import Settings
from kahanmaps.invariants.integrals_and_densities import ClaimedIntegral

TOP = QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"])
CONSERVED = "(1 - eps^2*y^2)/(1 + 2*eps^2*z^2)"
AT_ONE_TENTH = "(1 - y^2/100)/(1 + 2*z^2/100)"


def identity(claim: str, eps: fmpq | None):
    return conservation(TOP, ClaimedIntegral("I", parse_rational_function(claim, ["x", "y", "z", "eps"])), eps)


def test_a_conserved_quantity_is_proved_for_every_eps():
    evidence = expansion(identity(CONSERVED, None))
    assert evidence is not None
    assert evidence.data["eps"] == "every"


def test_a_quantity_conserved_at_one_eps_is_proved_there_and_nowhere_else():
    assert expansion(identity(AT_ONE_TENTH, fmpq(1, 10))) is not None
    with pytest.raises(NotEqual):
        expansion(identity(AT_ONE_TENTH, None))
    with pytest.raises(NotEqual):
        expansion(identity(AT_ONE_TENTH, fmpq(1, 9)))


@pytest.mark.parametrize(
    "claim", ["(1 - eps^2*y^2)/(1 + 2*eps^2*z^2) + eps^9*x", "(1 - eps^2*y^2)/(1 + 2*eps^2*z^2 + 1/10^40*x^2)"]
)
def test_a_quantity_that_is_not_conserved_is_never_proved(claim):
    with pytest.raises(NotEqual):
        expansion(identity(claim, None))


@pytest.mark.parametrize("wrong", [(0,), (2,)])
def test_all_components_have_to_agree(wrong):
    right = Identity(3, lambda field, x, eps: (list(x), list(x)), None, seed_data=())

    def sides(field, x, eps):
        return list(x), [x[k] + field.one if k in wrong else x[k] for k in range(3)]

    assert expansion(right) is not None
    with pytest.raises(NotEqual):
        expansion(replace(right, sides=sides))


def test_eps_is_scaled_out_only_where_the_map_and_the_claim_scale():
    assert identity(CONSERVED, None).scales_with_eps
    true_for_eps_1_only = identity("(1 - y^2)/(1 + 2*z^2)", None)
    assert not true_for_eps_1_only.scales_with_eps
    with pytest.raises(NotEqual):
        expansion(true_for_eps_1_only)
    assert expansion(replace(true_for_eps_1_only, eps=fmpq(1))) is not None
    with pytest.raises(NotEqual):
        expansion(identity("(1 - 2*eps^2*y^2)/(1 + 2*eps^2*z^2)", None))
    pendulum = QuadraticSystem.from_text(["x", "y"], ["y", "-x + x^2"])
    energy = ClaimedIntegral("H", parse_rational_function("x^2 + y^2", ["x", "y", "eps"]))
    assert not conservation(pendulum, energy, None).scales_with_eps


@pytest.mark.slow
def test_the_integrals_of_the_member_in_dimension_6_are_proved_and_changed_ones_refuted():
    file = load("paper_m3")
    assert check_integrals(file).verdict is Certainty.PROVED
    changed = {name: f"{function.numerator + 1}" for name, function in file.integrals.items()}
    assert {finding.verdict for finding in check_integrals(file, extra=changed).findings} == {Certainty.REFUTED}


def test_a_small_budget_ends_without_an_answer():
    assert expansion(identity(CONSERVED, None), budget=100) is None


@pytest.mark.parametrize("k", [0, 2])
def test_every_eps_is_not_an_eps_that_equals_a_coordinate(k):
    """eps = x_k holds where eps is that coordinate, and eps x_k = x_k eps everywhere."""
    with pytest.raises(NotEqual):
        expansion(Identity(3, lambda field, x, eps: ([eps], [x[k]]), None, seed_data=()))
    with pytest.raises(NotEqual):
        expansion(Identity(3, lambda field, x, eps: ([eps * eps], [x[k] * eps]), None, seed_data=()))
    evidence = expansion(Identity(3, lambda field, x, eps: ([eps * x[k]], [x[k] * eps]), None, seed_data=()))
    assert evidence is not None
    assert evidence.data["eps"] == "every"


def test_an_expansion_refutes_what_random_points_let_pass(monkeypatch):
    held = Decision(Certainty.SUPPORTED, Evidence("random points over GF(p)", "held"))
    monkeypatch.setattr(certify, "decide", lambda *arguments: held)
    claim = ClaimedIntegral("I", parse_rational_function("x^2 + y^2 + z^2", ["x", "y", "z", "eps"]))
    finding = certify.certify("I is conserved", conservation(TOP, claim, None), Settings())
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
