"""Run tasks within their limits in worker processes on this machine (by pebble); no worker outlives this process.

Tasks need processes of their own, since FLINT may abort the process, ignores Ctrl-C and allocates memory without bound.
A worker runs tasks for some seconds and is then replaced. If a task fails unexpectedly, or kills its worker, after this
worker has run other tasks, the task is run again in a fresh worker, and the second outcome is recorded: so records do
not depend on the order of tasks. A task whose worker is killed from outside is tried a few times before it is lost.
"""

from __future__ import annotations

import json
import os
import platform
import resource
import signal
import sys
import time
import traceback
from collections.abc import Mapping
from concurrent.futures import FIRST_COMPLETED, Future
from concurrent.futures import wait as wait_for
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from fcntl import F_SETFL, fcntl
from functools import cache
from importlib.metadata import version
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from signal import SIGKILL, Signals
from stat import S_IRUSR, S_IWUSR
from tempfile import TemporaryFile
from threading import Lock, Thread
from types import ModuleType
from typing import Any

from kahanmaps.errors import InputError, KahanmapsError, is_out_of_memory
from kahanmaps.experiments.options import OTHER
from kahanmaps.experiments.registry import task_kind, task_kinds
from kahanmaps.experiments.results.records import Documents, Job, Outcome, Record, Task, canonical
from kahanmaps.experiments.results.system_spec import system_from
from kahanmaps.processes import end_with_parent
from kahanmaps.version import __version__

# A task is lost after so many attempts in which its worker was killed from outside. A lost task has no result, so that
# the next run of the batch runs it again.
TRIES = 5
GROUP_SECONDS = 5.0  # seconds after which a worker process is replaced: its start takes about 0.2 s
TAIL_LENGTH = 2000  # maximal number of characters stored of a message, a traceback, or the output of a worker

# Error messages by which Python, FLINT, GMP and OpenBLAS report lack of memory.
_MEMORY_PHRASES = (
    *("allocate memory", "out of memory", "memoryerror", "cannot reallocate", "bad_alloc", "not enough memory"),
    *("memory allocation", "memory alloc failed", "malloc failed", "too many memory regions"),
)
# These signals come from a fault in the process or from its own limits: the task, or a library that it called, has
# crashed. All others come from outside, e.g. when a job is cancelled or the machine shuts down. The system also sends
# SIGKILL if memory is exhausted; this case cannot be distinguished.
_CRASH_SIGNALS = {
    *(Signals.SIGSEGV, Signals.SIGABRT, Signals.SIGFPE, Signals.SIGBUS, Signals.SIGILL),
    *(Signals.SIGSYS, Signals.SIGTRAP, Signals.SIGXCPU, Signals.SIGXFSZ),
}


class WorkersError(KahanmapsError):
    """Raised if worker processes cannot be started."""


# Code of the parent process


@dataclass
class _Attempt:
    """A job in flight (submitted, but its record is not yet returned), and what happened in its attempts."""

    job: Job
    documents: dict[str, str]
    tries: int = 0  # number of attempts in which the worker was killed from outside
    had_fault: bool = False  # whether an attempt failed for a reason that may lie in earlier tasks of its worker
    begun: float = 0.0  # time at which the current attempt began


