"""Members that do not say so: A is found from H and J alone. The normal form of a system, declared or found.

Specified here: all A with A^T J = J A and A Hess(H) = Hess(H) A^T are found, for every invertible J; of a member whose
A is forgotten an A with the same splitting is found again, and its normal form steps like the system itself; without
structure nothing is found; and an A that leaves repeated roots is said not to be generic.
"""

import random
from dataclasses import replace
from itertools import product

import pytest
from check_helpers import hamiltonian_of, system_of
from family.members import GENERIC, t
from flint import fmpq, fmpq_mat
from helpers import EULER_TOP, HENON_HEILES, LORENZ, LOTKA_VOLTERRA, random_point, refuses
from hypothesis import given
from hypothesis import strategies as st
from planar_helpers import invertible, moved, over_members, structure_and_system

from kahanmaps import QQ, FamilyMember, KahanMap, QuadraticSystem, parse_polynomial
from kahanmaps.algebra.matrices import rank
from kahanmaps.algebra.polynomials import monomials, ring
from kahanmaps.errors import HypothesisError
from kahanmaps.family.cubics import default_variables, third_derivatives
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.family.recognition import find_family_structure, structure_space, why_not_member
from kahanmaps.family.skew_hamiltonian import chi, evaluate_at_matrix, random_symplectic
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm, system_normal_form
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

MEMBERS = GENERIC | {
    "m = 2, complex": random_member_with_chi(t**2 + 1, 1),
    "m = 4, twice the same field": random_member_with_chi((t**2 - 2) * (t**2 - 2 * t - 1), 1),
    "m = 5, partly split": random_member_with_chi((t - 1) * (t + 3) * (t**3 - t - 1), 1),
    "m = 6, split": random_member_with_eigenvalues([1, -2, 3, 5, -7, 4], 1),
}
over_generic = pytest.mark.parametrize("member", MEMBERS.values(), ids=MEMBERS.keys())


def forgotten(member: FamilyMember) -> CubicHamiltonian:
    """The system of a member, without its A."""
    return CubicHamiltonian(member.H, standard_structure(member.dim))


def involutions(member: FamilyMember) -> set[str]:
    """All B_s and -B_s: what the splitting is, whatever A is."""
    return {str(B) for g in member.associated() for B in (g.B, -g.B)}


@over_generic
def test_the_splitting_is_found_again(member):
    result = find_family_structure(forgotten(member))
    assert (result.is_generic, result.dimension, result.member.H) == (True, member.m, member.H)
    assert involutions(result.member) == involutions(member)
    assert sorted(f.degree for f in result.member.factors) == sorted(f.degree for f in member.factors)


@given(st.sampled_from([(1, -2), (3, 5), (1, 2, 3), (0, 1, -4)]), st.integers(0, 10**6))
def test_a_symplectic_disguise_hides_nothing(eigenvalues, seed):
    member = random_member_with_eigenvalues(eigenvalues, seed % 5)
    S = random_symplectic(member.m, random.Random(seed))
    result = find_family_structure(moved(forgotten(member), S))
    assert (result.is_standard, result.is_generic) == (True, True)
    # In the new coordinates x = S z the matrix B is S^-T B S^T.
    inverse = S.inv().transpose()
    expected = {str(s * inverse * g.B * S.transpose()) for g in member.associated() for s in (1, -1)}
    assert involutions(result.member) == expected


@pytest.mark.parametrize(("n", "seed"), [(4, 0), (4, 1), (6, 2)])
def test_a_cubic_without_structure_is_no_member(n, seed):
    rng = random.Random(seed)  # every coefficient is drawn
    H = ring(default_variables(n)).from_dict({e: fmpq(rng.randint(-9, 9), 1 + seed % 3) for e in monomials(n, 3)})
    hamiltonian = CubicHamiltonian(H, standard_structure(n))
    assert structure_space(hamiltonian.H) == [QQ.identity(n)]
    assert find_family_structure(hamiltonian) is None
    assert why_not_member(hamiltonian).startswith("only the multiples of I")


@pytest.mark.parametrize(
    ("H", "J", "reason"),
    [
        ("x1^3 + x1*x2", [[0, 1], [-1, 0]], "H is not a homogeneous cubic"),
        ("x1^3", [[0, 0], [0, 0]], "J is singular"),
        ("x1^3", [[0, 1, 0], [-1, 0, 0], [0, 0, 0]], "the dimension is 3, expected an even one"),
    ],
)
def test_systems_of_another_kind_are_no_members(H, J, reason):
    hamiltonian = CubicHamiltonian(parse_polynomial(H, default_variables(len(J))), fmpq_mat(J))
    assert find_family_structure(hamiltonian) is None
    assert why_not_member(hamiltonian).startswith(reason)
    refuses(reason, structure_space, hamiltonian.H, hamiltonian.J)


