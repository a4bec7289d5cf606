"""The cubics of a skew-Hamiltonian A, A (Hess H) = (Hess H) A^T, and their chains grad H_i = A grad H_{i-1}.

Specified here: the dimension is 4m for generic A and the true one otherwise; every H of the space, and no other, starts
a chain; the members of a chain are in involution and generically independent. Source: petrera-suris-2017.
"""

from __future__ import annotations

import random
from itertools import pairwise
from math import comb

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly
from helpers import matrices, rationals
from hypothesis import given, settings
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import gradient, linear_combinations, monomials, ring
from kahanmaps.algebra.written.text import parse_polynomial
from kahanmaps.errors import HypothesisError
from kahanmaps.family.cubics import (
    belongs,
    chain,
    cubic_space,
    default_variables,
    potential,
    require_member,
    third_derivatives,
)
from kahanmaps.family.draw import draw_generic, draw_with_chi, draw_with_eigenvalues
from kahanmaps.family.skew_hamiltonian import diagnosis, is_generic, minimal_degree, random_skew_hamiltonian

t = fmpq_poly([0, 1])
DIAGONAL = fmpq_mat([[1, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]])
X4 = default_variables(4)
x1, x2, x3, x4 = ring(X4).gens()

MEMBERS = {
    "m = 1": draw_generic(1, 1),
    "m = 2, split": draw_with_eigenvalues([1, -2], 1),
    "m = 2, irreducible": draw_with_chi(t**2 - 2, 1),
    "m = 3, partly split": draw_with_chi((t - 1) * (t**2 + 1), 1),
    "m = 4, split": draw_with_eigenvalues([-1, 0, 2, "1/2"], 1),
    "m = 3, a root twice": draw_with_eigenvalues([1, 1, 2], 1),
    "m = 2, not diagonalisable": draw_with_chi((t - 1) ** 2, 1),
}
over_members = pytest.mark.parametrize("member", MEMBERS.values(), ids=MEMBERS.keys())


def hessian(H):
    return [gradient(component) for component in gradient(H)]


def fulfils_the_condition(A, H) -> bool:
    """A (Hess H) = (Hess H) A^T, with polynomials."""
    n, Hess = A.nrows(), hessian(H)
    return all(
        sum((A[i, k] * Hess[k][j] - Hess[i][k] * A[j, k] for k in range(n)), 0 * H) == 0
        for i in range(n)
        for j in range(n)
    )


def generic(m: int, seed: int) -> fmpq_mat:
    """The first generic matrix from a seed on."""
    rng = random.Random(seed)
    while not is_generic(A := random_skew_hamiltonian(m, rng)):
        pass
    return A


# The space.


# A diagonalisable A is a scalar on the 2k variables of a root of multiplicity k: all their cubics belong, C(2k+2, 3).
REPEATED = [
    ([1, 1], 20),
    ([1, 1, 2], 20 + 4),
    ([1, 1, 2, 2], 20 + 20),
    ([3, 3, 3], 56),
    ([1, 1, 2, 3], 20 + 4 + 4),
]


@pytest.mark.parametrize(("eigenvalues", "dimension"), REPEATED, ids=str)
def test_a_repeated_root_of_a_diagonalisable_matrix_enlarges_the_space(eigenvalues, dimension):
    space = cubic_space(draw_with_eigenvalues(eigenvalues, 1).A)
    assert (space.dimension, space.expected) == (dimension, 4 * len(eigenvalues))


# There R^{2m} is a free module of rank 2 over K = Q[t]/chi, cubics are cubic forms in two variables over K: 4 dim K.
@pytest.mark.parametrize("chi", [(t - 1) ** 2, (t + 2) ** 3, (t - 1) ** 2 * (t - 3), (t**2 - 2) ** 2], ids=str)
def test_a_repeated_root_of_a_matrix_with_minimal_polynomial_chi_leaves_the_dimension_4m(chi):
    assert cubic_space(draw_with_chi(chi, 1).A).dimension == 4 * chi.degree()


@over_members
def test_every_element_of_the_basis_fulfils_the_condition(member):
    assert all(fulfils_the_condition(member.A, H) for H in cubic_space(member.A).basis)


