"""Tasks on a dask cluster that is running already: groups of them go out, records come back.

What a worker of dask is asked to do is the standard library's `subprocess.run`, on our group command, with JSON on its
standard input. So nothing of ours is needed on the scheduler or inside the workers, and a task that dies takes nothing
with it. A group is a few seconds of work, since the scheduler needs about as long for a millisecond as for an hour.

Nothing here touches the database: a record is handed back by `wait`, once, and is safe when the caller has stored it.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
import logging
import os
import queue
import re
import subprocess
import sys
import threading
import time
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.experiments.children import documents_of
from kahanmaps.experiments.executor import Documents, Executor
from kahanmaps.experiments.records import Job, Limits, Outcome, Record, Task

GROUP_MODULE = "kahanmaps.experiments.group"
TASKS_VARIABLE = "KAHANMAPS_TASKS"
PASSED_ON = (TASKS_VARIABLE, "PYTHONPATH")  # variables that mean the same to the workers as to us

TAIL = 2000  # characters of standard error kept
START_UP = 60.0  # seconds a group may take beyond the limits of its jobs, on a cold and busy worker,
START_UP_OF_A_JOB = 5.0  # and for each job in it
LARGEST_TEXT = 1 << 20  # bytes in a group, of what is sent and of what is expected back: this bounds memory
RESULTS_AT_ONCE = 32  # groups whose results may lie here unread; others leave theirs on the workers
MEMORY_OF_MEANS = 20  # a mean follows a batch that goes from cheap tasks to dear ones
UNFIT_AFTER = 3  # groups that ended by themselves without a record, when there has never been one
HOPELESS_AFTER = 10  # the same, however they ended
COUNT_EVERY = 2.0  # seconds between two looks at who the workers are
SILENCE = 3.0  # seconds without a worker before a word is said; then again, ever more rarely

_LOGGERS = ("distributed", "tornado")
_ADDRESS = re.compile(r"([a-z]+://)?[^\s/]+:\d+/?")


class ClusterLost(KahanmapsError):
    """The scheduler is gone, or has dropped what was asked of it. What was recorded before is safe."""


class WorkersUnfit(ClusterLost):
    """The workers cannot run tasks at all: not a word about any task, which is nobody's fault but the set-up's."""


class _Kept(NamedTuple):
    """A job in flight. Its canonical text is a quarter as large as the task with its dictionaries."""

    kind: str
    text: str
    limits: Limits


@dataclass
class _Group:
    """Jobs that one command does, by key; what has come back is taken out."""

    jobs: dict[str, _Kept] = field(default_factory=dict)
    documents: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    sent: int = 0  # bytes, about
    expected: float = 0.0  # bytes, about
    is_alone: bool = False  # so small that a failure is its only job's
    is_suspect: bool = False  # its worker died, again and again

    @property
    def timeout(self) -> float | None:
        """How long the command may take: what its jobs may, and a generous start; None if one of them is unlimited."""
        total = START_UP
        for job in self.jobs.values():
            if job.limits.time is None:
                return None
            total += job.limits.time + START_UP_OF_A_JOB
        return total

    @property
    def text(self) -> bytes:
        """What the group command reads."""
        jobs = [{"task": job.text, "limits": asdict(job.limits)} for job in self.jobs.values()]
        return json.dumps({"documents": self.documents, "jobs": jobs}).encode()


@dataclass(frozen=True)
class _Failure:
    """Why a group ended without all its records.

    `is_unfit`: by itself, as if the command could not be run at all; `is_the_workers`: they died, and it with them.
    """

    message: str
    stderr: str
    outcome: Outcome = Outcome.CRASHED
    is_unfit: bool = False
    is_the_workers: bool = False


@dataclass(frozen=True)
class _Result:
    """What dask says of a group: the finished command, or the exception in its place."""

    number: int
    process: subprocess.CompletedProcess[bytes] | None = None
    error: BaseException | None = None


@dataclass
class _Means:
    """What a record of one kind of task takes, on average over the last ones."""

    seconds: float = 0.0
    size: float = 0.0
    seen: int = 0

    def learn(self, seconds: float, size: int) -> None:
        """One record more."""
        self.seen = min(self.seen + 1, MEMORY_OF_MEANS)
        self.seconds += (seconds - self.seconds) / self.seen
        self.size += (size - self.size) / self.seen


class ClusterWorkers(Executor):
    """Runs jobs on the workers of an existing dask scheduler.

    `address` is that of the scheduler, "tcp://host:port", or the path of its scheduler file. `command` is what a worker
    runs for a group, by default `python -m kahanmaps.experiments.group` with this interpreter, which the workers have
    to find at the same path. A group takes about `group_seconds` and has at most `largest_group` jobs. `talk` is told,
    now and then, what is being waited for.

    At most two groups for each thread of the workers are under way, so that memory here does not depend on the number
    of tasks. A group that ends early is taken apart: each job without a record is tried once more, alone, so that only
    the guilty one is recorded as crashed. dask itself moves the group of a dead worker elsewhere.

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
        self._documents = documents
        self._command = _with_environment(command or [python or sys.executable, "-m", GROUP_MODULE])
        self._group_seconds = group_seconds
        self._largest_group = largest_group
        self._talk = talk or (lambda text: None)

        self._keys: set[str] = set()  # of jobs in flight
        self._open = _Group()
        self._again: deque[_Kept] = deque()  # jobs to be tried alone
        self._suspects: deque[_Kept] = deque()  # jobs to be tried one after the other
        self._groups: dict[int, _Group] = {}  # at the scheduler
        self._held: list[tuple[str, _Failure]] = []  # failures, while it is open whose fault they are
        self._given_up = 0
        self._numbers = count()
        self._means: dict[str, _Means] = {}
        self._is_proven = False  # a record has come from the workers
        self._lost: str | None = None
        self._is_closed = False
        self._threads = 0
        self._silent_since: float | None = None
        self._next_word = SILENCE

        self._results: queue.Queue[_Result | str] = queue.Queue()  # a string: why the scheduler is lost
        self._fetching: set[Future[None]] = set()  # coroutines on dask's loop, one for each group that has ended
        self._connect(connect_seconds)

    def _connect(self, seconds: float) -> None:
        self._client = _connected(self.address, seconds)
        self._loop: asyncio.AbstractEventLoop = self._client.loop.asyncio_loop
        self._room = asyncio.Semaphore(RESULTS_AT_ONCE)
        self._counted = threading.Event()
        self._counter = asyncio.run_coroutine_threadsafe(self._count_threads(), self._loop)
        self._counted.wait(seconds)

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
        return self._threads

    @property
    def groups_in_flight(self) -> int:
        """How many groups are at the scheduler."""
        return len(self._groups)

    def submit(self, job: Job) -> None:
        """Take a job into the open group, which is sent when it is full, or by `wait` when a worker might idle."""
        if job.task.key in self._keys:
            raise InputError(f"task {job.task.key} is in flight already: submit it again when its record is back")
        if self._open.jobs and not self._fits(job.task.kind):
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
            results = self._drained(min(max(left, 0.0), 1.0))
            records = [record for result in results for record in self._taken(result)]
            records += self._judged()
            if records:
                return records
            if self._lost is not None:
                raise ClusterLost(
                    f"the scheduler at {self.address} is lost ({self._lost}): what was recorded is safe; "
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
        for running in [self._counter, *self._fetching.copy()]:
            running.cancel()
        # A scheduler that is gone must not hold us up, and there is nothing to be done about its last words.
        with contextlib.suppress(Exception), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._client.close(timeout=2)
        self._keys.clear()
        self._groups.clear()
        self._again.clear()
        self._suspects.clear()
        self._held.clear()
        self._open = _Group()
        _SILENCE.end()

    # Groups

    @property
    def _window(self) -> int:
        """How many groups may be at the scheduler: one that runs and one that waits for each thread."""
        return max(2, 2 * self._threads)

    def _mean(self, kind: str) -> _Means:
        return self._means.setdefault(kind, _Means())

    def _seconds(self, kind: str) -> float:
        """How long a task of this kind will take; a whole group's time while nothing is known of it."""
        mean = self._mean(kind)
        return mean.seconds if mean.seen else self._group_seconds

    def _fits(self, kind: str) -> bool:
        """Whether the open group comes nearer to its time with a job of this kind, and stays within its size."""
        group = self._open
        return (
            group.seconds + self._seconds(kind) / 2 <= self._group_seconds
            and group.expected + self._mean(kind).size <= LARGEST_TEXT
        )

    def _is_full(self, group: _Group) -> bool:
        return (
            len(group.jobs) >= self._largest_group
            or group.seconds >= self._group_seconds
            or group.sent >= LARGEST_TEXT
            or group.expected >= LARGEST_TEXT
        )

    def _add(self, group: _Group, task: Task, limits: Limits) -> None:
        for wanted in documents_of(task):
            if wanted not in group.documents:
                group.documents[wanted] = self._documents(wanted)
                group.sent += len(group.documents[wanted])
        group.jobs[task.key] = _Kept(task.kind, task.text, limits)
        group.seconds += self._seconds(task.kind)
        group.expected += self._mean(task.kind).size
        group.sent += len(task.text)

    def _send_open(self) -> None:
        if self._open.jobs:
            group, self._open = self._open, _Group()
            group.is_alone = len(group.jobs) == 1
            self._send(group)

    def _send_again(self) -> None:
        while self._again and len(self._groups) < self._window:
            self._send_alone(self._again.popleft())
        if self._suspects and not any(group.is_suspect for group in self._groups.values()):
            self._send_alone(self._suspects.popleft(), is_suspect=True)

    def _send_alone(self, job: _Kept, is_suspect: bool = False) -> None:
        group = _Group(is_alone=True, is_suspect=is_suspect)
        self._add(group, Task.from_text(job.text), job.limits)
        self._send(group)

    def _send(self, group: _Group) -> None:
        """Hand a group to the scheduler. Never raises: a scheduler that is gone is told by `wait`."""
        number = next(self._numbers)
        self._groups[number] = group
        text, group.documents = group.text, {}
        try:
            # distributed warns of arguments beyond 10 MB: a single document may be as large.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                future = self._client.submit(
                    subprocess.run,
                    self._command,
                    input=text,
                    capture_output=True,
                    timeout=group.timeout,
                    pure=False,
                    key=f"kahanmaps-{uuid.uuid4().hex}",
                )
            future.add_done_callback(partial(self._ended, number))
        except Exception as error:  # the client has closed itself after losing the scheduler
            self._lost = self._lost or _loss(error)

    # In dask's threads: nothing here but the queue is shared with the caller's

    def _ended(self, number: int, future: Any) -> None:
        """Have the result of a group fetched. Callbacks share one thread, which no result may hold up."""
        fetching = self._fetched(number, future)
        try:
            running = asyncio.run_coroutine_threadsafe(fetching, self._loop)
        except RuntimeError:  # the loop has been closed
            fetching.close()
            return
        self._fetching.add(running)
        running.add_done_callback(self._fetching.discard)

    async def _fetched(self, number: int, future: Any) -> None:
        """Put the result of a group into the queue. A result that was lost with its worker is computed anew first."""
        try:
            if not future.cancelled():
                await self._room.acquire()  # given back when the result has been read
            result = _Result(number, process=await future)
        except Exception as error:
            if future.status != "error":  # then it is no error of the command's, but of the way to it
                self._results.put(_loss(error))
                return
            result = _Result(number, error=error)
        finally:
            with contextlib.suppress(Exception):
                future.release()
        self._results.put(result)

    async def _count_threads(self) -> None:
        """Keep count of the workers' threads, and notice a scheduler that went away while nothing was in flight."""
        try:
            # A client that has lost its scheduler would wait for another one before the question fails.
            while self._client.status == "running":
                self._threads = sum((await self._client.nthreads()).values())
                self._counted.set()
                await asyncio.sleep(COUNT_EVERY if self._threads else COUNT_EVERY / 4)
            self._results.put("the connection was closed")
        except Exception as error:
            self._results.put(_loss(error))

    # Results

    def _drained(self, timeout: float) -> list[_Result]:
        """All results that are there; one is waited for. What comes after the loss of the scheduler is dropped."""
        found: list[_Result] = []
        try:
            while self._lost is None:
                result = self._results.get_nowait() if found else self._results.get(timeout=timeout)
                if isinstance(result, str):
                    self._lost = result
                else:
                    self._loop.call_soon_threadsafe(self._room.release)
                    found.append(result)
        except queue.Empty:
            pass
        return found

    def _taken(self, result: _Result) -> list[Record]:
        """The records that a group has printed. Jobs without one are put up for another try, or held."""
        group = self._groups.pop(result.number)
        timeout = group.timeout
        printed = result.process if result.process is not None else result.error
        records = []
        for line in (getattr(printed, "stdout", None) or b"").split(b"\n"):
            record = _record(line)
            job = None if record is None else group.jobs.pop(record.key, None)
            if record is not None and job is not None:  # so a record that is printed twice is handed back once
                self._mean(job.kind).learn(record.seconds, len(line))
                self._keys.discard(record.key)
                records.append(record)
        if records:
            self._is_proven = True
        if group.jobs:
            self._sort_out(group, _failure(result, timeout))
        return records

    def _sort_out(self, group: _Group, failure: _Failure) -> None:
        """Put up the jobs without a record for another try, alone, or hold them.

        dask blames the death of a worker on all that the worker had in its queue. So what has lost its workers is tried
        once more, one such job at a time: then no other suspect is in the same queue.
        """
        if failure.is_the_workers and not group.is_suspect:
            self._suspects.extend(group.jobs.values())
        elif not group.is_alone:
            self._again.extend(group.jobs.values())
        else:
            self._held += [(key, failure) for key in group.jobs]

    def _judged(self) -> list[Record]:
        """Records of the jobs that failed alone, as soon as it is clear that it was their fault.

        Before the first record there has been no sign that the workers can run anything: a missing installation
        must not be recorded as thousands of crashed tasks, nor a single task that kills its group as a missing
        installation.
        """
        if not self._held:
            return []
        if not self._is_proven:
            is_all = len(self._held) == len(self._keys)  # nothing else is in flight that might tell
            unfit = [failure for _, failure in self._held if failure.is_unfit]
            if len(unfit) >= UNFIT_AFTER or (unfit and is_all):
                raise WorkersUnfit(self._unfit(unfit[-1]))
            if self._given_up + len(self._held) >= HOPELESS_AFTER:
                raise WorkersUnfit(self._unfit(self._held[-1][1]))
            if not is_all:
                return []
        held, self._held = self._held, []
        self._given_up += len(held)
        self._keys.difference_update(key for key, _ in held)
        return [_failed(key, failure) for key, failure in held]

    def _unfit(self, failure: _Failure) -> str:
        command = " ".join(self._command)
        sentence = f"the workers cannot run {command!r}: {failure.message}, and none has ever printed a record"
        return f"{sentence}\n{failure.stderr.strip()}" if failure.stderr.strip() else sentence

    def _say_if_nobody_works(self) -> None:
        now = time.monotonic()
        if self._threads or not self._keys:
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


