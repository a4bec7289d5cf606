"""Negative controls: input that breaks exactly one hypothesis. On it the claims that need the hypothesis must fail.

A control takes the paper's objects and returns broken ones; what it changes is random. A claim names the controls that
refute it. A claim that no control can refute would not be a check.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.systems.quadratic import SystemOver


@dataclass(frozen=True)
class Control:
    """One way to break a hypothesis: its name, what is broken, and how."""

    name: str
    breaks: str
    function: Callable[[PaperObjects], PaperObjects]
    least_m: int


CONTROLS: dict[str, Control] = {}


def control(
    name: str, breaks: str, least_m: int = 1
) -> Callable[[Callable[[PaperObjects], PaperObjects]], Callable[[PaperObjects], PaperObjects]]:
    """Register a function as a control."""

    def register(function: Callable[[PaperObjects], PaperObjects]) -> Callable[[PaperObjects], PaperObjects]:
        CONTROLS[name] = Control(name, breaks, function, least_m)
        return function

    return register


@control("A", "A is not skew-Hamiltonian")
def broken_A(o: PaperObjects) -> PaperObjects:
    """A plus a random matrix of rank 1; H, J and the roots stay."""
    return o.changed(A=o.A + o.vector("break 1") * o.vector("break 2").transpose())


@control("H", "H is outside the space of A")
def broken_H(o: PaperObjects) -> PaperObjects:
    """H plus the cube of a random linear form; for m = 1, where every cubic belongs, f is doubled but not H."""
    if o.m == 1:
        return o.changed(base=o.f.transformed(o.I * o.number(2)))
    u, n = o.vector("break 1"), o.n
    entries = [u[i, 0] * u[j, 0] * u[k, 0] for i in range(n) for j in range(n) for k in range(n)]
    return o.changed(third=o.third + o.K.matrix(n * n, n, entries), base=None)


@control("J", "J is not the standard structure, and A^T J = J A fails")
def broken_J(o: PaperObjects) -> PaperObjects:
    """J plus a random skew matrix of rank 2, throughout; for m = 1, where A^T J = J A for every skew J, twice J."""
    u, v = o.vector("break 1"), o.vector("break 2")
    return o.changed(J=o.J + u * v.transpose() - v * u.transpose(), base=None)


@control("f", "f is not Hamiltonian")
def broken_f(o: PaperObjects) -> PaperObjects:
    """f plus a random vector times the square of a random linear form; H stays."""
    p, u, n = o.vector("break 1"), o.vector("break 2"), o.n
    entries = [p[i, 0] * u[j, 0] * u[k, 0] for i in range(n) for j in range(n) for k in range(n)]
    tensor = o.f.tensor + o.K.matrix(n * n, n, entries)
    return o.changed(base=SystemOver(o.K, tensor, o.f.B, o.f.c))


@control("f''", "f'' is not the derivative of f'")
def broken_second_derivative(o: PaperObjects) -> PaperObjects:
    """f'' v gains a random matrix times the first component of v."""
    return o.changed(error_of_second=o.vector("break 1") * o.vector("break 2").transpose())


@control("B", "B^2 = I fails: B_i(lambda_i) = 2")
def broken_B(o: PaperObjects) -> PaperObjects:
    """B_i takes the value 2 at its own root instead of -1."""
    given = o.associate_matrices and tuple((o.I * o.number(3) - B) * o.number(1, 2) for B in o.associate_matrices)
    return o.changed(minus=o.number(2), associate_matrices=given)


@control("B=I", "all B_i are I")
def trivial_B(o: PaperObjects) -> PaperObjects:
    """B_i takes the value 1 at its own root as well, so all associated systems are f."""
    return o.changed(minus=o.K.one, associate_matrices=o.associate_matrices and (o.I,))


@control("eps", "the maps are computed with twice the eps of the formulas")
def broken_eps(o: PaperObjects) -> PaperObjects:
    """The time step of the maps is 4 eps."""
    return o.changed(step_eps=o.eps * o.number(2))


@control("map", "the map is the explicit Euler method, not Kahan's")
def broken_map(o: PaperObjects) -> PaperObjects:
    """x~ = x + 2 eps f(x)."""
    return o.changed(method="euler")


@control("roots", "the lambda_i are not the eigenvalues of A")
def broken_roots(o: PaperObjects) -> PaperObjects:
    """Every root is moved by a random amount."""
    return o.changed(roots=tuple(root + o.scalar(f"break {i}") for i, root in enumerate(o.lam)))


@control("repeated", "chi has a repeated root", least_m=2)
def repeated_root(o: PaperObjects) -> PaperObjects:
    """A + (lambda_2 - lambda_1) E_1, E_1 the projector to lambda_1: still skew-Hamiltonian, H still in its space."""
    A = o.A + o.projector(0) * (o.lam[1] - o.lam[0])
    return o.changed(A=A, roots=(o.lam[1], *o.lam[1:]), known_chi=None)


@control("A=B", "A itself has A^2 = I", least_m=2)
def involutive_A(o: PaperObjects) -> PaperObjects:
    """A := B_1, so that H_1 is associated to H_0."""
    return o.changed(A=o.B(0))


@control("H0", "H = 0")
def zero_H(o: PaperObjects) -> PaperObjects:
    """No Hamilton function at all."""
    return o.changed(third=o.zeros(o.n * o.n, o.n), base=None)


@control("linear", "f is linear")
def linear_f(o: PaperObjects) -> PaperObjects:
    """H with its quadratic part only: linear maps that are functions of one matrix commute with any steps."""
    zero = o.zeros(o.n * o.n, o.n)
    inhomogeneous = o.inhomogeneous()
    return inhomogeneous.changed(third=zero, gradient_of_linear_part=o.zeros(o.n, 1), base=None, draw=o.vector)


@control("inhomogeneous", "H is not homogeneous")
def inhomogeneous_H(o: PaperObjects) -> PaperObjects:
    """H with quadratic and linear terms, such that A nabla^2 H = nabla^2 H A^T still holds."""
    return o.inhomogeneous()


@control("unvaried", "nothing is varied: H homogeneous, J standard, equal steps, distinct roots")
def unvaried(o: PaperObjects) -> PaperObjects:
    """What is called inhomogeneous, another J, or other steps, is as in the paper."""
    return o.changed(varied=False)


def broken(name: str, o: PaperObjects) -> Any:
    """The objects broken by a control; vectors that were drawn stay the same."""
    changed = CONTROLS[name].function(o)
    changed.draw = o.vector
    return changed