@pytest.mark.parametrize("A", [DIAGONAL, draw_with_chi(t**2 - 2, 1).A, draw_with_eigenvalues([1, 1], 1).A], ids=str)
def test_the_rank_is_that_of_the_equations_written_with_polynomials(A):
    columns = []
    for exponents in monomials(4, 3):
        H = ring(X4).from_dict({exponents: 1})
        Hess, row = hessian(H), []
        for i in range(4):
            for j in range(4):
                entry = sum((A[i, k] * Hess[k][j] - Hess[i][k] * A[j, k] for k in range(4)), 0 * H)
                row += [entry.derivative(l)(*[fmpq(0)] * 4) for l in range(4)]  # entries are linear forms
        columns.append(row)
    assert cubic_space(A).rank == fmpq_mat(columns).rank()


def test_the_space_of_a_diagonal_matrix_is_the_sum_of_the_planar_cubics():
    planar = [x1**3, x1**2 * x3, x1 * x3**2, x3**3, x2**3, x2**2 * x4, x2 * x4**2, x4**3]
    assert sorted(map(str, cubic_space(DIAGONAL).basis)) == sorted(map(str, planar))


@over_members
def test_the_basis_has_coprime_integer_coefficients(member):
    for H in cubic_space(member.A).basis:
        coefficients = H.coeffs()
        content = coefficients[0].p
        for coefficient in coefficients:
            content = content.gcd(coefficient.p)
        assert (content, {coefficient.q for coefficient in coefficients}) == (1, {1})


def test_the_space_speaks_of_the_variables_it_is_given():
    assert str(cubic_space(fmpq_mat([[1, 0], [0, 1]]), ("q", "p")).basis[0].context().gens()) == "(q, p)"


def test_a_matrix_outside_the_family_has_no_space():
    with pytest.raises(HypothesisError, match="A is not skew-Hamiltonian"):
        cubic_space(fmpq_mat([[1, 2], [0, 1]]))


# Membership.


@given(coefficients=st.lists(rationals(), min_size=8, max_size=8))
def test_every_combination_of_the_basis_belongs_to_the_space(coefficients):
    A = MEMBERS["m = 2, irreducible"].A
    H = sum((c * b for c, b in zip(coefficients, cubic_space(A).basis, strict=True)), 0 * x1)
    assert belongs(A, H)


@given(coefficients=st.lists(st.sampled_from([0, 0, 0, 0, 1, -1]), min_size=20, max_size=20))
def test_a_cubic_belongs_exactly_when_it_fulfils_the_condition(coefficients):
    H = ring(X4).from_dict({m: c for m, c in zip(monomials(4, 3), coefficients, strict=True) if c})
    assert belongs(DIAGONAL, H) is fulfils_the_condition(DIAGONAL, H)


@given(coefficients=st.lists(st.sampled_from([0, 0, 0, 0, 1, -1]), min_size=20, max_size=20))
def test_a_times_the_gradient_is_a_gradient_exactly_when_the_cubic_belongs(coefficients):
    A = MEMBERS["m = 2, split"].A
    inside = cubic_space(A).basis
    H = sum((c * b for c, b in zip(coefficients, inside, strict=False)), 0 * x1)
    H += (coefficients[-1]) * x1 * x2 * x3
    try:
        potential(linear_combinations(A, gradient(H)))
        solvable = True
    except HypothesisError:
        solvable = False
    assert solvable is belongs(A, H)


@pytest.mark.parametrize("H", [x1**2, x1**3 + x2, x1**3 + 1], ids=str)
def test_a_polynomial_that_is_no_homogeneous_cubic_does_not_belong(H):
    assert not belongs(fmpq_mat(4, 4), H)  # although A = 0 asks for nothing


def test_a_cubic_outside_is_refused_with_the_entry_and_both_sides():
    # Hess(x1 x2^2) has 2 x2 in entry (1,2): once on the left by A = diag(1,2,1,2), twice on the right
    sentence = r"entry \(1,2\), where the coefficient of x2 is 2 on the left and 4 on the right"
    with pytest.raises(HypothesisError, match=sentence):
        require_member(DIAGONAL, x1 * x2**2)


@pytest.mark.parametrize(
    ("H", "term"), [(x1**3 + x2**2, "x2^2 of degree 2"), (x1**3 - 5 * x3, "x3 of degree 1")], ids=str
)
def test_a_polynomial_that_is_no_homogeneous_cubic_is_refused_by_its_term(H, term):
    with pytest.raises(HypothesisError, match=f"H has the term {term.replace('^', '.')}"):
        require_member(DIAGONAL, H)


def test_a_cubic_in_another_number_of_variables_is_refused():
    H = parse_polynomial("q^3", ["q", "p"])
    with pytest.raises(HypothesisError, match="A is 4 x 4 and H has 2 variables"):
        require_member(DIAGONAL, H)


