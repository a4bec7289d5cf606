"""Exact orbits of the systems and maps of the catalogue: kahanmaps against FLINT and PARI.

    python benchmarks/bench_catalogue.py [--quick]

All take the same steps at eps = 3/11 from one start, as many as give numbers long enough to be measured. kahanmaps has
integers over one denominator or fractions, on many orbits relations between points, and reduces the last iterate.
Members of the family go without their normal form first. Orbits with relations and members have a longer run as well.
"""

from __future__ import annotations

import re
import subprocess
import sys
from functools import partial, reduce
from typing import Any

from bench_exact import GP_STEPS, gp_orbit
from flint import fmpq, fmpz
from work import Absent, Row, require_equal, row, say, table, timed

from kahanmaps import Orbit, load
from kahanmaps.documents.catalog import map_names, names
from kahanmaps.family.system_normal_form import SystemNormalForm, system_normal_form

GROUP, LONG = "Exact orbits of the catalogue", "Longer exact orbits of the integrable systems of the catalogue"
OURS, NORMAL = "kahanmaps without normal form", "kahanmaps, normal form"
PLAIN = "FLINT: fmpq_mat.solve, rationals"
PARI = "PARI/GP by hand"
SOMOS, FORMS = "Somos sequences", "bilinear forms"
EPS = fmpq(3, 11)
START = tuple(fmpq(p, q) for p, q in ((1, 2), (-1, 3), (2, 5), (1, 1), (3, 4), (-2, 7)))
BITS, QUICK_BITS, LEAST_BITS, MOST_STEPS = 100_000, 6_000, 6_000, 400
LONG_BITS, LONG_STEPS = 400_000, 2000
QUICK = ("euler_top", "henon_heiles", "fibonacci")


Pairs = list[tuple[Any, Any]]  # the coordinates in lowest terms


def ours(map_over: Any, steps: int, normal_form: SystemNormalForm | None = None) -> Pairs:
    """The last iterate of an orbit."""
    *_, last = Orbit(map_over, START[: map_over.dim], steps, max_digits=None, normal_form=normal_form)
    return last.value.lowest_terms()


def plain(map_over: Any, steps: int) -> Pairs:
    """The last iterate by rationals, one linear system a step."""
    x = START[: map_over.dim]
    for _ in range(steps):
        x = map_over.generic_step(x)
    return [(entry.p, entry.q) for entry in x]


def pari(map_over: Any, steps: int, way: str = "") -> tuple[float, Pairs, str]:
    """One formulation by hand, or the quickest of some: its time, the last iterate, and what it is. Raises Absent."""
    start = ", ".join(map(str, START[: map_over.dim]))
    program = [*GP_STEPS, f"start = [{start}]~"]
    rational, complete = [], []
    is_explicit = True
    for k, item in enumerate(map_over.factors):
        rows = [_integral(row) for row in item.equation.polynomials()]
        matrix = ";".join(",".join(map(_written, row[:-1])) for row in rows)
        side = ",".join(_written(-row[-1]) for row in rows)
        program += [f"matrix{k}(x, z) = [{matrix}]", f"side{k}(x, z) = [{side}]~"]
        complete.append(f"r = step(matrix{k}(r[1], r[2]), side{k}(r[1], r[2]), r[2])")
        if all(i == j or entry.is_zero() for i, row in enumerate(rows) for j, entry in enumerate(row[:-1])):
            formulas = ",".join(f"({_written(-row[-1])})/({_written(row[i])})" for i, row in enumerate(rows))
            rational.append(f"x = subst_one((x, z) -> [{formulas}]~, x)")
        else:
            is_explicit = False
            rational.append(f"x = matsolve(matrix{k}(x, 1), side{k}(x, 1))")
    program += [
        "subst_one(f, x) = f(x, 1)",
        f"rational(N) = {{my(x = start); for(k = 1, N, {'; '.join(rational)}); x}}",
        "orbit(step, N) = {my(d = denominator(start), r = [start*d, d]);"
        f" for(k = 1, N, {'; '.join(complete)}); r[1]/r[2]}}",
    ]
    ways = {"formulas on rationals" if is_explicit else "matsolve on rationals": f"rational({steps})"}
    ways |= {f"{name} on integers": f"orbit(by_{name[3:]}, {steps})" for name in ("matsolve", "matadjoint")}
    if map_over.dim % 2 == 0 and map_over.dim > 2:
        ways["elimination on integers"] = f"orbit(by_elimination, {steps})"
    result = {}
    for name, orbit in ways.items() if not way else ():
        try:
            result[name] = gp_orbit(program, orbit, 0.0)
        except (RuntimeError, subprocess.CalledProcessError):  # pivots that are 0
            continue
    way = way or min(result, key=lambda name: result[name][0])
    return *gp_orbit(program, ways[way], 1.0), way


