"""The library's mathematics, broken in one place at a time: `verify` has to turn red, in the rows that are about it.

Red is a refuted claim that is no misprint, or a contradiction between two ways of deciding a claim. Only what is
broken may be: without a mutation the same member is green, and so is every row that does not use the broken piece.
"""

from __future__ import annotations

import pytest
from flint import fmpq, fmpq_poly
from helpers import quick
from paper.members import fresh

from kahanmaps.algebra.duals import Dual
from kahanmaps.algebra.matrices import solve
from kahanmaps.checks.claims import Verdict
from kahanmaps.documents.files import SystemFile
from kahanmaps.family import associated, cubics
from kahanmaps.invariants.integrals import ModifiedHamiltonian, PaperIntegral
from kahanmaps.maps.kahan import KahanMapOver
from kahanmaps.paper import calculus, objects, realise
from kahanmaps.paper.examiner import VerifyOptions
from kahanmaps.paper.proofs import normal_form_proof
from kahanmaps.paper.registry import claims
from kahanmaps.paper.survivors import survivors
from kahanmaps.paper.verify import verify, verify_universal
from kahanmaps.systems import hamiltonian
from kahanmaps.systems.quadratic import SystemOver

MISPRINTS = {claim.key for claim in claims() if claim.misprint}


@pytest.fixture(autouse=True)
def no_proofs_from_before():
    """Proofs are remembered: those made with a broken library must not be seen by other tests, nor the other way."""
    normal_form_proof.cache_clear()
    yield
    normal_form_proof.cache_clear()


def red(name="m=2, split", *sections):
    """The keys of the claims that `verify` refutes for a member drawn with the library as it is now."""
    report = verify(SystemFile.from_member(fresh(name)), options=VerifyOptions(sections=sections or None, order=2))
    return {f.place["key"] for f in report.findings if f.verdict is Verdict.REFUTED} - MISPRINTS


def red_universal(*sections):
    """The same for the member in general."""
    report = verify_universal(2, options=VerifyOptions(sections=sections, order=2))
    return {f.place["key"] for f in report.findings if f.verdict is Verdict.REFUTED} - MISPRINTS


@pytest.mark.parametrize("name", ["m=2, split", pytest.param("m=3, split", marks=pytest.mark.slow)])
def test_without_a_mutation_nothing_is_red(name):
    assert red(name) == set()


def test_without_a_mutation_nothing_is_red_for_the_member_in_general():
    assert red_universal() == set()


# The structure J


def opposite_structure(dim):
    return standard(dim) * (-1)


standard = hamiltonian.standard_structure


def test_the_structure_with_the_wrong_sign_is_seen_by_the_brackets(monkeypatch):
    for module in (hamiltonian, realise, associated):
        monkeypatch.setattr(module, "standard_structure", opposite_structure)
    assert red("m=2, split", 3) >= {"brackets", "equations-of-motion"}


def test_the_structure_with_the_wrong_sign_in_the_paper_s_letters_alone_is_seen_by_the_equations_of_motion(monkeypatch):
    original = realise.MemberObjects.at.__func__

    def at(cls, *arguments):
        o = original(cls, *arguments)
        o.J = -o.J
        return o

    monkeypatch.setattr(realise.MemberObjects, "at", classmethod(at))
    assert red("m=2, split", 4) >= {"fields-of-the-chain"}


# The Kahan map

ORIGINAL_STEP = KahanMapOver.step


def half_step(self, point):
    """x + eps (I - eps f')^{-1} f: eps where 2 eps belongs."""
    x = self.point(point)
    image = ORIGINAL_STEP(self, x)
    half = self.field.one / self.field.convert(2)
    with self.field.working():
        return tuple(a + (b - a) * half for a, b in zip(x, image, strict=True))


def backward_step(self, point):
    """The map with -eps."""
    return ORIGINAL_STEP(self.inverse, point)


def explicit_step(self, point):
    """x + 2 eps f(x)."""
    x = self.point(point)
    two = self.field.convert(2)
    with self.field.working():
        return tuple(a + two * self.eps * b for a, b in zip(x, self.local.value(x), strict=True))


@pytest.mark.parametrize("step", [half_step, backward_step, explicit_step])
def test_a_wrong_step_is_seen_by_the_defining_equation(step, monkeypatch):
    monkeypatch.setattr(KahanMapOver, "step", step)
    assert red("m=2, split", 2) & {"defining-equation"}


