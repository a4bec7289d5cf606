"""Run tasks in groups on an existing dask cluster.

    python -m kahanmaps.experiments.running.cluster < group.json

is the command that a dask worker runs for a group, with `subprocess.run`. Hence neither the scheduler nor dask's worker
processes import kahanmaps, and a crashing task does not affect them. The input is {"documents": {DIGEST: TEXT}, "jobs":
[{"task": TEXT, "limits": {"time": S, "memory": BYTES}}, ...]}. The record of every job is printed on one line when the
job ends. The exit status is 0 for all outcomes of the jobs. A group takes a few seconds, since the scheduler has a
constant overhead for each group.

This module does not access the database: `wait` returns each record once, and the caller stores it.
"""

from __future__ import annotations

import json
import logging
import os
import re
import select
import subprocess
import sys
import time
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import asdict, replace
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import IO, Any

from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.experiments.results.records import Documents, Executor, Job, Outcome, Record, Task, TaskLimits, canonical
from kahanmaps.experiments.running.local import GROUP_SECONDS, TAIL_LENGTH, TRIES, LocalWorkers, ending
from kahanmaps.processes import end_with_parent

MODULE = "kahanmaps.experiments.running.cluster"
PASSED_VARIABLES = ("KAHANMAPS_TASKS", "PYTHONPATH")  # environment variables that are passed on to the workers

GROUP_START = 60.0  # seconds allowed for a group beyond the time limits of its jobs, since a worker may be busy
JOB_START = 5.0  # seconds allowed in addition for each job of a group
MAX_GROUP_JOBS = 200
MAX_SILENT_GROUPS = 3  # groups that may end by themselves before any group has printed a record
FETCH_SECONDS = 30.0  # seconds to fetch the output of a group that has ended
COUNT_INTERVAL = 2.0  # seconds between two counts of the workers
_ADDRESS = re.compile(r"([a-z]+://)?[^\s/]+:\d+/?")


class ClusterLost(KahanmapsError):
    """Raised when the scheduler does not answer or has dropped groups. Records that were stored are safe."""


class WorkersUnfit(ClusterLost):
    """Raised when the workers cannot run any task, since their installation is wrong."""


