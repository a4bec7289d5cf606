"""The equations of a symmetry x -> S x + r of a quadratic system: checked, and solved for r or for S.

f(S x + r) = sign S f(x) for all x; sign 1 for a symmetry, -1 for a reversing one. Everything is exact over Q.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomials import coefficients_in, ring
from kahanmaps.algebra.small_systems import Component, solve_system
from kahanmaps.systems.quadratic import QuadraticSystem


def is_symmetry(system: QuadraticSystem, S: fmpq_mat, r: Sequence[fmpq], sign: int) -> bool:
    """Whether f(S x + r) = sign S f(x) for all x: sign 1 for a symmetry, -1 for a reversing one. Exact.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["y", "-x^2"])
    >>> is_symmetry(f, fmpq_mat([[1, 0], [0, -1]]), [fmpq(0)] * 2, -1)
    True
    """
    return S.det() != 0 and system.composed(S, r) == system.transformed(S).scaled(sign)


def translation(f: QuadraticSystem, S: fmpq_mat, sign: int, deadline: float) -> tuple[fmpq, ...] | None:
    """An r with f(S x + r) = sign S f(x), 0 if possible; None if none that is rational was found.

    `deadline` is a value of time.monotonic(). Source: cmoq-2013.

    >>> f = QuadraticSystem.from_text(["x"], ["x^2 + x"])
    >>> translation(f, fmpq_mat([[-1]]), -1, float("inf"))
    (-1,)
    """
    n = f.dim
    zero = (fmpq(0),) * n
    if is_symmetry(f, S, zero, sign):
        return zero
    # f''(S x, r) + B S x = sign S B x is linear in r, with one equation for each entry of a matrix.
    missing = (S * f.B * fmpq(sign) - f.B * S).entries()
    slopes = [(form * S * fmpq(2)).transpose() for form in f.Q]
    rows = [[*(slopes[i][j, k] for k in range(n)), -missing[i * n + j]] for i in range(n) for j in range(n)]
    solutions = nullspace(QQ, fmpq_mat(rows))
    if not any(v[-1] != 0 for v in solutions):
        return None
    (special,) = [v for v in solutions if v[-1] != 0]
    directions = [v for v in solutions if v[-1] == 0]
    # f(r) = sign S c decides among them.
    parameters = ring([f"t{k + 1}" for k in range(len(directions) + 1)])
    gens = parameters.gens()
    r = [parameters.constant(special[k] / special[-1]) for k in range(n)]
    for t, v in zip(gens, directions, strict=False):
        r = [a + t * v[k] for k, a in enumerate(r)]
    constants = (S * fmpq_mat(n, 1, list(f.c)) * fmpq(sign)).entries()
    equations = [p.compose(*r, ctx=parameters) - value for p, value in zip(f.rhs, constants, strict=True)]
    solved = solve_system([*equations, gens[-1]], r, deadline)
    if not solved.components:
        return None
    found = solved.components[0].point
    return found if is_symmetry(f, S, found, sign) else None


def matrix_equations(f: QuadraticSystem, S: Sequence[Sequence[fmpq_mpoly]], sign: int) -> list[fmpq_mpoly]:
    """Polynomials in the entries of S that vanish where f(S x) = sign S f(x) for all x.

    `S` holds the generators of a ring, row by row. The divergence of f must go along with an invertible S as well:
    this follows, and is linear in S.

    >>> s = ring(["s"]).gens()[0]
    >>> matrix_equations(QuadraticSystem.from_text(["x"], ["x^2"]), [[s]], 1)
    [s^2 - s, 2*s - 2]
    """
    n, entries = f.dim, [entry for row in S for entry in row]
    joint = ring([f"x{j}" for j in range(n)] + [f"s{k}" for k in range(n * n)])
    x, s = joint.gens()[:n], joint.gens()[n:]
    images = [sum((s[i * n + j] * x[j] for j in range(n)), joint.constant(0)) for i in range(n)]
    *at_x, divergence = (p.compose(*x, ctx=joint) * fmpq(sign) for p in (*f.rhs, f.divergence))
    sides = [sum((s[i * n + a] * at_x[a] for a in range(n)), joint.constant(0)) for i in range(n)]
    parts = [
        p.compose(*images, ctx=joint) - side
        for p, side in zip((*f.rhs, f.divergence), (*sides, divergence), strict=True)
    ]
    context = entries[0].context()
    back = [context.constant(0)] * n + entries
    return [c.compose(*back, ctx=context) for part in parts for c in coefficients_in(part, n)]


def is_singular(part: Component, n: int) -> bool:
    """Whether det S = 0 on the whole linear family of n x n matrices, its entries row by row.

    >>> a = ring(["a"]).gens()[0]
    >>> is_singular(Component((a, a, a, a)), 2), is_singular(Component((a, a, a, -a)), 2)
    (True, False)
    """
    rows = [[*part.values[i * n : (i + 1) * n], None] for i in range(n)]
    return bool(kernel_minors(rows)[-1].is_zero())