class LocalWorkers:
    """An executor that runs jobs on this machine, in at most `jobs` worker processes at a time.

    `documents` maps the digest of a system document to its text. A job is lost after `tries` attempts in which its
    worker was killed from outside. `submit` and `wait` raise WorkersError if no worker process can be started.
    """

    def __init__(
        self, jobs: int, documents: Documents, *, group_seconds: float = GROUP_SECONDS, tries: int = TRIES
    ) -> None:
        self.jobs = jobs
        self._documents = documents
        self._group_seconds = group_seconds
        self._tries = tries
        self._workers: list[_Worker] = []
        self._idle: list[_Worker] = []
        self._running: dict[Future[str], tuple[_Worker, _Attempt]] = {}
        self._ending: list[Thread] = []

    @property
    def is_free(self) -> bool:
        """Whether one more job may be submitted now."""
        return self.in_flight < self.jobs

    @property
    def in_flight(self) -> int:
        """The number of submitted jobs whose records have not been returned yet."""
        return len(self._running)

    def submit(self, job: Job) -> None:
        """Give a job to an idle worker, or start a new one."""
        self._begin(_Attempt(job, {key: self._documents(key) for key in job.task.documents}))

    def wait(self, timeout: float) -> list[Record]:
        """Return the records of finished jobs, after at most `timeout` seconds; the list may be empty."""
        wait_for(self._running, timeout, FIRST_COMPLETED)
        # If a pool breaks while it accepts a task, pebble never sets the result of the future of this task.
        ended = [future for future, (worker, _) in self._running.items() if future.done() or not worker.pool.active]
        records = []
        for future in ended:
            worker, attempt = self._running.pop(future)
            record = self._record(worker, attempt, future)
            if record is None:
                self._begin(attempt)
            else:
                records.append(record)
        return records

    def close(self) -> None:
        """Kill every worker at once."""
        for worker in list(self._workers):
            self._end(worker)
        self._idle.clear()
        self._running.clear()
        for thread in self._ending:
            thread.join()

    def _begin(self, attempt: _Attempt) -> None:
        # The attempt after a failed one is made in a fresh worker, which has not run any task.
        is_retry = attempt.tries > 0 or attempt.had_fault
        if is_retry or not self._idle:
            worker = _Worker()
            self._workers.append(worker)  # before the process starts, so that `close` kills every worker
        else:
            worker = self._idle.pop()
        attempt.begun = time.monotonic()
        try:
            future = worker.start_task(attempt)
        except (OSError, RuntimeError) as error:  # pebble's BrokenProcessPool is a RuntimeError
            self._end(worker)
            if worker.process is None:
                raise WorkersError(f"a worker process cannot be started: {error.__cause__ or error}") from error
            return self._begin(attempt)  # the idle worker had died before it got the task
        self._running[future] = worker, attempt

    def _record(self, worker: _Worker, attempt: _Attempt, future: Future[str]) -> Record | None:
        """Return the record of a job whose attempt has ended; None if the job is to be run again in a fresh worker."""
        from pebble import ProcessExpired

        was_fresh, worker.is_fresh = worker.is_fresh, False
        data: dict[str, Any] = {"key": attempt.job.task.key, "seconds": time.monotonic() - attempt.begun}
        error = future.exception() if future.done() else RuntimeError("the pool is broken")
        if error is None:
            try:
                data |= json.loads(future.result())
            except (ValueError, RecursionError) as parse_error:  # such as an integer of too many digits for Python
                data |= {"outcome": Outcome.FAILED, "message": f"the result cannot be kept: {parse_error}"}
            worker.seconds += data["seconds"]
            # Earlier tasks of this worker may be the cause of an unexpected error, which comes with a traceback.
            is_doubtful = data["outcome"] == Outcome.FAILED and "stderr" in data
            is_exhausted = data["outcome"] == Outcome.OUT_OF_MEMORY  # earlier tasks may have taken the memory
            is_retry = attempt.tries > 0 or attempt.had_fault
            if is_doubtful or is_exhausted or is_retry or worker.seconds >= self._group_seconds:
                self._end(worker)
            else:
                self._idle.append(worker)
            if (is_doubtful or is_exhausted) and not was_fresh:
                attempt.had_fault = True
                return None
            return _record_of(data)
        # Pebble reports a broken pool too if the worker ended with status 0, or before it accepted the task.
        status = error.exitcode if isinstance(error, ProcessExpired) else worker.exitcode
        data["stderr"] = output = worker.printed()
        is_ready = worker.is_ready
        self._end(worker)
        if isinstance(error, TimeoutError):
            message = f"not done within {attempt.job.limits.time:g} seconds"
            return _record_of({**data, "outcome": Outcome.TIMEOUT, "message": message})
        ending_text = f"the child {ending(status)}"
        if not is_ready and not is_from_outside(status):
            shown_output = output or "no output"
            raise WorkersError(f"a worker process cannot start (it {ending(status)}): {shown_output}")
        if is_from_outside(status):
            attempt.tries += 1
            if attempt.tries < self._tries:
                return None
            return _record_of({**data, "outcome": Outcome.LOST, "message": ending_text})
        lacks_memory = any(phrase in output.lower() for phrase in _MEMORY_PHRASES)
        # A signal that indicates a fault may also come from outside, but hardly in two attempts.
        if not was_fresh or not (lacks_memory or attempt.had_fault or (status is not None and status > 0)):
            attempt.had_fault = True
            return None
        if lacks_memory:
            return _record_of({**data, "outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"})
        return _record_of({**data, "outcome": Outcome.CRASHED, "message": ending_text})

    def _end(self, worker: _Worker) -> None:
        """Kill a worker; a thread waits for the end of its pool, which takes some tenths of a second."""
        self._workers.remove(worker)
        worker.kill()
        self._ending = [thread for thread in self._ending if thread.is_alive()]
        self._ending.append(Thread(target=worker.end, daemon=True))
        self._ending[-1].start()


