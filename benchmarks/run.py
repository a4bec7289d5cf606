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
    if info.exists() and (result := re.search(r"model name\s*:\s*(.+)", info.read_text(encoding="utf-8"))):
        cpu = result.group(1)
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
    results = [entry["seconds"] for entry in here if entry["contestant"].endswith(f"dimension {dimension}")]
    if not results:
        raise KeyError("processes")
    return max(results)


def _most_memory(rows: list[Row]) -> float:
    here = [entry["note"] for entry in rows if entry["group"] == bench_memory.GROUP]
    if not here:
        raise KeyError("memory")
    return max(float(note.split()[0]) for note in here)


# Each claim: what is measured, how to read it from the rows, and the bound.
CLAIMS: list[tuple[str, Callable[[list[Row]], float], str, float]] = [
    (
        "smallest time of another program, relative to kahanmaps with reduced rationals in x (m = 3, N = 80)",
        _least_of_peers,
        "at least",
        20,
    ),
    (
        "smallest time of FLINT's plain solve relative to kahanmaps, over all systems of the catalogue",
        _least_of_catalogue,
        "at least",
        1,
    ),
    (
        "the same over the systems with bilinear forms along the orbit",
        partial(_least_of_catalogue, relations=bench_catalogue.FORMS),
        "at least",
        5,
    ),
    (
        "the same over the systems whose coordinates are forms in Somos sequences",
        partial(_least_of_catalogue, relations=bench_catalogue.SOMOS),
        "at least",
        4,
    ),
    (
        "smallest time of handwritten PARI code relative to kahanmaps, over the integrable systems, to 400,000 bits",
        _least_of_longer,
        "at least",
        4,
    ),
    (
        "largest time of a member whose chi does not split relative to one whose chi splits (m = 3, N = 80)",
        _most_over_fields,
        "below",
        3,
    ),
    (
        "exponent of N in the time of a complete orbit, normal coordinates alone",
        lambda rows: _value(rows, "kahanmaps, normal form: normal coordinates", "m = 3, N = 80 to 320"),
        "below",
        3.7,
    ),
    (
        "exponent of N in the time of a complete orbit, reduced rationals in x",
        lambda rows: _value(rows, "kahanmaps, normal form: reduced", "m = 3, N = 80 to 320"),
        "below",
        3.7,
    ),
    (
        "time of stepping to n = 640 relative to computing this iterate alone",
        lambda rows: _value(rows, "kahanmaps: stepping", "m = 3, n = 640,"),
        "at least",
        50,
    ),
    (
        "time of the iterate n = 640 alone, relative to one product of numbers of its length",
        _multiplications,
        "below",
        10,
    ),
    (
        "milliseconds for the iterate n = 10^18 over GF(2^61 - 1) (absolute time)",
        lambda rows: _value(rows, "kahanmaps: doublings", "m = 3, n = 10^18", "seconds") * 1e3,
        "below",
        0.3,
    ),
    (
        "seconds of a process that computes only the iterate n = 2000 (absolute time)",
        lambda rows: _value(rows, bench_iterate.ALONE, "m = 3, n = 2000,", "seconds"),
        "below",
        8,
    ),
    (
        "seconds of the slowest process of `analyze` in dimension 6 (absolute time, two processors)",
        partial(_slowest_process, dimension=6),
        "below",
        10,
    ),
    (
        "seconds of the slowest process of `analyze` in dimension 3 (absolute time, two processors)",
        partial(_slowest_process, dimension=3),
        "below",
        1,
    ),
    ("megabytes of the largest process of long orbits, ensembles and batches", _most_memory, "below", 400),
]


def claims(rows: list[Row]) -> list[tuple[str, str, str, bool]]:
    """Every claim with its bound, the figure found and whether it holds; those without a figure are missing."""
    results = []
    for text, figure, how, bound in CLAIMS:
        try:
            value = figure(rows)
        except KeyError:
            continue
        results.append(
            (text, f"{how} {bound}", format_ratio(value), value >= bound if how == "at least" else value < bound)
        )
    return results


# The page ------------------------------------------------------------------------------------------------------------

HOW = """\
# Benchmarks

`make bench` writes this page. The scripts are in `benchmarks/`, and the results with times in
`benchmarks/results.json`.

All programs get the same work on the same machine, one after the other, on one core unless stated otherwise. Exact
results are compared, and a disagreement stops the run. Short runs are repeated, and the best processor time counts. The
tables show ratios because they depend less on the machine than times do. PARI/GP measures its own time, without
start-up and output. No result includes the search for the normal form (a fraction of a second, once per system). Each
other program is used with the best formulation that we know, and also with slower ones that are more natural.

The exact system is a member of the commuting family with integer coefficients, in coordinates changed by a symplectic
integer matrix; eps = 1/10.
"""

