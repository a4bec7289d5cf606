"""The quadratic fields g whose flow commutes with that of f: [f, g] = f' g - g' f = 0, exact linear algebra over Q.

Where the Kahan maps of f and g commute for every eps, the bracket vanishes, since it is the first term of the
commutator in eps. So every commuting system is in this space.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq, fmpq_mat

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import combination_of, nullspace, primitive_integers
from kahanmaps.laboratory.symmetry.commuting_equations import coefficients_of, combination, system_of
from kahanmaps.systems.quadratic import QuadraticSystem

SHAPES = ("linear", "quadratic")
MAX_DIMENSION = 100  # of a space whose basis is kept and verified
MAX_UNKNOWNS = 900  # a matrix of so many rows and columns takes seconds


@dataclass(frozen=True)
class CommutingSpace:
    """A basis of all g with [f, g] = 0, f itself first; `matrices` are the B with g = B f (shape linear), else empty.

    Where the components of f are dependent B is not unique, and one of several is given. If `dimension` is more than
    the number of fields, the space is too large: its dimension is at most that, and f alone is kept.
    """

    fields: tuple[QuadraticSystem, ...]
    matrices: tuple[fmpq_mat, ...]
    dimension: int


def unknowns(system: QuadraticSystem, shape: str) -> int:
    """How many coefficients the space is looked for in."""
    n = system.dim
    return n * len(_independent_components(system)) if shape == "linear" else n * (n + 1) * (n + 2) // 2


def commuting_space(f: QuadraticSystem, shape: str, seed: int = 0, C: fmpq_mat | None = None) -> CommutingSpace:
    """All g with [f, g] = 0, of the shape g = B f ("linear") or any quadratic g ("quadratic"). Exact; f is not zero.

    With a matrix C, for which C f' = f' C, only those g with C g' = g' C.

    The conditions are taken at random integer points, and the result is verified as an identity of polynomials.
    Source: petrera-suris-2016.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "2*y^2"])
    >>> for g in commuting_space(f, "linear").fields:
    ...     print(str(g).replace(chr(10), ", "))
    x' = x^2, y' = 2*y^2
    x' = x^2, y' = 0
    """
    n = f.dim
    local = f.over(QQ)
    columns = _independent_components(f)
    rng = random.Random(f"commuting space {seed}")
    rows: list[list[fmpq]] = []
    needed = unknowns(f, shape)
    while True:
        while len(rows) < needed + 2 * n:
            point = [fmpq(rng.randint(-9, 9)) for _ in range(n)]
            value, jacobian = local.value(point), local.jacobian(point)
            # For each unknown scalar function phi: phi(x) and its derivative along f.
            if shape == "linear":
                along = (sum((jacobian[j, k] * value[k] for k in range(n)), fmpq(0)) for j in columns)
                scalars = [*zip((value[j] for j in columns), along, strict=True)]
            else:
                pairs = itertools.combinations_with_replacement(range(n), 2)
                scalars = [(point[j] * point[k], value[j] * point[k] + point[j] * value[k]) for j, k in pairs]
                scalars += [*zip(point, value, strict=True), (fmpq(1), fmpq(0))]
            for i in range(n):
                # the component i of f' (phi e_k) - e_k (grad phi . f), for all k and phi
                rows.append(
                    [
                        jacobian[i, k] * phi - (slope if i == k else 0)
                        for k, (phi, slope) in itertools.product(range(n), scalars)
                    ]
                )
        kernel = nullspace(QQ, fmpq_mat(rows))
        if len(kernel) > MAX_DIMENSION:
            return CommutingSpace((f,), (QQ.identity(n),) * (shape == "linear"), len(kernel))
        solutions = [[fmpq(e) for e in primitive_integers(v)] for v in kernel]
        matrices: list[fmpq_mat] = []
        if shape == "linear":
            for v in solutions:
                matrices.append(fmpq_mat(n, n))
                for (i, j), entry in zip(itertools.product(range(n), columns), v, strict=True):
                    matrices[-1][i, j] = entry
            fields = [f.transformed(B) for B in matrices]
        else:
            size = len(solutions[0]) // n
            fields = [system_of(f.variables, [v[i * size : (i + 1) * size] for i in range(n)]) for v in solutions]
        if all(bracket_vanishes(f, g) for g in fields):
            if C is not None:
                defects = []  # all coefficients of C g' - g' C
                for g in fields:
                    zero, defect = 0 * g.rhs[0], list[fmpq]()
                    for i, j in itertools.product(range(n), repeat=2):
                        terms = (C[i, k] * g.rhs[k].derivative(j) - C[k, j] * g.rhs[i].derivative(k) for k in range(n))
                        entry = sum(terms, zero)
                        defect += [fmpq(entry[tuple(int(l == k) for l in range(n))]) for k in range(n + 1)]
                    defects.append(defect)
                combinations = nullspace(QQ, fmpq_mat(defects).transpose())
                fields = [system_of(f.variables, combination(fields, w, fmpq(0))) for w in combinations]
                matrices = [combination_of(w, matrices) for w in combinations] if matrices else []
            # f in the place of one member of the basis, moved to the front.
            flat = fmpq_mat([[e for row in coefficients_of(g) for e in row] for g in [*fields, f]]).transpose()
            (relation,) = nullspace(QQ, flat)
            replaced = max(k for k in range(len(fields)) if relation[k] != 0)
            rest = [k for k in range(len(fields)) if k != replaced]
            identity = [QQ.identity(n)] if matrices else []
            found = (f, *(fields[k] for k in rest))
            return CommutingSpace(found, (*identity, *(matrices[k] for k in rest if matrices)), len(found))
        needed = len(rows) + 2 * n


def bracket_vanishes(f: QuadraticSystem, g: QuadraticSystem) -> bool:
    """Whether f' g - g' f = 0, as polynomials.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "y^2"])
    >>> bracket_vanishes(f, f), bracket_vanishes(f, QuadraticSystem.from_text(["x", "y"], ["x", "y"]))
    (True, False)
    """
    for a, b in zip(f.rhs, g.rhs, strict=True):
        total = a.context().constant(0)
        for k in range(f.dim):
            total = total + a.derivative(k) * g.rhs[k] - b.derivative(k) * f.rhs[k]
        if not total.is_zero():
            return False
    return True


def _independent_components(f: QuadraticSystem) -> list[int]:
    """The first components of f that span all of them."""
    reduced, count = fmpq_mat(coefficients_of(f)).transpose().rref()
    return [next(j for j in range(f.dim) if reduced[i, j] != 0) for i in range(count)]


def field_at(space: CommutingSpace, weights: Sequence[fmpq]) -> QuadraticSystem:
    """The field sum weights[i] fields[i]."""
    return system_of(space.fields[0].variables, combination(space.fields, weights, fmpq(0)))