class _Worker:
    """A worker: a process in a pebble pool of its own, which runs tasks one after another.

    All workers of a pebble pool share one pipe with one lock. A worker that is killed while it holds the lock, or while
    it sends a result, would block all others. Hence each worker has a pool of its own, which is discarded when the
    worker dies.
    """

    def __init__(self) -> None:
        from pebble import ProcessPool  # imported here, since `kahanmaps --help` does not need it

        self.seconds = 0.0
        self.is_fresh = True  # whether the worker has not run a task yet
        self._documents: set[str] = set()
        with TemporaryFile() as file:
            # The file for the output of the worker, as a Connection: multiprocessing passes no other unnamed file.
            self._output = Connection(os.dup(file.fileno()))
        fcntl(self._output.fileno(), F_SETFL, os.O_APPEND)
        self._context = _Context()
        arguments = (os.getpid(), self._output)
        self.pool: Any = ProcessPool(1, initializer=_begin, initargs=arguments, context=self._context)

    def start_task(self, attempt: _Attempt) -> Future[str]:
        """Start a task and return the future of its record, which is JSON text."""
        os.ftruncate(self._output.fileno(), 0)
        new_documents = {key: text for key, text in attempt.documents.items() if key not in self._documents}
        self._documents.update(new_documents)
        job = attempt.job
        arguments = (job.task.text, job.limits.memory, new_documents)
        future: Future[str] = self.pool.schedule(_run_task, args=arguments, timeout=job.limits.time)
        return future

    @property
    def process(self) -> SpawnProcess | None:
        """The process of the worker; None before its start."""
        return self._context.process

    @property
    def exitcode(self) -> int | None:
        """The exit status of the process as in `subprocess`; None while it runs."""
        return None if self.process is None else self.process.exitcode

    @property
    def is_ready(self) -> bool:
        """Whether the process has been prepared and accepts tasks."""
        return not os.fstat(self._output.fileno()).st_mode & S_IWUSR

    def printed(self) -> str:
        """Return the end of what the process has printed since its current task began."""
        begin = max(0, os.fstat(self._output.fileno()).st_size - TAIL_LENGTH)
        return os.pread(self._output.fileno(), TAIL_LENGTH, begin).decode("utf-8", "replace").strip()

    def kill(self) -> None:
        """Kill the process and all processes that its tasks started."""
        self.pool.stop()
        if self.process is not None and self.process.pid is not None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, SIGKILL)
            self.process.kill()

    def end(self) -> None:
        """Kill the process, and remove its zombie, its threads and its open files."""
        self.kill()
        with suppress(Exception):  # for a dead worker pebble may raise any exception
            self.pool.join()
        self._output.close()


