"""What one coordinator does in a second: records read and stored, and short tasks on this machine.

    python benchmarks/scaling.py [--quick]

Prints the tables of docs/scaling.md.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

from kahanmaps.experiments.results.records import Outcome, Record, Task, TaskLimits
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.cluster import record_on
from kahanmaps.experiments.running.run import Batch, executor_for, plan
from kahanmaps.experiments.spec import parse_spec

JOBS = 2
SIZES = (500, 5_000, 50_000)  # bytes of a record


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Markdown."""
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(entry) for entry in line) + " |" for line in lines) + "\n"


def costs_of_a_record(folder: Path, number: int, size: int) -> list[object]:
    """Seconds to read the line of a record, and to store it: one a transaction, and a hundred."""
    versions = {"flint": "3.6.0", "kahanmaps": "0.1.0", "python": "3.11.7", "python-flint": "0.9.0"}
    result = {"numbers": ["1234567/89"] * max(0, (size - 400) // 14)}
    family = {"draw": "eigenvalues", "m": 3}
    tasks = [Task("check-commute", {"family": {**family, "seed": n}}, {"eps": "1/10"}) for n in range(number)]
    made = [Record(task.key, Outcome.OK, result, "proved", host="node", versions=versions) for task in tasks]
    lines = [json.dumps(record.to_json()).encode() for record in made]
    start = time.perf_counter()
    records = [record for record in map(record_on, lines) if record is not None]
    costs = [(time.perf_counter() - start) / number]
    for chunk in (1, 100):
        with Store.open(folder / f"{size}-{chunk}.db", create=True) as store:
            store.plan("scaling", f"{number} tasks", TaskLimits(time=600.0), tasks, {})
            start = time.perf_counter()
            for first in range(0, number, chunk):
                store.add(records[first : first + chunk])
            costs.append((time.perf_counter() - start) / number)
    rate = f"{1 / (costs[0] + costs[2]):,.0f}"
    return [f"{len(lines[0]) / 1000:.1f} kB", *(f"{1e6 * cost:.0f}" for cost in costs), rate]


def costs_of_a_task(folder: Path, number: int, group_seconds: float) -> list[object]:
    """A batch of short real tasks on two workers: what a task costs beyond its own time, and how often a second."""
    name = "own worker" if group_seconds == 0 else f"{group_seconds:g} s"
    axes = f'{{m = [2], seed = "0..{number - 1}"}}'
    spec = parse_spec(f'[experiments.space]\ntask = "family-space"\nsystem = "family"\naxes = {axes}')
    with Store.open(folder / f"{number} {name}.db", create=True) as store:
        begin = time.perf_counter()
        plan(spec, store)
        planned_in = time.perf_counter() - begin
        begin, own = time.perf_counter(), 0.0
        for records in Batch(store.pending(), executor_for(store.document, JOBS, group_seconds=group_seconds)):
            store.add(records)
            own += sum(record.seconds for record in records)
        elapsed = time.perf_counter() - begin
    overhead = (JOBS * elapsed - own) / number
    rate = f"{number / elapsed:,.0f}"
    return [name, number, f"{1e3 * own / number:.2f}", f"{1e3 * overhead:.2f}", rate, f"{1e3 * planned_in:.0f}"]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of everything")
    tenth = 10 if parser.parse_args().quick else 1
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [costs_of_a_record(folder, 2000 // tenth, size) for size in SIZES]
        header = ["a record of", "read, us", "stored alone, us", "stored among 100, us", "records each second"]
        print(table(header, rows))
        rows = [costs_of_a_task(folder, n // tenth, s) for n, s in ((2000, 5.0), (20_000, 5.0), (200, 0.0))]
        header = ["a worker serves for", "tasks", "own, ms", "on top, ms", "tasks each second", "planned in, ms"]
        print(table(header, rows))


if __name__ == "__main__":
    main()
