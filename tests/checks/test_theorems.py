"""Proof by hypotheses: a theorem applies when every one of its finite hypotheses holds exactly, and then only.

Where a broken hypothesis breaks the conclusion as well, that is shown by a point at which the independent computation
fails.
"""

from dataclasses import replace
from fractions import Fraction

import pytest
from check_helpers import commute_at, exact, hamiltonian_of, side_by_side, system_of
from flint import fmpq, fmpq_mat, fmpq_poly
from helpers import matrices, points, rationals, systems
from hypothesis import assume, given

from kahanmaps import (
    KahanMap,
    Settings,
    SystemFile,
    check_commute,
    check_integrals,
    check_measure,
    check_poisson,
    standard_structure,
)
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.checks import theorems
from kahanmaps.checks.theorems import commutant_integral
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.invariants.integrals_and_densities import CommutantIntegral
from kahanmaps.systems.hamiltonian import CubicHamiltonian

MEMBER = random_member_with_eigenvalues([1, -2, 3], seed=3)
X = exact("1/2", "-1/3", 1, 2, "2/5", -1)
EPS = Fraction(1, 7)


def failing(hypotheses: list[tuple[str, bool]]) -> list[str]:
    return [name for name, holds in hypotheses if not holds]


ASSOCIATE = MEMBER.associate((1, 1, -1))

