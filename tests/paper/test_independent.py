"""The letters of the paper and its main statements, confirmed by an implementation that shares nothing with ours.

The numbers of a member (A, H, the roots of chi, eps and x) are read from the library's objects; everything else is
computed a second time in independent.py. Letters are compared one by one, then the statements are put to the test on
the independent numbers alone, next to a neighbour that fails.
"""

import random
from fractions import Fraction
from itertools import combinations

import pytest
from flint import fmpq
from helpers import fraction, quick
from paper.independent import (
    Paper,
    apply,
    combination,
    determinant,
    dot,
    evaluated,
    gradient,
    inverse,
    jacobi_matrix,
    plus,
    scaled,
    times,
    trace,
    transposed,
    unit,
)
from paper.members import member, values

from kahanmaps.algebra.fields import QQ
from kahanmaps.paper import objects_over

NAMES = ["m=2, split", "m=3, split"]


class Case:
    """The library's objects at a rational point, the same numbers as Fractions, and the independent objects."""

    def __init__(self, name):
        found = member(name)
        roots = objects_over.rational_roots(found)
        self.o = objects_over.point_over(found, QQ, roots, fmpq(1, 7), random.Random(name), 3)
        n = found.dim
        self.x = [fraction(entry) for entry in self.o.x.entries()]
        self.y = [fraction(entry) for entry in self.o.vector("y").entries()]
        A = [[fraction(found.A[i, j]) for j in range(n)] for i in range(n)]
        H = {tuple(int(e) for e in monomial): fraction(c) for monomial, c in found.H.terms()}
        self.p = Paper(A, H, [fraction(root) for root in roots], Fraction(1, 7))

    @property
    def each(self):
        return range(self.p.m)


CASES = {name: Case(name) for name in NAMES}
over_cases = pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
m2, m3 = CASES.values()
mostly_over_m2 = pytest.mark.parametrize("case", quick([m2, m3], [m2]), ids=CASES.keys())  # m = 3 takes seconds


def flat(value):
    """Numbers, vectors and matrices as a list of Fractions, row by row."""
    if isinstance(value, list):
        return [entry for part in value for entry in flat(part)]
    return [value]


def exact(side):
    """What the library gives, the same way."""
    return [fraction(entry) for entry in values(side)]


