"""Tasks on a dask cluster that is running already: groups of them go out, records come back.

    python -m kahanmaps.experiments.running.cluster < group.json

is what a worker of dask runs for a group, by the standard library's `subprocess.run`: nothing of ours is needed on the
scheduler or inside the workers, and a task that dies takes nothing with it. The input is {"documents": {DIGEST: TEXT},
"jobs": [{"task": TEXT, "limits": {"time": S, "memory": BYTES}}, ...]}; every job gives one line, its record, as soon as
it is there, and the exit status is 0 whatever the tasks did. A group is a few seconds of work, since the scheduler
needs about as long for a millisecond as for an hour.

Nothing here touches the database: a record is handed back by `wait`, once, and is safe when the caller has stored it.
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
from kahanmaps.experiments.running.local import GROUP_SECONDS, TAIL, TRIES, LocalWorkers, ending
from kahanmaps.processes import end_with_parent

MODULE = "kahanmaps.experiments.running.cluster"
PASSED_ON = ("KAHANMAPS_TASKS", "PYTHONPATH")  # variables that mean the same to the workers as to us

START_UP = 60.0  # seconds a group may take beyond the limits of its jobs, on a cold and busy worker,
START_UP_OF_A_JOB = 5.0  # and for each job in it
LARGEST_GROUP = 200  # jobs
UNFIT_AFTER = 3  # groups that ended by themselves without a record, when there has never been one
FETCH = 30.0  # seconds to fetch the output of a group that has ended
LOOK_EVERY = 2.0  # seconds between two looks at who the workers are
_ADDRESS = re.compile(r"([a-z]+://)?[^\s/]+:\d+/?")


class ClusterLost(KahanmapsError):
    """The scheduler is gone, or has dropped what was asked of it. What was recorded before is safe."""


class WorkersUnfit(ClusterLost):
    """Raised when the set-up is wrong: the workers cannot run tasks at all, whichever these are."""


class ClusterWorkers(Executor):
    """Runs jobs on the workers of an existing dask scheduler.

    `address` is that of the scheduler, "tcp://host:port", or the path of its scheduler file; for "tls://host:port" the
    certificates are those of dask's own configuration. dask's parties unpickle what they are sent, so each of them can
    run code on all others: scheduler and workers have to be trusted, and closed to everybody else.

    `command` is what a worker runs for a group, by default this module with the interpreter `python`, which the workers
    have to find at the same path as we do. A group takes about `group_seconds`, by what the last tasks of the same kind
    took, and has at most 200 jobs. `on_message` gets messages about what is being waited for.

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
        group_seconds: float = GROUP_SECONDS,
        on_message: Callable[[str], None] | None = None,
        connect_seconds: float = 10.0,
    ) -> None:
        self.address = address
        self._documents = documents
        self._group_seconds = group_seconds
        self._talk = on_message or (lambda text: None)
        # `env=` of subprocess.run would replace all that the worker has instead.
        passed = [f"{name}={os.environ[name]}" for name in PASSED_ON if name in os.environ]
        self._command = ["/usr/bin/env", *passed, *(command or [python or sys.executable, "-m", MODULE])]
        self._tries: dict[str, int] = {}  # of the jobs in flight, by key: how often each alone has failed
        self._open: list[Job] = []
        self._again: deque[Job] = deque()  # to be tried alone
        self._groups: dict[Any, list[Job]] = {}  # futures at the scheduler
        self._means: dict[str, float] = {}  # seconds of a task, by kind, over the last ones
        self._unfit: set[str] | None = set()  # jobs of groups that ended by themselves; None: a record has come
        self._unfit_groups = 0
        self._client = connect(address, connect_seconds)
        self._results = import_module("distributed").as_completed(loop=self._client.loop)
        self._lost: str | None = None  # why the scheduler is lost
        self._threads, self._looked, self._is_reported = 0, -LOOK_EVERY, False
        self._look()

    @property
    def is_free(self) -> bool:
        """Whether one more job may be submitted now."""
        return not self._again and len(self._groups) < self._window

    @property
    def in_flight(self) -> int:
        """How many jobs have been submitted and not yet handed back."""
        return len(self._tries)

    def submit(self, job: Job) -> None:
        """Take a job into the open group, which is sent when it is full, or by `wait` when a worker might idle."""
        if job.task.key in self._tries:
            raise InputError(f"task {job.task.key} is in flight already: submit it again when its record is back")
        self._tries[job.task.key] = 0
        self._open.append(job)
        # A kind of task of which nothing is known takes a whole group's time.
        seconds = sum(self._means.get(job.task.kind, self._group_seconds) for job in self._open)
        if len(self._open) >= LARGEST_GROUP or seconds >= self._group_seconds:
            self._send_open()

    def wait(self, timeout: float) -> list[Record]:
        """Records that are ready, as soon as there is one, or none after `timeout` seconds.

        Raises ClusterLost when the scheduler is gone, and WorkersUnfit when groups end by themselves one after the
        other, those of every job in flight among them, and none has ever printed a record.
        """
        deadline = time.monotonic() + timeout
        while True:
            while self._again and len(self._groups) < self._window:
                self._send([self._again.popleft()])
            # If every thread has a group waiting for it, there is time to fill the open one.
            if len(self._groups) < self._window:
                self._send_open()
            while not (is_ready := self._results.has_ready()) and time.monotonic() < deadline and self._is_connected:
                time.sleep(0.01)
            futures = self._results.next_batch(block=False) if is_ready else []
            self._look()
            records = [record for future in futures if self._is_connected for record in self._taken(future)]
            if records or (self._is_connected and time.monotonic() >= deadline):
                return records
            if not self._is_connected:
                raise ClusterLost(
                    f"the scheduler at {self.address} is lost ({self._lost or 'the connection was closed'}): what was "
                    "recorded is safe; run the same command again once the scheduler is back"
                )

    def close(self) -> None:
        """End at once, whether or not the scheduler is still there; it and its workers stay. May be called twice.

        What is in flight is forgotten. Groups that a worker has begun are not killed, since a running call cannot be
        taken back: they go on to their end, and their results are dropped.
        """
        # A scheduler that is gone must not hold us up, and there is nothing to be done about its last words.
        with suppress(Exception), warnings.catch_warnings(action="ignore"):
            self._client.close(timeout=2)
        self._tries.clear()
        self._groups.clear()

    @property
    def _window(self) -> int:
        """How many groups may be at the scheduler: one that runs and one that waits for each thread."""
        return max(2, 2 * self._threads)

    @property
    def _is_connected(self) -> bool:
        return self._lost is None and self._client.status == "running"

    def _look(self) -> None:
        """Count the workers' threads now and then, and say once when there are none."""
        if not self._is_connected or time.monotonic() - self._looked < LOOK_EVERY / (1 if self._threads else 4):
            return
        self._looked = time.monotonic()
        with suppress(Exception):  # a scheduler that is lost meanwhile
            self._threads = sum(self._client.nthreads().values())
            if not self._threads and not self._is_reported:
                self._talk(f"waiting for workers: the scheduler at {self.address} has none")
            self._is_reported = not self._threads

    def _send_open(self) -> None:
        if self._open:
            jobs, self._open = self._open, []
            self._send(jobs)

    def _send(self, jobs: list[Job]) -> None:
        """Hand a group to the scheduler. A lost scheduler is reported by `wait`."""
        documents = {name: self._documents(name) for job in jobs for name in job.task.documents}
        group = {"documents": documents, "jobs": [{"task": j.task.text, "limits": asdict(j.limits)} for j in jobs]}
        times = [job.limits.time for job in jobs]
        # The limits of a task are kept by the command: this is for a command that hangs.
        timeout = None if None in times else START_UP + sum((time or 0.0) + START_UP_OF_A_JOB for time in times)
        # distributed warns of arguments beyond 10 MB: a single document may be as large.
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
                self._lost = self._lost or on_one_line(error)
                return
        self._groups[future] = jobs
        self._results.add(future)

    def _taken(self, future: Any) -> list[Record]:
        """The records that a group has printed; jobs without one are put up for another try, alone, or lost."""
        left = {job.task.key: job for job in self._groups[future]}
        is_alone = len(left) == 1
        output: Any
        try:
            output = future.result(timeout=FETCH)
            message = f"the worker's command {ending(output.returncode)}"
            message += " and no record" if output.returncode == 0 else ""
            is_unfit = output.returncode >= 0
        except TimeoutError:  # the worker has died with the output, and the scheduler has the command run again
            self._results.add(future)
            return []
        except subprocess.TimeoutExpired as error:
            output, is_unfit = error, False
            message = f"the worker's command did not end within {error.timeout:g} s"
        except Exception as error:
            if future.status != "error":  # no error of the command's, but of the way to it
                self._lost = self._lost or on_one_line(error)
                return []
            output, is_unfit = None, "KilledWorker" not in type(error).__name__
            message = f"the worker could not run its command: {on_one_line(error)}"
        del self._groups[future]
        with suppress(Exception):
            future.release()
        records: list[Record] = []
        failures: list[tuple[Job, Record]] = []
        for line in (getattr(output, "stdout", None) or b"").split(b"\n"):
            record = record_on(line)
            if record is None or record.key not in left:  # a record that is printed twice is handed back once
                continue
            job = left.pop(record.key)
            self._unfit = None
            if record.outcome is Outcome.LOST:
                self._tries[record.key] += 1
                failures.append((job, record))
                continue
            mean = self._means.setdefault(job.task.kind, record.seconds)
            self._means[job.task.kind] += (record.seconds - mean) / 10
            records.append(record)
        stderr = (getattr(output, "stderr", None) or b"").decode(errors="replace")[-TAIL:]
        for key, job in left.items():
            self._tries[key] += is_alone
            failures.append((job, Record(key, Outcome.LOST, message=message, stderr=stderr)))
        if left and is_unfit and self._unfit is not None:
            # A missing installation must not be told as thousands of lost tasks, nor one deadly task as the former.
            self._unfit |= left.keys()
            self._unfit_groups += 1
            if self._unfit_groups >= UNFIT_AFTER and self._tries.keys() <= self._unfit:
                command = " ".join(self._command)
                sentence = f"the workers cannot run {command!r}: {message}, and none has ever printed a record"
                raise WorkersUnfit(f"{sentence}\n{stderr.strip()}".strip())
        finished = datetime.now(UTC).isoformat(timespec="seconds")
        for job, record in failures:
            if self._tries[record.key] < TRIES:
                self._again.append(job)
            else:
                records.append(replace(record, finished=finished))
        for record in records:
            del self._tries[record.key]
        return records


