"""Are integrals conserved: I(x~) = I(x), proved for those that a theorem gives, decided for those that are claimed.

Every witness is computed a second time with Python's Fractions.
"""

import pytest
from check_helpers import (
    QUICK,
    claim,
    exact,
    file_of,
    function_value,
    hamiltonian_of,
    hamiltonians,
    kahan_step,
    only,
    system_of,
    verdicts,
    verify_witness,
)
from flint import fmpq_mat, fmpq_poly
from helpers import LOTKA_VOLTERRA, refuses
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.checks import theorems
from kahanmaps.checks.certify import Contradiction
from kahanmaps.checks.claims import Certainty, Finding
from kahanmaps.checks.conserve import check_integrals, known_integrals
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.invariants.integrals_and_densities import CommutantIntegral, ModifiedHamiltonian
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

PROVED, REFUTED, SUPPORTED, UNDECIDED = Certainty.PROVED, Certainty.REFUTED, Certainty.SUPPORTED, Certainty.UNDECIDED
pytestmark = pytest.mark.usefixtures("at_points_only")

WEIERSTRASS = hamiltonian_of("q p", "p^2/2 - q^3/3 + q")


def check_claim(system: QuadraticSystem, text: str, how: Settings = QUICK) -> Finding:
    """The finding on one claimed integral, its witness verified if it is refuted."""
    result = only(check_integrals(file_of(system, I=text), how))
    if result.verdict is REFUTED:
        x, (eps,) = exact(*result.witness.point), exact(result.witness.eps)
        function, image = claim(text, " ".join(system.variables)), kahan_step(system, eps, x)
        assert image is not None
        verify_witness(result.witness, [function_value(function, image, eps)], [function_value(function, x, eps)])
    return result


def proved(hamiltonian: CubicHamiltonian, how: Settings = QUICK) -> list[Certainty]:
    return verdicts(check_integrals(SystemFile.from_hamiltonian(hamiltonian), how))


@given(hamiltonians(dims=(1, 2, 3)), st.sampled_from([None, "-2/3"]))
def test_modified_h_is_proved_for_every_constant_skew_j_and_no_point_contradicts_it(hamiltonian, eps):
    results = set(proved(hamiltonian, Settings(eps=eps, steps=2)))
    # At one eps, as for H = q p at eps = 1, there may be no map at all, and modified H may be a constant, as for H = 0.
    assert results == {PROVED} or ((eps is not None or hamiltonian.H.is_constant()) and results == {UNDECIDED})


# H + (2 eps/3) grad H^T (I - eps f')^{-1} f for q' = p, p' = q^2 - 1, by hand: f' = [[0, 1], [2q, 0]] and
# det = 1 - 2 eps^2 q; grad H = (1 - q^2, p) and f = (p, q^2 - 1) give grad H^T adj(I - eps f') f =
# (1 - q^2)(p + eps (q^2 - 1)) + p (2 eps q p + q^2 - 1) = 2 eps q p^2 - eps (q^2 - 1)^2.
WRITTEN_OUT = "p^2/2 - q^3/3 + q + 2/3*eps^2*(2*q*p^2 - (q^2 - 1)^2)/(1 - 2*eps^2*q)"


@pytest.mark.parametrize(
    ("text", "verdict"),
    [
        (WRITTEN_OUT, SUPPORTED),
        (f"{WRITTEN_OUT} + q/10^300", REFUTED),
        (f"{WRITTEN_OUT} + eps^2/(1 - 2*eps^2*q)/10^50", REFUTED),
        (WRITTEN_OUT.replace("+ 2/3*eps^2", "+ 1/3*eps^2"), REFUTED),  # eps for 2 eps
        (WRITTEN_OUT.replace("1 - 2*eps^2*q", "1"), REFUTED),  # the leading term alone
    ],
)
def test_modified_h_written_out_is_supported_and_with_a_slip_or_another_far_digit_refuted(text, verdict):
    finding = check_claim(WEIERSTRASS.system, text)
    assert finding.verdict is verdict
    assert verdict is REFUTED or int(finding.evidence.data["error_bound"].split("^")[1]) <= -100