# Chains.


@over_members
def test_each_gradient_of_a_chain_is_a_times_the_one_before(member):
    hamiltonians = chain(member.A, member.H)
    for H, following in pairwise(hamiltonians):
        assert gradient(following) == linear_combinations(member.A, gradient(H))


@over_members
def test_a_chain_stays_in_the_space(member):
    assert all(belongs(member.A, H) for H in chain(member.A, member.H))


@over_members
def test_a_chain_has_m_members_and_begins_with_h(member):
    assert (len(chain(member.A, member.H)), chain(member.A, member.H)[0]) == (member.m, member.H)


def test_a_chain_can_be_asked_for_longer_and_then_obeys_chi():
    # chi(A) = 0, so H_2 = 2 H_0 for chi = t^2 - 2
    member = MEMBERS["m = 2, irreducible"]
    H0, _, H2 = chain(member.A, member.H, 3)
    assert H2 == 2 * H0


def test_the_chain_of_a_sum_of_planar_cubics_multiplies_each_by_its_root():
    assert chain(DIAGONAL, x1**3 + x2**2 * x4) == (x1**3 + x2**2 * x4, x1**3 + 2 * x2**2 * x4)


def test_a_cubic_outside_starts_no_chain():
    with pytest.raises(HypothesisError, match="H is not in the space of A"):
        chain(DIAGONAL, x1 * x2 * x3)


# Potentials and third derivatives.


@given(coefficients=st.lists(rationals(), min_size=20, max_size=20))
def test_the_potential_of_a_gradient_is_the_cubic(coefficients):
    H = ring(X4).from_dict({m: c for m, c in zip(monomials(4, 3), coefficients, strict=True) if c != 0})
    assert potential(gradient(H)) == H


def test_quadratic_forms_that_are_no_gradient_have_no_potential():
    with pytest.raises(HypothesisError, match="not the gradient"):
        potential((x2**2, 0 * x1, 0 * x1, 0 * x1))


@settings(max_examples=25)
@given(coefficients=st.lists(rationals(), min_size=20, max_size=20))
def test_third_derivatives_are_the_gradient_taken_three_times(coefficients):
    H = ring(X4).from_dict({m: c for m, c in zip(monomials(4, 3), coefficients, strict=True) if c != 0})
    zero = [fmpq(0)] * 4
    expected = [
        fmpq_mat(4, 4, [H.derivative(l).derivative(i).derivative(j)(*zero) for i in range(4) for j in range(4)])
        for l in range(4)
    ]
    assert third_derivatives(H) == expected


def test_there_are_as_many_unknowns_as_cubic_monomials():
    assert [cubic_space(generic(m, 0)).unknowns for m in (1, 2, 3)] == [comb(2 * m + 2, 3) for m in (1, 2, 3)]


@given(change=matrices(2, 2, st.integers(-3, 3)).filter(lambda A: A != A[0, 0] * QQ.identity(2)))
def test_for_m_equal_to_one_only_multiples_of_the_identity_are_in_the_family(change):
    with pytest.raises(HypothesisError):
        cubic_space(change)


def blocks(*jordan: tuple[int, int]) -> fmpq_mat:
    """A = diag(W, W^T), W with Jordan blocks (root, size)."""
    m = sum(size for _, size in jordan)
    A, at = fmpq_mat(2 * m, 2 * m), 0
    for root, size in jordan:
        for i in range(at, at + size):
            A[i, i] = A[m + i, m + i] = root
            if i + 1 < at + size:
                A[i, i + 1] = A[m + i + 1, m + i] = 1
        at += size
    return A


@pytest.mark.parametrize(
    ("jordan", "dimension"),
    [
        ([(1, 2)], 8),
        ([(1, 3)], 12),
        ([(1, 2), (2, 1)], 12),
        ([(1, 2), (2, 2)], 16),
        ([(1, 1), (1, 1)], 20),
        ([(1, 1), (1, 1), (2, 1)], 24),
        ([(1, 2), (1, 1)], 24),
        ([(1, 1)] * 3, 56),
    ],
)
def test_the_dimension_is_4m_for_jordan_blocks_and_larger_only_for_a_derogatory_A(jordan, dimension):
    A = blocks(*jordan)
    m, degree = A.nrows() // 2, minimal_degree(A)
    assert cubic_space(A).dimension == dimension
    assert (dimension == 4 * m) is (degree == m)
    assert ("dimension 4m" in diagnosis(A)) is (degree == m)
    assert ("larger than 4m" in diagnosis(A)) is (degree < m)