def _distributed() -> Any:
    """The package distributed, which takes a second to import. Some versions of it say what types they have."""
    return importlib.import_module("distributed")


def _connected(address: str, timeout: float) -> Any:
    """A client of the scheduler, with distributed's log silenced; or InputError with a sentence."""
    try:
        client = _distributed().Client
    except ModuleNotFoundError as error:
        raise InputError(
            f"a cluster needs the package distributed, which is not there ({error}): pip install 'kahanmaps[cluster]'"
        ) from None
    chosen = _scheduler(address)
    _SILENCE.begin()
    try:
        # A warning of other versions of some package: our tasks are the standard library's, whose version may differ.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            make = partial(client, **chosen, timeout=timeout, set_as_default=False, name="kahanmaps")
            return _in_time(make, timeout + 1)
    except ImportError as error:  # what distributed raises when the scheduler says that versions cannot go together
        _SILENCE.end()
        raise InputError(f"the scheduler at {address} runs other versions than this client: {error}") from error
    except Exception as error:
        _SILENCE.end()
        raise InputError(
            f"no dask scheduler answers at {address} within {timeout:g} s ({_told(error)}): "
            "is the address right, and does `dask scheduler` run there?"
        ) from error
    except BaseException:
        _SILENCE.end()
        raise


def _in_time(make: Callable[[], Any], seconds: float) -> Any:
    """What `make` returns. distributed itself waits for ever where something listens that is no scheduler."""
    made: Future[Any] = Future()

    def run() -> None:
        try:
            made.set_result(make())
        except BaseException as error:
            made.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return made.result(seconds)


