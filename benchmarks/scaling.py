"""What a thousand workers would need of one coordinator: costs measured here, and a cluster of that size simulated.

    python benchmarks/scaling.py [--quick]

Prints the tables of docs/scaling.md. Measured: what the coordinator spends on a record and on a group, what a scheduler
of dask on 127.0.0.1 spends on a group, memory. Simulated: the workers, whose clock leaps over the time in which the
coordinator has nothing to do. So the work of the coordinator is real, and minutes of a cluster take seconds.
"""

from __future__ import annotations

import argparse
import heapq
import json
import os
import queue
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from kahanmaps.experiments.results.records import Limits, Outcome, Record, Task
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.cluster import GROUP_MODULE, ClusterWorkers, record_on
from kahanmaps.experiments.running.dask_client import RESULTS_AT_ONCE, Result
from kahanmaps.experiments.running.run import Batch, executor_for, plan
from kahanmaps.experiments.spec import parse_spec

WORKERS = 1000
CHILDREN = 2
SIZES = (500, 5_000, 50_000)  # bytes of a record
DURATIONS = (0.1, 1.0, 10.0)  # seconds of a task
GROUP_SECONDS = (1, 2, 5, 10, 20, 60)
DOCUMENTED = 1e-3  # seconds for a task of dask, by the first page of its documentation
TASKS = {0.1: 600_000, 1.0: 60_000, 10.0: 20_000}  # of the simulation: each worker has ten groups and more
PLANNED = (100_000, 1_000_000)


