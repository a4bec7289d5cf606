"""Skew-Hamiltonian matrices A^T J = J A: recognised entry by entry, with chi, its factors and their order.

Specified here: `defects` is empty exactly for A^T J = J A and names what is wrong; det(t - A) = chi(t)^2;
factors come in the order that signs refer to; random symplectic matrices are symplectic.
"""

import random

import pytest
from family.members import t
from flint import fmpq, fmpq_mat
from helpers import random_skew_hamiltonian
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.family.skew_hamiltonian import chi, defects, diagnosis, factors_of_chi, random_symplectic
from kahanmaps.systems.hamiltonian import standard_structure

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
    (random_member_with_eigenvalues([1, 1, 2], 1).A, "A is not generic: .*(t - 1) 2 times; A is still diagonalisable"),
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
