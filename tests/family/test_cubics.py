"""The cubics of a skew-Hamiltonian A, A (Hess H) = (Hess H) A^T, their chains grad H_i = A grad H_{i-1}, and associated
systems.

Specified here: the dimension is 4m for generic A and the true one otherwise; exactly the H of the space fulfil the
condition, and others are refused with the reason. Source: petrera-suris-2017.
"""

from dataclasses import replace
from itertools import pairwise, product
from math import prod

import pytest
from family.members import over_members
from flint import fmpq_mat, fmpq_poly
from hypothesis import given
from hypothesis import strategies as st
from planar_helpers import diagonal

import kahanmaps as km
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import gradient, linear_combinations, monomials, ring
from kahanmaps.errors import HypothesisError
from kahanmaps.family.cubics import belongs, chain, cubic_space, default_variables, require_member
from kahanmaps.family.random_members import parse_chi, random_member_with_chi
from kahanmaps.family.skew_hamiltonian import chi, diagnosis, evaluate_at_matrix, minimal_degree

DIAGONAL = diagonal([1, 2, 1, 2])
X4 = default_variables(4)


def fulfils_the_condition(A, H) -> bool:
    """A (Hess H) = (Hess H) A^T, with polynomials."""
    n, Hess = A.nrows(), [gradient(component) for component in gradient(H)]
    return all(
        sum((A[i, k] * Hess[k][j] - Hess[i][k] * A[j, k] for k in range(n)), 0 * H) == 0
        for i, j in product(range(n), repeat=2)
    )


@over_members
def test_every_element_of_the_basis_fulfils_the_condition(member):
    assert all(fulfils_the_condition(member.A, H) for H in cubic_space(member.A).basis)


@given(coefficients=st.lists(st.sampled_from([0, 0, 0, 0, 1, -1]), min_size=20, max_size=20))
def test_a_cubic_belongs_exactly_when_it_fulfils_the_condition(coefficients):
    H = ring(X4).from_dict({m: c for m, c in zip(monomials(4, 3), coefficients, strict=True) if c})
    assert belongs(DIAGONAL, H) is fulfils_the_condition(DIAGONAL, H)


def test_a_cubic_outside_is_refused_with_the_entry_and_both_sides():
    # Hess(x1 x2^2) has 2 x2 in entry (1,2): once on the left by A = diag(1,2,1,2), twice on the right
    sentence = r"entry \(1,2\), where the coefficient of x2 is 2 on the left and 4 on the right"
    with pytest.raises(HypothesisError, match=sentence):
        require_member(DIAGONAL, parse_polynomial("x1*x2^2", X4))


@over_members
def test_each_gradient_of_a_chain_is_a_times_the_one_before(member):
    hamiltonians = chain(member.A, member.H)
    for H, following in pairwise(hamiltonians):
        assert gradient(following) == linear_combinations(member.A, gradient(H))


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
    [([(1, 2)], 8), ([(1, 2), (2, 1)], 12), ([(1, 1), (1, 1), (2, 1)], 24), ([(1, 2), (1, 1)], 24), ([(1, 1)] * 3, 56)],
)
def test_the_dimension_is_4m_for_jordan_blocks_and_larger_only_for_a_derogatory_A(jordan, dimension):
    A = blocks(*jordan)
    m, degree = A.nrows() // 2, minimal_degree(A)
    assert cubic_space(A).dimension == dimension
    assert (dimension == 4 * m) is (degree == m)
    assert ("dimension 4m" in diagnosis(A)) is (degree == m)
    assert ("larger than 4m" in diagnosis(A)) is (degree < m)


@over_members
def test_a_sign_matrix_is_the_sign_on_the_part_that_belongs_to_the_factor(member):
    for g in member.associated():
        for factor, sign in zip(member.factors, g.signs, strict=True):
            vanishing = evaluate_at_matrix(factor.polynomial**factor.multiplicity, member.A)
            others = (f.polynomial**f.multiplicity for f in member.factors if f.polynomial != factor.polynomial)
            cofactor = evaluate_at_matrix(prod(others, start=fmpq_poly([1])), member.A)  # its image is the part
            assert vanishing * cofactor == fmpq_mat(member.dim, member.dim)
            assert g.B * cofactor == sign * cofactor


@over_members
def test_there_is_one_rational_associated_system_for_every_choice_of_signs_up_to_all(member):
    systems = [g.system for g in member.associated()]
    assert len(set(systems)) == len(systems) == 2 ** (len(chi(member.A).factor()[1]) - 1)


@pytest.mark.parametrize(
    ("text", "count"),
    [("t^2 - 2", 1), ("t^2 + t + 1", 1), ("t^3 - t - 1", 1), ("(t - 1)*(t^2 - 2)", 2), ("(t - 1)^2", 0)],
)
def test_associated_systems_over_a_number_field_commute_with_the_member_and_others_do_not(text, count):
    member = random_member_with_chi(parse_chi(text), seed=3)
    declared, results = km.SystemFile.from_member(member), list(member.conjugate_associates())
    assert len(results) == count
    for result in results:
        K = result.root.number_field
        powers = [K.convert_matrix(member.A**k) for k in range(member.m)]
        unit = K.identity(member.dim)
        B = sum((P * c for P, c in zip(powers, result.coefficients, strict=True)), unit * 0)
        assert B * B == unit != B
        file = km.SystemFile.from_conjugate(result)
        assert km.parse_system(file.to_toml()) == file
        assert km.check_commute(declared, file).holds
    for result in results[:1]:  # the square of B + 1 is not 1
        wrong = replace(result, coefficients=(result.coefficients[0] + 1, *result.coefficients[1:]))
        assert km.check_commute(declared, km.SystemFile.from_conjugate(wrong)).verdict is km.Certainty.REFUTED