def say(text: str) -> None:
    """Progress, on standard error."""
    print(text, file=sys.stderr, flush=True)


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Markdown."""
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(entry) for entry in line) + " |" for line in lines) + "\n"


def task(number: int) -> Task:
    """A task as long as real ones are."""
    family = {"draw": "eigenvalues", "m": 3, "seed": number}
    return Task("check-commute", {"family": family}, {"eps": "1/10", "method": "auto", "starts": 4})


def record(key: str, size: int, seconds: float = 0.0) -> Record:
    """A record whose JSON has about this size."""
    versions = {"flint": "3.6.0", "kahanmaps": "0.1.0", "python": "3.11.7", "python-flint": "0.9.0"}
    result = {"numbers": ["1234567/89"] * max(0, (size - 400) // 14)}
    return Record(
        key,
        Outcome.OK,
        result,
        "proved",
        seconds=seconds,
        host="node",
        versions=versions,
        finished="2026-11-01T00:00:00",
    )


def planned(path: Path, number: int) -> Store:
    """A store with so many tasks and no results."""
    store = Store.open(path, create=True)
    store.plan("scaling", f"{number} tasks", Limits(time=600.0), map(task, range(number)), {})
    return store


# A record ------------------------------------------------------------------------------------------------------------


def costs_of_a_record(folder: Path, number: int) -> list[list[object]]:
    """Seconds to read the line of a record, and to store it: one a transaction, and a hundred."""
    rows: list[list[object]] = []
    for size in SIZES:
        keys = [task(n).key for n in range(number)]
        lines = [json.dumps(record(key, size).to_json()).encode() for key in keys]
        start = time.perf_counter()
        records = [found for found in map(record_on, lines) if found is not None]
        reading = (time.perf_counter() - start) / number
        storing = []
        for chunk in (1, 100):
            with planned(folder / f"{size}-{chunk}.db", number) as store:
                start = time.perf_counter()
                for first in range(0, number, chunk):
                    store.add(records[first : first + chunk])
                storing.append((time.perf_counter() - start) / number)
        rate = 1 / (reading + storing[1])
        rows.append(
            [f"{len(lines[0]) / 1000:.1f} kB", *(f"{1e6 * cost:.0f}" for cost in (reading, *storing)), f"{rate:,.0f}"]
        )
    return rows


# A group -------------------------------------------------------------------------------------------------------------


def overhead_here(folder: Path, number: int, group_seconds: float) -> list[object]:
    """A batch of short real tasks on two children: what a task costs beyond its own time, and how often a second."""
    name = "own child" if group_seconds == 0 else f"{group_seconds:g} s"
    text = (
        f'[experiments.space]\ntask = "family-space"\nsystem = "family"\naxes = {{m = [2], seed = "0..{number - 1}"}}'
    )
    spec = parse_spec(text)
    begin = time.perf_counter()
    with Store.open(folder / f"{number} {name}.db", create=True) as store:
        plan(spec, store)
        planned_in = time.perf_counter() - begin
        begin, own = time.perf_counter(), 0.0
        for records in Batch(store.pending(), executor_for(store.document, CHILDREN, group_seconds=group_seconds)):
            store.add(records)
            own += sum(record.seconds for record in records)
        elapsed = time.perf_counter() - begin
    overhead = (CHILDREN * elapsed - own) / number
    rate = f"{number / elapsed:,.0f}"
    return [name, number, f"{1e3 * own / number:.2f}", f"{1e3 * overhead:.2f}", rate, f"{1e3 * planned_in:.0f}"]


def processor_time(pid: int) -> float:
    """Seconds of processor time that a process has had (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    ticks = int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def costs_of_a_group(folder: Path, number: int) -> dict[str, float]:
    """What a scheduler of dask and its client spend on one group; the group is the command `true`."""
    import distributed

    connect: Any = distributed.Client

    file = folder / "scheduler.json"
    commands = [["dask_scheduler", "--port", "0", "--scheduler-file", str(file)]]
    place = ["--scheduler-file", str(file), "--local-directory", str(folder)]
    commands += [["dask_worker", *place, "--nthreads", "1", "--no-nanny"]] * 2
    running: list[subprocess.Popen[bytes]] = []
    try:
        for module, *options in commands:
            here = ["--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
            command = [sys.executable, "-m", f"distributed.cli.{module}", *here, *options]
            running.append(subprocess.Popen(command, stderr=subprocess.DEVNULL))
            while not file.exists():
                time.sleep(0.05)
        client = connect(scheduler_file=str(file), set_as_default=False)
        client.wait_for_workers(2)
        text = json.dumps({"documents": {}, "jobs": [{"task": task(n).text} for n in range(50)]}).encode()
        ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        counts: dict[str, float] = {}
        for is_warm in (False, True):
            before = [processor_time(running[0].pid), time.process_time(), time.perf_counter()]
            _through(client, text, ended, number if is_warm else 100)
            after = [processor_time(running[0].pid), time.process_time(), time.perf_counter()]
            spent = [(late - early) / number for early, late in zip(before, after, strict=True)]
            counts = dict(zip(("scheduler", "client", "wall"), spent, strict=True))
        client.close()
        return counts
    finally:
        for process in running:
            process.kill()
            process.wait()


def _through(client: Any, text: bytes, ended: queue.SimpleQueue[Any], number: int) -> None:
    """Groups one after the other through dask, four of them under way."""

    def submit() -> None:
        future = client.submit(
            subprocess.run, ["true"], input=text, capture_output=True, pure=False, key=f"bench-{time.monotonic_ns()}"
        )
        future.add_done_callback(ended.put)

    for _ in range(4):
        submit()
    for done in range(number):
        ended.get().result()
        if done + 4 < number:
            submit()


def start_of_a_group(repeats: int = 5) -> float:
    """Seconds that a group command needs beside its tasks: the least over some tries with one small task."""
    family = {"draw": "eigenvalues", "m": 2, "seed": 1}
    job = {"task": Task("family-space", {"family": family}, {}).text, "limits": {"time": None, "memory": None}}
    text = json.dumps({"documents": {}, "jobs": [job]}).encode()
    taken = []
    for _ in range(repeats):
        start = time.perf_counter()
        done = subprocess.run([sys.executable, "-m", GROUP_MODULE], input=text, capture_output=True, check=True)
        taken.append(time.perf_counter() - start - float(json.loads(done.stdout)["seconds"]))
    return min(taken)


# A thousand workers --------------------------------------------------------------------------------------------------


class Simulated(ClusterWorkers):
    """The executor itself with its grouping, its window and its reading of records, above workers that do not exist.

    `now` is the time on the cluster: that of this process, less what only the simulation needs, plus the leaps. Every
    group is charged `client_seconds` here, as long as dask's client takes for it, and `start` on its worker.
    """

    def __init__(self, seconds: float, size: int, start: float, client_seconds: float) -> None:
        self.task_seconds, self.size, self.start, self.client_seconds = seconds, size, start, client_seconds
        self.workers = [0.0] * WORKERS  # when each is free
        self.ending: list[tuple[float, int]] = []
        self.taken: dict[int, list[float]] = {}
        self.leaps = self.idle = 0.0
        self.random = random.Random(7)  # or all workers would end at once, again and again
        super().__init__("nowhere", str)

    @property
    def now(self) -> float:
        """Seconds on the clock of the cluster."""
        return time.perf_counter() + self.leaps

    def _connect(self, seconds: float) -> Any:
        return SimpleNamespace(threads=WORKERS, lost=None, drained=self._drained)

    def _send(self, group: Any) -> None:
        number = next(self._numbers)
        self._groups[number] = group
        len(group.text)  # written, as for a real scheduler
        self.leaps += self.client_seconds
        self.taken[number] = [self.task_seconds * self.random.uniform(0.5, 1.5) for _ in group.jobs]
        end = max(self.now, heapq.heappop(self.workers)) + self.start + sum(self.taken[number])
        heapq.heappush(self.workers, end)
        heapq.heappush(self.ending, (end, number))

    def _drained(self, timeout: float) -> list[Any]:
        if self.ending and self.ending[0][0] > self.now:
            leap = self.ending[0][0] - self.now
            self.leaps += leap
            self.idle += leap
        found: list[Any] = []
        begun = time.perf_counter()
        until = self.now
        while self.ending and self.ending[0][0] <= until and len(found) < RESULTS_AT_ONCE:
            number = heapq.heappop(self.ending)[1]
            found.append(Result(number, subprocess.CompletedProcess([], 0, self._output(number), b"")))
        self.leaps -= time.perf_counter() - begun
        return found

    def _output(self, number: int) -> bytes:
        """What the group command would have printed."""
        pairs = zip(self._groups[number].jobs, self.taken.pop(number), strict=True)
        return "\n".join(json.dumps(record(key, self.size, taken).to_json()) for key, taken in pairs).encode()

    def close(self) -> None:
        """Nothing to end."""


def simulated(folder: Path, seconds: float, number: int, costs: dict[str, float]) -> list[object]:
    """Records each second in the middle half of a batch, beside what the workers alone would allow."""
    store = planned(folder / f"{seconds}-{time.monotonic_ns()}.db", number)
    executor = Simulated(seconds, 500, costs["start"], costs["client"])
    done, marks = 0, {}
    for records in Batch(store.pending(), executor):
        store.add(records)
        done += len(records)
        for quarter in (1, 3):
            if quarter not in marks and 4 * done >= quarter * number:
                marks[quarter] = (executor.now, executor.idle, done, next(executor._numbers))
    store.close()
    (now, idle, first, groups), (then, later, last, more) = marks[1], marks[3]
    span = then - now
    rate, ideal = (last - first) / span, WORKERS / seconds
    busy = 1 - (later - idle) / span
    return [
        f"{rate:,.0f}",
        f"{ideal:,.0f}",
        f"{100 * rate / ideal:.0f} %",
        f"{(more - groups) / span:.0f}",
        f"{100 * busy:.0f} %",
    ]


# Memory --------------------------------------------------------------------------------------------------------------


def resident() -> float:
    """Megabytes of this process, now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


def memory_of(number: int) -> dict[str, float]:
    """Memory of a coordinator with so many planned tasks and a full window. Meant for a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        before, start = resident(), time.perf_counter()
        store = planned(Path(folder) / "plan.db", number)
        planning = time.perf_counter() - start
        size = (Path(folder) / "plan.db").stat().st_size
        executor = Simulated(0.025, 500, 0.3, 0.0)
        executor._means["check-commute"].learn(0.025)  # groups of 200
        pending = store.pending()
        after = resident()
        held = _filled(executor, pending)
        window, groups = resident() - after, executor.groups_in_flight
        store.close()
        return {
            "number": number, "planning": planning, "disk": size / number, "planned": after - before,
            "group": 1e3 * window / groups, "jobs": held / groups, "groups": groups, "peak": resident(),
        }  # fmt: skip


def _filled(executor: Simulated, jobs: Iterator[Any]) -> int:
    while executor.is_free and (job := next(jobs, None)) is not None:
        executor.submit(job)
    return executor.in_flight


def memory(number: int) -> list[object]:
    """`memory_of` in a new process."""
    command = [sys.executable, __file__, "--memory", str(number)]
    found = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    return [
        f"{found['number']:,}", f"{found['planning']:.0f} s", f"{found['disk']:.0f} B", f"{found['planned']:.0f} MB",
        f"{found['groups']:,} of {found['jobs']:.0f} tasks", f"{found['group']:.0f} kB", f"{found['peak']:.0f} MB",
    ]  # fmt: skip


# All -----------------------------------------------------------------------------------------------------------------


def main() -> None:
    """All tables, as markdown."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer of everything: a first look")
    parser.add_argument("--memory", type=int, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.memory is not None:
        print(json.dumps(memory_of(chosen.memory)))
        return
    fewer = 10 if chosen.quick else 1
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        say("a record")
        header = ["a record of", "read, µs", "stored alone, µs", "stored among 100, µs", "records each second"]
        print(table(header, costs_of_a_record(folder, 5000 // fewer)))
        say("one machine")
        header = ["a child serves for", "tasks", "own, ms", "on top, ms", "tasks each second", "planned in, ms"]
        rows_here = [overhead_here(folder, 2000 // fewer, 5.0), overhead_here(folder, 20_000 // fewer, 5.0)]
        print(table(header, [*rows_here, overhead_here(folder, 200 // fewer, 0.0)]))
        say("a group")
        costs = costs_of_a_group(folder, 3000 // fewer)
        costs["start"] = start_of_a_group()
        parts = [
            ["processor time of dask's scheduler", f"{1e3 * costs['scheduler']:.2f}"],
            ["processor time of the coordinator, in dask's client", f"{1e3 * costs['client']:.2f}"],
            ["by the clock, with the scheduler and 2 workers on 2 cores", f"{1e3 * costs['wall']:.2f}"],
            ["start of the group command, on its worker", f"{1e3 * costs['start']:.0f}"],
        ]
        print(table(["for one group", "ms"], parts))
        say("a thousand workers")
        rows: list[list[object]] = []
        for seconds in DURATIONS:
            rows.append([f"{seconds:g} s", *simulated(folder, seconds, TASKS[seconds] // fewer, costs)])
        header = ["a task of", "records each second", "at most", "reached", "groups each second", "coordinator busy"]
        print(table(header, rows))
        say("memory")
        header = [
            "tasks planned",
            "planning",
            "on disk, each",
            "memory for it",
            "groups in flight",
            "memory, each",
            "coordinator",
        ]
        print(table(header, map(memory, PLANNED[: 1 if chosen.quick else None])))
        header = ["group", "groups each second", "lost to starts", "scheduler, measured", "scheduler, at 1 ms"]
        print(table(header, map(partial(shares, costs), GROUP_SECONDS)))


def shares(costs: dict[str, float], seconds: float) -> list[object]:
    """What a thousand workers ask of the scheduler if a group has so many seconds of tasks."""
    whole = seconds + costs["start"]
    rate = WORKERS / whole
    loads = [f"{100 * rate * cost:.0f} %" for cost in (costs["scheduler"], DOCUMENTED)]
    return [f"{seconds:g} s", f"{rate:.0f}", f"{100 * costs['start'] / whole:.0f} %", *loads]


if __name__ == "__main__":
    main()
