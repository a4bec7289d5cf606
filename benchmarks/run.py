"""All benchmarks (`make bench`): runs them, prints ratios, and writes results.json here and docs/benchmarks.md.

    python benchmarks/run.py [--quick] [--only exact|fields|catalogue|iterate|float|degrees|analysis|memory|units]
        [--page]

--quick takes less than a minute, on shorter orbits, and writes nothing; --only runs one part, and leaves what is on
record of the others as it is; --page runs nothing and writes the page anew from the record. Peers that are absent are
left out with a word.
"""

from __future__ import annotations

import argparse
import contextlib
import datetime
import importlib
import importlib.metadata
import json
import platform
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import bench_analysis
import bench_catalogue
import bench_degrees
import bench_exact
import bench_iterate
import bench_memory
import flint
import units
from work import Absent, Row, format_ratio, gp_version, say, table

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results.json"
PAGE = HERE.parent / "docs" / "benchmarks.md"
PARTS = ("exact", "fields", "catalogue", "iterate", "float", "degrees", "analysis", "memory", "units")
PACKAGES = ("python-flint", "numpy", "cypari", "gmpy2", "sympy", "scipy", "numba", "heyoka")
FLOAT = "Float orbits"


def machine() -> dict[str, Any]:
    """What the figures were taken with."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists() and (found := re.search(r"model name\s*:\s*(.+)", info.read_text(encoding="utf-8"))):
        cpu = found.group(1)
    versions = {"FLINT": flint.__FLINT_VERSION__}
    for package in PACKAGES:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    with contextlib.suppress(Absent):
        versions["PARI/GP"] = gp_version()
    return {
        "cpu": cpu,
        "python": platform.python_version(),
        "versions": versions,
        "date": datetime.date.today().isoformat(),
    }


def measured(part: str, quick: bool) -> list[Row]:
    """The rows of one part; none if a package that it cannot do without is missing."""
    say(f"== {part}")
    if part == "exact":
        return bench_exact.measure(quick)
    if part == "fields":
        return bench_exact.over_fields(quick)
    if part == "catalogue":
        return bench_catalogue.measure(quick)
    if part == "iterate":
        return bench_iterate.measure(quick)
    if part == "degrees":
        return bench_degrees.measure(quick)
    if part == "analysis":
        return bench_analysis.measure(quick)
    if part == "memory":
        return bench_memory.measure(quick)
    if part == "units":
        return units.measure(quick)
    if quick:
        say("  left out: there is no quick form of it")
        return []
    try:
        bench_float = importlib.import_module("bench_float")
    except ImportError as error:
        say(f"  left out: {error}")
        return []
    return [{"group": FLOAT, **entry} for entry in bench_float.measure()]


# Claims --------------------------------------------------------------------------------------------------------------


def _value(rows: list[Row], contestant: str, work: str, key: str = "ratio") -> Any:
    for entry in rows:
        if entry["contestant"].startswith(contestant) and entry["work"].startswith(work):
            return entry[key]
    raise KeyError(contestant)


def _least_of_peers(rows: list[Row]) -> float:
    peers = [
        entry["ratio"]
        for entry in rows
        if entry["work"].startswith("m = 3, N = 80,") and not entry["contestant"].startswith("kahanmaps")
    ]
    if not peers:
        raise KeyError("peers")
    return min(peers)


def _least_of_longer(rows: list[Row]) -> float:
    ratios = [e["ratio"] for e in rows if (e["group"], e["contestant"]) == (bench_catalogue.LONG, bench_catalogue.PARI)]
    if not ratios:
        raise KeyError("longer")
    return min(ratios)


def _least_of_catalogue(rows: list[Row], relations: str = "") -> float:
    """FLINT's time over ours, for all systems or for those along whose orbits there are such relations."""
    here = [entry for entry in rows if entry["group"] == bench_catalogue.GROUP]
    notes = {entry["work"]: entry["note"] for entry in here if entry["contestant"] == bench_catalogue.OURS}
    chosen = {work for work, note in notes.items() if relations in note}
    ratios = [e["ratio"] for e in here if e["contestant"] == bench_catalogue.PLAIN and e["work"] in chosen]
    if not ratios:
        raise KeyError("catalogue")
    return min(ratios)


