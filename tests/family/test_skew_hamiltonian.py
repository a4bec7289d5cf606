"""Skew-Hamiltonian matrices A^T J = J A: recognised entry by entry, with chi, its factors and their order.

Specified here: `defects` is empty exactly for A^T J = J A and names what is wrong; det(t - A) = chi(t)^2; factors come
in the order that signs refer to; random symplectic matrices are symplectic; members drawn from a seed are what was
asked for, and stay the same.
"""

import random

import pytest
from family.members import t
from flint import fmpq, fmpq_mat
from helpers import random_skew_hamiltonian
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps import normal_form, standard_structure
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.family.cubics import belongs
from kahanmaps.family.random_members import random_member, random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.family.skew_hamiltonian import chi, defects, diagnosis, factors_of_chi, random_symplectic

over_m = pytest.mark.parametrize("m", [1, 2, 3, 4])
seeds = st.integers(0, 10**6)


def drawn(m: int, seed: int) -> fmpq_mat:
    return random_skew_hamiltonian(m, random.Random(seed))


@given(seed=seeds, row=st.integers(0, 3), column=st.integers(0, 3), change=st.integers(-3, 3))
def test_defects_are_found_exactly_where_the_definition_fails(seed, row, column, change):
    A = drawn(2, seed)
    A[row, column] += change
    J = standard_structure(4)
    assert (defects(A) == []) is (A.transpose() * J == J * A)


@over_m
@given(seed=seeds)
def test_the_characteristic_polynomial_is_the_square_of_chi(m, seed):
    A = drawn(m, seed)
    assert (chi(A) ** 2, chi(A).degree()) == (A.charpoly(), m)


ORDERS = [  # chi as a product in some order, the order of its factors
    ((t - 3) * (t + 2) * (t - fmpq(1, 2)), ["t + 2", "t - 1/2", "t - 3"]),  # linear ones by increasing root
    ((t**2 + 1) * (t - 9), ["t - 9", "t^2 + 1"]),  # linear ones first
    ((t**3 - 2) * (t**2 - 2), ["t^2 - 2", "t^3 - 2"]),  # then by degree
    ((t**2 + 1) * (t**2 - 2), ["t^2 - 2", "t^2 + 1"]),  # then by the constant term
    ((t**2 + t + 1) * (t**2 + 1), ["t^2 + 1", "t^2 + t + 1"]),  # then by the next coefficient
    ((t**2 - t + fmpq(1, 2)) * (t**2 + fmpq(1, 3)), ["t^2 + 1/3", "t^2 - t + 1/2"]),  # of the monic polynomials
]


@pytest.mark.parametrize(("polynomial", "expected"), ORDERS, ids=lambda value: str(value))
def test_factors_come_in_the_order_of_the_signs(polynomial, expected):
    assert [str(factor) for factor in factors_of_chi(random_member_with_chi(polynomial, 1).A)] == expected


DIAGNOSES = [
    (random_member_with_eigenvalues([1, "1/2"], 1).A, "A is generic: chi = (t - 1/2) (t - 1), .* all roots rational"),
    (random_member_with_chi(t**3 - 2, 1).A, "A is generic: chi = (t^3 - 2), .* irreducible over Q"),
    (random_member_with_chi((t - 1) * (t**2 - 2), 1).A, "A is generic: .* 2 irreducible factors over Q"),
    (
        random_member_with_eigenvalues([1, 1, 2], 1).A,
        "A is not generic: .*2 times; A is derogatory.* A is diagonalisable",
    ),
    (
        random_member_with_chi((t - 1) ** 2, 1).A,
        "A is not generic: .*(t - 1) 2 times; A is not diagonalisable, but chi is its minimal polynomial.*dimension 4m",
    ),
]


@pytest.mark.parametrize(("A", "sentence"), DIAGNOSES, ids=["split", "irreducible", "partly", "diagonal", "nilpotent"])
def test_the_diagnosis_says_how_chi_factors_and_what_that_means(A, sentence):
    words = diagnosis(A)
    assert [part in words for part in sentence.split(".*")] == [True] * (sentence.count(".*") + 1)


@over_m
@given(seed=seeds)
def test_a_random_symplectic_matrix_is_symplectic(m, seed):
    S, J = random_symplectic(m, random.Random(seed)), standard_structure(2 * m)
    assert S.transpose() * J * S == J


DRAWS = {
    "eigenvalues": lambda seed: random_member_with_eigenvalues([1, -2, "1/2"], seed),
    "a repeated eigenvalue": lambda seed: random_member_with_eigenvalues([1, 1, 2], seed),
    "chi": lambda seed: random_member_with_chi(t**3 - t - 1, seed),
    "chi with a repeated root": lambda seed: random_member_with_chi((t - 1) ** 2 * (t + 1), seed),
    "generic": lambda seed: random_member(3, seed),
}
over_seeds = pytest.mark.parametrize("seed", range(5))


def test_a_seed_gives_the_member_that_it_always_gave():
    # Records of experiments name members by seed: when this fails, old records no longer say what they were about.
    member = random_member_with_chi(t**2 - 2, seed=7)
    assert member.A == fmpq_mat([[4, -3, 0, -2], [-6, -4, 2, 0], [0, -16, 4, -6], [16, 0, -3, -4]])
    assert format_polynomial(member.H).startswith("47*x1^3 - 66*x1^2*x2 + 30*x1*x2^2 - 4*x2^3 + 256*x1^2*x3")


@pytest.mark.parametrize("draw", DRAWS.values(), ids=DRAWS.keys())
@over_seeds
def test_the_matrix_is_skew_hamiltonian_and_the_cubic_belongs_to_it(draw, seed):
    member = draw(seed)
    assert (defects(member.A), belongs(member.A, member.H)) == ([], True)


@pytest.mark.parametrize("name", ["eigenvalues", "chi", "generic"])
@over_seeds
def test_no_planar_cubic_has_a_repeated_line(name, seed):
    form = normal_form(DRAWS[name](seed))
    p, q, r = form.D_coefficients  # the discriminant of D = p X^2 + q X Y + r Y^2 is that of h, but for a factor
    assert (q * q - 4 * p * r).gcd(form.chi).degree() == 0


@pytest.mark.parametrize("polynomial", [t - 5, t**2 - 2, t**3 - t - 1, (t - 1) ** 2 * (t**2 + 1), t**4], ids=str)
@over_seeds
def test_chi_is_the_polynomial_asked_for(polynomial, seed):
    assert chi(random_member_with_chi(polynomial, seed).A) == polynomial