class ClusterWorkers(Executor):
    """Runs jobs on the workers of an existing dask scheduler.

    `address` is the address "tcp://host:port" of the scheduler or the path of its scheduler file; for "tls://host:port"
    dask's own configuration gives the certificates. The processes of dask unpickle all data sent to them, so each can
    run code on all others: use only a trusted scheduler and trusted workers, in a network that nobody else can reach.

    `command` is the command that a worker runs for a group, by default this module with the interpreter `python`, which
    must have the same path on the workers. A group takes about `group_seconds`, estimated from the last tasks of the
    same kind, and has at most 200 jobs. `on_message` is called with messages about waiting.

    At most two groups for each thread of the workers are in flight, so that the memory used here does not depend on the
    number of tasks. A job whose group ends without its record is run again a few times, in a group of its own, before
    it is lost.
    """

    def __init__(
        self,
        address: str,
        documents: Documents,
        *,
        command: Sequence[str] | None = None,
        python: str | None = None,
        group_seconds: float = GROUP_SECONDS,
        on_message: Callable[[str], None] | None = None,
        connect_seconds: float = 10.0,
    ) -> None:
        self.address = address
        self._documents = documents
        self._group_seconds = group_seconds
        self._on_message = on_message or (lambda text: None)
        # `env=` of subprocess.run would replace the whole environment of the worker.
        environment = [f"{name}={os.environ[name]}" for name in PASSED_VARIABLES if name in os.environ]
        self._command = ["/usr/bin/env", *environment, *(command or [python or sys.executable, "-m", MODULE])]
        self._tries: dict[str, int] = {}  # key of a job in flight -> failed attempts in a group of its own
        self._open_group: list[Job] = []
        self._retries: deque[Job] = deque()  # jobs to be run in groups of their own
        self._groups: dict[Any, list[Job]] = {}  # future at the scheduler -> its group
        self._mean_seconds: dict[str, float] = {}  # mean seconds of recent tasks by kind
        self._jobs_without_record: set[str] | None = set()  # jobs of groups without records; None: there was a record
        self._groups_without_record = 0
        self._client = connect(address, connect_seconds)
        self._futures = import_module("distributed").as_completed(loop=self._client.loop)
        self._lost_reason: str | None = None  # reason why the scheduler is lost
        self._threads, self._counted_at, self._is_reported = 0, -COUNT_INTERVAL, False
        self._count_threads()

    @property
    def is_free(self) -> bool:
        """Whether one more job may be submitted now."""
        return not self._retries and len(self._groups) < self._max_groups

    @property
    def in_flight(self) -> int:
        """The number of jobs submitted whose records have not been returned."""
        return len(self._tries)

    def submit(self, job: Job) -> None:
        """Add a job to the open group, which is sent when it is full, or by `wait` when a worker might be idle."""
        if job.task.key in self._tries:
            raise InputError(
                f"task {job.task.key} is already running: submit it again when its record has been returned"
            )
        self._tries[job.task.key] = 0
        self._open_group.append(job)
        # A task of unknown duration is a group of its own.
        seconds = sum(self._mean_seconds.get(job.task.kind, self._group_seconds) for job in self._open_group)
        if len(self._open_group) >= MAX_GROUP_JOBS or seconds >= self._group_seconds:
            self._send_open()

    def wait(self, timeout: float) -> list[Record]:
        """Return the finished records as soon as there is one, or none after `timeout` seconds.

        Raises ClusterLost if the scheduler does not answer. Raises WorkersUnfit if no group has printed a record, and
        several groups, among them those of all jobs in flight, have ended by themselves.
        """
        deadline = time.monotonic() + timeout
        while True:
            while self._retries and len(self._groups) < self._max_groups:
                self._send([self._retries.popleft()])
            # While every thread has a waiting group, the open group is not sent, and further jobs can be added.
            if len(self._groups) < self._max_groups:
                self._send_open()
            while not (is_ready := self._futures.has_ready()) and time.monotonic() < deadline and self._is_connected:
                time.sleep(0.01)
            futures = self._futures.next_batch(block=False) if is_ready else []
            self._count_threads()
            records = [record for future in futures if self._is_connected for record in self._collect(future)]
            if records or (self._is_connected and time.monotonic() >= deadline):
                return records
            if not self._is_connected:
                reason = self._lost_reason or "the connection was closed"
                raise ClusterLost(
                    f"the scheduler at {self.address} is lost ({reason}): what was recorded is safe; run the same "
                    "command again once the scheduler is back"
                )

    def close(self) -> None:
        """Close the connection; the scheduler and its workers keep running. May be called twice.

        Jobs in flight are dropped. A group that a worker has begun cannot be stopped: it runs to its end, and its
        results are ignored.
        """
        # A lost scheduler must not block this process, and its errors no longer matter.
        with suppress(Exception), warnings.catch_warnings(action="ignore"):
            self._client.close(timeout=2)
        self._tries.clear()
        self._groups.clear()

    @property
    def _max_groups(self) -> int:
        """The number of groups allowed at the scheduler: for each thread one running group and one waiting group."""
        return max(2, 2 * self._threads)

    @property
    def _is_connected(self) -> bool:
        return self._lost_reason is None and self._client.status == "running"

    def _count_threads(self) -> None:
        """Count the threads of the workers from time to time, and report once that there are none."""
        if not self._is_connected or time.monotonic() - self._counted_at < COUNT_INTERVAL / (1 if self._threads else 4):
            return
        self._counted_at = time.monotonic()
        with suppress(Exception):  # the scheduler may have been lost
            self._threads = sum(self._client.nthreads().values())
            if not self._threads and not self._is_reported:
                self._on_message(f"waiting for workers: the scheduler at {self.address} has none")
            self._is_reported = not self._threads

    def _send_open(self) -> None:
        if self._open_group:
            jobs, self._open_group = self._open_group, []
            self._send(jobs)

    def _send(self, jobs: list[Job]) -> None:
        documents = {name: self._documents(name) for job in jobs for name in job.task.documents}
        group = {"documents": documents, "jobs": [{"task": j.task.text, "limits": asdict(j.limits)} for j in jobs]}
        times = [job.limits.time for job in jobs]
        # The command itself enforces the limits of tasks: this timeout ends a command that hangs.
        timeout = None if None in times else GROUP_START + sum((time or 0.0) + JOB_START for time in times)
        # distributed warns of arguments beyond 10 MB, but a single document may exceed this size.
        with warnings.catch_warnings(action="ignore"):
            try:
                future = self._client.submit(
                    subprocess.run,
                    self._command,
                    input=json.dumps(group).encode(),
                    capture_output=True,
                    timeout=timeout,
                    pure=False,
                    key=f"kahanmaps-{uuid.uuid4().hex}",
                )
            except Exception as error:  # the client has closed itself after losing the scheduler
                self._lost_reason = self._lost_reason or on_one_line(error)
                return
        self._groups[future] = jobs
        self._futures.add(future)

    def _collect(self, future: Any) -> list[Record]:
        """Return the records that a group has printed. Its other jobs will be run again alone, or are lost."""
        unfinished = {job.task.key: job for job in self._groups[future]}
        is_alone = len(unfinished) == 1
        output: Any
        try:
            output = future.result(timeout=FETCH_SECONDS)
            message = f"the worker's command {ending(output.returncode)}"
            message += " and no record" if output.returncode == 0 else ""
            has_ended_by_itself = output.returncode >= 0
        except TimeoutError:  # the worker died before its output was fetched: the scheduler repeats the command
            self._futures.add(future)
            return []
        except subprocess.TimeoutExpired as error:
            output, has_ended_by_itself = error, False
            message = f"the worker's command did not end within {error.timeout:g} s"
        except Exception as error:
            if future.status != "error":  # an error of the connection, not of the command
                self._lost_reason = self._lost_reason or on_one_line(error)
                return []
            output, has_ended_by_itself = None, "KilledWorker" not in type(error).__name__
            message = f"the worker could not run its command: {on_one_line(error)}"
        del self._groups[future]
        with suppress(Exception):
            future.release()
        records: list[Record] = []
        failures: list[tuple[Job, Record]] = []
        for line in (getattr(output, "stdout", None) or b"").split(b"\n"):
            record = record_on(line)
            if record is None or record.key not in unfinished:  # a record that is printed twice is returned once
                continue
            job = unfinished.pop(record.key)
            self._jobs_without_record = None
            if record.outcome is Outcome.LOST:
                self._tries[record.key] += 1
                failures.append((job, record))
                continue
            mean = self._mean_seconds.setdefault(job.task.kind, record.seconds)
            self._mean_seconds[job.task.kind] += (record.seconds - mean) / 10
            records.append(record)
        stderr = (getattr(output, "stderr", None) or b"").decode(errors="replace")[-TAIL_LENGTH:]
        for key, job in unfinished.items():
            self._tries[key] += is_alone
            failures.append((job, Record(key, Outcome.LOST, message=message, stderr=stderr)))
        if unfinished and has_ended_by_itself and self._jobs_without_record is not None:
            # A missing installation must not be reported as thousands of lost tasks, nor a crashing task as a
            # missing installation.
            self._jobs_without_record |= unfinished.keys()
            self._groups_without_record += 1
            if self._groups_without_record >= MAX_SILENT_GROUPS and self._tries.keys() <= self._jobs_without_record:
                command = " ".join(self._command)
                sentence = f"the workers cannot run {command!r}: {message}, and none has ever printed a record"
                raise WorkersUnfit(f"{sentence}\n{stderr.strip()}".strip())
        finished = datetime.now(UTC).isoformat(timespec="seconds")
        for job, record in failures:
            if self._tries[record.key] < TRIES:
                self._retries.append(job)
            else:
                records.append(replace(record, finished=finished))
        for record in records:
            del self._tries[record.key]
        return records


