"""A batch on a cluster: the theorem for random members, and the growth of three maps, on workers of a dask scheduler.

This script starts the scheduler and two workers on one machine. On a real cluster only the address of the scheduler
changes. The same batch without a cluster gives the same results, in whatever order they arrive. Needs `pip install
'kahanmaps[cluster]'`.
"""

import subprocess
import sys
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import kahanmaps as km

SPEC = """
[experiments.commute]
task = "check-commute"
system = "family"
axes = { m = "2..3", seed = "0..4" }

[experiments.growth]
task = "degrees"
system = ["euler_top", "weierstrass", "lotka_volterra"]
options = { max_degree = 300 }
"""


def start(module, *options):
    # Anyone who can reach a port of dask can run code there, so these accept local connections only.
    here = ["--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
    command = [sys.executable, "-m", f"distributed.cli.{module}", *here, *options]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    stack.callback(process.wait)
    stack.callback(process.terminate)


def results(records):
    """The results by the key of their task, independent of the order in which they arrive."""
    return {record.key: record.verdict or record.result["growth"] for record in records}


with ExitStack() as stack:
    folder = Path(stack.enter_context(TemporaryDirectory()))
    scheduler = folder / "scheduler.json"
    start("dask_scheduler", "--port", "0", "--scheduler-file", str(scheduler))
    for _ in range(2):
        start("dask_worker", "--scheduler-file", str(scheduler), "--nthreads", "1")
    there = results(km.run(SPEC, folder / "cluster.db", scheduler=str(scheduler)))

here = results(km.run(SPEC))
print(len(here), "tasks; the same results on the cluster:", there == here)
for word, count in sorted(Counter(here.values()).items()):
    print(f"{count} {word}")