def _most_over_fields(rows: list[Row]) -> float:
    ratios = [
        e["ratio"]
        for e in rows
        if e["work"].startswith("m = 3, N = 80, chi") and e["contestant"].startswith("kahanmaps, this chi, normal form")
    ]
    if not ratios:
        raise KeyError("fields")
    return max(ratios)


def _multiplications(rows: list[Row]) -> float:
    note = _value(rows, "kahanmaps: doublings", "m = 3, n = 640,", "note")
    return float(note.split()[0])


def _slowest_process(rows: list[Row], dimension: int) -> float:
    here = [entry for entry in rows if entry["group"] == bench_analysis.PROCESSES]
    found = [entry["seconds"] for entry in here if entry["contestant"].endswith(f"dimension {dimension}")]
    if not found:
        raise KeyError("processes")
    return max(found)


def _most_memory(rows: list[Row]) -> float:
    here = [entry["note"] for entry in rows if entry["group"] == bench_memory.GROUP]
    if not here:
        raise KeyError("memory")
    return max(float(note.split()[0]) for note in here)


# What is claimed, the figure, and whether it is at least or at most that.
CLAIMS: list[tuple[str, Callable[[list[Row]], float], str, float]] = [
    (
        "every peer takes so many times as long as kahanmaps with reduced rationals in x (m = 3, N = 80)",
        _least_of_peers,
        "at least",
        20,
    ),
    (
        "every system of the catalogue: FLINT's plain solve takes so many times as long as kahanmaps",
        _least_of_catalogue,
        "at least",
        1,
    ),
    (
        "the same, where bilinear forms hold along the orbit",
        partial(_least_of_catalogue, relations=bench_catalogue.FORMS),
        "at least",
        5,
    ),
    (
        "the same, where coordinates are forms in Somos sequences",
        partial(_least_of_catalogue, relations=bench_catalogue.SOMOS),
        "at least",
        4,
    ),
    (
        "every integrable system of the catalogue, to 400,000 bits: PARI by hand takes so many times as long",
        _least_of_longer,
        "at least",
        4,
    ),
    (
        "members whose chi does not split take at most so many times as long as one whose chi does (m = 3, N = 80)",
        _most_over_fields,
        "below",
        3,
    ),
    (
        "exponent of N in the time of a whole orbit, normal coordinates alone",
        lambda rows: _value(rows, "kahanmaps, normal form: normal coordinates", "m = 3, N = 80 to 320"),
        "below",
        3.7,
    ),
    (
        "exponent of N in the time of a whole orbit, reduced rationals in x",
        lambda rows: _value(rows, "kahanmaps, normal form: reduced", "m = 3, N = 80 to 320"),
        "below",
        3.7,
    ),
    (
        "stepping takes so many times as long as the iterate n = 640 alone",
        lambda rows: _value(rows, "kahanmaps: stepping", "m = 3, n = 640,"),
        "at least",
        50,
    ),
    ("multiplications of the final size for the iterate n = 640 alone", _multiplications, "below", 10),
    (
        "milliseconds for the iterate n = 10^18 over GF(2^61 - 1) (a claim on absolute time)",
        lambda rows: _value(rows, "kahanmaps: doublings", "m = 3, n = 10^18", "seconds") * 1e3,
        "below",
        0.3,
    ),
    (
        "seconds of the process that has the iterate n = 2000 for its only task (another one)",
        lambda rows: _value(rows, bench_iterate.ALONE, "m = 3, n = 2000,", "seconds"),
        "below",
        8,
    ),
    (
        "seconds of the slowest process of `analyze` in dimension 6 (two processors, another one)",
        partial(_slowest_process, dimension=6),
        "below",
        10,
    ),
    (
        "seconds of the slowest process of `analyze` in dimension 3 (two processors, another one)",
        partial(_slowest_process, dimension=3),
        "below",
        1,
    ),
    ("megabytes of the largest process of long orbits, ensembles and batches", _most_memory, "below", 400),
]


