"""Negative controls: objects that violate exactly one hypothesis, so that the claims that need it must fail.

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
    """A negative control: `function` changes the objects so that a hypothesis fails; `violation` says how it fails."""

    violation: str
    function: Callable[[PaperObjects], PaperObjects]
    least_m: int = 1


def broken_H(objects: PaperObjects) -> PaperObjects:
    """Add the cube of a random linear form to H; for m = 1, where every cubic is allowed, double f but not H."""
    if objects.m == 1:
        return objects.replace(base=objects.f.transformed(objects.I * objects.number(2)))
    u = objects.vector("break 1")
    return objects.replace(d3H=objects.d3H + objects.tensor(u, u, u), base=None)


def broken_J(objects: PaperObjects) -> PaperObjects:
    """Add a random skew matrix of rank 2 to J; for m = 1, where A^T J = J A for every skew J, double J."""
    u, v = objects.vector("break 1"), objects.vector("break 2")
    return objects.replace(J=objects.J + u * v.transpose() - v * u.transpose(), base=None)


def broken_f(objects: PaperObjects) -> PaperObjects:
    """Add a random vector times the square of a random linear form to f, without changing H."""
    p, u = objects.vector("break 1"), objects.vector("break 2")
    return objects.replace(
        base=SystemOver(objects.K, objects.f.tensor + objects.tensor(p, u, u), objects.f.B, objects.f.c)
    )


def broken_B(objects: PaperObjects) -> PaperObjects:
    matrices = objects.associate_matrices and tuple(
        (objects.I * objects.number(3) - B) * objects.number(1, 2) for B in objects.associate_matrices
    )
    return objects.replace(B_at_root=objects.number(2), associate_matrices=matrices)


def repeated_root(objects: PaperObjects) -> PaperObjects:
    """Replace lambda_1 by lambda_2 in A: A is still skew-Hamiltonian, and A nabla^2 H = nabla^2 H A^T still holds."""
    A = objects.A + objects.projector(0) * (objects.lam[1] - objects.lam[0])
    return objects.replace(A=A, roots=(objects.lam[1], *objects.lam[1:]), known_chi=None)


def linear_f(objects: PaperObjects) -> PaperObjects:
    """Replace H by a random quadratic form: then f is linear, and its maps with different time steps commute."""
    zero = objects.zeros(objects.n * objects.n, objects.n)
    return objects.inhomogeneous().replace(
        d3H=zero, gradient_of_linear_part=objects.zeros(objects.n, 1), base=None, draw=objects.vector
    )


def _random_rank_1_matrix(objects: PaperObjects) -> Any:
    return objects.vector("break 1") * objects.vector("break 2").transpose()


CONTROLS: dict[str, Control] = {
    "A": Control(
        "A is not skew-Hamiltonian", lambda o: o.replace(A=o.A + _random_rank_1_matrix(o))
    ),  # H, J and the roots are not changed
    "H": Control("H is outside the space of A", broken_H),
    "J": Control("J is not the standard structure, and A^T J = J A fails", broken_J),
    "f": Control("f is not Hamiltonian", broken_f),
    # Add v_1 times a random matrix to f'' v.
    "f''": Control("f'' is not the derivative of f'", lambda o: o.replace(error_of_second=_random_rank_1_matrix(o))),
    "B": Control("B^2 = I fails: B_i(lambda_i) = 2", broken_B),
    # Set B_i(lambda_i) = 1: then every B_i is I, and every associated system is f.
    "B=I": Control(
        "all B_i are I", lambda o: o.replace(B_at_root=o.K.one, associate_matrices=o.associate_matrices and (o.I,))
    ),
    "eps": Control(
        "the maps are computed with twice the eps of the formulas", lambda o: o.replace(step_eps=o.eps * o.number(2))
    ),
    "map": Control("the map is the explicit Euler method, not Kahan's", lambda o: o.replace(method="euler")),
    "roots": Control(
        "the lambda_i are not the eigenvalues of A",
        lambda o: o.replace(roots=tuple(root + o.scalar(f"break {i}") for i, root in enumerate(o.lam))),
    ),
    "repeated": Control("chi has a repeated root", repeated_root, least_m=2),
    # With A = B_1, H_1 is the Hamilton function of a field associated to f_0.
    "A=B": Control("A itself has A^2 = I", lambda o: o.replace(A=o.B(0)), least_m=2),
    "H0": Control("H = 0", lambda o: o.replace(d3H=o.zeros(o.n * o.n, o.n), base=None)),
    "linear": Control("f is linear", linear_f),
    # Add quadratic and linear terms to H such that A nabla^2 H = nabla^2 H A^T still holds.
    "inhomogeneous": Control("H is not homogeneous", PaperObjects.inhomogeneous),
    "unvaried": Control(
        "nothing is varied: H homogeneous, J standard, equal steps, distinct roots", lambda o: o.replace(varied=False)
    ),
}


def broken(name: str, objects: PaperObjects) -> PaperObjects:
    """Return the objects changed by the control `name`; vectors already drawn keep their values."""
    broken_objects = CONTROLS[name].function(objects)
    broken_objects.draw = objects.vector
    return broken_objects
