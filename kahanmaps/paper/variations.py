"""Variations of the hypotheses of the paper: other H, J, A or time steps.

Like a control, a variation takes the paper's objects and returns changed objects, but a statement may hold or fail for
the changed objects. With `varied=False` the objects are not changed, which is the control for statements that fail.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kahanmaps.paper.objects import PaperObjects


@dataclass(frozen=True)
class Variation:
    """A change of the objects by `function`, for m >= `least_m`; `theorem` proves claims about it without expansion."""

    title: str
    function: Callable[[PaperObjects], PaperObjects]
    least_m: int = 1
    theorem: str = ""


def other_structure(o: PaperObjects) -> PaperObjects:
    """J is a random skew matrix with A^T J = J A, singular or not: a polynomial in A^T times the standard J."""
    weights = o.vector("weights")
    factor = o.polynomial_in_A([weights[k, 0] for k in range(o.m)]).transpose()
    return o.replace(J=factor * o.J, base=None, draw=o.vector)


def any_structure(o: PaperObjects) -> PaperObjects:
    """J is a random constant skew matrix; A^T J = J A need not hold."""
    J = o.columns([o.vector(f"J {j}") for j in range(o.n)])
    return o.replace(J=J - J.transpose(), base=None, draw=o.vector)


def different_steps(o: PaperObjects) -> PaperObjects:
    """The maps of the associated g = B^T f are taken at 2 eps: they are the maps of 2 g at eps."""
    return o.replace(associate_matrices=tuple(B * o.number(2) for B in o.associates()), draw=o.vector)


def jordan_block(o: PaperObjects) -> PaperObjects:
    """A has a double root and is not diagonalizable: chi is its minimal polynomial. H is a random cubic of A."""
    roots = (o.lam[0], o.lam[0], *o.lam[2:])
    chi = tuple(o.replace(roots=roots).chi_of_roots)
    S, _ = o.symplectic_normal_form()
    A = -(S * o.block_diagonal(o.companion(chi)) * o.J * S.transpose() * o.J)
    p = o.replace(A=A, known_chi=chi, base=None, draw=o.vector)
    # H is a sum of cubics l(M_a(x)^3) of A; t^k and C_k(t) are dual bases for the functional l on Q[t]/chi.
    terms = []
    for name in ("d1", "d2", "d3"):
        powers = [p.A_to(k) * p.vector(name) for k in range(p.m)]
        for k in range(p.m):
            for l in range(p.m):
                terms.append(p.tensor(powers[k], powers[l], p.horner(k) * p.horner(l) * p.vector(name)))
    return p.replace(roots=None, d3H=p.sum(terms), associate_matrices=_associate_matrices(o, A, roots), draw=o.vector)


def derogatory(o: PaperObjects) -> PaperObjects:
    """A is diagonalizable with lambda_1 = lambda_2; H is an arbitrary cubic on the eigenspace of this root."""
    E = o.projector(0) + o.projector(1)
    A = o.A + o.projector(0) * (o.lam[1] - o.lam[0])
    d3H = o.sum([o.d3H, *(o.tensor(w, w, w) for w in (E * o.vector(name) for name in ("d1", "d2", "d3")))])
    matrices = _associate_matrices(o, A, (o.lam[1], *o.lam[1:]))
    return o.replace(A=A, known_chi=None, base=None, roots=None, d3H=d3H, associate_matrices=matrices, draw=o.vector)


def _associate_matrices(o: PaperObjects, A: Any, roots: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return (B,), B = I - 2 E, where E projects onto the eigenspace of A for the simple third root; () if m < 3."""
    if o.m < 3:
        return ()
    E, simple_root = o.I, roots[2]
    for root in (*roots[:2], *roots[3:]):
        E = E * (A - o.I * root) * (o.K.one / (simple_root - root))
    return (o.I + E * (o.B_at_root - o.K.one),)


_CMOQ = "the theorem of Celledoni, McLachlan, Owren and Quispel"
VARIATIONS: dict[str, Variation] = {
    "inhomogeneous": Variation("H inhomogeneous", PaperObjects.inhomogeneous),
    "structure": Variation("other J, A^T J = J A", other_structure),
    "any-structure": Variation("other J, any", any_structure, 2, _CMOQ),
    "steps": Variation("g at 2 eps", different_steps),
    "jordan": Variation("A with a Jordan block", jordan_block, 2, "the theorem on A that is not derogatory"),
    "derogatory": Variation("A derogatory", derogatory, 2, f"the splitting lemma, with {_CMOQ},"),
}


def varied(name: str, o: PaperObjects) -> PaperObjects:
    """Return the varied objects, or the objects unchanged if `o.varied` is False."""
    return VARIATIONS[name].function(o) if o.varied else o