GROUPS = {
    bench_exact.GROUP: (
        "Time relative to kahanmaps with reduced rationals in x: more is slower. All other libraries solve the\n"
        "linear system of each step. Their rationals are reduced as well, and their integers are over one\n"
        "denominator in lowest terms. Two lines are for variants of kahanmaps that do less work: the first computes x\n"
        "over one common denominator, which may have a factor of a few bits in common with all numerators; the second\n"
        "computes normal coordinates, and not x. `fractions.Fraction` is too slow for N = 80 and is compared for\n"
        "N = 40."
    ),
    bench_exact.FIELDS: (
        "Time relative to the member of the same dimension whose chi splits and whose numbers are about as long.\n"
        "A plane over Q[t]/g represents deg g planes, but a multiplication in it costs more than deg g\n"
        "multiplications of integers."
    ),
    bench_exact.GROWTH: (
        "The table gives the exponent e in time ~ N^e. The N-th iterate has about N^2 digits, so the complete\n"
        "orbit has about N^3."
    ),
    bench_catalogue.GROUP: (
        "Time relative to kahanmaps, which uses integers over one common denominator, or fractions, and reduces\n"
        "the coordinates of the last iterate: more is slower. The other programs have the same map, eps = 3/11\n"
        "and initial point. FLINT uses rationals. PARI uses the fastest of three or four formulations written by\n"
        "hand, named in the line: matsolve or the formulas of an explicit map on rationals, otherwise integers\n"
        "over one denominator in lowest terms. Orbits end at 100,000 bits or 400 steps. Systems whose numbers\n"
        "stay short are omitted, because their times would only measure calls of Python functions."
    ),
    bench_catalogue.LONG: (
        "The same comparison for orbits of up to 400,000 bits or 2000 steps: those with bilinear forms or Somos\n"
        "sequences, and those of members of the family in normal form. Searches, which take a fixed time, have\n"
        "less weight here. PARI uses the formulation that was the fastest in the section before."
    ),
    bench_iterate.OVER_Q: (
        "Time relative to the doublings of kahanmaps: more is slower. `ellmul` does only the main part of the\n"
        "task: it multiplies the point T by n on each elliptic curve, and does not compute x from the result."
    ),
    bench_iterate.CATALOGUE: (
        "Time relative to the point n alone: its coordinates are forms in two sequences, whose terms near n\n"
        "follow from those near n/2. An orbit modulo a prime shows that it meets no indeterminacy point; the time\n"
        "includes this."
    ),
    bench_iterate.MODULO: (
        "Time relative to the doublings of kahanmaps. `ellmul`, compiled from C, is faster here than kahanmaps,\n"
        "which calls single operations of FLINT from Python, some twelve for each binary digit of n."
    ),
    bench_iterate.BALLS: (
        "There is no other program to compare with. The balls were checked to contain the exact iterate n = 80."
    ),
    FLOAT: (
        "Speed relative to the first line of each block: **more is faster**. Integrators solve a different\n"
        "problem, the flow; they are what one would use instead."
    ),
    bench_degrees.GROUP: (
        "Time relative to kahanmaps, which computes the degrees on two lines with different primes, compares\n"
        "them, and derives the degrees from the singularities. The last part has a constant cost, which dominates\n"
        "if there are few iterates. The second row is the computation on lines alone, as in the other programs,\n"
        "modulo 2^61 - 1. Up to dimension 5 kahanmaps uses polynomials with gcds, too; in dimension 6 it uses\n"
        "power series."
    ),
    bench_analysis.PROCESSES: (
        "There is no other program to compare with. Each line is the time of `kahanmaps analyze NAME`, including the\n"
        "start of Python, on two processors. The speed of the machine may change by the hour; the first line, the\n"
        "time of a product of long numbers, measures it."
    ),
    bench_memory.GROUP: (
        "There is no other program to compare with. The numbers are peak memory relative to the first line of each\n"
        "block. Orbits and results are written as they are computed. An orbit keeps the terms of its sequences\n"
        "between n/2 and n. Up to 128 MB of the memory of a batch are SQLite's cache of database pages (a batch\n"
        "of a million tasks took 191 MB)."
    ),
    bench_analysis.GROUP: (
        "Time relative to the first part of `analyze`, which counts integrals by the number of polynomials of\n"
        "each degree that vanish along orbits modulo two primes. The complete `analyze` includes degree 7,\n"
        "formulas, densities, proofs, degrees, singularities and symmetries."
    ),
    units.GROUP: (
        "Searches are bounded by counted work, so that their results depend neither on the machine nor on its\n"
        "load. The ratio is units per microsecond of processor time; a unit should be one microsecond, within a\n"
        "factor of three."
    ),
}


def page(record: dict[str, Any]) -> str:
    """docs/benchmarks.md."""
    rows: list[Row] = [entry for part in PARTS for entry in record["parts"].get(part, {}).get("rows", [])]
    lines = [HOW]
    held = claims(rows)
    if held:
        lines += ["## Claims", "", "| | claimed | measured |", "|---|---:|---:|"]
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
            messages = record["parts"][part]["machine"]
            versions = ", ".join(f"{name} {version}" for name, version in messages["versions"].items())
            versions = versions.replace("PARI/GP gp", "PARI/GP").replace("PARI/GP cypari with PARI", "PARI/GP (cypari)")
            lines.append(f"* {part}: {messages['cpu']}; Python {messages['python']}, {versions}; {messages['date']}")
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
        result = measured(part, options.quick)
        rows += result
        if result:
            record["parts"][part] = {"machine": machine(), "rows": result}
    print(table(rows))
    for text, bound, value, holds in claims(rows):
        print(f"{'holds ' if holds else 'MISSED'} {text}: {value}, claimed {bound}")
    if not options.quick:
        RESULTS.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        PAGE.write_text(page(record), encoding="utf-8")
        say(f"Written: {RESULTS.relative_to(HERE.parent)} and {PAGE.relative_to(HERE.parent)}")


if __name__ == "__main__":
    main()