@pytest.mark.parametrize("step", quick([half_step, explicit_step], [half_step]))
def test_a_wrong_step_is_seen_by_theorem_9(step, monkeypatch):
    monkeypatch.setattr(KahanMapOver, "step", step)
    assert {"both-maps", "commutativity"} <= red("m=2, irreducible", 6)


@pytest.mark.parametrize("step", quick([half_step, backward_step, explicit_step], [half_step]))
def test_a_wrong_step_is_seen_by_the_member_in_general(step, monkeypatch):
    monkeypatch.setattr(KahanMapOver, "step", step)
    assert {"defining-equation", "explicit-form"} <= red_universal(2)


def test_a_wrong_inverse_map_is_seen_by_the_jacobi_matrix(monkeypatch):
    # dPhi = (I - eps f'(x))^{-1} (I - eps f'(x~)).
    monkeypatch.setattr(KahanMapOver, "inverse", property(lambda self: KahanMapOver(self.local, self.eps)))
    assert red("m=2, split", 2, 8)


def test_a_jacobi_matrix_of_the_map_at_the_wrong_point_is_seen(monkeypatch):
    # I + eps f'(x) where I + eps f'(x~) belongs.
    def jacobian(self, point):
        x = self.point(point)
        return solve(self.denominator_matrix(x), self.inverse.denominator_matrix(x))

    monkeypatch.setattr(KahanMapOver, "jacobian", jacobian)
    assert "invariant-measure" in red("m=2, split", 2)


# Systems

ORIGINAL_JACOBIAN = SystemOver.jacobian
ORIGINAL_POLARISED = SystemOver.polarised
ORIGINAL_HESSIAN = SystemOver.hessian_times


def test_transposed_jacobians_are_seen_everywhere(monkeypatch):
    monkeypatch.setattr(SystemOver, "jacobian", lambda self, x: ORIGINAL_JACOBIAN(self, x).transpose())
    assert "defining-equation" in red("m=2, split", 2)
    assert red("m=2, split", 4) & {"jacobians-by-powers-of-A", "jacobians-commute-with-A"}


def test_twice_the_jacobian_is_seen(monkeypatch):
    monkeypatch.setattr(SystemOver, "jacobian", lambda self, x: ORIGINAL_JACOBIAN(self, x) + ORIGINAL_JACOBIAN(self, x))
    assert "defining-equation" in red("m=2, split", 2)


def test_a_wrong_polarisation_is_seen(monkeypatch):
    # Q(x, x) for Q(x, x~).
    monkeypatch.setattr(SystemOver, "polarised", lambda self, x, y: ORIGINAL_POLARISED(self, x, x))
    assert {"defining-equation", "polarisation"} <= red("m=2, split", 2)


def test_a_wrong_second_derivative_is_seen_by_lemma_10(monkeypatch):
    def transposed(self, vector):
        return ORIGINAL_HESSIAN(self, vector).transpose()

    monkeypatch.setattr(SystemOver, "hessian_times", transposed)
    assert red("m=2, split", 6) & {"second-derivatives-agree", "jacobians-at-the-images", "both-maps"}


def test_a_quadratic_form_with_a_wrong_factor_is_seen(monkeypatch):
    # Q for f'' = 2 Q.
    original = SystemOver.of

    def halved(field, system, values=()):
        found = original(field, system, values)
        return SystemOver(field, found.tensor * field.convert(fmpq(1, 2)), found.B, found.c, found.exact)

    monkeypatch.setattr(SystemOver, "of", halved)
    assert {"polarisation", "explicit-form", "second-order"} <= red("m=2, split", 2)


# The family

ORIGINAL_SIGNS = associated.sign_polynomial


def constant_too_large(factors, signs):
    return ORIGINAL_SIGNS(factors, signs) + 1


def reflected(factors, signs):
    """B(-lambda)."""
    return ORIGINAL_SIGNS(factors, signs)(fmpq_poly([0, -1]))


def last_sign_ignored(factors, signs):
    return ORIGINAL_SIGNS(factors, (*signs[:-1], 1))


@pytest.mark.parametrize("name", quick(["m=2, split", "m=3, split"], ["m=2, split"]))
@pytest.mark.parametrize("wrong", [constant_too_large, reflected, last_sign_ignored])
def test_a_wrong_sign_polynomial_is_seen_by_lemma_7(wrong, name, monkeypatch):
    monkeypatch.setattr(associated, "sign_polynomial", wrong)
    assert {"interpolation", "matrices-as-polynomials-in-A"} <= red(name, 5)


