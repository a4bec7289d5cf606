"""`analyze` in dimension 6, and the relations along orbits in it, against the same relations by hand.

    python benchmarks/bench_analysis.py [--quick]

By hand: for every degree the values of all monomials at as many points of an orbit and eight more, and the rank of
that matrix modulo a prime; for two primes, with python-flint. kahanmaps takes the points that Macaulay's bound leaves.
"""

from __future__ import annotations

import random
import sys
from functools import partial
from math import comb

from flint import nmod_mat
from work import Row, require_equal, row, table, timed

from kahanmaps import analyze, load
from kahanmaps.algebra.polynomials import monomials
from kahanmaps.documents.files import SystemFile
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import ModularMap
from kahanmaps.laboratory.preserve.hirota_kimura import orbit_profile

GROUP = "Analysis in dimension 6"
WORKS = ["clebsch_first_flow", "kirchhoff_case", "so4_euler_manakov", "lagrange_top", "three_wave", "paper_m3"]
QUICK = ["three_wave"]
DEGREE = 6
OURS = "kahanmaps: relations along orbits"
BY_HAND = "python-flint: the same by square matrices"
WHOLE = "kahanmaps: all of analyze"
_SPARE = 8


def ours(file: SystemFile, degree: int) -> list[int]:
    """How many polynomials of degree at most 1, 2, ... vanish along orbits."""
    return list(orbit_profile(Laboratory(file).maps, max_degree=degree, seconds=600).nullities)


def by_hand(file: SystemFile, degree: int) -> list[int]:
    """The same with a row for every unknown."""
    return [min(_nullity(map_, d) for map_ in Laboratory(file).maps) for d in range(1, degree + 1)]


def _nullity(map_: ModularMap, degree: int) -> int:
    p, unknowns = map_.prime, comb(map_.dim + degree, degree)
    rng = random.Random(degree)
    x: tuple[int, ...] | None = tuple(rng.randrange(p) for _ in range(map_.dim))
    exponents = [m for d in range(degree + 1) for m in monomials(map_.dim, d)]
    rows = []
    while len(rows) < unknowns + _SPARE:
        assert x is not None  # no point of a random orbit modulo p is singular
        values: dict[tuple[int, ...], int] = {}
        for m in exponents:  # each is one before it times a variable
            k = next((k for k, e in enumerate(m) if e), None)
            values[m] = 1 if k is None else values[(*m[:k], m[k] - 1, *m[k + 1 :])] * x[k] % p
        rows.append(list(values.values()))
        x = map_.step(x)
    return unknowns - int(nmod_mat(rows, p).rank())


def measure(quick: bool = False) -> list[Row]:
    """The rows of this part."""
    rows: list[Row] = []
    degree = 3 if quick else DEGREE
    for name in QUICK if quick else WORKS:
        file = load(name)
        seconds, found = timed(partial(ours, file, degree), most=3)
        slow, expected = timed(partial(by_hand, file, degree), most=2)
        require_equal(BY_HAND, expected, found)
        whole, _ = timed(partial(analyze, file), most=1)
        what = f"{name}, degree 1 to {degree}"
        for label, took in ((OURS, seconds), (BY_HAND, slow), (WHOLE, whole)):
            rows.append(row(GROUP, label, what, took, took / seconds))
    return rows


if __name__ == "__main__":
    print(table(measure("--quick" in sys.argv)))
