"""Negative controls: input that violates exactly one hypothesis; the claims that need this hypothesis must fail.

A control takes the paper's objects and returns them with one random change. A claim names the controls that must refute
it; a claim that no control can refute would check nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.systems.quadratic import SystemOver


@dataclass(frozen=True)
class Control:
    """A negative control: the violated hypothesis as text, and the function that changes the objects."""

    breaks: str
    function: Callable[[PaperObjects], PaperObjects]
    least_m: int = 1


def broken_H(o: PaperObjects) -> PaperObjects:
    """Add the cube of a random linear form to H; for m = 1, where every cubic is allowed, double f but not H."""
    if o.m == 1:
        return o.changed(base=o.f.transformed(o.I * o.number(2)))
    u = o.vector("break 1")
    return o.changed(third=o.third + o.tensor(u, u, u), base=None)


def broken_J(o: PaperObjects) -> PaperObjects:
    """Add a random skew matrix of rank 2 to J; for m = 1, where A^T J = J A for every skew J, double J."""
    u, v = o.vector("break 1"), o.vector("break 2")
    return o.changed(J=o.J + u * v.transpose() - v * u.transpose(), base=None)


def broken_f(o: PaperObjects) -> PaperObjects:
    """Add a random vector times the square of a random linear form to f; H is unchanged."""
    p, u = o.vector("break 1"), o.vector("break 2")
    return o.changed(base=SystemOver(o.K, o.f.tensor + o.tensor(p, u, u), o.f.B, o.f.c))


def broken_B(o: PaperObjects) -> PaperObjects:
    matrices = o.associate_matrices and tuple((o.I * o.number(3) - B) * o.number(1, 2) for B in o.associate_matrices)
    return o.changed(minus=o.number(2), associate_matrices=matrices)


def repeated_root(o: PaperObjects) -> PaperObjects:
    """Replace A by A + (lambda_2 - lambda_1) E_1: A stays skew-Hamiltonian, H stays in its space."""
    A = o.A + o.projector(0) * (o.lam[1] - o.lam[0])
    return o.changed(A=A, roots=(o.lam[1], *o.lam[1:]), known_chi=None)


def linear_f(o: PaperObjects) -> PaperObjects:
    """Replace H by its quadratic part: then f is linear, and its maps with different time steps commute."""
    zero = o.zeros(o.n * o.n, o.n)
    return o.inhomogeneous().changed(third=zero, gradient_of_linear_part=o.zeros(o.n, 1), base=None, draw=o.vector)


def _rank_1(o: PaperObjects) -> Any:
    return o.vector("break 1") * o.vector("break 2").transpose()


CONTROLS: dict[str, Control] = {
    "A": Control("A is not skew-Hamiltonian", lambda o: o.changed(A=o.A + _rank_1(o))),  # H, J, roots unchanged
    "H": Control("H is outside the space of A", broken_H),
    "J": Control("J is not the standard structure, and A^T J = J A fails", broken_J),
    "f": Control("f is not Hamiltonian", broken_f),
    # Add a random matrix times the first component of v to f'' v.
    "f''": Control("f'' is not the derivative of f'", lambda o: o.changed(error_of_second=_rank_1(o))),
    "B": Control("B^2 = I fails: B_i(lambda_i) = 2", broken_B),
    # Set B_i(lambda_i) = 1: then every B_i is I, and all associated systems are f.
    "B=I": Control(
        "all B_i are I", lambda o: o.changed(minus=o.K.one, associate_matrices=o.associate_matrices and (o.I,))
    ),
    "eps": Control(
        "the maps are computed with twice the eps of the formulas", lambda o: o.changed(step_eps=o.eps * o.number(2))
    ),
    "map": Control("the map is the explicit Euler method, not Kahan's", lambda o: o.changed(method="euler")),
    "roots": Control(
        "the lambda_i are not the eigenvalues of A",
        lambda o: o.changed(roots=tuple(root + o.scalar(f"break {i}") for i, root in enumerate(o.lam))),
    ),
    "repeated": Control("chi has a repeated root", repeated_root, least_m=2),
    # A := B_1, so that H_1 is associated to H_0.
    "A=B": Control("A itself has A^2 = I", lambda o: o.changed(A=o.B(0)), least_m=2),
    "H0": Control("H = 0", lambda o: o.changed(third=o.zeros(o.n * o.n, o.n), base=None)),
    "linear": Control("f is linear", linear_f),
    # Add quadratic and linear terms to H such that A nabla^2 H = nabla^2 H A^T still holds.
    "inhomogeneous": Control("H is not homogeneous", PaperObjects.inhomogeneous),
    "unvaried": Control(
        "nothing is varied: H homogeneous, J standard, equal steps, distinct roots", lambda o: o.changed(varied=False)
    ),
}


def broken(name: str, objects: PaperObjects) -> PaperObjects:
    """Return the objects changed by a control; vectors that were drawn before are unchanged."""
    changed = CONTROLS[name].function(objects)
    changed.draw = objects.vector
    return changed
