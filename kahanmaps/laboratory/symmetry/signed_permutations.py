"""Signed permutation matrices S that a translation may complete to a symmetry: the terms of highest degree agree.

With (S x)_{p(i)} = s_i x_i the condition f(S x) = sign S f(x) on coefficients is a table of equations between single
numbers. Variables are placed one after the other, and a choice is dropped at the first equation that fails.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

from flint import fmpq, fmpq_mat

from kahanmaps.algebra.integers import over_one
from kahanmaps.systems.quadratic import QuadraticSystem

MAX_DIMENSION = 12
MAX_FOUND = 1_000  # all permutations in dimension 6 are 720


def signed_permutations(f: QuadraticSystem, sign: int, deadline: float) -> tuple[list[fmpq_mat], bool]:
    """The signed permutations S with f_2(S x) = sign S f_2(x), f_2 the quadratic terms (the linear ones if none).

    Exact. Returns them, and whether these are all: there may be too many, or `deadline` (time.monotonic) passes.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "y^2 + 1"])
    >>> [S.tolist() for S in signed_permutations(f, 1, time.monotonic() + 10)[0]]
    [[[1, 0], [0, 1]], [[0, 1], [1, 0]]]
    """
    found: list[fmpq_mat] = []
    for S in _walk(f, sign, deadline):
        if S is None or len(found) >= MAX_FOUND:
            return found, False
        found.append(S)
    return found, True


def _walk(f: QuadraticSystem, sign: int, deadline: float) -> Iterator[fmpq_mat | None]:
    """All of them; None where the time is over."""
    n = f.dim
    # A translation changes the linear terms where there are quadratic ones, and never those of highest degree.
    if f.degree <= 1:
        table: dict[tuple[int, ...], fmpq] = {(i, j): f.B[i, j] for i in range(n) for j in range(n)}
    else:
        table = {(i, j, k): f.Q[i][j, k] for i in range(n) for j in range(n) for k in range(n)}
    # The equations that contain a variable and no later one, each of them once; first those that fail most.
    integers, _ = over_one(table.values())
    numbers = dict(zip(table, map(int, integers), strict=True))
    equations = [
        sorted((at for at in table if max(at) == last and at[1] <= at[-1]), key=lambda at: numbers[at] == 0)
        for last in range(n)
    ]

    def fits(p: list[int], s: list[int]) -> bool:
        return all(
            numbers[tuple(p[k] for k in at)] * math.prod(s[k] for k in at) == numbers[at] * sign
            for at in equations[len(p) - 1]
        )

    def further(p: list[int], s: list[int]) -> Iterator[fmpq_mat | None]:
        if time.monotonic() > deadline:
            yield None
        elif len(p) == n:
            yield fmpq_mat([[s[i] if p[i] == row else 0 for i in range(n)] for row in range(n)])
        else:
            choices = (([*p, place], [*s, t]) for place in range(n) if place not in p for t in (1, -1))
            for places, signs in choices:
                if fits(places, signs):
                    yield from further(places, signs)

    return further([], [])