def _integral(row: list[Any]) -> list[Any]:
    below = reduce(fmpz.lcm, (c.q for entry in row for c in entry.coeffs()), fmpz(1))
    return [entry * below for entry in row]


def _written(polynomial: Any) -> str:
    return re.sub(r"x(\d+)", r"x[\1]", str(polynomial))


def measure(quick: bool = False) -> list[Row]:
    """A block for each system whose orbit becomes long enough, without poles on the way; longer ones come last."""
    rows, longer = [], list[Row]()
    for name in QUICK if quick else (*names(), *map_names()):
        file = load(name)
        map_over = file.map.at(EPS)
        orbit, steps, bits = _reached(map_over, MOST_STEPS, QUICK_BITS if quick else BITS)
        if bits < LEAST_BITS:
            say(f"  {name}: left out, its orbit ends or has short numbers")
            continue
        note = "" if orbit.relations is None else f"dimension {map_over.dim}, {orbit.relations}"
        best, result = timed(partial(ours, map_over, steps), 1.0)
        seconds, expected = timed(partial(plain, map_over, steps), 1.0)
        require_equal(PLAIN, expected, result)
        work = f"{name}, N = {steps}, {bits:,} bits"
        rows += [row(GROUP, OURS, work, best, 1.0, note), row(GROUP, PLAIN, work, seconds, seconds / best)]
        say(f"  {work}: {seconds / best:.3g}")
        try:
            seconds, expected, way = pari(map_over, steps)
        except Absent as absent:
            say(f"  {absent}")
            continue
        require_equal(PARI, expected, result)
        rows.append(row(GROUP, PARI, work, seconds, seconds / best, way))
        say(f"    PARI: {seconds / best:.3g}, {way}")
        normal_form = system_normal_form(file.system) if file.is_quadratic else None
        normal = normal_form if isinstance(normal_form, SystemNormalForm) and normal_form.form.m > 1 else None
        if not quick and (note or normal):
            longer += _longer(name, map_over, normal, way)
    return rows + longer


def _reached(map_over: Any, steps: int, bits: int) -> tuple[Orbit, int, int]:
    """An orbit up to a number of steps or of bits, and both for its last point."""
    orbit = Orbit(map_over, START[: map_over.dim], steps, max_digits=None)
    for point in orbit:
        if point.value.bits > bits:
            break
    return orbit, point.step, point.value.bits


def _longer(name: str, map_over: Any, normal: SystemNormalForm | None, way: str) -> list[Row]:
    """A longer orbit, of a member of the family in normal form, against the quickest way of PARI."""
    _, steps, bits = _reached(map_over, LONG_STEPS, LONG_BITS)
    best, result = timed(partial(ours, map_over, steps, normal), 1.0)
    seconds, expected, _ = pari(map_over, steps, way)
    require_equal(PARI, expected, result)
    work = f"{name}, N = {steps}, {bits:,} bits"
    say(f"  {work}: PARI {seconds / best:.3g}")
    contestant = OURS if normal is None else NORMAL
    return [row(LONG, contestant, work, best, 1.0), row(LONG, PARI, work, seconds, seconds / best, way)]


if __name__ == "__main__":
    print(table(measure("--quick" in sys.argv[1:])))