# Letter -> (the library's, the independent one); i runs through the indices of the roots.
LETTERS = {
    "J": (lambda c: c.o.J, lambda c: c.p.J),
    "H": (lambda c: c.o.H(c.o.x), lambda c: evaluated(c.p.H, c.x)),
    "nabla H": (lambda c: c.o.grad(c.o.x), lambda c: c.p.nabla(c.x)),
    "nabla^2 H": (lambda c: c.o.hess(c.o.x), lambda c: c.p.hessian(c.x)),
    "f": (lambda c: c.o.fx, lambda c: c.p.f(c.x)),
    "f'": (lambda c: c.o.df, lambda c: c.p.df(c.x)),
    "f' by differentiation": (lambda c: c.o.df, lambda c: jacobi_matrix(c.p.f, c.x)),
    "f'' y": (lambda c: c.o.second(c.o.f, c.o.vector("y")), lambda c: c.p.df(c.y)),
    "x~": (lambda c: c.o.x_tilde, lambda c: c.p.step(c.x)),
    "x~ with 2 eps": (lambda c: c.o.step(c.o.f, c.o.x, times=2), lambda c: c.p.step(c.x, eps=2 * c.p.eps)),
    "dPhi": (lambda c: c.o.jacobian_of_step(c.o.f, c.o.x), lambda c: jacobi_matrix(c.p.step, c.x)),
    "det(I - eps f')": (
        lambda c: c.o.det(c.o.minus_eps_jac(c.o.f, c.o.x)),
        lambda c: determinant(plus(unit(c.p.n), scaled(-c.p.eps, c.p.df(c.x)))),
    ),
    "H~": (lambda c: c.o.H_tilde(c.o.x), lambda c: c.p.integral(c.x)),
    "nabla H~": (lambda c: c.o.gradient(lambda o, x: o.H_tilde(x), c.o.x), lambda c: gradient(c.p.integral, c.x)),
    "modified H": (lambda c: c.o.modified_H(c.o.x), lambda c: c.p.modified(c.x)),
    "Pi": (lambda c: c.o.Pi(c.o.x), lambda c: c.p.Pi(c.x)),
    "p_0": (lambda c: c.o.p0(c.o.x), lambda c: c.p.p0(c.x)),
    "P_0": (lambda c: c.o.P0(c.o.x), lambda c: c.p.P0(c.x)),
    "nabla p_0": (lambda c: c.o.gradient(lambda o, x: o.p0(x), c.o.x), lambda c: gradient(c.p.p0, c.x)),
    "nabla P_0": (lambda c: c.o.gradient(lambda o, x: o.P0(x), c.o.x), lambda c: gradient(c.p.P0, c.x)),
}
INDEXED_LETTERS = {
    "A^i": (lambda c, i: c.o.A_to(i), lambda c, i: c.p.power(i)),
    "H_i": (lambda c, i: c.o.H(c.o.x, i), lambda c, i: c.p.K(c.p.power(i), c.x)),
    "nabla H_i": (lambda c, i: c.o.grad(c.o.x, i), lambda c, i: c.p.nabla(c.x, c.p.power(i))),
    "f_i": (lambda c, i: c.o.value(c.o.f_(i), c.o.x), lambda c, i: c.p.f(c.x, c.p.power(i))),
    "f_i'": (lambda c, i: c.o.jac(c.o.f_(i), c.o.x), lambda c, i: c.p.df(c.x, c.p.power(i))),
    "E_i": (lambda c, i: c.o.projector(i), lambda c, i: c.p.E(i)),
    "B_i": (lambda c, i: c.o.B(i), lambda c, i: c.p.B(i)),
    "g_i": (lambda c, i: c.o.value(c.o.g_(i), c.o.x), lambda c, i: c.p.f(c.x, c.p.B(i))),
    "K_i": (lambda c, i: c.o.Kf(c.o.B(i), c.o.x), lambda c, i: c.p.K(c.p.B(i), c.x)),
    "x^": (lambda c, i: c.o.step(c.o.g_(i), c.o.x), lambda c, i: c.p.step(c.x, c.p.B(i))),
    "K~_i": (lambda c, i: c.o.integral(c.o.g_(i), c.o.x), lambda c, i: c.p.integral(c.x, c.p.B(i))),
    "H~_i": (
        lambda c, i: c.o.H_tilde_(i, c.o.x),
        lambda c, i: dot(c.x, apply(times(c.p.J, transposed(c.p.power(i))), c.p.step(c.x))) / c.p.eps,
    ),
    "q_i": (lambda c, i: c.o.q(i, c.o.x), lambda c, i: c.p.q(i, c.x)),
    "s_i": (lambda c, i: c.o.s(i, c.o.x), lambda c, i: c.p.s(i, c.x)),
    "Q_i": (lambda c, i: c.o.Q(i, c.o.x), lambda c, i: c.p.Q(i, c.x)),
    "eigenvalue of f'^2": (
        lambda c, i: c.o.eigenvalue_of_square(i, c.o.x),
        lambda c, i: trace(times(transposed(c.p.E(i)), c.p.square(c.x))) / 2,
    ),
}


@mostly_over_m2
@pytest.mark.parametrize("letter", LETTERS)
def test_a_letter_is_what_the_independent_implementation_says(case, letter):
    theirs, ours = LETTERS[letter]
    assert exact(theirs(case)) == flat(ours(case))


@over_cases
@pytest.mark.parametrize("letter", INDEXED_LETTERS)
def test_an_indexed_letter_is_what_the_independent_implementation_says(case, letter):
    theirs, ours = INDEXED_LETTERS[letter]
    assert [exact(theirs(case, i)) for i in case.each] == [flat(ours(case, i)) for i in case.each]


@over_cases
def test_the_coefficients_of_b_give_b(case):
    for i in case.each:
        coefficients = [fraction(c) for c in case.o.lagrange(i)]
        powers = [(c, case.p.power(k)) for k, c in enumerate(coefficients)]
        assert combination(powers) == case.p.B(i)


@over_cases
def test_the_coefficients_of_the_powers_give_the_square_of_the_jacobi_matrix(case):
    terms = [(fraction(case.o.coefficient_of_power(k, case.o.x)), transposed(case.p.power(k))) for k in range(case.p.m)]
    assert combination(terms) == case.p.square(case.x)


