"""The letters of the paper, computed a second time by an implementation that shares nothing with the library's.

The numbers of a member (A, H, the roots of chi, eps and x) are read from the library's objects; everything else is
computed in independent.py, and the letters are compared one by one. What claims say of the letters, `verify` checks.
"""

import random
from fractions import Fraction

import pytest
from check_helpers import determinant, dot, times, transposed, unit
from flint import fmpq
from helpers import fraction, quick
from paper.independent import Paper, apply, combination, evaluated, gradient, jacobi_matrix, plus, scaled, trace
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
