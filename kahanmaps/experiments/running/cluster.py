"""Run tasks in groups on an existing dask cluster.

    python -m kahanmaps.experiments.running.cluster < group.json

is the command that a dask worker runs, by `subprocess.run`, for a group of tasks. Hence neither the scheduler nor the
worker processes of dask import kahanmaps, and a task that crashes does not affect them. The input of the command is
{"documents": {DIGEST: TEXT}, "jobs": [{"task": TEXT, "limits": {"time": S, "memory": BYTES}}, ...]}. When a job ends,
its record is printed on one line. The exit status is 0 whatever the outcomes are. The tasks of a group take some
seconds together, since each group costs the scheduler a constant time.

This module does not access the database: `wait` returns each record once, and its caller stores the record.
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
PASSED_VARIABLES = ("KAHANMAPS_TASKS", "PYTHONPATH")  # environment variables that the workers receive

GROUP_START = 60.0  # seconds that a group may take beyond the time limits of its jobs, since a worker may be busy
JOB_START = 5.0  # additional seconds that each job of a group may take
MAX_GROUP_JOBS = 200
MAX_SILENT_GROUPS = 3  # number of groups that may end without any record before the workers are considered unfit
FETCH_SECONDS = 30.0  # seconds to fetch the output of a group that has ended
COUNT_INTERVAL = 2.0  # minimal number of seconds between two counts of the workers
_ADDRESS = re.compile(r"([a-z]+://)?[^\s/]+:\d+/?")


class ClusterLost(KahanmapsError):
    """Raised when the scheduler does not answer or has lost groups; records that were stored are safe."""


class WorkersUnfit(ClusterLost):
    """Raised when the workers cannot run any task, since kahanmaps is not installed correctly there."""


class ClusterWorkers(Executor):
    """An executor that runs jobs on the workers of an existing dask scheduler.

    `address` is the address "tcp://host:port" of the scheduler or the path of its scheduler file; for "tls://host:port"
    the configuration of dask gives the certificates. Each process of dask can run code on all others, since it
    unpickles all data sent to it: use only a trusted scheduler and workers, in a network that nobody else can reach.

    `command` is run by a worker for a group; by default it is this module with the interpreter `python`, whose path
    must be the same on all workers. A group takes about `group_seconds`, estimated from recent tasks of the same kinds,
    and has at most 200 jobs. `on_message` is called with messages about waiting for workers.

    At most two groups for each thread of the workers are in flight, so that the memory used here does not grow with the
    number of tasks. If a group ends without the record of a job, the job is run again, alone in a group, a few times
    before it is lost.
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
        # The argument `env=` of `subprocess.run` would replace the environment of the worker, not extend it.
        environment = [f"{name}={os.environ[name]}" for name in PASSED_VARIABLES if name in os.environ]
        self._command = ["/usr/bin/env", *environment, *(command or [python or sys.executable, "-m", MODULE])]
        self._tries: dict[str, int] = {}  # key of a job in flight -> number of failed attempts in a group of its own
        self._open_group: list[Job] = []
        self._retries: deque[Job] = deque()  # jobs to be run again, each in a group of its own
        self._groups: dict[Any, list[Job]] = {}  # dask's future of a group -> jobs of this group
        self._mean_seconds: dict[str, float] = {}  # kind of a task -> mean seconds of recent tasks
        self._jobs_without_record: set[str] | None = set()  # jobs in groups without records (None: some group had one)
        self._groups_without_record = 0
        self._client = connect(address, connect_seconds)
        self._futures = import_module("distributed").as_completed(loop=self._client.loop)
        self._lost_reason: str | None = None  # the reason why the connection to the scheduler is lost
        self._threads, self._counted_at, self._is_reported = 0, -COUNT_INTERVAL, False
        self._count_threads()

    @property
    def is_free(self) -> bool:
        """Whether one more job may be submitted now."""
        return not self._retries and len(self._groups) < self._max_groups

    @property
    def in_flight(self) -> int:
        """The number of submitted jobs whose records have not been returned yet."""
        return len(self._tries)

    def submit(self, job: Job) -> None:
        """Add a job to the open group, which is sent when it is full, or by `wait` if a thread has no waiting group."""
        if job.task.key in self._tries:
            raise InputError(
                f"task {job.task.key} is already running: submit it again when its record has been returned"
            )
        self._tries[job.task.key] = 0
        self._open_group.append(job)
        # A task of a kind whose duration is unknown counts as a full group.
        seconds = sum(self._mean_seconds.get(job.task.kind, self._group_seconds) for job in self._open_group)
        if len(self._open_group) >= MAX_GROUP_JOBS or seconds >= self._group_seconds:
            self._send_open()

    def wait(self, timeout: float) -> list[Record]:
        """Return the records of finished jobs as soon as there is one; an empty list after `timeout` seconds.

        Raises ClusterLost if the scheduler does not answer. Raises WorkersUnfit if no group has ever printed a record,
        and several groups, among them a group of each job in flight, have ended without being killed.
        """
        deadline = time.monotonic() + timeout
        while True:
            while self._retries and len(self._groups) < self._max_groups:
                self._send([self._retries.popleft()])
            # While a group waits for each thread, the open group is not sent, so that jobs can still be added to it.
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
        """Close the connection; scheduler and workers continue to run. Closing twice has no effect.

        Jobs in flight are dropped. A group that a worker has begun cannot be stopped: the worker finishes it, and its
        records are ignored.
        """
        # A scheduler that does not answer must not block this process, and its errors no longer matter.
        with suppress(Exception), warnings.catch_warnings(action="ignore"):
            self._client.close(timeout=2)
        self._tries.clear()
        self._groups.clear()

    @property
    def _max_groups(self) -> int:
        """The maximal number of groups at the scheduler: for each thread one that runs and one that waits."""
        return max(2, 2 * self._threads)

    @property
    def _is_connected(self) -> bool:
        return self._lost_reason is None and self._client.status == "running"

    def _count_threads(self) -> None:
        """Count the threads of the workers every few seconds; report once if there are none."""
        if not self._is_connected or time.monotonic() - self._counted_at < COUNT_INTERVAL / (1 if self._threads else 4):
            return
        self._counted_at = time.monotonic()
        with suppress(Exception):  # the connection to the scheduler may be lost
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
        # The command itself enforces the limits of its tasks; this timeout is for a command that hangs.
        timeout = None if None in times else GROUP_START + sum((time or 0.0) + JOB_START for time in times)
        # distributed warns of arguments above 10 MB, a size that a single document may exceed.
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
            except Exception as error:  # the client closes itself when it has lost the scheduler
                self._lost_reason = self._lost_reason or on_one_line(error)
                return
        self._groups[future] = jobs
        self._futures.add(future)

    def _collect(self, future: Any) -> list[Record]:
        """Return the records that an ended group printed; its jobs without a record are run again alone, or lost."""
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
            # A wrong installation must not be reported as thousands of lost tasks, and a task that crashes must not be
            # reported as a wrong installation.
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
    """Return the record that a line of output contains; None if it contains none, or only a part of one."""
    if not line.startswith(b"{"):
        return None
    try:
        return Record.from_json(json.loads(line))
    except (ValueError, TypeError, LookupError):
        return None