@over_cases
def test_h_i_has_the_gradient_a_to_the_i_nabla_h(case):
    for i in case.each:
        assert gradient(lambda x: case.p.K(case.p.power(i), x), case.x) == case.p.nabla(case.x, case.p.power(i))  # noqa: B023


# Theorems on independent numbers


def classes(case):
    """The products of the B_i, up to sign: the matrices of the class."""
    found = [unit(case.p.n)]
    for i in range(case.p.m - 1):
        found += [times(B, case.p.B(i)) for B in found]
    return found


@mostly_over_m2
def test_theorem_9_maps_of_associated_fields_commute(case):
    p, x = case.p, case.x
    for B, C in combinations(classes(case), 2):
        assert p.step(p.step(x, B), C) == p.step(p.step(x, C), B)


@over_cases
def test_maps_of_the_chain_do_not_commute(case):
    p, x = case.p, case.x
    assert p.step(p.step(x), p.A) != p.step(p.step(x, p.A))


@over_cases
def test_maps_with_different_steps_do_not_commute(case):
    p, x, B = case.p, case.x, case.p.B(0)
    assert p.step(p.step(x), B, 2 * p.eps) != p.step(p.step(x, B, 2 * p.eps))


@mostly_over_m2
def test_theorem_11_integrals_are_shared(case):
    p, x = case.p, case.x
    for B in classes(case):
        for C in classes(case):
            assert p.integral(p.step(x, C), B) == p.integral(x, B)


@over_cases
def test_h_itself_is_no_integral_of_the_map(case):
    assert evaluated(case.p.H, case.p.step(case.x)) != evaluated(case.p.H, case.x)


@over_cases
def test_theorem_12_maps_of_the_class_are_poisson(case):
    p, x = case.p, case.x
    for B in classes(case):
        dPhi = jacobi_matrix(lambda z: p.step(z, B), x)  # noqa: B023
        assert times(dPhi, p.Pi(x), transposed(dPhi)) == p.Pi(p.step(x, B))
        assert times(dPhi, p.J, transposed(dPhi)) != p.J


def jacobi_sums(case, tensor):
    """The cyclic sums sum_l T_il d_l T_jk + ... for all triples."""
    x, n = case.x, case.p.n
    T = tensor(x)
    slopes = {(j, k): gradient(lambda z: tensor(z)[j][k], x) for j in range(n) for k in range(n)}  # noqa: B023
    return [
        dot(T[i], slopes[j, k]) + dot(T[j], slopes[k, i]) + dot(T[k], slopes[i, j])
        for i, j, k in combinations(range(n), 3)
    ]


def test_lemma_13_the_tensor_satisfies_the_jacobi_identity():
    assert set(jacobi_sums(m2, m2.p.Pi)) == {0}


def test_a_tensor_of_the_same_shape_need_not_satisfy_the_jacobi_identity():
    p = m2.p
    # J - eps^2 f'^2 J + the second coordinate times a constant skew matrix.
    other = [[Fraction((i == 0 and j == 1) - (i == 1 and j == 0)) for j in range(4)] for i in range(4)]
    assert set(jacobi_sums(m2, lambda x: plus(p.Pi(x), scaled(x[0], other)))) != {0}


@over_cases
def test_theorem_15_gradients_of_the_integrals(case):
    p, x = case.p, case.x
    of_H = gradient(p.integral, x)
    for B in classes(case):
        assert gradient(lambda z: p.integral(z, B), x) == apply(B, of_H)  # noqa: B023
    assert gradient(lambda z: p.integral(z, p.A), x) != apply(p.A, of_H)


@over_cases
def test_lemma_7_the_matrices_b(case):
    p = case.p
    total = combination([(Fraction(1), p.B(i)) for i in case.each])
    assert total == scaled(Fraction(p.m - 2), unit(p.n))
    for i in case.each:
        assert times(p.B(i), p.B(i)) == unit(p.n)
        assert times(transposed(p.B(i)), p.J) == times(p.J, p.B(i))


def right_side_of_lemma_8(case, p0):
    p, x = case.p, case.x
    return combination([(p0, unit(p.n)), *((p.q(i, x), transposed(p.B(i))) for i in case.each)])


@over_cases
def test_lemma_8_the_square_of_the_jacobi_matrix(case):
    assert case.p.square(case.x) == right_side_of_lemma_8(case, case.p.p0(case.x))


