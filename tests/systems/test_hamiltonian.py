"""Hamiltonian systems f = J grad H with a cubic H and a constant skew J.

Specified here: the standard J, the canonical equations, what follows from J being skew (H is an integral of the flow,
f' lies in the symplectic Lie algebra, the divergence vanishes), singular J, and the refusals.
"""

from __future__ import annotations

import pytest
from flint import fmpq, fmpq_mat
from helpers import HENON_HEILES, rationals
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import gradient, linear_combinations, monomials, ring
from kahanmaps.algebra.written.text import parse_polynomial
from kahanmaps.errors import InputError
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

PLANE = ring(["q", "p"])
q, p = PLANE.gens()
FOUR = ("q1", "q2", "p1", "p2")


def cubics(names, degrees=(1, 2, 3)):
    """Polynomials of degree up to 3 with all coefficients drawn."""
    exponents = [m for degree in degrees for m in monomials(len(names), degree)]
    drawn = st.lists(rationals(6), min_size=len(exponents), max_size=len(exponents))
    return drawn.map(lambda c: ring(names).from_dict({m: a for m, a in zip(exponents, c, strict=True) if a != 0}))


def dot(left, right):
    """The sum of the products of two rows of polynomials."""
    total = left[0] * 0
    for a, b in zip(left, right, strict=True):
        total = total + a * b
    return total


# The point about which a cubic is homogeneous.


@given(cubics(FOUR, (3,)), st.lists(rationals(6), min_size=4, max_size=4))
def test_a_homogeneous_cubic_is_found_about_the_point_it_was_moved_to(H, point):
    moved = CubicHamiltonian(H, standard_structure(4)).about([-c for c in point])
    back = moved.about(moved.centre)  # not that point itself, where H does not depend on all variables
    assert back.is_homogeneous
    assert back.H == H


@pytest.mark.parametrize("H", [q**3 / 3 + p**2 / 2, q**3 + p**3 + q, (q + p - 3) ** 3 + p, q**2 + p**2 + p])
def test_other_cubics_have_no_centre(H):
    assert CubicHamiltonian(H, standard_structure(2)).centre is None


@pytest.mark.parametrize(("H", "centre"), [(q**3 + p**3, (0, 0)), ((q - 1) ** 3, (1, 0)), (q * 0 + 5, (0, 0))])
def test_the_centre_is_the_origin_where_it_can_be(H, centre):
    assert CubicHamiltonian(H, standard_structure(2)).centre == centre


# The standard structure.


def test_the_standard_structure_pairs_each_variable_with_the_one_m_later():
    assert standard_structure(4) == fmpq_mat([[0, 0, 1, 0], [0, 0, 0, 1], [-1, 0, 0, 0], [0, -1, 0, 0]])


@pytest.mark.parametrize("dim", [2, 4, 6, 10])
def test_the_square_of_the_standard_structure_is_minus_one(dim):
    J = standard_structure(dim)
    assert J * J == -QQ.identity(dim)


@pytest.mark.parametrize("dim", [0, 1, 3, -2])
def test_there_is_no_standard_structure_in_odd_or_no_dimension(dim):
    with pytest.raises(InputError, match=f"even dimension, found {dim}"):
        standard_structure(dim)


# The equations.


@given(H=cubics(FOUR))
def test_with_the_standard_structure_the_equations_are_the_canonical_ones(H):
    f = CubicHamiltonian(H, standard_structure(4)).system.rhs
    dq1, dq2, dp1, dp2 = gradient(H)
    assert f == (dp1, dp2, -dq1, -dq2)


def test_henon_heiles_is_the_system_of_its_energy():
    H = parse_polynomial("(p1^2 + p2^2 + q1^2 + q2^2)/2 + q1^2*q2 - q2^3/3", FOUR)
    assert CubicHamiltonian(H, standard_structure(4)).system == HENON_HEILES


@given(H=cubics(("x", "y", "z")), entries=st.tuples(rationals(), rationals(), rationals()))
def test_the_energy_is_an_integral_of_the_flow_for_every_constant_skew_matrix(H, entries):
    a, b, c = entries
    J = fmpq_mat(3, 3, [fmpq(0), a, b, -a, fmpq(0), c, -b, -c, fmpq(0)])  # odd, hence singular
    assert dot(gradient(H), CubicHamiltonian(H, J).system.rhs) == 0


