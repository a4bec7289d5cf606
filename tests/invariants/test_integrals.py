"""Integrals, densities and Poisson tensors of Kahan maps, as functions of x and eps.

For f = J grad H with any cubic H and any constant skew J, "modified H" is H + (2 eps/3) grad H^T (I - eps f')^{-1}
f. It is conserved, tends to H with a defect of order eps^2, and is -1/6 of the paper's H~ where that is defined.
"""

from itertools import combinations, product

import numpy as np
import pytest
from check_helpers import (
    claim,
    determinant,
    exact,
    hamiltonian_of,
    hamiltonians,
    kahan_jacobian,
    kahan_step,
    modified_value,
    rows_of,
    slope,
    tensor,
    unit,
)
from flint import fmpq, fmpq_poly
from helpers import fraction, over_exact_fields, points, random_point, rationals, systems_with_points
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps import QQ, CubicHamiltonian, KahanMap, random_member_with_chi, standard_structure
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.errors import BadPrime, SingularStep
from kahanmaps.invariants.integrals_and_densities import (
    CommutantIntegral,
    ModifiedHamiltonian,
    PaperIntegral,
    jacobian_determinant_fraction,
    where,
)
from kahanmaps.invariants.poisson import HamiltonianTensor, jacobi_defects, poisson_tensor, transformation_sides

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


@given(systems_with_points(), nonzero)
def test_the_two_determinants_are_numerator_and_denominator_of_det_dphi(drawn, eps):
    system, x = drawn
    kahan = KahanMap(system, eps)
    try:
        above, below = jacobian_determinant_fraction(kahan, x, kahan.step(x))
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


@given(with_points(), nonzero)
def test_the_tensor_is_j_minus_eps_squared_jacobian_squared_j(drawn, eps):
    hamiltonian, x = drawn
    expected = tensor(hamiltonian, fraction(eps), exact(*x))
    assert (rows_of(poisson_tensor(hamiltonian, QQ, eps, x)) == expected).all()


@given(with_points(dims=(2, 3)), nonzero)
def test_the_two_sides_are_the_law_for_dphi_multiplied_out(drawn, eps):
    # With D = I - eps f'(x): left - right = D (dPhi Pi(x) dPhi^T - Pi(x~)) D^T.
    hamiltonian, x = drawn
    kahan = KahanMap(hamiltonian.system, eps)
    try:
        both = transformation_sides(kahan, HamiltonianTensor(hamiltonian), x, kahan.step(x))
    except SingularStep:
        assume(False)
    assume(both is not None)  # where the tensor is 0 at both points, 0 = 0 says nothing
    left, right = both
    step, here = fraction(eps), exact(*x)
    jacobian, image = kahan_jacobian(hamiltonian.system, step, here), kahan_step(hamiltonian.system, step, here)
    D = unit(hamiltonian.dim) - step * slope(hamiltonian.system, here)
    moved = jacobian @ tensor(hamiltonian, step, here) @ jacobian.T
    assert (rows_of(left) == D @ moved @ D.T).all()
    assert (rows_of(right) == D @ tensor(hamiltonian, step, image) @ D.T).all()


def defects_by_differentiation(hamiltonian: CubicHamiltonian, eps: fmpq, x: tuple[fmpq, ...]) -> list[fmpq]:
    """sum_l Pi_il d_l Pi_jk + cyclic for i < j < k, Pi written out as polynomials."""
    n = hamiltonian.dim
    slopes = [[component.derivative(j) for j in range(n)] for component in hamiltonian.system.rhs]
    zero = hamiltonian.H.context().constant(0)

    def entry(i, j):
        pairs = product(range(n), repeat=2)
        square = sum((hamiltonian.J[b, j] * slopes[i][a] * slopes[a][b] for a, b in pairs), zero)
        return hamiltonian.J[i, j] - eps**2 * square

    Pi = [[entry(i, j) for j in range(n)] for i in range(n)]
    values = []
    for triple in combinations(range(n), 3):
        total = zero
        for turn in range(3):
            i, j, k = triple[turn:] + triple[:turn]
            total = sum((Pi[i][l] * Pi[j][k].derivative(l) for l in range(n)), total)
        values.append(evaluate(total, QQ, x))
    return values


def test_the_defects_are_those_found_by_differentiation_for_another_j():
    J = [[0, 1, "1/2", -1], [-1, 0, 3, 0], ["-1/2", -3, 0, 2], [1, 0, -2, 0]]
    hamiltonian, x = hamiltonian_of("x y z w", "x^3 + y^2*w - x*z*w + z^2 - 3*y", J), random_point(4, 2)
    expected = defects_by_differentiation(hamiltonian, fmpq(2, 3), x)
    assert jacobi_defects(HamiltonianTensor(hamiltonian), QQ, fmpq(2, 3), x) == expected