# q'' = -q + q^2: Phi^4 = id at eps = 1, where q~ = p/(1 - q) and q~~ = -q; so q^2 + q~^2 is conserved there.
PERIODIC = system_of("q p", "p", "-q + q^2")
OF_PERIOD_FOUR = "q^2 + (p/(1 - q))^2"


@pytest.mark.parametrize("eps", [1, None, "1/2", "1001/1000"])
def test_an_integral_that_exists_at_one_eps_is_supported_there_and_refuted_elsewhere(eps):
    verdict = SUPPORTED if eps == 1 else REFUTED
    assert check_claim(PERIODIC, OF_PERIOD_FOUR, Settings(eps=eps, steps=2)).verdict is verdict


FAMILY = {
    "m=1": (random_member_with_eigenvalues([2], seed=3), 1),
    "m=2": (random_member_with_eigenvalues([1, -2], seed=3), 2),
    "m=2, irreducible": (random_member_with_chi(fmpq_poly([-2, 0, 1]), seed=3), 1),
    "m=3": (random_member_with_eigenvalues([1, -2, 3], seed=3), 4),
    "m=3, eigenvalue twice": (random_member_with_eigenvalues([1, 1, 2], seed=3), 2),
}
over_family = pytest.mark.parametrize(("member", "classes"), FAMILY.values(), ids=FAMILY)


@over_family
def test_a_class_has_modified_h_and_h_and_k_of_every_system_and_those_of_the_commutant(member, classes):
    results = [integral.name for integral, _, _ in known_integrals(SystemFile.from_member(member))]
    labels = [associate.label for associate in member.associated()][1:]
    assert len(labels) == classes - 1
    chain = [f"H~_{k}" for k in range(1, member.m)]
    assert results == ["modified H", "H~", *(f"K~_{label}" for label in labels), *chain]


@over_family
def test_every_integral_of_the_class_is_proved_and_without_the_theorem_supported(member, classes, monkeypatch):
    assert set(verdicts(check_integrals(SystemFile.from_member(member), QUICK))) == {PROVED}
    monkeypatch.setattr(theorems, "evidence", lambda theorem, hypotheses: None)
    assert set(verdicts(check_integrals(SystemFile.from_member(member), QUICK))) == {SUPPORTED}


def test_a_matrix_that_does_not_commute_with_the_jacobian_gives_no_integral(monkeypatch):
    member = FAMILY["m=2"][0]
    swap = fmpq_mat([[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]])
    integral = CommutantIntegral(member.chosen.hamiltonian, swap, 1)
    proof = theorems.commutant_integral(member.chosen.hamiltonian, integral, "S")
    assert proof is None
    monkeypatch.setattr("kahanmaps.checks.conserve.known_integrals", lambda file: [(integral, proof, "")])
    assert only(check_integrals(SystemFile.from_member(member), QUICK)).verdict is REFUTED


def test_claims_of_the_caller_come_first_and_alone_unless_the_known_ones_are_requested():
    file = SystemFile.from_hamiltonian(hamiltonian_of("q p", "q^3 - q*p^2"))
    names = [integral.name for integral, _, _ in known_integrals(file)]
    for options, expected in (({}, ["K"]), ({"known": True}, ["K", *names])):
        report = check_integrals(file, QUICK, {"K": "q"}, **options)
        assert [finding.claim for finding in report.findings] == [f"{name} is conserved" for name in expected]
        assert (report.findings[0].verdict, report.findings[0].holds) == (REFUTED, False)
    file = file_of(LOTKA_VOLTERRA, I="x", J="y")
    for extra, expected in (("J", "J"), (["x*y", "I"], ["I1", "I"]), ({"K": "x*y"}, "K")):
        assert [finding.claim.split()[0] for finding in check_integrals(file, QUICK, extra).findings] == [*expected]
    report = check_integrals(file, QUICK, {"K": "x*y"}, known=True)
    assert [finding.claim.split()[0] for finding in report.findings] == ["K", "I", "J"]
    refuses("found no integral, expected at least one", check_integrals, file, QUICK, [])


