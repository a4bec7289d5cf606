"""Memory of whole processes: long orbits as text, ensembles with many steps, batches of many tasks.

    python benchmarks/bench_memory.py [--quick]

No peer. Each block has the same command for less and for more work, and the memory of the largest of its processes at
its peak, relative to the first.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from work import Row, row, say, table

GROUP = "Memory of whole processes"
ORBIT, ENSEMBLE, BATCH = "kahanmaps orbit", "kahanmaps ensemble", "kahanmaps batch run"
# A small process starts the command: what one has that forks counts for its child.
STARTER = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
SPEC = """
[experiments.orbit]
task = "orbit"
system = "lotka_volterra"
axes = {{ seed = "0..{last}" }}
options = {{ eps = "1/10", steps = 3 }}
"""


def peak(*arguments: str) -> tuple[float, float]:
    """The megabytes that a command of kahanmaps needs at its peak, in one of its processes, and its seconds."""
    began = time.perf_counter()
    command = [sys.executable, "-c", STARTER, sys.executable, "-m", "kahanmaps_cli", *arguments]
    answer = subprocess.run(command, check=True, capture_output=True, text=True)
    return int(answer.stdout) / 1024, time.perf_counter() - began


def orbit(folder: Path, steps: int) -> tuple[float, float, str]:
    """An exact orbit to a file."""
    file = folder / f"orbit{steps}.txt"
    given = ("nahm_tetrahedral", "--start", "1/2,-1/3", "--eps", "3/11", "--max-digits", "1000000")
    megabytes, seconds = peak("orbit", *given, "--steps", str(steps), "-o", str(file))
    return megabytes, seconds, f"{file.stat().st_size / 1e6:.0f} MB of text"


def ensemble(folder: Path, steps: int) -> tuple[float, float, str]:
    """A thousand float orbits."""
    return *peak("ensemble", "paper_m2", "--random", "1000", "--eps", "1/10", "--steps", str(steps)), "1,000 orbits"


def batch(folder: Path, tasks: int) -> tuple[float, float, str]:
    """Many short tasks in two children, with the results in a database."""
    file = folder / f"tasks{tasks}.toml"
    file.write_text(SPEC.format(last=tasks - 1), encoding="utf-8")
    results = file.with_suffix(".db")
    megabytes, seconds = peak("batch", "run", str(file), "-j", "2", "--db", str(results))
    return megabytes, seconds, f"{results.stat().st_size / 1e6:.0f} MB of results"


WORKS = [
    (ORBIT, "steps", orbit, (200, 400, 800)),
    (ENSEMBLE, "steps", ensemble, (10**5, 10**6, 10**7)),
    (BATCH, "tasks", batch, (10**4, 10**5)),
]
QUICK = [(ORBIT, "steps", orbit, (50, 100)), (BATCH, "tasks", batch, (100, 1000))]


def measure(quick: bool = False) -> list[Row]:
    """The rows of this part."""
    rows: list[Row] = []
    with TemporaryDirectory() as folder:
        for name, unit, run, sizes in QUICK if quick else WORKS:
            first = None
            for size in sizes:
                megabytes, seconds, note = run(Path(folder), size)
                first = first or megabytes
                messages = f"{megabytes:.0f} MB, {note}"
                rows.append(row(GROUP, f"{size:,} {unit}", name, seconds, megabytes / first, messages))
                say(f"  {name}, {size:,} {unit}: {messages}")
    return rows


if __name__ == "__main__":
    print(table(measure("--quick" in sys.argv[1:])))