class _Context(SpawnContext):
    """The context in which pebble starts the only process of a pool; it refuses to start another one."""

    process: SpawnProcess | None = None

    # Methods that pebble calls.

    def Process(self, *args: Any, **keywords: Any) -> SpawnProcess:  # type: ignore[override]
        if self.process is not None:
            raise OSError("the worker has ended")  # this error breaks the pool, as is intended
        self.process = _Process(*args, **keywords)
        return self.process

    def RLock(self) -> Any:
        return _NoLock()


class _NoLock:
    """A lock without effect, for a pipe that one process uses; a semaphore would remain after a kill of the parent."""

    def acquire(self, block: bool = True, timeout: float | None = None) -> bool:
        return True

    def release(self) -> None:
        pass


class _Process(SpawnProcess):
    """A process that does not import the main module, has a fixed hash seed, and starts with SIGINT blocked."""

    _starting = Lock()

    def start(self) -> None:
        with _Process._starting:
            # Otherwise multiprocessing runs the main module: scripts that call `run` need `if __name__ == "__main__"`.
            main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
            # With a fixed hash seed no result depends on the order of the elements of a set.
            seed, os.environ["PYTHONHASHSEED"] = os.environ.get("PYTHONHASHSEED"), "0"
            # A KeyboardInterrupt during the start of Python would be a fatal error with status 1, or a RuntimeError.
            mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                super().start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, mask)
                sys.modules["__main__"] = main
                del os.environ["PYTHONHASHSEED"]
                if seed is not None:
                    os.environ["PYTHONHASHSEED"] = seed


def _record_of(data: dict[str, Any]) -> Record:
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    environment = {"host": platform.node(), "versions": _versions(), "finished": finished}
    return Record.from_json({**environment, **data})


def is_from_outside(status: int | None) -> bool:
    """Whether an exit status, as in `subprocess`, means that the process was killed from outside."""
    return status is not None and status < 0 and -status not in _CRASH_SIGNALS


def ending(status: int | None) -> str:
    """Return a description of how a process with this exit status, as in `subprocess`, ended.

    >>> ending(-15), ending(-11), ending(7)
    ('was killed by signal 15 (SIGTERM), from outside', 'was killed by signal 11 (SIGSEGV)', 'ended with status 7')
    """
    if status is None:
        return "closed the pipe for its answers"
    if status >= 0:
        return f"ended with status {status}"
    description = f"was killed by signal {-status}"
    with suppress(ValueError):
        description += f" ({Signals(-status).name})"
    if not is_from_outside(status):
        return description
    return f"{description}, from outside" + (" or for want of memory" if -status == SIGKILL else "")


# Code of the worker process


@dataclass
class _WorkerState:
    """The state of a worker process."""

    pid: int = 0
    idle: int | None = None  # bytes of address space before the first task
    documents: dict[str, str] = field(default_factory=dict)


_state = _WorkerState()


def _begin(parent: int, output: Connection) -> None:
    """Prepare a worker process; pebble calls this function once, before the first task."""
    end_with_parent(parent)
    os.setpgid(0, 0)  # a kill of this group ends processes that tasks started; Ctrl-C reaches the parent only
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # pebble's handler would wait until the current call of FLINT returns
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # undo that pebble ignores SIGINT
    # Output of tasks goes to a file, since records have a pipe of their own; the standard input of tasks is empty.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(output.fileno(), 1)
    os.dup2(output.fileno(), 2)
    task_kinds()  # load the tasks now, so that no task is charged with the time of the import
    _state.pid, _state.idle = os.getpid(), _address_space()
    os.fchmod(output.fileno(), S_IRUSR)  # the mode of the file tells the parent that the worker is ready


