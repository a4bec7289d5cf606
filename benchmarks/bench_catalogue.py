"""Exact orbits of the systems and maps of the catalogue: kahanmaps without normal form against FLINT's plain solve.

    python benchmarks/bench_catalogue.py [--quick]

Both take the same steps at eps = 3/11 from one start, as many as give numbers long enough to be measured. kahanmaps has
integers over one denominator, on many orbits bilinear forms, and reduces the coordinates of the last iterate.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

from flint import fmpq
from work import Row, require_equal, row, say, table, timed

from kahanmaps import Orbit, load
from kahanmaps.documents.catalog import map_names, names

GROUP = "Exact orbits of the catalogue"
OURS = "kahanmaps without normal form"
PLAIN = "FLINT: fmpq_mat.solve, rationals"
FORMS = "bilinear forms"
EPS = fmpq(3, 11)
START = tuple(fmpq(p, q) for p, q in ((1, 2), (-1, 3), (2, 5), (1, 1), (3, 4), (-2, 7)))
BITS, QUICK_BITS, LEAST_BITS, MOST_STEPS = 100_000, 6_000, 6_000, 400
QUICK = ("euler_top", "henon_heiles", "fibonacci")


Pairs = list[tuple[Any, Any]]  # the coordinates in lowest terms


def ours(map_over: Any, steps: int) -> Pairs:
    """The last iterate of an orbit."""
    *_, last = Orbit(map_over, START[: map_over.dim], steps, max_digits=None)
    return last.value.lowest_terms()


def plain(map_over: Any, steps: int) -> Pairs:
    """The last iterate by rationals, one linear system a step."""
    x = START[: map_over.dim]
    for _ in range(steps):
        x = map_over.generic_step(x)
    return [(entry.p, entry.q) for entry in x]


def measure(quick: bool = False) -> list[Row]:
    """A block for each system whose orbit becomes long enough, without poles on the way."""
    rows = []
    for name in QUICK if quick else (*names(), *map_names()):
        map_over, bits = load(name).map.at(EPS), QUICK_BITS if quick else BITS
        steps = 0
        orbit = Orbit(map_over, START[: map_over.dim], MOST_STEPS, max_digits=None)
        for point in orbit:
            steps = point.step
            if point.value.bits > bits:
                break
        if point.value.bits < LEAST_BITS:
            say(f"  {name}: left out, its orbit ends or has short numbers")
            continue
        since = orbit.bilinear_since
        note = "" if since is None else f"dimension {map_over.dim}, {FORMS} from step {since} on"
        best, found = timed(partial(ours, map_over, steps), 1.0)
        seconds, expected = timed(partial(plain, map_over, steps), 1.0)
        require_equal(PLAIN, expected, found)
        work = f"{name}, N = {steps}, {point.value.bits:,} bits"
        rows += [row(GROUP, OURS, work, best, 1.0, note), row(GROUP, PLAIN, work, seconds, seconds / best)]
        say(f"  {work}: {seconds / best:.3g}")
    return rows


if __name__ == "__main__":
    print(table(measure("--quick" in sys.argv[1:])))
