"""Relations along orbits and densities of many members of a family of maps, all modulo one small prime p.

Over GF(p), all members at once. What is counted are ranks: they are largest where a member has neither more relations
nor more densities than others, and a short orbit or a point without a value can only make them smaller.
"""

from __future__ import annotations

import random

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import monomials
from kahanmaps.maps.residues.families import Family, Members

Array = NDArray[np.int64]

_SPARE = 4  # points more than monomials


def ranks(family: Family, members: Members, eps: fmpq | None, top: int, rng: random.Random, by: str) -> Array:
    """For each member and each degree d = 1, ..., top a rank: the number of monomials less that of solutions.

    Args:
        family: the maps.
        members: as for `Family.degrees`; eps is random in GF(p) where it is no column and None.
        top: the largest degree.
        rng: of the points.
        by: "integrals": polynomials of degree at most d that vanish along an orbit. "density": those phi for which the
            map has the invariant measure dx/phi.
    """
    draw = np.random.default_rng(rng.getrandbits(64))
    p, count = family.prime, len(members)
    if members.shape[1] == len(family.symbols):
        step = draw.integers(1, p, (count, 1)) if eps is None else np.full((count, 1), int(GF(p).convert(eps)))
        members = np.hstack([members, step])
    values = family.coefficients(members, None, draw)[:, 0].astype(np.int64)
    support = [(d, e) for d in range(top + 1) for e in monomials(family.dim, d)]
    exponents = np.array([(*e, top - d) for d, e in support])
    X = _points(draw, p, count, family.dim)
    rows = []
    for _ in range(len(support) + _SPARE):
        equation = _equation(family, values, X)
        image = _kernel(equation, p)
        if by == "integrals":
            rows.append(_monomials(X, exponents, p))
            X = image
            continue
        scale = inverses(image[:, -1:], p)  # 0 at infinity
        image = image * scale % p
        above = _determinant(_derivative(family, values, X, image), p) * (-1) ** family.dim
        ratio = above * inverses(_determinant(equation[:, :, :-1], p), p) % p
        difference = _monomials(image, exponents, p) - ratio[:, None] * _monomials(X, exponents, p)
        rows.append(difference * (scale != 0) % p)
        X = _points(draw, p, count, family.dim)
    table = np.stack(rows, axis=1)
    sizes = [sum(e <= d for e, _ in support) for d in range(1, top + 1)]
    return np.stack([_reduced(table[:, :, :size], p)[1].max(axis=2).sum(axis=1) for size in sizes], axis=1)


def _points(draw: np.random.Generator, p: int, count: int, dim: int) -> Array:
    return np.hstack([draw.integers(0, p, (count, dim)), np.ones((count, 1), dtype=np.int64)])


def _monomials(X: Array, exponents: Array, p: int) -> Array:
    found = np.ones((len(X), len(exponents)), dtype=np.int64)
    for k, column in enumerate(exponents.T):
        power = np.ones((len(X), column.max() + 1), dtype=np.int64)
        for e in range(1, power.shape[1]):
            power[:, e] = power[:, e - 1] * X[:, k] % p
        found = found * power[:, column] % p
    return found


def _equation(family: Family, values: Array, X: Array) -> Array:
    """The matrix n x (n + 1) of each member that kills the image of a point."""
    found = np.zeros((len(X), family.dim, family.dim + 1), dtype=np.int64)
    known = _monomials(X, np.array(family.exponents), family.prime)
    for i, j, k, place in family.terms:
        found[:, i, j] += known[:, k] * values[:, place] % family.prime
    return found % family.prime


def _derivative(family: Family, values: Array, X: Array, image: Array) -> Array:
    """The derivatives of the equation at a point and its image by the coordinates of the point."""
    exponents, p = np.array(family.exponents), family.prime
    found = np.zeros((len(X), family.dim, family.dim), dtype=np.int64)
    for k in range(family.dim):
        lower = exponents.copy()
        lower[:, k] = np.maximum(lower[:, k] - 1, 0)
        known = _monomials(X, lower, p) * exponents[:, k] % p
        for i, j, place, value in family.terms:
            found[:, i, k] += known[:, place] * values[:, value] % p * image[:, j] % p
    return found % p


def _reduced(A: Array, p: int) -> tuple[Array, Array, Array]:
    """Reduced matrices, where the pivots of each are (a matrix of 0 and 1), and the products of pivots."""
    A = A % p
    pivots = np.zeros_like(A)
    product = np.ones(len(A), dtype=np.int64)
    every = np.arange(len(A))
    for c in range(A.shape[2]):
        free = (A[:, :, c] != 0) & ~pivots.any(axis=2)
        row, there = free.argmax(axis=1), free.any(axis=1)
        pivot = np.where(there, A[every, row, c], 1)
        product = product * pivot % p
        normed = A[every, row] * inverses(pivot, p)[:, None] % p
        factor = A[:, :, c] * there[:, None]
        factor[every, row] = 0
        A = (A - factor[:, :, None] * normed[:, None, :]) % p
        A[every, row] = np.where(there[:, None], normed, A[every, row])
        pivots[every, row, c] = there
    return A, pivots, product


def _kernel(A: Array, p: int) -> Array:
    """The vector that each matrix n x (n + 1) kills; 0 where there are more."""
    reduced, pivots, _ = _reduced(A, p)
    free = 1 - pivots.max(axis=1)  # of the columns
    entries = (reduced * free[:, None, :]).sum(axis=2)  # the free column
    found: Array = free - (pivots * entries[:, :, None]).sum(axis=1)
    found = found % p * (free.sum(axis=1) == 1)[:, None]
    return found


def _determinant(A: Array, p: int) -> Array:
    _, pivots, product = _reduced(A, p)
    columns = pivots.argmax(axis=2)
    inversions = sum(columns[:, i] > columns[:, j] for j in range(A.shape[1]) for i in range(j))
    whole = pivots.sum(axis=(1, 2)) == A.shape[1]
    return np.where(whole, product * (-1) ** (inversions % 2), 0) % p


def inverses(x: Array, p: int) -> Array:
    """Inverses modulo p; 0 of 0."""
    found, power, e = np.ones_like(x), x % p, p - 2
    while e:
        found = found * power % p if e & 1 else found
        power, e = power * power % p, e >> 1
    return found
