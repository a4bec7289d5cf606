"""Tasks on a dask cluster that is running already: groups of them go out, records come back.

What a worker of dask is asked to do is the standard library's `subprocess.run`, on our group command, with JSON on its
standard input. So nothing of ours is needed on the scheduler or inside the workers, and a task that dies takes nothing
with it. A group is a few seconds of work, since the scheduler needs about as long for a millisecond as for an hour.

Nothing here touches the database: a record is handed back by `wait`, once, and is safe when the caller has stored it.

Groups are filled by what the last tasks of the same kind took. All that talks to dask is in dask_client.py; here it is
decided what is sent when, and whose fault a failure was.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import defaultdict, deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from itertools import count
from typing import NamedTuple

from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.experiments.children import TRIES, ending
from kahanmaps.experiments.dask_client import DaskClient, Result, distributed, told
from kahanmaps.experiments.records import Documents, Executor, Job, Limits, Outcome, Record, Task

GROUP_MODULE = "kahanmaps.experiments.group"
TASKS_VARIABLE = "KAHANMAPS_TASKS"
PASSED_ON = (TASKS_VARIABLE, "PYTHONPATH")  # variables that mean the same to the workers as to us

START_UP = 60.0  # seconds a group may take beyond the limits of its jobs, on a cold and busy worker,
START_UP_OF_A_JOB = 5.0  # and for each job in it
LARGEST_TEXT = 1 << 20  # bytes in a group, of what is sent and of what is expected back: this bounds memory
MEMORY_OF_MEANS = 20  # a mean follows a batch that goes from cheap tasks to dear ones
UNFIT_AFTER = 3  # groups that ended by themselves without a record, when there has never been one
HOPELESS_AFTER = 10  # the same, however they ended
TAIL = 2000  # characters of standard error kept
SILENCE = 3.0  # seconds without a worker before a word is said; then again, ever more rarely


class ClusterLost(KahanmapsError):
    """The scheduler is gone, or has dropped what was asked of it. What was recorded before is safe."""


class WorkersUnfit(ClusterLost):
    """The workers cannot run tasks at all: not a word about any task, which is nobody's fault but the set-up's."""


class KeptJob(NamedTuple):
    """A job in flight, and how many tries of it alone have failed.

    Its canonical text is a quarter as large as the task with its dictionaries.
    """

    kind: str
    text: str
    limits: Limits
    tries: int = 0


@dataclass
class JobGroup:
    """Jobs that one command does, by key; what has come back is taken out."""

    jobs: dict[str, KeptJob] = field(default_factory=dict)
    documents: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    sent: int = 0  # bytes, about
    expected: float = 0.0  # bytes, about
    is_alone: bool = False  # so small that a failure is its only job's
    is_suspect: bool = False  # its worker died, again and again

    @property
    def timeout(self) -> float | None:
        """How long the command may take: what its jobs may, and a generous start; None if one of them is unlimited."""
        times = [job.limits.time for job in self.jobs.values()]
        return None if None in times else START_UP + sum((time or 0.0) + START_UP_OF_A_JOB for time in times)

    @property
    def text(self) -> bytes:
        """What the group command reads."""
        jobs = [{"task": job.text, "limits": asdict(job.limits)} for job in self.jobs.values()]
        return json.dumps({"documents": self.documents, "jobs": jobs}).encode()


@dataclass
class Means:
    """What a record of one kind of task takes, on average over the last ones."""

    seconds: float
    size: float = 0.0
    seen: int = 0

    def learn(self, seconds: float, size: int) -> None:
        """One record more."""
        self.seen = min(self.seen + 1, MEMORY_OF_MEANS)
        self.seconds += (seconds - self.seconds) / self.seen
        self.size += (size - self.size) / self.seen


@dataclass(frozen=True)
class Failure:
    """Why a group ended without all its records.

    A task has a process of its own below the group command, whose limits the command keeps and whose death it tells in
    a record: so what becomes of the command itself is the machine's doing, and no result. `is_unfit`: it ended by
    itself, as if it could not be run at all; `is_the_workers`: they died, and it with them.
    """

    message: str
    stderr: str
    is_unfit: bool = False
    is_the_workers: bool = False


class ClusterWorkers(Executor):
    """Runs jobs on the workers of an existing dask scheduler.

    `address` is that of the scheduler, "tcp://host:port", or the path of its scheduler file; for "tls://host:port" the
    certificates are those of dask's own configuration. dask's parties unpickle what they are sent, so each of them can
    run code on all others: scheduler and workers have to be trusted, and closed to everybody else.

    `command` is what a worker runs for a group, by default `python -m kahanmaps.experiments.group` with this
    interpreter, which the workers have to find at the same path. A group takes about `group_seconds` and has at most
    `largest_group` jobs. `talk` is told, now and then, what is being waited for.

    At most two groups for each thread of the workers are under way, so that memory here does not depend on the number
    of tasks. A group that ends early is taken apart: each job without a record is tried a few times more, alone, before
    it is lost. dask itself moves the group of a dead worker elsewhere.

    While one of these is open, the log of distributed in this process is silent: its news arrive as exceptions here.
    """

    def __init__(
        self,
        address: str,
        documents: Documents,
        *,
        command: Sequence[str] | None = None,
        python: str | None = None,
        group_seconds: float = 5.0,
        largest_group: int = 200,
        talk: Callable[[str], None] | None = None,
        connect_seconds: float = 10.0,
    ) -> None:
        self.address = address
        self._command = _with_environment(command or [python or sys.executable, "-m", GROUP_MODULE])
        self._documents = documents
        self._group_seconds = group_seconds
        self._largest_group = largest_group
        # Of the records of each kind of task; one of which nothing is known takes a whole group's time.
        self._means: defaultdict[str, Means] = defaultdict(lambda: Means(group_seconds))
        self._talk = talk or (lambda text: None)

        self._keys: set[str] = set()  # of jobs in flight
        self._open = JobGroup()
        self._again: deque[KeptJob] = deque()  # jobs to be tried alone
        self._suspects: deque[KeptJob] = deque()  # jobs to be tried one after the other
        self._groups: dict[int, JobGroup] = {}  # at the scheduler
        self._held: list[tuple[str, KeptJob, Failure]] = []  # failures, while it is open whose fault they are
        self._given_up = 0
        self._numbers = count()
        self._is_proven = False  # a record has come from the workers
        self._is_closed = False
        self._silent_since: float | None = None
        self._next_word = SILENCE

        self._dask = self._connect(connect_seconds)

    def _connect(self, seconds: float) -> DaskClient:
        return DaskClient(self.address, seconds)

    @property
    def is_free(self) -> bool:
        """Whether one more job may be submitted now."""
        return not self._again and len(self._groups) < self._window

    @property
    def in_flight(self) -> int:
        """How many jobs have been submitted and not yet handed back."""
        return len(self._keys)

    @property
    def threads(self) -> int:
        """How many threads the workers have, when last looked at: so many groups run at once."""
        return self._dask.threads

    @property
    def groups_in_flight(self) -> int:
        """How many groups are at the scheduler."""
        return len(self._groups)

    def submit(self, job: Job) -> None:
        """Take a job into the open group, which is sent when it is full, or by `wait` when a worker might idle."""
        if job.task.key in self._keys:
            raise InputError(f"task {job.task.key} is in flight already: submit it again when its record is back")
        if self._open.jobs and not self._fits(self._open, job.task.kind):
            self._send_open()
        self._add(self._open, job.task, job.limits)
        self._keys.add(job.task.key)
        if self._is_full(self._open):
            self._send_open()

    def wait(self, timeout: float) -> list[Record]:
        """Records that are ready, as soon as there is one, or none after `timeout` seconds.

        Raises ClusterLost when the scheduler is gone, and WorkersUnfit when groups fail one after the other and none
        has ever printed a record.
        """
        deadline = time.monotonic() + timeout
        while True:
            self._send_again()
            # Every thread has a group waiting for it: then there is time to fill the open one.
            if len(self._groups) < self._window:
                self._send_open()
            left = deadline - time.monotonic()
            results = self._dask.drained(min(max(left, 0.0), 1.0))
            records = [record for result in results for record in self._taken(result)]
            records += self._judged()
            if records:
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

        What is in flight is forgotten: the scheduler drops it as soon as this client is gone. Groups that a worker has
        begun are not killed, since a running call cannot be taken back: they go on to their end, and their results are
        dropped. The same happens when this process is killed.
        """
        if self._is_closed:
            return
        self._is_closed = True
        self._dask.close()
        self._keys.clear()
        self._groups.clear()

    # Groups

    def _fits(self, group: JobGroup, kind: str) -> bool:
        """Whether the group comes nearer to its time with a job of this kind, and stays within its size."""
        return (
            group.seconds + self._means[kind].seconds / 2 <= self._group_seconds
            and group.expected + self._means[kind].size <= LARGEST_TEXT
        )

    def _is_full(self, group: JobGroup) -> bool:
        """Whether the group is to be sent without another job."""
        return (
            len(group.jobs) >= self._largest_group
            or group.seconds >= self._group_seconds
            or group.sent >= LARGEST_TEXT
            or group.expected >= LARGEST_TEXT
        )

    def _add(self, group: JobGroup, task: Task, limits: Limits, tries: int = 0) -> None:
        """Put a job into the group, with the documents that it needs."""
        for wanted in task.documents:
            if wanted not in group.documents:
                group.documents[wanted] = self._documents(wanted)
                group.sent += len(group.documents[wanted])
        group.jobs[task.key] = KeptJob(task.kind, task.text, limits, tries)
        group.seconds += self._means[task.kind].seconds
        group.expected += self._means[task.kind].size
        group.sent += len(task.text)

    @property
    def _window(self) -> int:
        """How many groups may be at the scheduler: one that runs and one that waits for each thread."""
        return max(2, 2 * self._dask.threads)

    def _send_open(self) -> None:
        if self._open.jobs:
            group, self._open = self._open, JobGroup()
            group.is_alone = len(group.jobs) == 1
            self._send(group)

    def _send_again(self) -> None:
        while self._again and len(self._groups) < self._window:
            self._send_alone(self._again.popleft())
        if self._suspects and not any(group.is_suspect for group in self._groups.values()):
            self._send_alone(self._suspects.popleft(), is_suspect=True)

    def _send_alone(self, job: KeptJob, is_suspect: bool = False) -> None:
        group = JobGroup(is_alone=True, is_suspect=is_suspect)
        self._add(group, Task.from_text(job.text), job.limits, job.tries)
        self._send(group)

    def _send(self, group: JobGroup) -> None:
        """Hand a group to the scheduler. Never raises: a scheduler that is gone is told by `wait`."""
        number = next(self._numbers)
        self._groups[number] = group
        text, group.documents = group.text, {}
        self._dask.submit(number, self._command, text, group.timeout)

    # Results

    def _taken(self, result: Result) -> list[Record]:
        """The records that a group has printed. Jobs without one are put up for another try, or held."""
        group = self._groups.pop(result.number)
        timeout = group.timeout  # with the jobs that it had
        records = []
        for line in result.stdout.split(b"\n"):
            record = record_on(line)
            job = None if record is None else group.jobs.pop(record.key, None)
            if record is None or job is None:  # a record that is printed twice is handed back once
                continue
            self._is_proven = True
            if record.outcome is Outcome.LOST:
                self._failed_alone(record.key, job, Failure(record.message, record.stderr))
                continue
            self._means[job.kind].learn(record.seconds, len(line))
            self._keys.discard(record.key)
            records.append(record)
        if group.jobs:
            self._sort_out(group, _failure_of(result, timeout))
        return records

    def _sort_out(self, group: JobGroup, failure: Failure) -> None:
        """Put up the jobs without a record for another try, alone, or hold them.

        dask blames the death of a worker on all that the worker had in its queue. So what has lost its workers is tried
        once more, one such job at a time: then no other suspect is in the same queue.
        """
        if failure.is_the_workers and not group.is_suspect:
            self._suspects.extend(group.jobs.values())
        elif not group.is_alone:
            self._again.extend(group.jobs.values())
        elif failure.is_the_workers:
            self._held += [(key, job, failure) for key, job in group.jobs.items()]
        else:
            for key, job in group.jobs.items():
                self._failed_alone(key, job, failure)

    def _failed_alone(self, key: str, job: KeptJob, failure: Failure) -> None:
        """Put up a job that was the only one at work for another try, or hold it.

        A command that cannot be run is not tried again before another one has been: that would only take longer.
        """
        job = job._replace(tries=job.tries + 1)
        if job.tries < TRIES and (self._is_proven or not failure.is_unfit):
            self._again.append(job)
        else:
            self._held.append((key, job, failure))

    def _judged(self) -> list[Record]:
        """Records of the jobs that failed alone, as soon as it is clear that there is no use in another try.

        Before the first record there has been no sign that the workers can run anything: a missing installation
        must not be told as thousands of lost tasks, nor a single task that kills its group as a missing installation.
        """
        if not self._held:
            return []
        if not self._is_proven:
            is_all = len(self._held) == len(self._keys)  # nothing else is in flight that might tell
            unfit = [failure for _, _, failure in self._held if failure.is_unfit]
            if len(unfit) >= UNFIT_AFTER or (unfit and is_all):
                raise WorkersUnfit(self._unfit(unfit[-1]))
            if self._given_up + len(self._held) >= HOPELESS_AFTER:
                raise WorkersUnfit(self._unfit(self._held[-1][2]))
            if not is_all:
                return []
        held, self._held = self._held, []
        records, finished = [], datetime.now(UTC).isoformat(timespec="seconds")
        for key, job, failure in held:
            if failure.is_unfit and job.tries < TRIES:  # by now others have been run
                self._again.append(job)
            else:
                message, stderr = failure.message, failure.stderr
                records.append(Record(key, Outcome.LOST, message=message, stderr=stderr, finished=finished))
        self._given_up += len(records)
        self._keys.difference_update(record.key for record in records)
        return records

    def _unfit(self, failure: Failure) -> str:
        command = " ".join(self._command)
        sentence = f"the workers cannot run {command!r}: {failure.message}, and none has ever printed a record"
        return f"{sentence}\n{failure.stderr.strip()}" if failure.stderr.strip() else sentence

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


def _failure_of(result: Result, timeout: float | None) -> Failure:
    """Why a group ended without all its records; `timeout` is the one that its command had."""
    process, error = result.process, result.error
    stderr = result.stderr.decode(errors="replace")[-TAIL:]
    if process is not None:
        status = process.returncode
        message = f"the worker's command {ending(status)}" + (" and no record" if status == 0 else "")
        return Failure(message, stderr, is_unfit=status >= 0)
    if isinstance(error, subprocess.TimeoutExpired):
        message = f"the worker's command did not end within {timeout or 0:g} s"
        return Failure(message, stderr)
    if isinstance(error, distributed().KilledWorker):
        message = f"{error.allowed_failures + 1} workers died one after the other while they ran it"
        return Failure(message, stderr, is_the_workers=True)
    return Failure(f"the worker could not run its command: {told(error)}", stderr, is_unfit=True)