@pytest.mark.parametrize("wrong", [constant_too_large, reflected])
def test_a_wrong_sign_polynomial_is_seen_by_theorem_9(wrong, monkeypatch):
    monkeypatch.setattr(associated, "sign_polynomial", wrong)
    assert "commutativity" in red("m=2, split", 6)


def test_a_transposed_matrix_b_is_seen(monkeypatch):
    # It is skew-Hamiltonian and an involution as well, but belongs to another A.
    original = associated.evaluate_at_matrix
    monkeypatch.setattr(associated, "evaluate_at_matrix", lambda polynomial, A: original(polynomial, A).transpose())
    assert {"accelerations-agree", "squares-of-jacobians-agree"} <= red("m=2, split", 5)
    assert {"second-derivatives-agree", "commutativity"} <= red("m=2, split", 6)


def test_a_chain_with_the_transpose_of_a_cannot_be_made(monkeypatch):
    original = cubics.chain
    monkeypatch.setattr(associated, "chain", lambda A, H, *more: original(A.transpose(), H, *more))
    with pytest.raises(Exception, match=r"closed|space|Hess"):
        fresh("m=2, split")


def test_a_chain_with_wrong_factors_is_seen_by_sections_1_and_4(monkeypatch):
    original = associated.FamilyMember.chain.func

    def doubled(self):
        first, *more = original(self)
        return (first, *(2 * H for H in more))

    monkeypatch.setattr(associated.FamilyMember, "chain", property(doubled))
    assert "perturbed-hamiltonians-tend-to-the-hamiltonians" in red("m=2, split", 1)
    assert {"fields-of-the-chain", "fields-by-powers-of-A"} <= red("m=3, split", 4)


def test_fields_of_the_chain_with_a_wrong_sign_are_seen_by_section_4(monkeypatch):
    def opposite(member):
        J = standard(member.dim)
        return [hamiltonian.CubicHamiltonian(H * (-1 if i else 1), J) for i, H in enumerate(member.chain)]

    monkeypatch.setattr(associated.FamilyMember, "hamiltonians", property(opposite))
    assert {"fields-of-the-chain", "fields-by-powers-of-A"} <= red("m=2, split", 4)


# Integrals and the tensor

ORIGINAL_INTEGRAL = PaperIntegral.value
ORIGINAL_MODIFIED = ModifiedHamiltonian.value
ORIGINAL_TENSOR = realise.poisson_tensor


def test_h_tilde_with_a_wrong_factor_is_seen(monkeypatch):
    def doubled(self, field, eps, point):
        return ORIGINAL_INTEGRAL(self, field, eps, point) * field.convert(2)

    monkeypatch.setattr(PaperIntegral, "value", doubled)
    found = red("m=2, split", 7)
    assert "two-forms-of-H-tilde" in found
    assert "H-tilde-is-shared" not in found  # twice an integral is an integral
    assert "H-tilde-through-H-and-K" in red("m=2, split", 9)


def test_h_tilde_with_another_eps_is_no_integral(monkeypatch):
    def wrong(self, field, eps, point):
        return ORIGINAL_INTEGRAL(self, field, eps + eps, point)

    monkeypatch.setattr(PaperIntegral, "value", wrong)
    assert {"two-forms-of-H-tilde", "H-tilde-is-shared"} <= red("m=2, split", 7)


def test_a_modified_hamiltonian_with_a_wrong_factor_is_seen(monkeypatch):
    def wrong(self, field, eps, point):
        value = ORIGINAL_MODIFIED(self, field, eps, point)
        return value + value - realise.evaluate(self.hamiltonian.H, field, point)

    monkeypatch.setattr(ModifiedHamiltonian, "value", wrong)
    assert {"two-forms-of-the-integral", "integral-of-any-cubic-hamiltonian"} <= red("m=2, split", 2)


def wrong_sign(hamiltonian, field, eps, point):
    """J + eps^2 f'(x)^2 J."""
    J = field.convert_matrix(hamiltonian.J)
    return J + J - ORIGINAL_TENSOR(hamiltonian, field, eps, point)


def wrong_scale(hamiltonian, field, eps, point):
    """J - 4 eps^2 f'(x)^2 J: the time step for eps."""
    return ORIGINAL_TENSOR(hamiltonian, field, eps + eps, point)


def wrong_order(hamiltonian, field, eps, point):
    """J - eps^2 J f'(x)^2."""
    J = field.convert_matrix(hamiltonian.J)
    jacobian = hamiltonian.system.over(field).jacobian(point)
    return J - J * jacobian * jacobian * (eps * eps)


