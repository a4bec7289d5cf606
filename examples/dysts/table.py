"""The results of study.toml as a table in Markdown, from its database.

    python table.py study.db                    the table
    python table.py study.db --check systems    compares its degrees with those of ../12_degrees_mod_p.py

The check shares no code with the study: it computes degrees by their definition, over GF(2^61 - 1).
"""

import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import kahanmaps as km

PRIME = 2**61 - 1
TERMS = 5


def reports(database: str) -> dict[str, dict[str, Any]]:
    """The complete reports, by name of the system."""
    with km.Store.open(database, readonly=True) as store:
        rows = [row for row in store.rows(["analyze"]) if row.record is not None and row.record.is_ok]
        return {row.task.system["name"]: dict(row.record.result["report"]) for row in rows}


def degrees_of(report: dict[str, Any]) -> list[int]:
    """d_1, d_2, ..."""
    return [int(degree) for degree in report["degrees"]["degrees"]][1:]


def dynamical_degree(report: dict[str, Any]) -> str:
    """Rounded, with the word for its certainty."""
    degrees = report["degrees"]
    if degrees["dynamical_degree"] is None:
        return f"{degrees['estimate']} (estimated)" if degrees["looks_exponential"] else "undecided"
    value = degrees["dynamical_degree"]["value"]
    return value if "." not in value else f"{float(value):.6f}"


def densities(report: dict[str, Any]) -> str:
    """phi, or how far was searched."""
    found = report["densities"]
    if found["densities"]:
        return ", ".join(f"`{density['phi']}`" for density in found["densities"])
    return f"none to degree {found['degree_tried']}"


def fixed_points(report: dict[str, Any]) -> str:
    """How many complex ones, and components of larger dimension."""
    found = report["fixed_points"]
    isolated = sum(part["count"] for part in found["found"] if part["dimension"] == 0)
    larger = Counter(part["dimension"] for part in found["found"] if part["dimension"] > 0)
    words = [str(isolated)] if isolated or not larger else []
    words += [f"{number} of dimension {dimension}" for dimension, number in sorted(larger.items())]
    return " and ".join(words) + (" (undecided)" if found["undecided"] else "")


def row(name: str, report: dict[str, Any]) -> str:
    """A line of the table."""
    verdict, degrees = report["verdict"], degrees_of(report)
    shown = ", ".join(map(str, degrees[:TERMS]))
    cells = [
        f"`{name}`",
        report["dim"],
        verdict["integrability"],
        verdict["integrals"],
        f"{shown}, ...",
        dynamical_degree(report),
        densities(report),
        fixed_points(report),
    ]
    return f"| {' | '.join(map(str, cells))} |"


def print_table(found: dict[str, dict[str, Any]]) -> None:
    """The table, and how often each growth occurs."""
    print("| system | n | verdict | integrals | degrees | dynamical degree | density phi | fixed points |")
    print("|---|---|---|---|---|---|---|---|")
    for name, report in sorted(found.items()):
        print(row(name, report))
    print()
    verdicts = Counter(report["verdict"]["integrability"] for report in found.values())
    print(
        f"{len(found)} systems:", ", ".join(f"{number} {verdict}" for verdict, number in verdicts.most_common()) + "."
    )
    factors = Counter(dynamical_degree(report) for report in found.values())
    print("Dynamical degrees:", ", ".join(f"{factor} ({number})" for factor, number in factors.most_common()) + ".")


def check(found: dict[str, dict[str, Any]], folder: str) -> int:
    """The number of systems whose degrees are others than by the definition."""
    script = Path(__file__).parent.parent / "12_degrees_mod_p.py"
    wrong = 0
    for name, report in sorted(found.items()):
        words = [str(Path(folder) / f"{name}.toml"), "--primes", str(PRIME), "--terms", str(TERMS)]
        done = subprocess.run([sys.executable, script, *words], check=True, capture_output=True, text=True)
        expected = [int(text) for text in done.stdout.partition(") ")[2].split(", ")]
        if degrees_of(report)[:TERMS] != expected:
            wrong += 1
            print(f"{name}: {degrees_of(report)[:TERMS]} in the study, {expected} by the definition")
    print(f"{len(found) - wrong} of {len(found)} systems have the degrees of the definition, to the term {TERMS}")
    return wrong


if __name__ == "__main__":
    database, *options = sys.argv[1:]
    if options[:1] == ["--check"]:
        sys.exit(check(reports(database), *options[1:]) > 0)
    print_table(reports(database))