def record_on(line: bytes) -> Record | None:
    """Return the record on a line of output; None if the line is something else, such as an incomplete record."""
    if not line.startswith(b"{"):
        return None
    try:
        return Record.from_json(json.loads(line))
    except (ValueError, TypeError, LookupError):
        return None


def on_one_line(error: BaseException | None) -> str:
    """Return the type and the message of an exception on one line."""
    message = " ".join(str(error).split())
    return f"{type(error).__name__}: {message}" if message else type(error).__name__


def connect(address: str, timeout: float) -> Any:
    """Return a client of the scheduler, without log output. Raises InputError if it does not answer."""
    try:
        client = import_module("distributed").Client  # which takes a second to import
    except ModuleNotFoundError as error:
        raise InputError(
            f"a cluster needs distributed, which is not installed ({error}): pip install 'kahanmaps[cluster]'"
        ) from None
    path, scheduler = Path(address), address
    if "://" not in address and (path.is_file() or address.endswith(".json")):
        # distributed would wait forever for a missing file.
        try:
            scheduler = str(json.loads(path.read_text(encoding="utf-8"))["address"])
        except OSError as error:
            raise InputError(f"cannot read the scheduler file {address}: {error.strerror}") from None
        except (ValueError, LookupError, TypeError):
            raise InputError(f"{address} is not the file that `dask scheduler --scheduler-file` writes") from None
    elif not _ADDRESS.fullmatch(address):
        raise InputError(
            f"{address!r} is not the address of a scheduler: write tcp://host:port, or the path of a scheduler file"
        )
    for name in list(logging.Logger.manager.loggerDict):  # each logger has its own handler
        if name.split(".")[0] in ("distributed", "tornado"):
            logging.getLogger(name).disabled = True
    client_future: Future[Any] = Future()

    def make_client() -> None:
        try:
            # distributed warns of different package versions, which do not matter: workers only run a command.
            with warnings.catch_warnings(action="ignore"):
                client_future.set_result(client(scheduler, timeout=timeout, set_as_default=False, name="kahanmaps"))
        except BaseException as error:
            client_future.set_exception(error)

    # In a thread: distributed waits forever if another service listens at the address.
    Thread(target=make_client, daemon=True).start()
    try:
        return client_future.result(timeout + 1)
    except Exception as error:
        raise InputError(
            f"no dask scheduler answers at {address} within {timeout:g} s ({on_one_line(error)}): "
            "is the address right, and does `dask scheduler` run there?"
        ) from error


# The command on a worker


def run_group(source: IO[str], target: IO[str]) -> None:
    """Run the jobs in the JSON text of `source` one after the other, and write their records to `target`.

    A job whose process is killed from outside is lost after one attempt: the sender runs it again, perhaps elsewhere.
    """
    group = json.load(source)
    workers = LocalWorkers(1, group["documents"].__getitem__, tries=1)
    try:
        for job in group["jobs"]:
            workers.submit(Job(Task.from_text(job["task"]), TaskLimits(**job["limits"])))
            while workers.in_flight:
                for record in workers.wait(60.0):
                    target.write(canonical(record.to_json()) + "\n")
                    target.flush()
    finally:
        workers.close()


if __name__ == "__main__":
    end_with_parent(os.getppid())
    if hasattr(select, "poll"):
        # If the parent died before getppid was called, the pipe has no reader.
        reader = select.poll()
        reader.register(sys.stdout.fileno(), 0)
        if any(events & select.POLLERR for _, events in reader.poll(0)):
            os._exit(1)
    run_group(sys.stdin, sys.stdout)
