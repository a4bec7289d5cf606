"""Exact stepping against per-entry rationals: the same orbit of a family member, ratios of the times of one run.

`python benchmarks/bench_exact_steps.py [m] [steps]`; m = 3 and 80 steps unless given.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpz_mat

from kahanmaps import KahanMap, Orbit, QuadraticSystem, draw_with_eigenvalues

EPS = fmpq(1, 10)


def by_kahanmaps(system: QuadraticSystem, start: Sequence[fmpq], steps: int) -> tuple[fmpq, ...]:
    """Every iterate with reduced coordinates, as the library delivers it."""
    last: tuple[Any, ...] = ()
    for point in Orbit(KahanMap(system, EPS), start, steps, max_digits=10**9):
        last = point.x
    return last


def by_rational_solve(system: QuadraticSystem, start: Sequence[fmpq], steps: int) -> tuple[fmpq, ...]:
    """Per-entry rationals and fmpq_mat.solve (homogeneous systems)."""
    n = system.dim
    x = fmpq_mat(n, 1, list(start))
    for _ in range(steps):
        entries = [fmpq(int(i == j)) for i in range(n) for j in range(n)]
        for i in range(n):
            slopes = (system.Q[i] * x * (2 * EPS)).entries()
            for j in range(n):
                entries[i * n + j] -= slopes[j]
        x = fmpq_mat(n, n, entries).solve(x)
    return tuple(x.entries())


def by_integer_solve(system: QuadraticSystem, start: Sequence[fmpq], steps: int) -> tuple[fmpq, ...]:
    """Integers over one denominator and FLINT's fmpz_mat.solve, content removed by one gcd an entry."""
    n = system.dim
    common, tensor, _, _ = system.integer_form
    column, below = fmpq_mat(n, 1, list(start)).numer_denom()
    for _ in range(steps):
        matrix = fmpz_mat(n, n, (tensor * column * -EPS.p).entries())
        for i in range(n):
            matrix[i, i] += EPS.q * common * below
        column, below = matrix.solve(column * (EPS.q * common)).numer_denom()
        content = below
        for entry in column.entries():
            content = content.gcd(entry)
        column, below = fmpz_mat(n, 1, [entry // content for entry in column.entries()]), below // content
    return tuple(fmpq(entry, below) for entry in column.entries())


def main() -> None:
    """Run the contestants, compare their last points, print the ratios."""
    m = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 80
    system = draw_with_eigenvalues([1, -2, 3, -4, 5, -6, 7, -8][:m], seed=7).chosen.system
    start = [fmpq(1, k + 2) for k in range(2 * m)]
    contestants: list[Callable[[QuadraticSystem, Sequence[fmpq], int], tuple[fmpq, ...]]] = [
        by_kahanmaps,
        by_integer_solve,
        by_rational_solve,
    ]
    results, times = [], []
    for contestant in contestants:
        begin = time.perf_counter()
        results.append(contestant(system, start, steps))
        times.append(time.perf_counter() - begin)
    if any(result != results[0] for result in results):
        raise SystemExit("the contestants do not agree")
    digits = len(str(results[0][0].q))
    print(f"m = {m}, {steps} steps, eps = {EPS}, last denominator {digits} digits; all agree exactly")
    for contestant, seconds in zip(contestants, times, strict=True):
        print(f"{contestant.__name__:<20} {seconds:8.3f} s   {seconds / times[0]:6.2f} times kahanmaps")


if __name__ == "__main__":
    main()