def _scheduler(address: str) -> dict[str, str]:
    """How a client is told where the scheduler is. A file is looked at first: distributed waits for it for ever."""
    path = Path(address)
    if "://" not in address and (path.is_file() or address.endswith(".json")):
        try:
            return {"address": str(json.loads(path.read_text(encoding="utf-8"))["address"])}
        except OSError as error:
            raise InputError(f"cannot read the scheduler file {address}: {error.strerror}") from None
        except (ValueError, LookupError, TypeError):
            raise InputError(f"{address} is not the file that `dask scheduler --scheduler-file` writes") from None
    if not _ADDRESS.fullmatch(address):
        raise InputError(
            f"{address!r} is not the address of a scheduler: write tcp://host:port, or the path of a scheduler file"
        )
    return {"address": address}


def _record(line: bytes) -> Record | None:
    """The record on a line; None if it is something else, such as the half of one."""
    if not line.startswith(b"{"):
        return None
    try:
        return Record.from_json(json.loads(line))
    except (ValueError, TypeError, LookupError):
        return None


def _failure(result: _Result, timeout: float | None) -> _Failure:
    """Why a group ended without all its records."""
    process, error = result.process, result.error
    stderr = (getattr(process or error, "stderr", None) or b"").decode(errors="replace")[-TAIL:]
    if process is not None:
        message = f"the worker's command ended with status {process.returncode}"
        if process.returncode == 0:
            message += " and no record"
        return _Failure(message, stderr, is_unfit=process.returncode >= 0)
    if isinstance(error, subprocess.TimeoutExpired):
        message = f"the worker's command did not end within {timeout or 0:g} s"
        return _Failure(message, stderr, outcome=Outcome.TIMEOUT)
    if isinstance(error, _distributed().KilledWorker):
        message = f"{error.allowed_failures + 1} workers died one after the other while they ran it"
        return _Failure(message, stderr, is_the_workers=True)
    return _Failure(f"the worker could not run its command: {_told(error)}", stderr, is_unfit=True)