def test_for_a_matrix_that_is_not_skew_the_energy_is_no_integral():
    f = linear_combinations(fmpq_mat([[0, 1], [-2, 0]]), gradient(q**3 + p**3))
    assert dot(gradient(q**3 + p**3), f) != 0


@given(H=cubics(FOUR, (3,)), point=st.tuples(*[rationals()] * 4))
def test_the_jacobi_matrix_lies_in_the_symplectic_lie_algebra(H, point):
    J = standard_structure(4)
    derivative = CubicHamiltonian(H, J).system.over(QQ).jacobian(point)
    assert derivative.transpose() * J + J * derivative == fmpq_mat(4, 4)


@given(H=cubics(FOUR))
def test_a_hamiltonian_system_is_divergence_free(H):
    assert CubicHamiltonian(H, standard_structure(4)).system.divergence.is_zero()


@given(H=cubics(("q", "p")))
def test_the_gradient_is_the_column_of_partial_derivatives(H):
    assert CubicHamiltonian(H, standard_structure(2)).gradient == (H.derivative(0), H.derivative(1))


def test_linear_combinations_are_rows_times_the_column():
    assert linear_combinations(fmpq_mat([[1, 2], [0, 0], [0, -1]]), (q, p)) == (q + 2 * p, 0 * q, -p)


# Properties and equality.


@pytest.mark.parametrize(("H", "expected"), [(q**3 - q * p**2, True), (q**3 + p**2, False), (0 * q, True)], ids=str)
def test_an_energy_is_homogeneous_when_every_term_has_degree_three(H, expected):
    assert CubicHamiltonian(H, standard_structure(2)).is_homogeneous is expected


def test_a_structure_is_standard_only_if_it_is_the_one_of_its_dimension():
    standard, other = standard_structure(2), 2 * standard_structure(2)
    assert [CubicHamiltonian(q**3, J).is_standard for J in (standard, other)] == [True, False]


def test_in_odd_dimension_no_structure_is_standard():
    assert not CubicHamiltonian(ring(["x"]).gens()[0] ** 3, fmpq_mat(1, 1)).is_standard


def test_dimension_and_variables_are_those_of_the_ring():
    hamiltonian = CubicHamiltonian(q**3, standard_structure(2))
    assert (hamiltonian.dim, hamiltonian.variables) == (2, ("q", "p"))


def test_equal_hamiltonians_hash_alike():
    one, two = (CubicHamiltonian(q**3 + p, standard_structure(2)) for _ in range(2))
    assert (one, hash(one)) == (two, hash(two))


OTHERS = [
    CubicHamiltonian(q**3 + 1, standard_structure(2)),
    CubicHamiltonian(q**3, 2 * standard_structure(2)),
    CubicHamiltonian(ring(["q", "r"]).gens()[0] ** 3, standard_structure(2)),
    q**3,
]


@pytest.mark.parametrize("other", OTHERS, ids=["energy", "structure", "names", "kind"])
def test_hamiltonians_that_differ_are_different(other):
    assert CubicHamiltonian(q**3, standard_structure(2)) != other


# What is refused.


def test_an_energy_of_degree_four_is_refused():
    with pytest.raises(InputError, match="H has degree 4, expected at most 3"):
        CubicHamiltonian(q**3 * p, standard_structure(2))


@pytest.mark.parametrize("J", [standard_structure(4), fmpq_mat(2, 3), fmpq_mat(1, 2)], ids=["4x4", "2x3", "1x2"])
def test_a_structure_of_another_size_is_refused(J):
    with pytest.raises(InputError, match=r"expected 2 x 2 for 2 variables"):
        CubicHamiltonian(q**3, J)


def test_a_structure_that_is_not_skew_is_refused_by_the_entry():
    with pytest.raises(InputError, match=r"entry \(1,2\) is 1, entry \(2,1\) is 1, expected opposite"):
        CubicHamiltonian(q**3, fmpq_mat([[0, 1], [1, 0]]))


def test_a_structure_with_a_diagonal_is_not_skew():
    with pytest.raises(InputError, match="not skew"):
        CubicHamiltonian(q**3, fmpq_mat([[1, 0], [0, 0]]))
