"""Hamiltonian systems f = J grad H with a cubic H and a constant skew J.

Specified here: the canonical equations for the standard J, the point about which H is homogeneous, and the refusals.
"""

import pytest
from flint import fmpq_mat
from helpers import rationals
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.polynomials import gradient, monomials, ring
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


@given(H=cubics(FOUR))
def test_with_the_standard_structure_the_equations_are_the_canonical_ones(H):
    f = CubicHamiltonian(H, standard_structure(4)).system.rhs
    dq1, dq2, dp1, dp2 = gradient(H)
    assert f == (dp1, dp2, -dq1, -dq2)


@pytest.mark.parametrize(
    ("H", "J", "words"),
    [
        (q**3 * p, standard_structure(2), "H has degree 4, expected at most 3"),
        (q**3, standard_structure(4), "expected 2 x 2 for 2 variables"),
        (q**3, fmpq_mat(2, 3), "expected 2 x 2 for 2 variables"),
        (q**3, fmpq_mat([[0, 1], [1, 0]]), r"entry \(1,2\) is 1, entry \(2,1\) is 1, expected opposite"),
    ],
)
def test_what_is_no_cubic_or_no_skew_structure_is_refused(H, J, words):
    with pytest.raises(InputError, match=words):
        CubicHamiltonian(H, J)