def claims(rows: list[Row]) -> list[tuple[str, str, str, bool]]:
    """Every claim with its bound, the figure found and whether it holds; those without a figure are missing."""
    found = []
    for text, figure, how, bound in CLAIMS:
        try:
            value = figure(rows)
        except KeyError:
            continue
        found.append(
            (text, f"{how} {bound}", format_ratio(value), value >= bound if how == "at least" else value < bound)
        )
    return found


# The page ------------------------------------------------------------------------------------------------------------

HOW = """\
# Benchmarks

Written by `make bench`; `benchmarks/` has the scripts, `benchmarks/results.json` the figures with times.

Every contestant gets the same work on the same machine, one after the other on one core where nothing else is said,
and exact results have to be equal before a time counts: a disagreement stops the run. Short runs are repeated, and the
best processor time is taken. What is printed are ratios, since they survive a change of machine better than times do.
PARI/GP takes its own time, without start-up and output; finding the normal form (a fraction of a second, once a system)
is in no figure. Peers were given the best formulation that was found, and those that are slower but more natural as
well.

The exact system is a member of the family with integer coefficients, hidden by a symplectic integer matrix;
eps = 1/10.
"""

GROUPS = {
    bench_exact.GROUP: (
        "Time relative to kahanmaps with reduced rationals in x: more is slower. All other libraries solve the\n"
        "linear system of each step; rationals are reduced there as well, integers stand over one denominator in\n"
        "lowest terms. What is less work than that has a line of its own: one common denominator from which the\n"
        "last few bits are not removed, and normal coordinates without x. `fractions.Fraction` is too slow for\n"
        "N = 80: it runs up to N = 40, and is compared there."
    ),
    bench_exact.FIELDS: (
        "Time relative to the member of the same dimension whose chi splits, whose numbers are about as long. A plane\n"
        "over Q[t]/g stands for deg g planes, but multiplications in it take more than deg g of integers."
    ),
    bench_exact.GROWTH: (
        "The exponent e in time ~ N^e. The N-th iterate has about N^2 digits, so that the orbit as a whole has N^3."
    ),
    bench_catalogue.GROUP: (
        "Time relative to kahanmaps, which keeps integers over one common denominator, or fractions, and reduces the\n"
        "coordinates of the last iterate: more is slower. The peers have the same map, eps = 3/11 and start. FLINT\n"
        "has rationals throughout; PARI the quickest of three or four formulations by hand, which the line names:\n"
        "matsolve or the formulas of an explicit map on rationals, otherwise integers over one denominator in lowest\n"
        "terms.\n"
        "Orbits go to 100,000 bits or 400 steps. Systems with numbers that stay short are left out: there calls of\n"
        "Python are all that is measured."
    ),
    bench_catalogue.LONG: (
        "The same up to 400,000 bits or 2000 steps, for orbits with relations, and members of the family, these in "
        "normal form: searches, which take a fixed time, count for less. PARI has the formulation that was the\n"
        "quickest above."
    ),
    bench_iterate.OVER_Q: (
        "Time relative to kahanmaps' doublings: more is slower. `ellmul` does the heart of the task only: it\n"
        "multiplies the point T by n on each elliptic curve, and does not come back to x."
    ),
    bench_iterate.CATALOGUE: (
        "Time relative to the point n alone: its coordinates are forms in two sequences, whose terms near n come from "
        "those near n/2. That there is no pole on the way is seen by an orbit modulo a prime, which is in the time."
    ),
    bench_iterate.MODULO: (
        "As above. Here `ellmul`, compiled from C, is faster than kahanmaps, which is Python around single\n"
        "operations of FLINT, some twelve for each binary digit of n."
    ),
    bench_iterate.BALLS: "No peer; the exact iterate n = 80 was found to be in the balls.",
    FLOAT: (
        "Speed relative to the first line of each block: **more is faster**. Integrators solve another problem,\n"
        "the flow, and are what one would use instead."
    ),
    bench_degrees.GROUP: (
        "Time relative to kahanmaps, which walks two lines with different primes, compares them, and derives the\n"
        "degrees from the singularity patterns: a constant cost, most of the time where iterates are few. The second\n"
        "row is the lines alone, which is what the peers do, modulo 2^61 - 1. Polynomials with gcds are what\n"
        "kahanmaps does itself up to dimension 5; in dimension 6 it takes power series."
    ),
    bench_analysis.PROCESSES: (
        "No peer; `kahanmaps analyze NAME`, from the start of Python, on two processors. How fast these are,\n"
        "which may change by the hour, a product of long numbers tells."
    ),
    bench_memory.GROUP: (
        "No peer; memory at its peak, relative to the first line of each block. Orbits and results are written as\n"
        "they come. An orbit remembers terms of its sequences between n/2 and n; of the memory of a batch 128 MB are\n"
        "SQLite's for pages of the database (a batch of a million tasks took 191 MB)."
    ),
    bench_analysis.GROUP: (
        "Time relative to what `analyze` does first to count integrals: how many polynomials of each degree vanish\n"
        "along orbits modulo two primes. All of `analyze` includes degree 7, formulas, densities, proofs, degrees,\n"
        "singularities and symmetries."
    ),
    units.GROUP: (
        "Searches are bounded by counted work, so that their answers do not depend on the machine nor on its load.\n"
        "The ratio is units per microsecond of the processor; a unit is meant to be one, within a factor of three."
    ),
}