@pytest.mark.parametrize("wrong", quick([wrong_sign, wrong_scale], [wrong_scale]))
def test_a_wrong_tensor_is_seen_by_theorem_12(wrong, monkeypatch):
    monkeypatch.setattr(realise, "poisson_tensor", wrong)
    assert {"tensor", "tensor-by-B", "poisson-map", "poisson-map-of-g"} <= red("m=3, split", 8)


def test_a_tensor_with_j_on_the_wrong_side_is_seen_by_theorem_12(monkeypatch):
    monkeypatch.setattr(realise, "poisson_tensor", wrong_order)
    assert red("m=3, split", 8) >= {"tensor", "poisson-map"}


# The letters of the paper


def test_a_wrong_coefficient_of_the_modified_hamiltonian_of_k_is_seen(monkeypatch):
    original = objects.PaperObjects._modified

    def wrong(self, g, value, gradient, x):
        return original(self, g, value, gradient, x) + self.eps * value

    monkeypatch.setattr(objects.PaperObjects, "_modified", wrong)
    assert survivors(1).verdict is Verdict.REFUTED


@pytest.mark.parametrize(
    ("letter", "section", "seen"),
    [
        ("p0", 5, {"square-of-the-jacobian"}),
        ("p0", 8, {"tensor-by-B", "gradients-of-the-coefficients"}),
        ("P0", 9, {"inverse-tensor", "H-tilde-through-H-and-K", "gradients-of-P-and-Q"}),
        ("reciprocals", 9, {"inverse-tensor"}),
        ("eighth_of_trace", 8, {"gradients-of-the-coefficients", "gradients-through-p0"}),
    ],
)
def test_a_letter_with_a_wrong_factor_is_seen(letter, section, seen, monkeypatch):
    original = getattr(objects.PaperObjects, letter)
    monkeypatch.setattr(objects.PaperObjects, letter, lambda self, x: original(self, x) * self.number(3))
    assert seen <= red("m=3, split", section)


@pytest.mark.parametrize(
    ("letter", "section", "seen"),
    [
        ("q", 5, {"square-of-the-jacobian", "mixed-traces"}),
        ("q", 8, {"tensor-by-B", "gradient-of-q"}),
        ("s", 9, {"factorization-of-the-determinant", "functions-s-are-eigenvalues"}),
        ("Q", 9, {"inverse-tensor", "K-tilde-through-H-and-K-for-every-m"}),
    ],
)
def test_an_indexed_letter_with_a_wrong_factor_is_seen(letter, section, seen, monkeypatch):
    original = getattr(objects.PaperObjects, letter)
    monkeypatch.setattr(objects.PaperObjects, letter, lambda self, i, x: original(self, i, x) * self.number(3))
    assert seen <= red("m=3, split", section)


def test_wrong_derivatives_are_seen(monkeypatch):
    original = calculus.Calculus.slope
    monkeypatch.setattr(calculus.Calculus, "slope", lambda self, f, x, v: original(self, f, x, v) * self.number(2))
    assert "jacobi-matrix-of-the-map" in red("m=2, split", 2)
    assert "hamilton-function-of-the-associated-field" in red("m=2, split", 5)


def test_dual_numbers_that_forget_the_product_rule_are_seen(monkeypatch):
    def times(self, other):
        return self.field.dual(self.value * other.value, self.slope * other.value)

    monkeypatch.setattr(Dual, "_times", times)
    assert red("m=2, split", 9)


def test_a_solution_of_the_transposed_system_is_seen(monkeypatch):
    monkeypatch.setattr(calculus, "solve", lambda matrix, right: solve(matrix.transpose(), right))
    assert {"explicit-form", "homogeneous-form"} <= red("m=2, split", 2)


# A proof that disagrees with the points


def test_a_wrong_normal_form_contradicts_the_points(monkeypatch):
    # The third derivatives of a u^3 + ... without symmetry: no cubic has them.
    original = realise._normal_form

    def broken(K, roots, cubics):
        A, third = original(K, roots, cubics)
        n = A.nrows()
        entries = list(third.entries())
        entries[n] = entries[n] + K.one
        return A, K.matrix(n * n, n, entries)

    monkeypatch.setattr(realise, "_normal_form", broken)
    report = verify(SystemFile.from_member(fresh("m=2, split")), options=VerifyOptions(sections=(4,)))
    assert "contradiction" in {finding.evidence.method for finding in report.findings}
    assert report.verdict is Verdict.REFUTED
