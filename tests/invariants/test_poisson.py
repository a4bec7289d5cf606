"""The tensor Pi(x) = J - eps^2 f'(x)^2 J: its formula, its transformation under the Kahan map, its Jacobi identity.

For generic members of the commuting family, and in dimension 2 for every H, it is a Poisson tensor that the map
preserves; for other Hamiltonian systems it is neither. The Jacobi defects are computed a second time by differentiating
polynomials, the transformation law by dPhi from dual numbers.
"""

from itertools import combinations

from check_helpers import exact, hamiltonian_of, hamiltonians, kahan_jacobian, kahan_step, rows_of, slope, tensor, unit
from flint import fmpq, fmpq_mat
from helpers import fraction, points, random_point, rationals
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.errors import SingularStep
from kahanmaps.invariants.poisson import HamiltonianTensor, jacobi_defects, poisson_tensor, transformation_sides
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import CubicHamiltonian

nonzero = rationals(6).filter(lambda eps: eps != 0)


@st.composite
def hamiltonian_with_point(draw, dims=(1, 2, 3)):
    hamiltonian = draw(hamiltonians(dims))
    return hamiltonian, draw(points(hamiltonian.dim, rationals(9)))


@given(hamiltonian_with_point(), nonzero)
def test_the_tensor_is_j_minus_eps_squared_jacobian_squared_j(drawn, eps):
    hamiltonian, x = drawn
    expected = tensor(hamiltonian, fraction(eps), exact(*x))
    assert (rows_of(poisson_tensor(hamiltonian, QQ, eps, x)) == expected).all()


def sides(hamiltonian: CubicHamiltonian, eps: fmpq, x: tuple[fmpq, ...]) -> tuple[fmpq_mat, fmpq_mat]:
    """Both sides of the law at x and its image."""
    kahan = KahanMap(hamiltonian.system, eps)
    return transformation_sides(kahan, HamiltonianTensor(hamiltonian), x, kahan.step(x))


@given(hamiltonian_with_point(dims=(2, 3)), nonzero)
def test_the_two_sides_are_the_law_for_dphi_multiplied_out(drawn, eps):
    # With D = I - eps f'(x): left - right = D (dPhi Pi(x) dPhi^T - Pi(x~)) D^T.
    hamiltonian, x = drawn
    try:
        both = sides(hamiltonian, eps, x)
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
        total = zero + hamiltonian.J[i, j]
        for a in range(n):
            for b in range(n):
                total = total - eps**2 * hamiltonian.J[b, j] * slopes[i][a] * slopes[a][b]
        return total

    Pi = [[entry(i, j) for j in range(n)] for i in range(n)]
    values = []
    for triple in combinations(range(n), 3):
        total = zero
        for turn in range(3):
            i, j, k = triple[turn:] + triple[:turn]
            for l in range(n):
                total = total + Pi[i][l] * Pi[j][k].derivative(l)
        values.append(evaluate(total, QQ, x))
    return values


def test_the_defects_are_those_found_by_differentiation_for_another_j():
    J = [[0, 1, "1/2", -1], [-1, 0, 3, 0], ["-1/2", -3, 0, 2], [1, 0, -2, 0]]
    hamiltonian, x = hamiltonian_of("x y z w", "x^3 + y^2*w - x*z*w + z^2 - 3*y", J), random_point(4, 2)
    assert jacobi_defects(HamiltonianTensor(hamiltonian), QQ, fmpq(2, 3), x) == defects_by_differentiation(
        hamiltonian, fmpq(2, 3), x
    )
