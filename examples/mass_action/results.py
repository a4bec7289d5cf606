"""The results of study.toml as tables in Markdown, from its database and from the output of read_networks.py.

    python results.py study.db read.txt           the tables
    python results.py study.db --check systems    compares the degrees with those of ../12_degrees_mod_p.py

The check and some columns are those of ../dysts/table.py.
"""

import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "dysts"))
from table import TERMS, check, degrees_of, densities, dynamical_degree, fixed_points, reports


def affine_integrals(report: dict) -> int:
    """How many integrals are linear: the conservation laws of the network."""
    return sum(entry["degrees"] == [1, 0] for entry in report["integrals"]["integrals"])


def row(name: str, report: dict) -> str:
    """A line of the table."""
    degrees = ", ".join(map(str, degrees_of(report)[:TERMS]))
    cells = [f"`{name}`", report["dim"], report["verdict"]["integrability"], report["verdict"]["integrals"]]
    cells += [affine_integrals(report), f"{degrees}, ...", report["degrees"]["growth"], dynamical_degree(report)]
    return f"| {' | '.join(map(str, [*cells, densities(report), fixed_points(report)]))} |"


def main(database: str, read: str) -> None:
    """Print the counts, and a line for each map."""
    found = reports(database)
    kinds = Counter(line.split("\t")[1] for line in Path(read).read_text().splitlines() if "\t" in line)
    print("| files | number |\n|---|---|")
    for kind, number in [("all", kinds.total()), *kinds.most_common()]:
        print(f"| {kind} | {number} |")
    print("\n| maps | number |\n|---|---|")
    print(f"| all | {len(found)} |")
    for words in (
        Counter(report["verdict"]["integrability"] for report in found.values()),
        Counter(f"{report['degrees']['growth']} growth" for report in found.values()),
        Counter(f"dynamical degree {dynamical_degree(report)}" for report in found.values()),
    ):
        for word, number in words.most_common():
            print(f"| {word} | {number} |")
    others = sum(report["verdict"]["integrals"] > affine_integrals(report) for report in found.values())
    print(f"| integrals other than the linear ones | {others} |")
    print("\n| network | n | verdict | integrals | linear | degrees | growth | dynamical degree ", end="")
    print("| density phi | fixed points |\n" + "|---" * 10 + "|")
    for name, report in sorted(found.items()):
        print(row(name, report))


if __name__ == "__main__":
    if sys.argv[2:3] == ["--check"]:
        sys.exit(check(reports(sys.argv[1]), sys.argv[3]) > 0)
    main(*sys.argv[1:])