@pytest.mark.parametrize(
    ("text", "eps", "condition", "verdict"),
    [
        ("y/((10*eps - 1)*x)", None, ", where 10*eps - 1 is not 0", SUPPORTED),
        ("y/((10*eps - 1)*x)", "1/9", "", SUPPORTED),
        ("y/((10*eps - 1)*x)", "1/10", "", UNDECIDED),  # no values
        ("eps*y/((10*eps - 1)*x + eps*y)", "1/10", "", UNDECIDED),  # constants
        ("eps*y/((10*eps - 1)*x + eps*y)", None, "", SUPPORTED),
        ("(10*eps - 1)*y/x", "1/10", "", UNDECIDED),
        ("(10*eps - 1)*y/x", "1/11", "", SUPPORTED),
        ("(x - y)/(2*y - 2*x)", None, "", UNDECIDED),
        ("x/((10*eps - 1)*x)", None, ", where 10*eps - 1 is not 0", UNDECIDED),
        ("x/((10*eps - 1)*x)", "1/9", "", UNDECIDED),
    ],
)
def test_a_constant_is_no_integral_and_the_claim_says_where_one_has_values(text, eps, condition, verdict):
    file = file_of(QuadraticSystem.from_text(["x", "y"], ["x^2", "x*y"]), I=text)
    result = only(check_integrals(file, Settings(eps=eps, steps=1)))
    assert (result.verdict, result.claim, result.applies) == (verdict, f"I is conserved{condition}", True)


@pytest.mark.parametrize(
    ("H", "eps", "verdict"),
    [
        ("3*q^2 + p^2", "1/2", UNDECIDED),
        ("3*q^2 + p^2", "1/3", PROVED),
        ("3*q^2 + p^2 + q^3", "1/2", PROVED),
        ("5", None, UNDECIDED),
        ("0", None, UNDECIDED),
    ],
)
def test_a_modified_hamiltonian_that_is_a_constant_is_no_integral(H, eps, verdict):
    # f is linear with f'^2 = -w^2, and H + grad H . (x~ - x)/3 = (3 - w^2 eps^2)/(1 + w^2 eps^2) H/3.
    file = parse_system(f'variables = ["q", "p"]\n[hamiltonian]\nH = "{H}"\nJ = "standard"\n')
    result = check_integrals(file, Settings(eps=eps, steps=1)).findings[0]
    assert (result.verdict, result.applies) == (verdict, verdict is PROVED)
    if eps is not None:
        claimed = check_integrals(file, Settings(eps=eps, steps=1), claim("1/2*q^2", "q p"))
        assert claimed.verdict is REFUTED  # what nobody claimed does not count


@pytest.mark.parametrize(("H", "verdict"), [("x1^3 + x1*x3^2", UNDECIDED), ("x2^3 + x2*x4^2", PROVED)])
def test_an_integral_of_the_commutant_lemma_may_be_0(H, verdict):
    # A = diag(0, 1, 0, 1) takes grad H to 0 where H is a function of the first plane.
    A = fmpq_mat(4, 4, [int(i == j and i % 2 == 1) for i in range(4) for j in range(4)])
    member = FamilyMember(A, parse_polynomial(H, ["x1", "x2", "x3", "x4"]))
    report = check_integrals(SystemFile.from_member(member), QUICK)
    result = next(finding for finding in report.findings if finding.claim == "H~_1 is conserved")
    assert (result.verdict, result.applies) == (verdict, verdict is PROVED)
    assert report.verdict is PROVED


def test_one_half_for_one_third_in_modified_h_contradicts_the_theorem(monkeypatch):
    right = ModifiedHamiltonian.value

    def wrong(self, field, eps, point):  # H + grad H . (x~ - x)/2 = (3 (modified H) - H)/2
        H = evaluate(self.hamiltonian.H, field, point)
        return (right(self, field, eps, point) * field.convert(3) - H) / field.convert(2)

    monkeypatch.setattr(ModifiedHamiltonian, "value", wrong)
    file = SystemFile.from_hamiltonian(WEIERSTRASS)
    refuses("modified H is conserved", check_integrals, file, QUICK, error=Contradiction)
