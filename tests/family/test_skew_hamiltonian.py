"""Skew-Hamiltonian matrices A^T J = J A: recognised entry by entry, with chi, its factors and their order.

Specified here: `defects` is empty exactly for A^T J = J A and names what is wrong; det(t - A) = chi(t)^2 and already
chi(A) = 0; factors come in the order that signs refer to; random symplectic matrices are symplectic.
"""

from __future__ import annotations

import random

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly
from helpers import matrices
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.errors import HypothesisError, InputError
from kahanmaps.family.draw import draw_with_chi, draw_with_eigenvalues
from kahanmaps.family.skew_hamiltonian import (
    chi,
    defects,
    diagnosis,
    evaluate_at_matrix,
    factors_of_chi,
    format_univariate,
    is_generic,
    random_skew_hamiltonian,
    random_symplectic,
    require_skew_hamiltonian,
    symplectic_inverse,
)
from kahanmaps.systems.hamiltonian import standard_structure

t = fmpq_poly([0, 1])
over_m = pytest.mark.parametrize("m", [1, 2, 3, 4])
seeds = st.integers(0, 10**6)


def drawn(m: int, seed: int) -> fmpq_mat:
    return random_skew_hamiltonian(m, random.Random(seed))


def diagonal(*values) -> fmpq_mat:
    """diag(values, values)."""
    n = 2 * len(values)
    return fmpq_mat(n, n, [fmpq(values[i % len(values)]) if i == j else fmpq(0) for i in range(n) for j in range(n)])


# Recognition.


def is_skew_hamiltonian(A: fmpq_mat) -> bool:
    """The definition."""
    J = standard_structure(A.nrows())
    return A.transpose() * J == J * A


@over_m
@given(seed=seeds)
def test_a_random_matrix_of_the_family_fulfils_the_definition(m, seed):
    assert is_skew_hamiltonian(drawn(m, seed))


@over_m
@given(seed=seeds)
def test_a_random_matrix_of_the_family_has_no_defects(m, seed):
    assert defects(drawn(m, seed)) == []


@given(seed=seeds, row=st.integers(0, 3), column=st.integers(0, 3), change=st.integers(-3, 3))
def test_defects_are_found_exactly_where_the_definition_fails(seed, row, column, change):
    A = drawn(2, seed)
    A[row, column] += change
    assert (defects(A) == []) is is_skew_hamiltonian(A)


@given(A=matrices(4, 4, st.integers(-1, 1)))
def test_an_arbitrary_matrix_has_no_defects_exactly_when_it_fulfils_the_definition(A):
    assert (defects(A) == []) is is_skew_hamiltonian(A)


@over_m
def test_the_matrices_form_a_space_of_dimension_m_times_2m_minus_1(m):
    n, J = 2 * m, standard_structure(2 * m)
    columns = []
    for position in range(n * n):
        E = fmpq_mat(n, n, [int(k == position) for k in range(n * n)])
        columns.append((E.transpose() * J - J * E).entries())
    equations = fmpq_mat([list(row) for row in columns]).transpose()
    assert len(nullspace(QQ, equations)) == m * (2 * m - 1)


