"""The question of the paper's conclusions: what are the level varieties, and how do the maps act on them?

The answer is a theorem proved in docs/mathematics.md, "Geometry of the level sets". The claims are the identities of
its proof, for a generic point x. Plane i is the image of E_i^T, where E_i is the projector for lambda_i. In this plane
let h be the restriction of H and D the determinant of f'; e, e' is a symplectic basis of the plane.
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import Any

from kahanmaps.algebra.ternary_cubics import Cubic, aronhold_invariants, hessian
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Pairs, claim

_W = 2  # the index of the homogenizing variable w in F(u, v, w)


@claim(
    "Algebra K",
    "",
    "repeated",
    least_m=2,
    distinct_roots=True,
    at_most="there are m powers, and every eigenvalue of a skew-Hamiltonian matrix is double",
)
def algebra_of_the_planes(o: PaperObjects) -> Pairs:
    """The powers of A span an algebra K = Q[t]/chi of dimension m, and every root of chi has a plane
    dim Q[A] = m, rank(A - lambda_i I) = 2m - 2"""
    powers = [o.A_to(k).entries() for k in range(o.m)]
    yield o.rank(o.K.matrix(o.m, o.n * o.n, [entry for power in powers for entry in power])), o.m
    for root in o.lam:
        yield o.rank(o.A - o.I * root), o.n - 2


@claim("Level varieties of the flow", "", "H A", least_m=2)
def level_varieties_of_the_flow(o: PaperObjects) -> Pairs:
    """The level varieties of H_0, ..., H_{m-1} are products of m plane curves h_i = b_i
    H_k = sum lambda_i^k h_i, k < m, with h_i = H(E_i^T x)"""
    levels = [o.H(o.projector(i).transpose() * o.x) for i in o.each]
    for k in range(o.m):
        yield o.H(o.x, k), o.sum([level * o.lam[i] ** k for i, level in enumerate(levels)])


@claim("Level varieties of the flow", "", "H A", least_m=2)
def linear_flows(o: PaperObjects) -> Pairs:
    """The flow of H_k is that of H in each plane, with another speed: linear, since du/h_v is the regular differential
    E_i^T f_k(x) = lambda_i^k f(E_i^T x)"""
    for i in o.each:
        E = o.projector(i).transpose()
        f_in_plane = o.value(o.f, E * o.x)
        for k in range(o.m):
            yield E * o.value(o.f_i(k), o.x), f_in_plane * o.lam[i] ** k


@claim("Level varieties of the flow", "", "inhomogeneous", blockwise=True)
def fermat_cubics(o: PaperObjects) -> Pairs:
    """The closures of the curves are Fermat cubics, whose points at infinity are flexes: j = 0
    S = 0, T = -disc(h) b^2/27, Hess(u, v, 0) = 0 for h(u, v) = b w^3"""
    for i in o.tested_indices:
        x, e_prime, disc = _plane(o, i)
        cubic = _restriction(o, (x, e_prime))
        b = o.H(x)
        cubic[_W, _W, _W] = -b
        S, T = aronhold_invariants(o.K, cubic)
        yield S, o.K.zero
        yield T, -disc * b * b * o.number(1, 27)
        for index, value in hessian(o.K, cubic).items():
            if _W not in index:
                yield value, o.K.zero


@claim("Level varieties of the maps", "", "eps map H")
def level_varieties_of_the_maps(o: PaperObjects) -> Pairs:
    """The level varieties of the integrals H~_k of the map are products of m plane curves h_i = c_i (1 + eps^2 D_i)
    H~_k = -6 sum lambda_i^k c_i, k < m, with c_i = h_i/(1 + eps^2 D_i)"""
    levels = [_level(o, i, o.projector(i).transpose() * o.x) for i in o.each]
    for k in range(o.m):
        right = o.sum([level * o.lam[i] ** k for i, level in enumerate(levels)])
        yield o.H_tilde_(k, o.x), right * o.number(-6)


@claim("Level varieties of the maps", "", "eps map", blockwise=True)
def hesse_cubics(o: PaperObjects) -> Pairs:
    """The curves are conserved; their closures are Hesse cubics X^3 + Y^3 + Z^3 = 3 k X Y Z, singular for k^3 = 1 only
    k^3 = 64 eps^6 disc(h) c^2, j = 27 k^3 (k^3 + 8)^3/(k^3 - 1)^3"""
    for i in o.tested_indices:
        x, e_prime, disc = _plane(o, i)
        c, square = _level(o, i, x), o.eps * o.eps
        yield _level(o, i, o.step(o.f, x)), c
        D = [o.block_determinant(i, y) for y in (x, e_prime, x + e_prime)]
        D_mixed = (D[2] - D[0] - D[1]) * o.number(1, 2)
        cubic = _restriction(o, (x, e_prime))
        for j, k, value in ((0, 0, D[0]), (0, 1, D_mixed), (1, 1, D[1])):
            cubic[j, k, _W] = -c * square * value * o.number(1, 3)
        S, T = aronhold_invariants(o.K, {**cubic, (_W, _W, _W): -c})
        k_cubed, disc_c2 = disc * c * c * square**3 * o.number(64), disc * c * c
        yield S, -disc_c2 * square * (o.number(8) + k_cubed) * o.number(1, 36)
        yield T, -disc_c2 * (o.number(8) + k_cubed * o.number(20) - k_cubed * k_cubed) * o.number(1, 216)
        discriminant = T * T + S**3 * o.number(64)
        yield discriminant, disc_c2 * disc_c2 * (o.K.one - k_cubed) ** 3 * o.number(1, 729)
        yield S**3 * o.number(4096) * (k_cubed - o.K.one) ** 3, k_cubed * (k_cubed + o.number(8)) ** 3 * discriminant


@claim("Level varieties of the maps", "", "eps map H", blockwise=True)
def translations(o: PaperObjects) -> Pairs:
    """Every map of the class acts on these curves as a translation: chords of its orbits meet on the curve
    P_{-1} P_2 and P_0 P_1 meet on h = c (w^2 + eps^2 D) w, for all associated f_s"""
    for B in (o.I, *o.associates()):
        g = o.g(B)
        orbit = [o.step(g, o.x, times=-1), o.x, o.step(g, o.x)]
        orbit.append(o.step(g, orbit[-1]))
        for i in o.tested_indices:
            E = o.projector(i).transpose()
            points = [E * point for point in orbit]

            def area(*indices: int, points: list[Any] = points) -> Any:
                index_pairs = zip(indices, indices[1:] + indices[:1], strict=True)
                return o.sum([o.dot(points[a], o.J * points[b]) for a, b in index_pairs])

            area_1, area_2 = area(1, 0, 3), area(2, 0, 3)
            chord_point, w = points[2] * area_1 - points[1] * area_2, area_1 - area_2
            square = w * w + o.eps * o.eps * o.block_determinant(i, chord_point)
            yield o.H(chord_point), _level(o, i, points[1]) * w * square


def _level(o: PaperObjects, i: int, x: Any) -> Any:
    """Return H(x)/(1 + eps^2 D_i(x)) at a point x of plane i."""
    return o.H(x) / (o.K.one + o.eps * o.eps * o.block_determinant(i, x))


def _plane(o: PaperObjects, i: int) -> tuple[Any, Any, Any]:
    """Return (e, e', disc(h)): e is the component of x in plane i, (e, e') a symplectic basis of this plane."""
    E = o.projector(i).transpose()
    x, v = E * o.x, E * o.vector("v")
    e_prime = v * (o.K.one / o.dot(x, o.J * v))
    cubic = _restriction(o, (x, e_prime))
    a, d = cubic[0, 0, 0], cubic[1, 1, 1]
    b, c = cubic[0, 0, 1], cubic[0, 1, 1]  # h = a u^3 + 3 b u^2 v + 3 c u v^2 + d v^3
    ad, cubic_terms = a * d, a * c**3 + b**3 * d
    disc = (b * c) ** 2 * o.number(81) + ad * b * c * o.number(162) - ad * ad * o.number(27)
    return x, e_prime, disc - cubic_terms * o.number(108)


def _restriction(o: PaperObjects, basis: tuple[Any, Any]) -> Cubic:
    """Return H(u e + v e') for `basis` = (e, e'), as a cubic form in u, v, w; w homogenizes lower terms of H."""
    zero = o.zeros(o.n, 1)
    quadratic, linear = o.hess(zero), o.grad(zero)
    cubic: Cubic = {}
    for index in combinations_with_replacement(range(3), 3):
        vectors = [basis[k] for k in index if k < _W]
        if len(vectors) == 3:
            x, y, z = vectors
            value = o.dot(x, (o.hess(y) - quadratic) * z) * o.number(1, 6)
        elif len(vectors) == 2:
            value = o.dot(vectors[0], quadratic * vectors[1]) * o.number(1, 6)
        else:
            value = o.dot(vectors[0], linear) * o.number(1, 3) if vectors else o.K.zero
        cubic[index] = value
    return cubic
