"""Counted work beside seconds: how many units a microsecond has, for each kind of work and each part of `analyze`.

    python benchmarks/units.py [--quick] [NAME ...]

Budgets are units, one about a microsecond of field operations on a laptop of 2020. The ratio is units per microsecond
of the processor: what is counted within a factor of three is between 1/3 and 3. With names of systems of the catalogue
only parts of `analyze` for these are measured.
"""

from __future__ import annotations

import random
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

from flint import fmpq
from work import Row, format_seconds, row, say, table

from kahanmaps import analyze, load
from kahanmaps.algebra import modular_matrices
from kahanmaps.algebra.functions import FunctionField
from kahanmaps.algebra.polynomials import monomials, ring
from kahanmaps.algebra.small_systems import echelon_basis, solve_system
from kahanmaps.algebra.work import Budget
from kahanmaps.documents.catalog import names, titles
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import monomial_values
from kahanmaps.laboratory.singular.singularities import singularities
from kahanmaps.laboratory.symmetry.commuting_space import commuting_space
from kahanmaps.laboratory.symmetry.signed_permutations import signed_permutations
from kahanmaps.systems.quadratic import QuadraticSystem

GROUP = "Units of work"
KINDS, PARTS = "kinds of work", "parts of analyze in dimension {}"
LEAST = 0.2  # seconds below which a part of `analyze` says nothing
PRIME = 2**61 - 1
QUICK = ["euler_top", "weierstrass"]

Sized = tuple[str, str, Callable[[], Any]]


def kinds() -> Iterator[Sized]:
    """The kinds of work, each with its size and a call that does it."""
    rng = random.Random(1)
    for size in (30, 100, 300):
        rows = [[rng.randrange(PRIME) for _ in range(size)] for _ in range(size)]
        yield "linear algebra modulo p", f"{size} x {size}", lambda rows=rows: modular_matrices.rank(rows, PRIME)
    for name, steps in (("euler_top", 2000), ("three_wave", 500)):
        map_ = Laboratory(load(name)).maps[0]
        yield "points modulo p", f"{name}, {steps} steps", lambda map_=map_, steps=steps: map_.orbit(steps)
    for dim, degree in ((3, 8), (6, 6)):
        point = [rng.randrange(PRIME) for _ in range(dim)]

        def values(point: list[int] = point, degree: int = degree) -> None:
            for _ in range(100):
                monomial_values(tuple(point), degree, PRIME)

        yield "values of monomials", f"dimension {dim}, degree {degree}, 100 points", values
    field = FunctionField(["x", "y", "z"])
    for power in (4, 8, 12):

        def expand(power: int = power) -> None:
            x, y, z = field.variables
            base, product = 1 + x + 2 * y - 3 * z, field.one
            for _ in range(power):
                product = product * base

        yield "products of polynomials", f"(1 + x + 2 y - 3 z)^{power}", expand
    for name in ("weierstrass", "euler_top", "paper_m2"):
        system = load(name).system
        yield "heights of orbits", name, lambda system=system: height_survey(system, starts=1, max_digits=5_000)
        yield "degrees", name, lambda system=system: degree_growth(system, max_terms=8, enclosed=False)
        yield "power series", name, lambda system=system: singularities(system, "1/7")
    for dim in (3, 6, 8):
        variables = [f"x{i}" for i in range(dim)]
        f = QuadraticSystem.from_text(
            variables, [f"{v}*(x{(i + 1) % dim} - {i + 1}*x{(i + 2) % dim})" for i, v in enumerate(variables)]
        )
        yield "linear algebra over Q", f"[f, g] = 0 in dimension {dim}", lambda f=f: commuting_space(f, "quadratic")
    for name in ("three_wave", "clebsch_first_flow"):
        f = load(name).system
        yield "signed permutations", name, lambda f=f: signed_permutations(f, 1, Budget())
    for dim, degree in ((2, 4), (3, 3), (4, 2)):
        context = ring([f"x{i}" for i in range(dim)])
        support = [m for k in range(degree + 1) for m in monomials(dim, k)]
        equations = echelon_basis(context.from_dict({m: fmpq(rng.randint(-9, 9)) for m in support}) for _ in range(dim))
        yield (
            "small systems",
            f"{dim} equations of degree {degree}",
            lambda equations=equations, context=context: solve_system(equations, context.gens(), Budget()),
        )


def counted_row(name: str, work: str, size: str, seconds: float, units: int) -> Row:
    """One line: the ratio is units per microsecond."""
    note = f"{size}: {units:,} units, {format_seconds(seconds)}"
    return row(GROUP, name, work, seconds, units / 1e6 / seconds if units else None, note)


def parts_of(name: str) -> Iterator[Row]:
    """A line for each part of `analyze` that takes some time."""
    before: dict[str, Any] = {"pending": None, "time": time.process_time(), "units": 0}
    results: list[tuple[str, float, int]] = []

    def on_result(analysis: Analysis) -> None:
        now = time.process_time()
        if before["pending"] is not None:
            (part,) = set(before["pending"]) - set(analysis.pending)
            results.append((part, now - before["time"], analysis.units - before["units"]))
        before.update(pending=list(analysis.pending), time=now, units=analysis.units)

    dim = analyze(load(name), on_result=on_result).dim
    for part, seconds, units in results:
        if seconds >= LEAST:
            yield counted_row(part, PARTS.format(dim), name, seconds, units)


def measure(quick: bool, systems: list[str] | None = None) -> list[Row]:
    """All rows, the parts of `analyze` by dimension and name."""
    rows: list[Row] = []
    for kind, size, work in () if systems else kinds():
        seconds, units = float("inf"), 0
        for _ in range(1 if quick else 3):
            budget, begin = Budget(), time.process_time()
            work()
            seconds, units = min(seconds, time.process_time() - begin), budget.spent
        rows.append(counted_row(kind, KINDS, size, seconds, units))
    of_parts: list[Row] = []
    for name in systems or (QUICK if quick else sorted(names(), key=lambda name: titles()[name][0])):
        say(name)
        of_parts += parts_of(name)
    order = list(dict.fromkeys(entry["contestant"] for entry in of_parts))
    return rows + sorted(of_parts, key=lambda entry: (entry["work"], order.index(entry["contestant"])))


if __name__ == "__main__":
    print(table(measure("--quick" in sys.argv, [name for name in sys.argv[1:] if not name.startswith("-")])))