def test_p_0_as_printed_for_m_3_is_not_that_of_m_2():
    p0 = trace(m2.p.square(m2.x)) / 8
    assert m2.p.square(m2.x) != right_side_of_lemma_8(m2, p0)
    assert m3.p.square(m3.x) == right_side_of_lemma_8(m3, trace(m3.p.square(m3.x)) / 8)


@mostly_over_m2
def test_lemma_14_gradients_of_the_coefficients(case):
    p, x = case.p, case.x
    left = gradient(p.p0, x)
    for i in case.each:
        of_q = gradient(lambda z: p.q(i, z), x)  # noqa: B023
        assert left == [(4 - p.m) * entry for entry in apply(p.B(i), of_q)]
        assert left != [(4 - p.m) * entry for entry in of_q]


@over_cases
def test_lemma_16_the_inverse_of_the_tensor(case):
    p, x = case.p, case.x
    terms = [(-p.P0(x), p.J), *((-(p.eps**2) * p.Q(i, x), times(p.B(i), p.J)) for i in case.each)]
    assert inverse(p.Pi(x)) == combination(terms)


@mostly_over_m2
def test_lemma_17_gradients_of_p_and_q(case):
    p, x = case.p, case.x
    left = gradient(p.P0, x)
    for i in case.each:
        right = apply(p.B(i), gradient(lambda z: p.Q(i, z), x))  # noqa: B023
        assert left == [(4 - p.m) * p.eps**2 * entry for entry in right]


@over_cases
def test_106_h_tilde_through_h_and_k(case):
    p, x = case.p, case.x
    right = -6 * p.P0(x) * evaluated(p.H, x)
    for i in case.each:
        right = right - 6 * p.eps**2 * p.Q(i, x) * p.K(p.B(i), x)
    assert p.integral(x) == right


def test_107_k_tilde_through_h_and_k_as_printed_for_m_3():
    p, x = m3.p, m3.x
    H, K, Q = evaluated(p.H, x), [p.K(p.B(i), x) for i in range(3)], [p.Q(i, x) for i in range(3)]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        right = -6 * p.P0(x) * K[i] + 6 * p.eps**2 * (-Q[i] * H + Q[j] * K[k] + Q[k] * K[j])
        assert p.integral(x, p.B(i)) == right


@over_cases
def test_109_the_determinant_is_the_product_of_the_s(case):
    p, x = case.p, case.x
    product = Fraction(1)
    for i in case.each:
        product = product * p.s(i, x)
    assert determinant(plus(unit(p.n), scaled(-p.eps, p.df(x)))) == product
    assert determinant(plus(unit(p.n), scaled(-2 * p.eps, p.df(x)))) != product


# Misprints on independent numbers


def linear_system(entry):
    """Both sides of the 4 x 4 system of Lemma 16 with this factor of q_3 in place (2,3)."""
    p, x, e = m3.p, m3.x, m3.p.eps**2
    q1, q2, q3 = (p.q(i, x) for i in range(3))
    d = 1 - e * p.p0(x)
    matrix = [[d, e * q1, e * q2, e * q3], [e * q1, d, entry * q3, e * q2], [e * q2, e * q3, d, e * q1]]
    matrix.append([e * q3, e * q2, e * q1, d])
    unknown = [-p.P0(x), *(e * p.Q(i, x) for i in range(3))]
    return apply(matrix, unknown), [-1, 0, 0, 0]


def test_the_linear_system_of_lemma_16_has_eps_squared_where_eps_cubed_is_printed():
    left, right = linear_system(m3.p.eps**2)
    assert left == right
    left, right = linear_system(m3.p.eps**3)
    assert left != right


@over_cases
def test_the_last_display_of_theorem_12_has_eps_squared_where_eps_is_printed(case):
    p, x = case.p, case.x
    after = p.step(x)

    def sides(factor):
        left = plus(unit(p.n), scaled(-factor, p.square(after)))
        right = plus(unit(p.n), scaled(-factor, p.square(x)))
        return times(left, p.Pi(x), p.J), times(p.Pi(after), p.J, right)

    left, right = sides(p.eps**2)
    assert left == right
    left, right = sides(p.eps)
    assert left != right


def test_the_brackets_are_those_of_x_i_and_x_m_plus_i():
    assert [m3.p.J[i][i + 3] for i in range(3)] == [1, 1, 1]
    assert [m3.p.J[0][2], m3.p.J[1][3]] == [0, 0]  # as printed