def _run_task(text: str, memory: int | None, documents: dict[str, str]) -> str:
    """Run the task with this canonical text; return its record as JSON, since unpickling a result might run code."""
    _state.documents.update(documents)
    data = perform(Task.from_text(text), memory, _state.documents, _state.idle)
    if os.getpid() != _state.pid:
        os._exit(0)  # this process is a copy that the task forked
    try:
        return canonical(data)
    except (ValueError, TypeError, RecursionError) as error:  # JSON cannot represent nan, a Fraction or an array
        message = f"the result cannot be kept: {error}"[:TAIL_LENGTH]
        return canonical({"key": data["key"], "outcome": Outcome.FAILED, "message": message})


def perform(task: Task, memory: int | None, documents: Mapping[str, str], idle: int | None = None) -> dict[str, Any]:
    """Run a task and return the data of its `Record`.

    `idle` is the address space of a fresh worker in bytes. A task is charged with memory that earlier tasks did not
    release; otherwise it would have more memory than in a fresh worker.
    """
    with suppress(OSError), open("/proc/self/clear_refs", "w") as file:
        file.write("5")  # from now on, VmHWM is the peak memory of this task
    _limit_memory(memory, idle)
    begin = time.perf_counter()
    data: dict[str, Any] = {"key": task.key, "outcome": Outcome.OK}
    try:
        kind, options = task_kind(task.kind), dict(task.options)
        if options.get(OTHER) is not None:
            options[OTHER] = system_from(options[OTHER], documents.__getitem__)
        system = None if task.system is None else system_from(task.system, documents.__getitem__)
        result = kind.perform(system, options)
        if not isinstance(result, dict):
            raise InputError(f"found a result of type {type(result).__name__}, expected a dict")
        verdict = result.pop("verdict", None)
        if not isinstance(verdict, str | None):
            raise InputError(f"found the verdict {str(verdict)[:100]}, expected a text")
        data |= {"verdict": verdict, "result": result}
    except BaseException as error:  # any error of a task becomes its record, even SystemExit
        data |= failure(error)
    _limit_memory(None, idle)
    seconds = time.perf_counter() - begin
    # Peak resident memory in bytes since the task began; without /proc, since the process began.
    peak_memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    with suppress(OSError), open("/proc/self/status") as file:
        peak_memory = next((int(line.split()[1]) * 1024 for line in file if line.startswith("VmHWM:")), peak_memory)
    return {**data, "seconds": seconds, "peak_memory": peak_memory}


def failure(error: BaseException) -> dict[str, Any]:
    """Return the data of a record for an error; those of an unexpected error include its traceback."""
    cause: BaseException | None = error
    while cause is not None and not is_out_of_memory(cause):
        cause = cause.__cause__ or cause.__context__
    if cause is not None:  # an error caused by lack of memory, such as MemoryError
        return {"outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"}
    if isinstance(error, InputError):
        return {"outcome": Outcome.FAILED, "message": str(error)[:TAIL_LENGTH]}
    data = {"outcome": Outcome.FAILED, "message": f"{type(error).__name__}: {error}"[:TAIL_LENGTH]}
    return data if isinstance(error, KahanmapsError) else {**data, "stderr": traceback.format_exc()[-TAIL_LENGTH:]}


@cache
def _versions() -> dict[str, str]:
    import flint

    return {
        "kahanmaps": __version__,
        "python": platform.python_version(),
        "python-flint": version("python-flint"),
        "flint": str(getattr(flint, "__FLINT_VERSION__", "unknown")),
    }


def _limit_memory(memory: int | None, idle: int | None) -> None:
    """Limit the address space to `memory` bytes above `idle` (default: its current size); None removes the limit."""
    with suppress(OSError, ValueError):  # the system refuses a limit below the current size
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        soft = hard
        if memory is not None and (base := idle or _address_space()) is not None:
            soft = base + memory
            soft = soft if hard == resource.RLIM_INFINITY else min(soft, hard)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _address_space() -> int | None:
    with suppress(OSError), open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    return None
