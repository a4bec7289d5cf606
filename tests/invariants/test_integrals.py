"""Integrals of Kahan maps, as functions of x and eps.

For f = J grad H with any cubic H and any constant skew J, "modified H" is H + (2 eps/3) grad H^T (I - eps f')^{-1}
f. It is conserved, tends to H with a defect of order eps^2, and is -1/6 of the paper's H~ where that is defined.
"""

import numpy as np
import pytest
from check_helpers import exact, hamiltonian_of, hamiltonians, kahan_step, modified_value, rows_of
from flint import fmpq, fmpq_poly
from helpers import fraction, over_exact_fields, points, rationals
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.errors import BadPrime, SingularStep
from kahanmaps.family.random_members import random_member_with_chi
from kahanmaps.invariants.phase_functions import CommutantIntegral, ModifiedHamiltonian, PaperIntegral
from kahanmaps.systems.hamiltonian import standard_structure

nonzero = rationals(6).filter(lambda eps: eps != 0)

PLANE_CUBIC = hamiltonian_of("q p", "q^3/3 - 2*q*p^2 + p^3")


@st.composite
def with_points(draw, dims=(1, 2, 3), homogeneous=False, standard=False):
    hamiltonian = draw(hamiltonians(dims, homogeneous, standard))
    return hamiltonian, draw(points(hamiltonian.dim, rationals(9)))


@given(with_points(), nonzero)
def test_modified_h_is_what_its_formula_says(drawn, eps):
    hamiltonian, x = drawn
    expected = modified_value(hamiltonian, fraction(eps), exact(*x))
    assume(expected is not None)
    assert fraction(ModifiedHamiltonian(hamiltonian).value(QQ, eps, x)) == expected


@given(with_points(dims=(2, 4), homogeneous=True, standard=True), nonzero)
def test_modified_h_is_minus_one_sixth_of_the_papers_integral(drawn, eps):
    hamiltonian, x = drawn
    try:
        modified = ModifiedHamiltonian(hamiltonian).value(QQ, eps, x)
        paper = PaperIntegral(hamiltonian).value(QQ, eps, x)
    except SingularStep:
        assume(False)
    assert modified == paper / -6


@pytest.mark.parametrize("power", [1, 2])
def test_an_integral_of_the_commutant_is_what_its_formula_says(power):
    member, eps = random_member_with_chi(fmpq_poly([1, 1, 0, 1]), seed=3), fmpq(1, 7)
    x = tuple(fmpq(k, 3) for k in (1, -2, 4, 1, 5, -1))
    image = kahan_step(member.chosen.system, fraction(eps), exact(*x))
    assert image is not None
    matrix = rows_of(standard_structure(6))
    for _ in range(power):
        matrix = matrix @ rows_of(member.A).T
    expected = np.dot(exact(*x), matrix @ image) / fraction(eps)
    assert fraction(CommutantIntegral(member.chosen.hamiltonian, member.A, power).value(QQ, eps, x)) == expected


@over_exact_fields
@given(x=points(2, rationals(9)))
def test_over_a_prime_field_every_integral_is_its_rational_value_reduced(field, x):
    eps = fmpq(5, 11)
    for integral in (ModifiedHamiltonian(PLANE_CUBIC), PaperIntegral(PLANE_CUBIC)):
        try:
            value = integral.value(QQ, eps, x)
            reduced = integral.value(field, field.convert(eps), tuple(field.convert(entry) for entry in x))
        except (SingularStep, BadPrime):
            continue
        assert reduced == field.convert(value)