# Each breaks one hypothesis and keeps the others.
BROKEN_ASSOCIATES = {
    "B is another polynomial in A": (
        replace(ASSOCIATE, coefficients=(ASSOCIATE.coefficients[0] + 1, *ASSOCIATE.coefficients[1:])),
        "B_++- is a polynomial in A",
    ),
    "B = 2 I, so that B^2 is not I": (
        replace(ASSOCIATE, coefficients=(fmpq(2), fmpq(0), fmpq(0)), B=QQ.identity(6) * fmpq(2), K=2 * MEMBER.H),
        "B_++-^2 = I",
    ),
    "K with a term too many": (
        replace(ASSOCIATE, K=ASSOCIATE.K + parse_polynomial("x1^3", MEMBER.variables)),
        "grad K_++- = B_++- grad H",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("associate", "hypothesis"), BROKEN_ASSOCIATES.values(), ids=BROKEN_ASSOCIATES)
def test_a_broken_associated_system_fails_in_that_hypothesis_alone(associate, hypothesis):
    assert failing(theorems.associated_hypotheses(MEMBER, ASSOCIATE)) == []
    assert failing(theorems.associated_hypotheses(MEMBER, associate)) == [hypothesis]
    assert theorems.shared_integral(MEMBER, associate) is None


def forced(member: FamilyMember, **fields: object) -> FamilyMember:
    """A member whose fields were changed behind the back of its constructor."""
    broken = replace(member)
    for name, value in fields.items():
        broken.__dict__[name] = value
    return broken


def test_the_hypotheses_on_a_and_h_are_verified_anew_and_a_member_out_of_the_family_proves_nothing():
    assert failing(theorems.member_hypotheses(MEMBER)) == []
    A = MEMBER.A * fmpq(1)
    A[0, 0] += 1
    assert "A^T J = J A" in failing(theorems.member_hypotheses(forced(MEMBER, A=A)))
    H = MEMBER.H + parse_polynomial("x1^2*x5", MEMBER.variables)
    broken = forced(MEMBER, H=H, chain=MEMBER.chain)
    assert failing(theorems.member_hypotheses(broken)) == ["H is a homogeneous cubic with A Hess(H) = Hess(H) A^T"]
    assert theorems.shared_integral(broken, ASSOCIATE) is None
    assert theorems.poisson_tensor_invariant(ASSOCIATE.hamiltonian, broken) is None
    assert theorems.commuting_by_involution_of_members(broken, broken) is None
    assert theorems.commuting_over_splitting_field(broken) is None


@pytest.mark.parametrize(("H", "signs"), [(MEMBER.H, (1, -1, 1)), (MEMBER.chain[1], (1, 1, 1))])
def test_two_members_with_the_same_a_and_h_commute_by_the_theorem_and_with_another_h_they_do_not(H, signs):
    other, same = FamilyMember(MEMBER.A, H, signs), H == MEMBER.H
    assert (theorems.commuting_by_involution_of_members(MEMBER, other) is not None) == same
    assert commute_at(MEMBER.chosen.system, other.chosen.system, EPS, X) is same


@pytest.mark.parametrize(
    "member",
    [
        MEMBER,
        random_member_with_chi(fmpq_poly([-2, 0, 1]), seed=3),
        random_member_with_chi(fmpq_poly([1, -2, 1]), seed=3),  # (t - 1)^2, not diagonalisable
        random_member_with_eigenvalues([1, 1, 2], seed=3),
    ],
    ids=["split", "irreducible", "repeated root", "repeated eigenvalue"],
)
def test_over_the_splitting_field_every_chi_gives_its_associated_systems(member):
    assert theorems.commuting_over_splitting_field(member) is not None


def broken_hamiltonian(**fields: object) -> CubicHamiltonian:
    """A Hamiltonian system changed behind the back of its constructor."""
    hamiltonian = hamiltonian_of("q p", "q^3/3 + p^2/2")
    for name, value in fields.items():
        hamiltonian.__dict__[name] = value
    return hamiltonian


@pytest.mark.parametrize(
    "fields",
    [
        {"J": fmpq_mat([[0, 1], [1, 0]]), "system": system_of("q p", "p", "q^2")},
        {"H": parse_polynomial("q^4 + p^2/2", ["q", "p"]), "system": system_of("q p", "p", "-q^2")},
        {"system": system_of("q p", "p", "-q^2 + q")},
    ],
    ids=["J not skew", "H of degree 4", "f is not J grad H"],
)
def test_a_broken_hamiltonian_system_proves_nothing(fields):
    assert theorems.cubic_hamiltonian(broken_hamiltonian()) is not None
    assert theorems.cubic_hamiltonian(broken_hamiltonian(**fields)) is None


# Linear relations g = C f

# x and (y, z) do not see each other; inhomogeneous on both sides.
DECOUPLED = system_of("x y z", "x^2 - 3*x + 1", "y*z + 2*y - 1/2", "y^2 - z + 5")


@given(matrices(3, 3))
def test_a_linear_relation_is_found_where_there_is_one(C):
    assert theorems.linear_relation(DECOUPLED, DECOUPLED.transformed(C)) == C


@given(systems(dims=(1, 2)), systems(dims=(1, 2)), points(4, rationals(9)))
def test_two_systems_side_by_side_and_one_of_them_reversed_commute(first, second, x):
    f, g = side_by_side(first, second), side_by_side(first, second.scaled(-1))
    assume(theorems.linear_relation(f, g) is not None)  # the components of f do not depend on each other
    assert theorems.commuting_by_splitting(f, g) is not None
    assert commute_at(f, g, EPS, exact(*x)[: f.dim]) in (True, None)


@pytest.mark.parametrize("signs", [(1, -1, -1), (0, 0, 0), (-1, 0, 0), (0, 1, 1)])
def test_each_of_two_decoupled_parts_may_be_kept_reversed_or_stopped(signs):
    g = DECOUPLED.transformed(fmpq_mat([[s * (i == j) for j in range(3)] for i, s in enumerate(signs)]))
    assert theorems.commuting_by_splitting(DECOUPLED, g).data["hypotheses"] == [
        "g = C f with a constant matrix C",
        "C^3 = C",
        "C f'(x) = f'(x) C for every x",
    ]
    assert commute_at(DECOUPLED, g, EPS, X[:3]) is True


# (what is broken, f, g): no evidence, and the maps indeed do not commute at X.
SWAP = fmpq_mat([[0, 1, 0], [1, 0, 0], [0, 0, 1]])
BROKEN_SPLITTINGS = {
    "g = C f up to a constant": (DECOUPLED, system_of("x y z", "x^2 - 3*x + 1", "-y*z - 2*y + 1/3", "-y^2 + z - 5")),
    "C^3 is not C": (DECOUPLED, DECOUPLED.scaled(2)),
    "C^3 = C on one part only": (DECOUPLED, DECOUPLED.transformed(fmpq_mat([[1, 0, 0], [0, 3, 0], [0, 0, 3]]))),
    "C swaps, f is not symmetric": (DECOUPLED, DECOUPLED.transformed(SWAP)),
    "C commutes with the quadratic part only": (
        system_of("x y z", "x^2 + y", "y*z", "y^2 - z^2"),
        system_of("x y z", "x^2 + y", "-y*z", "z^2 - y^2"),
    ),
    "C commutes with the linear part only": (
        system_of("x y z", "x^2 + y*z - x", "y*z + y", "y^2 - z^2"),
        system_of("x y z", "x^2 + y*z - x", "-y*z - y", "z^2 - y^2"),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("f", "g"), BROKEN_SPLITTINGS.values(), ids=BROKEN_SPLITTINGS.keys())
def test_each_hypothesis_of_the_lemma_is_needed(f, g):
    assert theorems.commuting_by_splitting(f, g) is None
    assert commute_at(f, g, EPS, X[:3]) is False


SADDLE = SystemFile.from_hamiltonian(CubicHamiltonian(parse_polynomial("q*p", ["q", "p"]), standard_structure(2)), "qp")
CHECKS = [check_integrals, check_measure, check_poisson, lambda file, settings: check_commute(file, file, settings)]


@pytest.mark.parametrize("check", CHECKS, ids=["integrals", "measure", "poisson", "commute"])
def test_nothing_is_proved_of_a_map_without_values(check):
    report = check(SADDLE, Settings(eps="-1", steps=2))
    assert report.findings[0].verdict == "undecided"
    assert report.holds is None
    assert "not defined at any" in report.findings[0].evidence.summary
    assert check(SADDLE, Settings(eps="1/2", steps=2)).verdict == "proved"


def test_the_commutant_lemma_asks_for_the_standard_structure():
    member = random_member_with_eigenvalues([1, 2], seed=1)
    standard = member.chosen.hamiltonian
    other = CubicHamiltonian(standard.H, standard.J * 2)
    assert commutant_integral(standard, CommutantIntegral(standard, member.A, 1), "A^T") is not None
    assert commutant_integral(other, CommutantIntegral(other, member.A, 1), "A^T") is None


def test_the_commutant_lemma_asks_for_a_homogeneous_cubic():
    """Two planes side by side, H = q1^3 + q1 p1^2 + q2 p2: A commutes with f', and x^T J A^T x~ is not conserved."""
    A = fmpq_mat(4, 4, [1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2])
    H = parse_polynomial("q1^3 + q1*p1^2 + q2*p2 + p1", ["q1", "q2", "p1", "p2"])
    hamiltonian = CubicHamiltonian(H, standard_structure(4))
    jacobian = hamiltonian.system.over(QQ).jacobian([fmpq(2), fmpq(3), fmpq(5), fmpq(7)])
    assert A.transpose() * jacobian == jacobian * A.transpose()
    integral = CommutantIntegral(hamiltonian, A, 1)
    assert commutant_integral(hamiltonian, integral, "A^T") is None
    kahan = KahanMap(hamiltonian.system, "1/7")
    x = kahan.point([1, 2, 3, 4])
    values = [integral.value(QQ, kahan.eps, point) for point in (x, kahan.step(x))]
    assert values[0] != values[1]
