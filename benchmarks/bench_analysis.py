"""`analyze`: relations along orbits in dimension 6 against the same by hand, and whole processes.

    python benchmarks/bench_analysis.py [--quick]

By hand: for every degree the values of all monomials at as many points of an orbit and eight more, and the rank of
that matrix modulo a prime; for two primes, with python-flint. kahanmaps takes the points that Macaulay's bound leaves.
"""

from __future__ import annotations

import random
import resource
import subprocess
import sys
import time
from functools import partial
from math import comb

from flint import fmpz, nmod_mat
from work import Row, require_equal, row, say, table, timed

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
PROCESSES = "Whole processes of analyze"
COMMAND = "kahanmaps analyze"
IN_DIMENSION_3 = [
    "euler_top",
    "dressing_chain_3",
    "volterra_periodic_3",
    "zhukovski_volterra_1",
    "zhukovski_volterra_2",
]
IN_DIMENSION_3 += ["lorenz", "todd"]
_SPARE = 8
_POWER = 63_093


def ours(file: SystemFile, degree: int) -> list[int]:
    """How many polynomials of degree at most 1, 2, ... vanish along orbits."""
    return list(orbit_profile(Laboratory(file).maps, max_degree=degree).nullities)


def by_hand(file: SystemFile, degree: int) -> list[int]:
    """The same with a row for every unknown."""
    return [min(_nullity(map_, d) for map_ in Laboratory(file).maps) for d in range(1, degree + 1)]


def _nullity(map_: ModularMap, degree: int) -> int:
    p, unknowns = map_.prime, comb(map_.dim + degree, degree)
    rng = random.Random(degree)
    x: tuple[int, ...] | None = tuple(rng.randrange(p) for _ in range(map_.dim))
    exponents = [m for d in range(degree + 1) for m in monomials(map_.dim, d)]
    rows: list[list[int]] = []
    while len(rows) < unknowns + _SPARE:
        assert x is not None  # no point of a random orbit modulo p is singular
        values: dict[tuple[int, ...], int] = {}
        for m in exponents:  # each is one before it times a variable
            k = next((k for k, e in enumerate(m) if e), None)
            values[m] = 1 if k is None else values[(*m[:k], m[k] - 1, *m[k + 1 :])] * x[k] % p
        rows.append(list(values.values()))
        x = map_.step(x)
    return unknowns - int(nmod_mat(rows, p).rank())


def process(name: str) -> tuple[float, float]:
    """The time that a command takes, and that of the processors."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "kahanmaps_cli", "analyze", name, "--json"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    took, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return took, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def whole_processes(names: list[str]) -> list[Row]:
    """Each the best of three; and a product of long numbers, which tells how fast the machine is."""
    number = fmpz(3) ** _POWER
    took, _ = timed(lambda: [number * (number + k) for k in range(1000)])
    what = f"a product of {number.bit_length():,} bits by FLINT"
    rows = [row(PROCESSES, what, COMMAND, took, None, f"{took:.2g} ms")]
    for name in names:
        took, processors = min(process(name) for _ in range(3))
        what, note = f"{name}, dimension {load(name).dim}", f"{took:.2g} s, of the processors {processors:.2g} s"
        rows.append(row(PROCESSES, what, COMMAND, took, None, note))
        say(f"  {what}: {note}")
    return rows


def measure(quick: bool = False) -> list[Row]:
    """The rows of this part."""
    rows = whole_processes(QUICK if quick else [*IN_DIMENSION_3, *WORKS])
    degree = 3 if quick else DEGREE
    for name in QUICK if quick else WORKS:
        file = load(name)
        seconds, result = timed(partial(ours, file, degree), most=3)
        slow, expected = timed(partial(by_hand, file, degree), most=2)
        require_equal(BY_HAND, expected, result)
        complete, _ = timed(partial(analyze, file), most=1)
        what = f"{name}, degree 1 to {degree}"
        for label, took in ((OURS, seconds), (BY_HAND, slow), (WHOLE, complete)):
            rows.append(row(GROUP, label, what, took, took / seconds))
    return rows


if __name__ == "__main__":
    print(table(measure("--quick" in sys.argv)))
