"""Invariant measures dx/phi: phi(x~) = phi(x) det dPhi(x), with phi = det(I - eps f') for Hamiltonian systems.

det dPhi is computed a second time here, from dual numbers: the Kahan step is taken at x + t e_j with t^2 = 0.
"""

import pytest
from check_helpers import claim, determinant, exact, kahan_jacobian
from helpers import fraction, rationals, systems_with_points
from hypothesis import assume, given

from kahanmaps.errors import SingularStep
from kahanmaps.invariants.phase_functions import jacobian_determinant_sides, where
from kahanmaps.maps.kahan import KahanMap

nonzero = rationals(6).filter(lambda eps: eps != 0)


@given(systems_with_points(), nonzero)
def test_the_two_determinants_are_numerator_and_denominator_of_det_dphi(drawn, eps):
    system, x = drawn
    kahan = KahanMap(system, eps)
    try:
        above, below = jacobian_determinant_sides(kahan, x, kahan.step(x))
    except SingularStep:
        assume(False)
    jacobian = kahan_jacobian(system, fraction(eps), exact(*x))
    assert jacobian is not None
    assert determinant(jacobian) == fraction(above) / fraction(below)


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (["(a - 1)*(a - 2)*x + (a - 1)*y"], "where a - 1 is not 0"),  # both vanish at a = 1 alone
        (["(a - 1)*x + (a - 2)*y"], ""),  # nowhere both
        (["(a - 1)*x + b*y"], "where a - 1, b are not all 0"),
        (["a*x", "2*a*y"], "where a is not 0"),
        (["eps^2*a*x - 3*eps*a*y"], "where a is not 0"),  # eps is not 0
    ],
)
def test_a_condition_names_the_common_zeros_of_the_coefficients(texts, expected):
    assert where(2, *(claim(text, "x y a b").numerator for text in texts)) == expected
