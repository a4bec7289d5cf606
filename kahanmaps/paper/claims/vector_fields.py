"""Section 4: algebra of the vector fields f_0, ..., f_{m-1} and of their Jacobi matrices."""

from __future__ import annotations

from itertools import pairwise

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Pairs, claim


@claim("(20)-(22)", "f", "f")
def fields_of_the_chain(o: PaperObjects) -> Pairs:
    """The vector fields of the chain are J nabla H_i
    f_i = J nabla H_i = J A^i nabla H_0"""
    for i in range(o.m):
        yield o.value(o.f_i(i), o.x), o.J * (o.A_to(i) * o.grad(o.x))


@claim("(23), (24)", "f vs g", "A J", least_m=2)
def fields_by_powers_of_A(o: PaperObjects) -> Pairs:
    """Each field of the chain is A^T times the preceding one
    f_i = A^T f_{i-1} = (A^T)^i f_0"""
    for i in range(1, o.m):
        yield o.value(o.f_i(i), o.x), o.AT * o.value(o.f_i(i - 1), o.x)
        yield o.value(o.f_i(i), o.x), o.power(o.AT, i) * o.fx


@claim("(25), (26)", "f' vs g'", "A J", least_m=2)
def jacobians_by_powers_of_A(o: PaperObjects) -> Pairs:
    """Each Jacobi matrix of the chain is A^T times the preceding one
    f_i' = A^T f_{i-1}' = (A^T)^i f_0'"""
    for i in range(1, o.m):
        yield o.jac(o.f_i(i), o.x), o.AT * o.jac(o.f_i(i - 1), o.x)
        yield o.jac(o.f_i(i), o.x), o.power(o.AT, i) * o.df


@claim("Lemma 3 (27)", "Ham f'", "f H")
def hamiltonian_jacobians(o: PaperObjects) -> Pairs:
    """The Jacobi matrices of the chain are Hamiltonian
    f_i'^T J = -J f_i'"""
    for i in range(o.m):
        jacobian = o.jac(o.f_i(i), o.x)
        yield jacobian.transpose() * o.J, -(o.J * jacobian)


@claim("Lemma 3 (28)", "Af'", "H A")
def jacobians_commute_with_A(o: PaperObjects) -> Pairs:
    """The Jacobi matrices commute with A^T
    A^T f_i' = f_i' A^T"""
    for i in range(o.m):
        jacobian = o.jac(o.f_i(i), o.x)
        yield o.AT * jacobian, jacobian * o.AT


@claim("Lemma 3, proof", "", "H J")
def jacobians_commute_with_A_step_by_step(o: PaperObjects) -> Pairs:
    """The equalities of the proof of (28) hold
    A^T f' = A^T J nabla^2 H = J A nabla^2 H = J nabla^2 H A^T = f' A^T"""
    for i in range(o.m):
        hessian = o.hess(o.x, i)
        steps = [
            o.AT * o.jac(o.f_i(i), o.x),
            o.AT * o.J * hessian,
            o.J * o.A * hessian,
            o.J * hessian * o.AT,
            o.jac(o.f_i(i), o.x) * o.AT,
        ]
        yield from pairwise(steps)


@claim("Lemma 3 (29)", "vf comm", "H A", least_m=2)
def fields_commute(o: PaperObjects) -> Pairs:
    """The vector fields commute pairwise
    f_i' f_j = f_j' f_i"""
    for i in range(o.m):
        for j in range(i):
            fi, fj = o.f_i(i), o.f_i(j)
            yield o.jac(fi, o.x) * o.value(fj, o.x), o.jac(fj, o.x) * o.value(fi, o.x)


@claim("Lemma 3, proof", "", "H A", least_m=2)
def commutation_step_by_step(o: PaperObjects) -> Pairs:
    """The equalities of the proofs of (29) and (30) hold
    f_0' f_1 = f_0' A^T f_0 = A^T f_0' f_0 = f_1' f_0, f_0' f_1' = f_0' A^T f_0' = A^T f_0' f_0' = f_1' f_0'"""
    f1 = o.f_i(1)
    steps = [o.df * o.value(f1, o.x), o.df * (o.AT * o.fx), o.AT * (o.df * o.fx), o.jac(f1, o.x) * o.fx]
    yield from pairwise(steps)
    steps = [o.df * o.jac(f1, o.x), o.df * o.AT * o.df, o.AT * o.df * o.df, o.jac(f1, o.x) * o.df]
    yield from pairwise(steps)


@claim("Lemma 3 (30)", "f'g'=g'f'", "H A", least_m=2)
def jacobians_commute(o: PaperObjects) -> Pairs:
    """The Jacobi matrices commute pairwise
    f_i' f_j' = f_j' f_i'"""
    for i in range(o.m):
        for j in range(i):
            dfi, dfj = o.jac(o.f_i(i), o.x), o.jac(o.f_i(j), o.x)
            yield dfi * dfj, dfj * dfi