def _failed(key: str, failure: _Failure) -> Record:
    return Record(
        key,
        failure.outcome,
        message=failure.message,
        stderr=failure.stderr,
        finished=datetime.now(UTC).isoformat(timespec="seconds"),
    )


def _told(error: BaseException | None) -> str:
    """An exception on one line."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def _loss(error: BaseException) -> str:
    """Why the scheduler is lost, as briefly as can be: distributed puts a reason into every cancelled future."""
    found = re.search(r"reason: ([\w-]+)", str(error))
    reason = found.group(1) if found else _told(error)
    return "the connection was closed" if reason == "scheduler-connection-lost" else reason


class _Silence:
    """Keeps the loggers of distributed from printing, while at least one executor is open."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._before: list[tuple[logging.Logger, list[logging.Handler], bool]] = []

    def begin(self) -> None:
        with self._lock:
            self._users += 1
            if self._users == 1:
                for logger in _loggers():
                    self._before.append((logger, logger.handlers, logger.propagate))
                    logger.handlers, logger.propagate = [logging.NullHandler()], False

    def end(self) -> None:
        with self._lock:
            self._users -= 1
            if self._users == 0:
                for logger, handlers, propagate in self._before:
                    logger.handlers, logger.propagate = handlers, propagate
                self._before.clear()


def _loggers() -> Iterable[logging.Logger]:
    """The loggers of distributed. Those it makes later hand on to the first ones, which are silent by then."""
    names = [name for name in logging.Logger.manager.loggerDict if name.split(".")[0] in _LOGGERS]
    return [logging.getLogger(name) for name in sorted({*_LOGGERS, *names})]


_SILENCE = _Silence()
