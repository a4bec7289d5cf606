"""Degrees of the iterates on a random line modulo a prime: kahanmaps against plain polynomials and rational functions.

    python benchmarks/bench_degrees.py [--quick]

The peers walk two lines modulo 2^61 - 1 at eps = 1/10 and remove common factors by gcds; kahanmaps walks two, each
modulo a prime of its own, compares them, and derives their degrees from the singularity patterns.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

from flint import fmpq, nmod_poly
from work import Absent, Row, require_equal, row, run_gp, say, table, timed

from kahanmaps import degree_growth, load
from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.laboratory.singular.singularities import Patterns, patterns
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem

GROUP = "Degrees of the iterates"
PRIME = 2**61 - 1
EPS = "1/10"
WORKS = [("planar_cubic_hamiltonian", 40), ("euler_top", 12), ("clebsch_first_flow", 8), ("lorenz", 7)]
WORKS += [("planar_cubic_hamiltonian", 80), ("euler_top", 28), ("clebsch_first_flow", 14), ("lorenz", 8)]
QUICK = [("planar_cubic_hamiltonian", 12), ("euler_top", 5)]
OURS = "kahanmaps, two lines compared, degrees derived"
ALONE = "kahanmaps, the lines alone, singularities known before"
POLYNOMIALS = "python-flint: minors of polynomial matrices, gcds, two lines"
PARI = "PARI/GP: matsolve over GF(p)(t), two lines"


def ours(system: QuadraticSystem, n: int, patterns: Patterns | None = None) -> list[int]:
    """The degrees from d_0 = 1 to d_n."""
    growth = degree_growth(system, EPS, max_terms=n, effort=8, max_degree=10**6, patterns=patterns)
    return list(growth.degrees)


LINES = (1, 2)


def _line(system: QuadraticSystem, seed: int) -> list[list[int]]:
    """A random affine line, as pairs of residues, and the homogenising coordinate."""
    rng = random.Random(seed)
    return [*([rng.randrange(PRIME), rng.randrange(PRIME)] for _ in range(system.dim)), [1]]


def _linear_forms(system: QuadraticSystem) -> list[list[list[Any]]]:
    """The coefficients of the linear forms in (X : Z) that are the entries of the matrix of the map."""
    equation = KahanMap(system, EPS, GF(PRIME)).equation
    return [[[dict(entry).get(k, 0) for k in range(system.dim + 1)] for entry in row] for row in equation.terms]


def polynomials(system: QuadraticSystem, n: int) -> tuple[float, list[int]]:
    """The same by homogeneous coordinates that are polynomials in t: Cramer's rule, then the content."""
    forms = _linear_forms(system)

    def run() -> list[int]:
        first, second = (walk(seed) for seed in LINES)
        require_equal(POLYNOMIALS, second, first)
        return first

    def walk(seed: int) -> list[int]:
        x = [nmod_poly(pair, PRIME) for pair in _line(system, seed)]
        degrees = [1]
        for _ in range(n):
            rows = [[_combination(entry, x) for entry in line] for line in forms]
            image = kernel_minors(rows)
            common = nmod_poly([0], PRIME)
            for entry in image:
                common = common.gcd(entry)
            x = [entry // common for entry in image]
            degrees.append(max(int(entry.degree()) for entry in x))
        return degrees

    return timed(run, most=2)


def _combination(coefficients: list[Any], x: list[nmod_poly]) -> nmod_poly:
    total = nmod_poly([0], PRIME)
    for coefficient, entry in zip(coefficients, x, strict=True):
        total = total + entry * int(coefficient)
    return total


def pari(system: QuadraticSystem, n: int) -> tuple[float, list[int]]:
    """The same by rational functions of t, which PARI reduces itself. Raises Absent."""
    forms = _linear_forms(system)
    size = system.dim
    entries = ", ".join(
        "[" + ", ".join("[" + ", ".join(f"Mod({int(c)}, p)" for c in entry) + "]" for entry in line) + "]"
        for line in forms
    )
    lines = (_line(system, seed) for seed in LINES)
    starts = [
        ", ".join(" + ".join(f"Mod({c}, p)*t^{k}" for k, c in enumerate(pair)) for pair in line) for line in lines
    ]
    program = [
        f"p = {PRIME}",
        f"L = [{entries}]",
        f"e(i, j, X) = sum(k = 1, {size + 1}, L[i][j][k]*X[k])",
        f"s(X) = matsolve(matrix({size}, {size}, i, j, e(i, j, X)), vector({size}, i, -e(i, {size + 1}, X))~)",
        f"h(y) = my(d = 1); for(i = 1, {size}, d = lcm(d, denominator(y[i]))); concat(Vec(y*d), [d])",
        f"w(X) = my(D = [1]); for(k = 1, {n}, X = h(s(X)); D = concat(D, [vecmax(apply(poldegree, X))])); D",
        f"gettime(); D = w([{starts[0]}]); E = w([{starts[1]}]); T = gettime()",
        "if(D != E, error(E))",
        "concat([T], D)",
    ]
    answer = [int(entry) for entry in run_gp(program)]
    return answer[0] / 1000, answer[1:]


PEERS: list[tuple[str, Callable[[QuadraticSystem, int], tuple[float, list[int]]]]] = [
    (POLYNOMIALS, polynomials),
    (PARI, pari),
]


def measure(quick: bool = False) -> list[Row]:
    """The rows of this part."""
    rows: list[Row] = []
    for name, n in QUICK if quick else WORKS:
        system = load(name).system
        seconds, degrees = timed(partial(ours, system, n), most=3)
        what = f"{name}, n = {n}, d_n = {degrees[-1]}"
        rows.append(row(GROUP, OURS, what, seconds, 1.0))
        alone, result = timed(partial(ours, system, n, patterns(system, fmpq(EPS))), most=3)
        require_equal(ALONE, result, degrees)
        rows.append(row(GROUP, ALONE, what, alone, alone / seconds))
        for label, run in PEERS:
            try:
                slow, result = run(system, n)
            except Absent as reason:
                say(f"  {label}: left out, {reason}")
                continue
            require_equal(label, result, degrees)
            rows.append(row(GROUP, label, what, slow, slow / seconds))
            say(f"  {what}: {label} {slow / seconds:.3g}")
    return rows


if __name__ == "__main__":
    print(table(measure("--quick" in sys.argv)))
