"""Tasks on a dask cluster that is running already: groups of them go out, records come back.

What a worker of dask is asked to do is the standard library's `subprocess.run`, on our group command, with JSON on its
standard input. So nothing of ours is needed on the scheduler or inside the workers, and a task that dies takes nothing
with it. A group is a few seconds of work, since the scheduler needs about as long for a millisecond as for an hour.

Nothing here touches the database: a record is handed back by `wait`, once, and is safe when the caller has stored it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import defaultdict, deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from itertools import count

from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.experiments.results.records import Documents, Executor, Job, Outcome, Record
from kahanmaps.experiments.running.children import TRIES, ending
from kahanmaps.experiments.running.dask_client import DaskClient, Result, told

GROUP_MODULE = "kahanmaps.experiments.running.group"
PASSED_ON = ("KAHANMAPS_TASKS", "PYTHONPATH")  # variables that mean the same to the workers as to us

START_UP = 60.0  # seconds a group may take beyond the limits of its jobs, on a cold and busy worker,
START_UP_OF_A_JOB = 5.0  # and for each job in it
LARGEST_GROUP = 200  # jobs
MEMORY_OF_MEANS = 20  # a mean follows a batch that goes from cheap tasks to dear ones
UNFIT_AFTER = 3  # groups that ended by themselves without a record, when there has never been one
TAIL = 2000  # characters of standard error kept
SILENCE = 3.0  # seconds without a worker before a word is said; then again, ever more rarely


class ClusterLost(KahanmapsError):
    """The scheduler is gone, or has dropped what was asked of it. What was recorded before is safe."""


class WorkersUnfit(ClusterLost):
    """Raised when the set-up is wrong: the workers cannot run tasks at all, whichever these are."""


Tried = tuple[Job, int]  # a job, and how many tries of it alone have failed


@dataclass
class JobGroup:
    """Jobs that one command does, by key; what has come back is taken out."""

    jobs: dict[str, Tried] = field(default_factory=dict)
    documents: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def timeout(self) -> float | None:
        """How long the command may take: what its jobs may, and a generous start; None if one of them is unlimited."""
        times = [job.limits.time for job, _ in self.jobs.values()]
        return None if None in times else START_UP + sum((time or 0.0) + START_UP_OF_A_JOB for time in times)

    @property
    def text(self) -> bytes:
        """What the group command reads."""
        jobs = [{"task": job.task.text, "limits": asdict(job.limits)} for job, _ in self.jobs.values()]
        return json.dumps({"documents": self.documents, "jobs": jobs}).encode()


@dataclass
class Mean:
    """The seconds that a record of one kind of task takes, on average over the last ones."""

    seconds: float
    seen: int = 0

    def learn(self, seconds: float) -> None:
        """One record more."""
        self.seen = min(self.seen + 1, MEMORY_OF_MEANS)
        self.seconds += (seconds - self.seconds) / self.seen


class ClusterWorkers(Executor):
    """Runs jobs on the workers of an existing dask scheduler.

    `address` is that of the scheduler, "tcp://host:port", or the path of its scheduler file; for "tls://host:port" the
    certificates are those of dask's own configuration. dask's parties unpickle what they are sent, so each of them can
    run code on all others: scheduler and workers have to be trusted, and closed to everybody else.

    `command` is what a worker runs for a group, by default `python -m kahanmaps.experiments.running.group` with this
    interpreter, which the workers have to find at the same path. A group takes about `group_seconds`, by what the last
    tasks of the same kind took, and has at most 200 jobs. `talk` is told, now and then, what is being
    waited for.

    At most two groups for each thread of the workers are under way, so that memory here does not depend on the number
    of tasks. What a group leaves undone is tried a few times more, each job alone, before it is lost.
    """

    def __init__(
        self,
        address: str,
        documents: Documents,
        *,
        command: Sequence[str] | None = None,
        python: str | None = None,
        group_seconds: float = 5.0,
        talk: Callable[[str], None] | None = None,
        connect_seconds: float = 10.0,
    ) -> None:
        self.address = address
        self._command = _with_environment(command or [python or sys.executable, "-m", GROUP_MODULE])
        self._documents = documents
        self._group_seconds = group_seconds
        # A kind of task of which nothing is known takes a whole group's time.
        self._means: defaultdict[str, Mean] = defaultdict(lambda: Mean(group_seconds))
        self._talk = talk or (lambda text: None)
        self._keys: set[str] = set()  # of jobs in flight
        self._open = JobGroup()
        self._again: deque[Tried] = deque()  # jobs to be tried alone
        self._groups: dict[int, JobGroup] = {}  # at the scheduler
        self._numbers = count()
        self._unfit = 0  # groups that ended by themselves before any record
        self._untold: set[str] = set()  # the jobs of these groups
        self._is_proven = False  # a record has come from the workers
        self._silent_since: float | None = None
        self._next_word = SILENCE
        self._dask = DaskClient(address, connect_seconds)

    @property
    def is_free(self) -> bool:
        """Whether one more job may be submitted now."""
        return not self._again and len(self._groups) < self._window

    @property
    def in_flight(self) -> int:
        """How many jobs have been submitted and not yet handed back."""
        return len(self._keys)

    def submit(self, job: Job) -> None:
        """Take a job into the open group, which is sent when it is full, or by `wait` when a worker might idle."""
        if job.task.key in self._keys:
            raise InputError(f"task {job.task.key} is in flight already: submit it again when its record is back")
        if self._open.seconds + self._means[job.task.kind].seconds / 2 > self._group_seconds:
            self._send_open()
        self._add(self._open, job)
        self._keys.add(job.task.key)
        if len(self._open.jobs) >= LARGEST_GROUP or self._open.seconds >= self._group_seconds:
            self._send_open()

    def wait(self, timeout: float) -> list[Record]:
        """Records that are ready, as soon as there is one, or none after `timeout` seconds.

        Raises ClusterLost when the scheduler is gone, and WorkersUnfit when groups end by themselves one after the
        other, those of every job in flight among them, and none has ever printed a record.
        """
        deadline = time.monotonic() + timeout
        while True:
            while self._again and len(self._groups) < self._window:
                group = JobGroup()
                self._add(group, *self._again.popleft())
                self._send(group)
            # If every thread has a group waiting for it, there is time to fill the open one.
            if len(self._groups) < self._window:
                self._send_open()
            left = deadline - time.monotonic()
            results = self._dask.drained(min(max(left, 0.0), 1.0))
            if records := [record for result in results for record in self._taken(result)]:
                return records
            if self._dask.lost is not None:
                raise ClusterLost(
                    f"the scheduler at {self.address} is lost ({self._dask.lost}): what was recorded is safe; "
                    "run the same command again once the scheduler is back"
                )
            if not results and left <= 0:
                return []
            self._say_if_nobody_works()

    def close(self) -> None:
        """End at once, whether or not the scheduler is still there; it and its workers stay. May be called twice.

        What is in flight is forgotten. Groups that a worker has begun are not killed, since a running call cannot be
        taken back: they go on to their end, and their results are dropped.
        """
        self._dask.close()
        self._keys.clear()
        self._groups.clear()

    @property
    def _window(self) -> int:
        """How many groups may be at the scheduler: one that runs and one that waits for each thread."""
        return max(2, 2 * self._dask.threads)

    def _add(self, group: JobGroup, job: Job, tries: int = 0) -> None:
        """Put a job into the group, with the documents that it needs."""
        group.documents |= {name: self._documents(name) for name in job.task.documents if name not in group.documents}
        group.jobs[job.task.key] = job, tries
        group.seconds += self._means[job.task.kind].seconds

    def _send_open(self) -> None:
        if self._open.jobs:
            group, self._open = self._open, JobGroup()
            self._send(group)

    def _send(self, group: JobGroup) -> None:
        """Hand a group to the scheduler. Never raises: a scheduler that is gone is told by `wait`."""
        number = next(self._numbers)
        self._groups[number] = group
        text, group.documents = group.text, {}
        self._dask.submit(number, self._command, text, group.timeout)

    def _taken(self, result: Result) -> list[Record]:
        """The records that a group has printed; jobs without one are put up for another try, alone, or lost."""
        group = self._groups.pop(result.number)
        is_alone, timeout = len(group.jobs) == 1, group.timeout
        records: list[Record] = []
        # The group command keeps the limits of a task and tells its death in a record: what becomes of the command
        # itself is the machine's doing, and no result.
        failures: list[tuple[Job, int, Record]] = []
        for line in result.output("stdout").split(b"\n"):
            record = record_on(line)
            if record is None or record.key not in group.jobs:  # a record that is printed twice is handed back once
                continue
            job, tries = group.jobs.pop(record.key)
            self._is_proven = True
            if record.outcome is Outcome.LOST:
                failures.append((job, tries + 1, record))
            else:
                self._means[job.task.kind].learn(record.seconds)
                records.append(record)
        if group.jobs:
            message, is_unfit = _failure_of(result, timeout)
            stderr = result.output("stderr").decode(errors="replace")[-TAIL:]
            if is_unfit and not self._is_proven:
                self._unfit += 1
                self._untold |= group.jobs.keys()
                self._require_fit(message, stderr)
            for key, (job, tries) in group.jobs.items():
                failures.append((job, tries + is_alone, Record(key, Outcome.LOST, message=message, stderr=stderr)))
        finished = datetime.now(UTC).isoformat(timespec="seconds")
        self._again.extend((job, tries) for job, tries, _ in failures if tries < TRIES)
        records += [replace(record, finished=finished) for _, tries, record in failures if tries >= TRIES]
        self._keys.difference_update(record.key for record in records)
        return records

    def _require_fit(self, message: str, stderr: str) -> None:
        """A missing installation must not be told as thousands of lost tasks, nor one deadly task as the former."""
        if self._unfit >= UNFIT_AFTER and self._keys <= self._untold:
            command = " ".join(self._command)
            sentence = f"the workers cannot run {command!r}: {message}, and none has ever printed a record"
            raise WorkersUnfit(f"{sentence}\n{stderr.strip()}" if stderr.strip() else sentence)

    def _say_if_nobody_works(self) -> None:
        now = time.monotonic()
        if self._dask.threads or not self._keys:
            self._silent_since, self._next_word = None, SILENCE
            return
        self._silent_since = self._silent_since or now
        if now - self._silent_since >= self._next_word:
            self._next_word = 2 * self._next_word
            self._talk(f"waiting for workers: the scheduler at {self.address} has none")


def _with_environment(command: Sequence[str]) -> list[str]:
    """The command with our variables set. `env=` of subprocess.run would replace all that the worker has instead."""
    passed = [f"{name}={os.environ[name]}" for name in PASSED_ON if name in os.environ]
    return ["/usr/bin/env", "PYTHONHASHSEED=0", *passed, *command]


def record_on(line: bytes) -> Record | None:
    """The record on a line; None if it is something else, such as the half of one."""
    if not line.startswith(b"{"):
        return None
    try:
        return Record.from_json(json.loads(line))
    except (ValueError, TypeError, LookupError):
        return None


def _failure_of(result: Result, timeout: float | None) -> tuple[str, bool]:
    """Why a group ended without all its records, and whether it ended by itself, as if it could not be run at all."""
    if result.process is not None:
        status = result.process.returncode
        return f"the worker's command {ending(status)}" + (" and no record" if status == 0 else ""), status >= 0
    if isinstance(result.error, subprocess.TimeoutExpired):
        return f"the worker's command did not end within {timeout or 0:g} s", False
    why = told(result.error)
    return f"the worker could not run its command: {why}", "KilledWorker" not in why
