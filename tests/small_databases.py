"""What the tests of databases share: small databases, and processes that are killed while they write to one."""

import io
import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import pytest

from kahanmaps.experiments.results import store as store_module
from kahanmaps.experiments.results.export import write_jsonl
from kahanmaps.experiments.results.records import Outcome, Record, Task, TaskLimits
from kahanmaps.experiments.results.store import Store, StoreError

# For hundreds of small databases: a disk that others use makes each wait to be synchronised.
MEMORY = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None

LIMITS = TaskLimits(time=1.5, memory=1 << 30)


def task(number: int) -> Task:
    return Task("orbit", {"family": {"m": 2, "seed": number}}, {"eps": "1/10"})


def tasks(*numbers: int) -> list[Task]:
    return [task(number) for number in numbers]


def ok(number: int, result: object = "1/2", verdict: str | None = None) -> Record:
    return Record(task(number).key, Outcome.OK, {"value": result}, verdict, seconds=0.25)


def failed(number: int, message: str = "no") -> Record:
    return Record(task(number).key, Outcome.FAILED, message=message, seconds=0.5)


def seed(what: Task) -> int:
    assert what.system is not None
    return what.system["family"]["seed"]


def seeds(jobs) -> list[int]:
    return [seed(job.task) for job in jobs]


def planned(path: Path, *numbers: int, records=(), experiment: str = "a", definition: str = "") -> Path:
    """A database with one experiment, closed."""
    with Store.open(path, create=True) as store:
        store.plan(experiment, definition or repr(numbers), LIMITS, tasks(*numbers), {})
        store.add(records)
    return path


def exported(path: Path) -> str:
    """The results of a database without times and places, in the order of the plan."""
    stream = io.StringIO()
    with Store.open(path, readonly=True) as store:
        write_jsonl(store.rows(), stream, stable=True)
    return stream.getvalue()


def recorded(path: Path | str) -> int:
    """How many tasks have a record in a database, 0 while there is none."""
    try:
        with Store.open(path, readonly=True) as store:
            return sum(experiment.tasks - experiment.missing for experiment in store.status())
    except StoreError:
        return 0


def until(holds: Callable[[], object], seconds: float = 100.0) -> None:
    """Wait until something holds."""
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


@contextmanager
def small_chunks():
    """So that a dozen rows are many chunks. A context and not a fixture, because Hypothesis needs it anew each time."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("PLAN_CHUNK", "RESULT_CHUNK"):
            patch.setattr(store_module, name, 3)
        yield


PRELUDE = """
import json, os, resource, sys, time, urllib.parse  # the last one for scripts that give up the right to load it later
from kahanmaps.experiments.results import store as store_module
from kahanmaps.experiments.results.records import TaskLimits, Outcome, Record, Task
from kahanmaps.experiments.results.store import Store, StoreError, Unavailable

def task(number):
    return Task("orbit", {"family": {"m": 2, "seed": number}}, {"eps": "1/10"})

def ok(number, result="1/2"):
    return Record(task(number).key, Outcome.OK, {"value": result})

path, arguments = sys.argv[1], sys.argv[2:]
"""


def start(script: str, path: Path, *arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", PRELUDE + script, str(path), *map(str, arguments)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