@pytest.mark.parametrize("n", [4, 6])
@pytest.mark.parametrize("seed", range(3))
def test_the_dimension_is_that_of_all_matrices_entry_by_entry(n, seed):
    """The same conditions, written down for all n^2 entries of A; H has few terms, so that solutions abound."""
    rng = random.Random(seed)
    H = ring(default_variables(n)).from_dict({e: fmpq(rng.randint(1, 3)) for e in rng.sample([*monomials(n, 3)], 4)})
    R = invertible(n, seed)
    J = R * standard_structure(n) * R.transpose()
    rows = []
    for left, sign in [(J, 1), *((third, -1) for third in third_derivatives(H))]:
        for i, j in product(range(n), repeat=2):
            row = fmpq_mat(n, n)
            for k in range(n):  # (A^T J - J A)[i, j] and (A T - T A^T)[i, j]
                row[(k, i) if sign > 0 else (i, k)] += left[k, j]
                row[(k, j) if sign > 0 else (j, k)] -= left[i, k]
            rows.append(row.entries())
    assert len(structure_space(H, J)) == n * n - rank(QQ, fmpq_mat(rows))


@pytest.mark.parametrize("power", [2, 3])
def test_nilpotent_structure_is_found_and_not_generic(power):
    member = random_member_with_chi((t - 5) ** power, 1)
    result = find_family_structure(forgotten(member))
    assert (result.is_generic, result.dimension, chi(result.A)) == (False, power, (t - 1) ** power)
    nilpotent = result.A - QQ.identity(2 * power)
    assert evaluate_at_matrix(t ** (power - 1), nilpotent) != nilpotent * 0 == evaluate_at_matrix(t**power, nilpotent)
    assert result.text == (f"H does not split: A, not scalar, with A Hess(H) = Hess(H) A^T has chi = (t - 1)^{power}")


def test_a_member_of_another_system_is_refused():
    result = find_family_structure(forgotten(GENERIC["m = 2, split"]))
    with pytest.raises(HypothesisError, match=r"not H\(T y\)"):
        replace(result, hamiltonian=CubicHamiltonian(2 * result.hamiltonian.H, result.hamiltonian.J))
    refuses("J is not T", replace, result, T=2 * result.T, error=HypothesisError)
    refuses("sign -1", replace, result, member=replace(result.member, signs=(1, -1)), error=HypothesisError)


def steps_like(normal_form: SystemNormalForm, system: QuadraticSystem) -> bool:
    """Whether one step in the planes is a step of the system."""
    splitting, x = Splitting(normal_form.form, QQ, "1/10", normal_form.T), random_point(system.dim, 8)
    images = [plane.block.image(P) for plane, P in zip(splitting.planes, splitting.triples(x), strict=True)]
    return splitting.point(images) == KahanMap(system, "1/10").step(x)


def test_a_declared_member_keeps_its_a():
    member = random_member_with_eigenvalues(["1/2", -7], 3)
    normal_form = system_normal_form(member.chosen.system, member=member)
    assert (normal_form.declared, normal_form.T) == (True, None)
    assert normal_form.form.A == member.A
    assert normal_form.text == "a member of the family, chi = (t + 7)*(t - 1/2)"


@over_members
def test_the_structure_steps_like_the_system(name):
    normal_form, system = structure_and_system(name)
    assert steps_like(normal_form, system)
    assert not normal_form.declared


@pytest.mark.parametrize("n", [2, 4, 6])
def test_with_another_J_there_is_a_change_of_coordinates(n):
    member = random_member_with_eigenvalues([1, -2, 3][: n // 2], 2)
    other = moved(forgotten(member), invertible(n, 5))
    normal_form = system_normal_form(other.system, other)
    assert normal_form.T * standard_structure(n) * normal_form.T.transpose() == other.J
    assert steps_like(normal_form, other.system)
    # x = S z alone, without T, are other coordinates
    assert not steps_like(SystemNormalForm(normal_form.form, None, False, ""), other.system)


REASONS = [
    (HENON_HEILES, "H is not a homogeneous cubic"),
    (LORENZ, "x' is not J grad H"),
    (EULER_TOP, "x' is not J grad H"),
    (LOTKA_VOLTERRA, "x' is not J grad H"),
    (hamiltonian_of("x y z w", "x^3 + y^3 + z^3 + w^3 + x*y*z").system, "only the multiples of I satisfy"),
    (system_of("x y", "x", "-y"), "H is not a homogeneous cubic"),
]


@pytest.mark.parametrize(("system", "reason"), REASONS)
def test_without_a_structure_the_reason_is_said(system, reason):
    normal_form = system_normal_form(system)
    assert isinstance(normal_form, NoNormalForm)
    assert normal_form.reason.startswith(reason)