def on_one_line(error: BaseException | None) -> str:
    """Return the type and the message of an exception as one line."""
    message = " ".join(str(error).split())
    return f"{type(error).__name__}: {message}" if message else type(error).__name__


def connect(address: str, timeout: float) -> Any:
    """Return a dask client of a scheduler, without log output. Raises InputError if the scheduler does not answer."""
    try:
        client = import_module("distributed").Client  # this import takes a second
    except ModuleNotFoundError as error:
        raise InputError(
            f"a cluster needs distributed, which is not installed ({error}): pip install 'kahanmaps[cluster]'"
        ) from None
    path, scheduler = Path(address), address
    if "://" not in address and (path.is_file() or address.endswith(".json")):
        # distributed would wait forever for a scheduler file that does not exist.
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
    for name in list(logging.Logger.manager.loggerDict):  # every logger of distributed has a handler of its own
        if name.split(".")[0] in ("distributed", "tornado"):
            logging.getLogger(name).disabled = True
    client_future: Future[Any] = Future()

    def make_client() -> None:
        try:
            # distributed warns of different versions of packages, which do not matter: workers only run a command.
            with warnings.catch_warnings(action="ignore"):
                client_future.set_result(client(scheduler, timeout=timeout, set_as_default=False, name="kahanmaps"))
        except BaseException as error:
            client_future.set_exception(error)

    # In a thread, since distributed waits forever if some other service listens at the address.
    Thread(target=make_client, daemon=True).start()
    try:
        return client_future.result(timeout + 1)
    except Exception as error:
        raise InputError(
            f"no dask scheduler answers at {address} within {timeout:g} s ({on_one_line(error)}): "
            "is the address right, and does `dask scheduler` run there?"
        ) from error


# The command that a worker runs for a group


def run_group(source: IO[str], target: IO[str]) -> None:
    """Run the jobs in the JSON text of `source` one after another, and write their records to `target`, one a line.

    A job whose process is killed from outside is lost at once: the sender of the group runs it again, maybe elsewhere.
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
        # If the parent process ended before `getppid` was called, the pipe has no reader.
        reader = select.poll()
        reader.register(sys.stdout.fileno(), 0)
        if any(events & select.POLLERR for _, events in reader.poll(0)):
            os._exit(1)
    run_group(sys.stdin, sys.stdout)