DEFECTS = [
    (
        fmpq_mat([[1, 2, 0, 0], [3, 4, 0, 0], [0, 0, 1, 3], [0, 0, 5, 4]]),
        "entry (4,3) is 5, expected 2: the lower right block must be the transpose of the upper left one",
    ),
    (
        fmpq_mat([[1, 0, 0, 7], [0, 1, 8, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
        "entry (2,3) is 8, expected -7: the upper right block must be skew",
    ),
    (
        fmpq_mat([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 9, 0, 1]]),
        "entry (4,2) is 9, expected 0: the lower left block must be skew",
    ),
    (fmpq_mat(2, 3), "A is 2 x 3, expected a square matrix of even size 2m"),
    (fmpq_mat(3, 3), "A is 3 x 3, expected a square matrix of even size 2m"),
    (fmpq_mat(0, 0), "A is 0 x 0, expected a square matrix of even size 2m"),
]


@pytest.mark.parametrize(("A", "sentence"), DEFECTS, ids=lambda value: str(value)[:30])
def test_a_defect_is_named_with_its_entry(A, sentence):
    assert defects(A) == [sentence]


def test_a_matrix_with_a_defect_is_refused_in_the_same_words():
    with pytest.raises(HypothesisError, match=r"A is not skew-Hamiltonian: entry \(1,2\) is 2, expected 0"):
        require_skew_hamiltonian(fmpq_mat([[1, 2], [0, 1]]))


def test_of_many_defects_four_are_shown_and_the_rest_counted():
    A = fmpq_mat(6, 6, list(range(36)))
    with pytest.raises(HypothesisError, match=f"and {len(defects(A)) - 4} more") as refusal:
        require_skew_hamiltonian(A)
    assert str(refusal.value).count("expected") == 4


def test_four_defects_are_all_that_there_are():
    A = fmpq_mat(4, 4, [int(k in (2, 7, 8, 13)) for k in range(16)])
    assert len(defects(A)) == 4
    with pytest.raises(HypothesisError) as refusal:
        require_skew_hamiltonian(A)
    assert str(refusal.value) == "A is not skew-Hamiltonian: " + "; ".join(defects(A))


def test_an_entry_of_many_digits_is_shortened_in_the_message():
    (sentence,) = defects(fmpq_mat(2, 2, [fmpq(1), fmpq(10**5000), fmpq(0), fmpq(1)]))
    assert len(sentence) < 200


# chi.


@over_m
@given(seed=seeds)
def test_the_characteristic_polynomial_is_the_square_of_chi(m, seed):
    A = drawn(m, seed)
    assert (chi(A) ** 2, chi(A).degree()) == (A.charpoly(), m)


@over_m
@given(seed=seeds)
def test_chi_already_annihilates_the_matrix(m, seed):
    A = drawn(m, seed)
    assert evaluate_at_matrix(chi(A), A) == fmpq_mat(2 * m, 2 * m)


def test_a_proper_divisor_of_chi_does_not_annihilate_a_generic_matrix():
    A = diagonal(1, 2, 3)
    assert evaluate_at_matrix((t - 1) * (t - 2), A) != fmpq_mat(6, 6)


def test_chi_of_a_diagonal_matrix_has_the_entries_as_roots():
    assert chi(diagonal(5, "1/2", -1)) == (t - 5) * (t - fmpq(1, 2)) * (t + 1)


def test_the_product_of_the_factors_with_their_multiplicities_is_chi():
    A = diagonal(2, 2, 3)
    product = fmpq_poly([1])
    for factor in factors_of_chi(A):
        product *= factor.polynomial**factor.multiplicity
    assert product == chi(A)


def test_chi_of_a_matrix_outside_the_family_is_refused():
    with pytest.raises(HypothesisError):
        chi(fmpq_mat([[1, 2], [0, 1]]))


# The order that signs refer to.

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
    assert [str(factor) for factor in factors_of_chi(draw_with_chi(polynomial, 1).A)] == expected


def test_a_factor_tells_its_multiplicity_in_chi_and_not_in_the_characteristic_polynomial():
    assert [factor.multiplicity for factor in factors_of_chi(diagonal(4, 4, 1))] == [1, 2]


def test_a_linear_factor_knows_its_root_and_another_has_none():
    factors = factors_of_chi(draw_with_chi((t - fmpq(2, 3)) * (t**2 - 2), 1).A)
    assert [factor.root for factor in factors] == [fmpq(2, 3), None]


# What chi means for A.


@pytest.mark.parametrize(("values", "expected"), [((1, 2, 3), True), ((1, 2, 1), False), ((0,), True)], ids=str)
def test_a_matrix_is_generic_when_chi_has_no_repeated_root(values, expected):
    assert is_generic(diagonal(*values)) is expected


DIAGNOSES = [
    (draw_with_eigenvalues([1, "1/2"], 1).A, "A is generic: chi = (t - 1/2) (t - 1), .* all roots rational"),
    (draw_with_chi(t**3 - 2, 1).A, "A is generic: chi = (t^3 - 2), .* irreducible over Q"),
    (draw_with_chi((t - 1) * (t**2 - 2), 1).A, "A is generic: .* 2 irreducible factors over Q"),
    (draw_with_eigenvalues([1, 1, 2], 1).A, "A is not generic: .*(t - 1) 2 times; A is still diagonalisable"),
    (
        draw_with_chi((t - 1) ** 2, 1).A,
        "A is not generic: .*(t - 1) 2 times; A is not diagonalisable, but chi is its minimal polynomial.*dimension 4m",
    ),
]


@pytest.mark.parametrize(("A", "sentence"), DIAGNOSES, ids=["split", "irreducible", "partly", "diagonal", "nilpotent"])
def test_the_diagnosis_says_how_chi_factors_and_what_that_means(A, sentence):
    words = diagnosis(A)
    assert [part in words for part in sentence.split(".*")] == [True] * (sentence.count(".*") + 1)


# Polynomials in A.


@given(seed=seeds, p=st.lists(st.integers(-3, 3), max_size=4), q=st.lists(st.integers(-3, 3), max_size=4))
def test_putting_a_matrix_into_polynomials_respects_products(seed, p, q):
    A, p, q = drawn(2, seed), fmpq_poly(p), fmpq_poly(q)
    assert evaluate_at_matrix(p * q, A) == evaluate_at_matrix(p, A) * evaluate_at_matrix(q, A)


def test_a_constant_polynomial_gives_a_multiple_of_the_identity():
    assert evaluate_at_matrix(fmpq_poly([5]), diagonal(1, 2)) == 5 * QQ.identity(4)


TEXTS = [
    (fmpq_poly([]), "0"),
    (fmpq_poly([fmpq(-1, 2)]), "-1/2"),
    (-t, "-t"),
    (t**2 - t + 1, "t^2 - t + 1"),
    (fmpq(2, 3) * t**3 - 5 * t, "2/3*t^3 - 5*t"),
]


@pytest.mark.parametrize(("polynomial", "expected"), TEXTS, ids=lambda value: str(value))
def test_a_polynomial_in_t_is_written_as_people_do(polynomial, expected):
    assert format_univariate(polynomial) == expected


# Symplectic matrices.


@over_m
@given(seed=seeds)
def test_a_random_symplectic_matrix_is_symplectic(m, seed):
    S, J = random_symplectic(m, random.Random(seed)), standard_structure(2 * m)
    assert S.transpose() * J * S == J


@over_m
@given(seed=seeds)
def test_the_symplectic_inverse_is_the_inverse(m, seed):
    S = random_symplectic(m, random.Random(seed))
    assert S * symplectic_inverse(S) == QQ.identity(2 * m)


def test_the_symplectic_inverse_of_another_matrix_is_not_the_inverse():
    assert 2 * QQ.identity(2) * symplectic_inverse(2 * QQ.identity(2)) != QQ.identity(2)


@pytest.mark.parametrize("seed", range(10))
def test_a_random_symplectic_matrix_is_more_than_a_renaming_of_variables(seed):
    S = random_symplectic(3, random.Random(seed))
    assert max(sum(entry != 0 for entry in row) for row in S.tolist()) > 1


@pytest.mark.parametrize("m", [2, 4, 8])
def test_a_random_symplectic_matrix_has_small_integers(m):
    entries = [entry for seed in range(20) for entry in random_symplectic(m, random.Random(seed)).entries()]
    assert {entry.q for entry in entries} == {1}
    assert max(abs(entry) for entry in entries) <= 100  # measured: at most 40


@given(seed=seeds)
def test_a_symplectic_change_of_variables_keeps_a_matrix_in_the_family(seed):
    A, S = drawn(2, seed), random_symplectic(2, random.Random(seed))
    assert defects(symplectic_inverse(S) * A * S) == []


def test_another_change_of_variables_leads_out_of_the_family():
    change = fmpq_mat([[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert defects(change * diagonal(1, 2) * change.inv())


@pytest.mark.parametrize("make", [random_skew_hamiltonian, random_symplectic])
def test_what_is_drawn_is_determined_by_the_generator(make):
    assert make(3, random.Random(5)) == make(3, random.Random(5))
    assert make(3, random.Random(5)) != make(3, random.Random(6))


def test_the_refusals_of_the_family_are_input_errors():
    assert issubclass(HypothesisError, InputError)