def record_on(line: bytes) -> Record | None:
    """The record on a line; None if it is something else, such as the half of one."""
    if not line.startswith(b"{"):
        return None
    try:
        return Record.from_json(json.loads(line))
    except (ValueError, TypeError, LookupError):
        return None


def on_one_line(error: BaseException | None) -> str:
    """An exception on one line."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def connect(address: str, timeout: float) -> Any:
    """A client of the scheduler, whose log is silent; or InputError with a sentence."""
    try:
        client = import_module("distributed").Client  # which takes a second to import
    except ModuleNotFoundError as error:
        raise InputError(
            f"a cluster needs the package distributed, which is not there ({error}): pip install 'kahanmaps[cluster]'"
        ) from None
    path, chosen = Path(address), address
    if "://" not in address and (path.is_file() or address.endswith(".json")):
        # distributed would wait for the file for ever.
        try:
            chosen = str(json.loads(path.read_text(encoding="utf-8"))["address"])
        except OSError as error:
            raise InputError(f"cannot read the scheduler file {address}: {error.strerror}") from None
        except (ValueError, LookupError, TypeError):
            raise InputError(f"{address} is not the file that `dask scheduler --scheduler-file` writes") from None
    elif not _ADDRESS.fullmatch(address):
        raise InputError(
            f"{address!r} is not the address of a scheduler: write tcp://host:port, or the path of a scheduler file"
        )
    for name in list(logging.Logger.manager.loggerDict):  # each of them has a handler of its own
        if name.split(".")[0] in ("distributed", "tornado"):
            logging.getLogger(name).disabled = True
    made: Future[Any] = Future()

    def make() -> None:
        try:
            # Of other versions of some package: our tasks are the standard library's, whose version may differ.
            with warnings.catch_warnings(action="ignore"):
                made.set_result(client(chosen, timeout=timeout, set_as_default=False, name="kahanmaps"))
        except BaseException as error:
            made.set_exception(error)

    # In a thread: distributed itself waits for ever where something listens that is no scheduler.
    Thread(target=make, daemon=True).start()
    try:
        return made.result(timeout + 1)
    except Exception as error:
        raise InputError(
            f"no dask scheduler answers at {address} within {timeout:g} s ({on_one_line(error)}): "
            "is the address right, and does `dask scheduler` run there?"
        ) from error


# The command on a worker


def do_group(source: IO[str], target: IO[str]) -> None:
    """Do the jobs that `source` describes, one after the other.

    A job whose process is killed from outside is lost at once: whoever has sent it tries it again, elsewhere maybe.
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
        # The parent may have died before it could be known who that is: then nobody reads.
        reader = select.poll()
        reader.register(sys.stdout.fileno(), 0)
        if any(events & select.POLLERR for _, events in reader.poll(0)):
            os._exit(1)
    do_group(sys.stdin, sys.stdout)