def page(record: dict[str, Any]) -> str:
    """docs/benchmarks.md."""
    rows: list[Row] = [entry for part in PARTS for entry in record["parts"].get(part, {}).get("rows", [])]
    lines = [HOW]
    held = claims(rows)
    if held:
        lines += ["## What is claimed", "", "| | claimed | here |", "|---|---:|---:|"]
        lines += [f"| {text} | {bound} | {value}{'' if holds else ' (missed)'} |" for text, bound, value, holds in held]
        lines.append("")
    for group in dict.fromkeys(entry["group"] for entry in rows):
        lines += [f"## {group}", "", GROUPS[group], ""]
        members = [entry for entry in rows if entry["group"] == group]
        for work in dict.fromkeys(entry["work"] for entry in members):
            head = "exponent" if group == bench_exact.GROWTH else "ratio"
            lines += [f"| {work} | {head} | |", "|---|---:|---|"]
            for entry in members:
                if entry["work"] == work:
                    note = entry["note"].replace("|", "\\|")
                    lines.append(
                        f"| {entry['contestant']} | {format_ratio(entry['ratio'])} | {note} |".replace("|  |", "| |")
                    )
            lines.append("")
    lines += ["## Measured with", ""]
    for part in PARTS:
        if part in record["parts"]:
            told = record["parts"][part]["machine"]
            versions = ", ".join(f"{name} {version}" for name, version in told["versions"].items())
            versions = versions.replace("PARI/GP gp", "PARI/GP").replace("PARI/GP cypari with PARI", "PARI/GP (cypari)")
            lines.append(f"* {part}: {told['cpu']}; Python {told['python']}, {versions}; {told['date']}")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="short orbits, less than a minute; nothing is written")
    parser.add_argument("--only", choices=PARTS, help="one part")
    parser.add_argument("--page", action="store_true", help="run nothing, write docs/benchmarks.md from results.json")
    options = parser.parse_args()
    if options.page:
        PAGE.write_text(page(json.loads(RESULTS.read_text(encoding="utf-8"))), encoding="utf-8")
        return
    parts = [options.only] if options.only else list(PARTS)
    record: dict[str, Any] = {"parts": {}}
    if not options.quick and RESULTS.exists():
        record = json.loads(RESULTS.read_text(encoding="utf-8"))
    rows: list[Row] = []
    for part in parts:
        found = measured(part, options.quick)
        rows += found
        if found:
            record["parts"][part] = {"machine": machine(), "rows": found}
    print(table(rows))
    for text, bound, value, holds in claims(rows):
        print(f"{'holds ' if holds else 'MISSED'} {text}: {value}, claimed {bound}")
    if not options.quick:
        RESULTS.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        PAGE.write_text(page(record), encoding="utf-8")
        say(f"Written: {RESULTS.relative_to(HERE.parent)} and {PAGE.relative_to(HERE.parent)}")


if __name__ == "__main__":
    main()
