"""Signed permutation matrices S that a translation may complete to a symmetry: the terms of highest degree agree.

With (S x)_{p(i)} = s_i x_i the condition f(S x) = sign S f(x) on coefficients is a table of equations between single
numbers. Variables are placed one after the other, and a choice is dropped at the first equation that fails.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from flint import fmpq, fmpq_mat

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
    for S in _Search(f, sign, deadline).walk([], []):
        if S is None or len(found) >= MAX_FOUND:
            return found, False
        found.append(S)
    return found, True


class _Search:
    def __init__(self, f: QuadraticSystem, sign: int, deadline: float) -> None:
        n = f.dim
        self.n, self.sign, self.deadline = n, sign, deadline
        self.Q = [[[form[j, k] for k in range(n)] for j in range(n)] for form in f.Q]
        self.B: list[list[fmpq]] = f.B.tolist()
        # A translation changes the linear terms where there are quadratic ones, and never those of highest degree.
        self.is_affine = f.degree <= 1

    def walk(self, places: list[int], signs: list[int]) -> Iterator[fmpq_mat | None]:
        """All ways to go on; None where the time is over."""
        if time.monotonic() > self.deadline:
            yield None
            return
        if len(places) == self.n:
            S = fmpq_mat(self.n, self.n)
            for i, (place, s) in enumerate(zip(places, signs, strict=True)):
                S[place, i] = fmpq(s)
            yield S
            return
        for place in range(self.n):
            if place in places:
                continue
            for s in (1, -1):
                p, t = [*places, place], [*signs, s]
                if self._fits(p, t):
                    yield from self.walk(p, t)

    def _fits(self, p: list[int], s: list[int]) -> bool:
        """Whether the equations hold that contain the last variable and no later one."""
        last = len(p) - 1
        for i in range(last + 1):
            for j in range(last + 1):
                if self.is_affine:
                    if last in (i, j) and self.B[p[i]][p[j]] * (s[i] * s[j]) != self.B[i][j] * self.sign:
                        return False
                    continue
                for k in range(j, last + 1):
                    if last in (i, j, k):
                        image = self.Q[p[i]][p[j]][p[k]]
                        if image * (s[i] * s[j] * s[k]) != self.Q[i][j][k] * self.sign:
                            return False
        return True
