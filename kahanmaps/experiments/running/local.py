"""Tasks in worker processes on this machine (pebble): each within its limits, and no worker outlives this process.

FLINT may abort its process, does not see Ctrl-C and takes whatever memory it can: hence the processes. A worker is
given one task after the other until it has worked for some seconds; then another one takes its place. A task that fails
in a worker that had done others before, or whose worker dies, is tried again in a fresh one, and only that decides:
what is recorded does not depend on the order of tasks. What is killed from outside decides nothing: it is tried a few
times, and then it is lost.
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

# How often in all a task is tried while its worker is killed from outside, before it is given up as lost: a lost task
# has no result, and the next run tries it as often again.
TRIES = 5
GROUP_SECONDS = 5.0  # of work for one worker: starting it costs about a fifth of a second
TAIL = 2000  # characters that are kept of a message, a traceback, or what a worker printed

# Words with which Python, FLINT, GMP and OpenBLAS end where there is no memory.
_NO_MEMORY = (
    *("allocate memory", "out of memory", "memoryerror", "cannot reallocate", "bad_alloc", "not enough memory"),
    *("memory allocation", "memory alloc failed", "malloc failed", "too many memory regions"),
)
# The signals that the processor, or a limit of its own, raises in a process: the task, or a library that it called, has
# died. Any other one was sent from outside: by a cancelled job, a service that stops, a shutdown. SIGKILL may also come
# from the system for want of memory, of which the dead say nothing.
_OWN = {
    *(Signals.SIGSEGV, Signals.SIGABRT, Signals.SIGFPE, Signals.SIGBUS, Signals.SIGILL),
    *(Signals.SIGSYS, Signals.SIGTRAP, Signals.SIGXCPU, Signals.SIGXFSZ),
}


class WorkersError(KahanmapsError):
    """Worker processes cannot be started here."""


# In this process


@dataclass
class _Attempt:
    """A job on its way to a record."""

    job: Job
    documents: dict[str, str]
    tries: int = 0  # that were ended from outside
    had_fault: bool = False
    begun: float = 0.0


class LocalWorkers:
    """An executor that runs at most `jobs` worker processes on this machine.

    `documents` gives the text of a system document by its digest. A job whose workers are killed from outside is lost
    after so many `tries`. `submit` and `wait` raise WorkersError where no worker can be started.
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
        """Whether some worker has nothing to do."""
        return self.in_flight < self.jobs

    @property
    def in_flight(self) -> int:
        """The number of jobs not yet handed back."""
        return len(self._running)

    def submit(self, job: Job) -> None:
        """Give a job to an idle worker, or to a new one."""
        self._begin(_Attempt(job, {key: self._documents(key) for key in job.task.documents}))

    def wait(self, timeout: float) -> list[Record]:
        """The records that came in, after at most `timeout` seconds."""
        wait_for(self._running, timeout, FIRST_COMPLETED)
        # A pool that breaks in the very moment in which it takes a task never says so in the future.
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
        # What is tried again gets a fresh worker: one that has done nothing yet.
        is_retry = attempt.tries > 0 or attempt.had_fault
        if is_retry or not self._idle:
            worker = _Worker()
            self._workers.append(worker)  # before it is started: a second Ctrl-C may come now
        else:
            worker = self._idle.pop()
        attempt.begun = time.monotonic()
        try:
            future = worker.ask(attempt)
        except (OSError, RuntimeError) as error:  # pebble's BrokenProcessPool is a RuntimeError
            self._end(worker)
            if worker.process is None:
                raise WorkersError(f"a worker process cannot be started: {error.__cause__ or error}") from error
            return self._begin(attempt)  # it died while it had nothing to do
        self._running[future] = worker, attempt

    def _record(self, worker: _Worker, attempt: _Attempt, future: Future[str]) -> Record | None:
        """What became of a job; None where that is not decided, and it has to be tried again in a fresh worker."""
        from pebble import ProcessExpired

        was_fresh, worker.is_fresh = worker.is_fresh, False
        found: dict[str, Any] = {"key": attempt.job.task.key, "seconds": time.monotonic() - attempt.begun}
        error = future.exception() if future.done() else RuntimeError("the pool is broken")
        if error is None:
            try:
                found |= json.loads(future.result())
            except (ValueError, RecursionError) as wrong:  # an integer of more digits than are read here
                found |= {"outcome": Outcome.FAILED, "message": f"the result cannot be kept: {wrong}"}
            worker.seconds += found["seconds"]
            # A traceback: nobody expected this, so it may be the fault of what was done before.
            is_doubtful = found["outcome"] == Outcome.FAILED and "stderr" in found
            is_exhausted = found["outcome"] == Outcome.OUT_OF_MEMORY  # what is left of the memory nobody knows
            is_retry = attempt.tries > 0 or attempt.had_fault
            if is_doubtful or is_exhausted or is_retry or worker.seconds >= self._group_seconds:
                self._end(worker)
            else:
                self._idle.append(worker)
            if (is_doubtful or is_exhausted) and not was_fresh:
                attempt.had_fault = True
                return None
            return _record_of(found)
        # Pebble takes a worker that ended with status 0, or before it took the task, for a broken pool.
        status = error.exitcode if isinstance(error, ProcessExpired) else worker.exitcode
        found["stderr"] = printed = worker.printed()
        is_ready = worker.is_ready
        self._end(worker)
        if isinstance(error, TimeoutError):
            message = f"not done within {attempt.job.limits.time:g} seconds"
            return _record_of({**found, "outcome": Outcome.TIMEOUT, "message": message})
        ended = f"the child {ending(status)}"
        if not is_ready and not is_from_outside(status):
            output = printed or "no output"
            raise WorkersError(f"a worker process cannot start (it {ending(status)}): {output}")
        if is_from_outside(status):
            attempt.tries += 1
            if attempt.tries < self._tries:
                return None
            return _record_of({**found, "outcome": Outcome.LOST, "message": ended})
        wants_memory = any(words in printed.lower() for words in _NO_MEMORY)
        # The signal of a fault may have been sent as well, but hardly twice.
        if not was_fresh or not (wants_memory or attempt.had_fault or (status is not None and status > 0)):
            attempt.had_fault = True
            return None
        if wants_memory:
            return _record_of({**found, "outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"})
        return _record_of({**found, "outcome": Outcome.CRASHED, "message": ended})

    def _end(self, worker: _Worker) -> None:
        """Kill a worker. Its pool takes some tenths of a second to notice, which nobody waits for here."""
        self._workers.remove(worker)
        worker.kill()
        self._ending = [thread for thread in self._ending if thread.is_alive()]
        self._ending.append(Thread(target=worker.end, daemon=True))
        self._ending[-1].start()


class _Worker:
    """One process, in a pool of its own, that is asked one thing after the other.

    Pebble's workers share one pipe with one lock. A worker that is killed while it holds the lock, or in the middle of
    an answer, would hold up all others. So nobody shares, and a pool whose worker has died is thrown away.
    """

    def __init__(self) -> None:
        from pebble import ProcessPool  # not needed for `kahanmaps --help`

        self.seconds = 0.0
        self.is_fresh = True  # it has done nothing yet
        self._documents: set[str] = set()
        with TemporaryFile() as file:
            # What it prints. A connection, since that is how multiprocessing hands over a file without a name.
            self._output = Connection(os.dup(file.fileno()))
        fcntl(self._output.fileno(), F_SETFL, os.O_APPEND)
        self._context = _Context()
        begin = (os.getpid(), self._output)
        self.pool: Any = ProcessPool(1, initializer=_begin, initargs=begin, context=self._context)

    def ask(self, attempt: _Attempt) -> Future[str]:
        """The answer to a task."""
        os.ftruncate(self._output.fileno(), 0)
        new = {key: text for key, text in attempt.documents.items() if key not in self._documents}
        self._documents.update(new)
        job = attempt.job
        asked = (job.task.text, job.limits.memory, new)
        answer: Future[str] = self.pool.schedule(_answer, args=asked, timeout=job.limits.time)
        return answer

    @property
    def process(self) -> SpawnProcess | None:
        """The process, once it is started."""
        return self._context.process

    @property
    def exitcode(self) -> int | None:
        """How it ended, as `subprocess` has it; None while it lives."""
        return None if self.process is None else self.process.exitcode

    @property
    def is_ready(self) -> bool:
        """Whether it has begun to wait for tasks."""
        return not os.fstat(self._output.fileno()).st_mode & S_IWUSR

    def printed(self) -> str:
        """The end of what it printed since its task began."""
        begin = max(0, os.fstat(self._output.fileno()).st_size - TAIL)
        return os.pread(self._output.fileno(), TAIL, begin).decode("utf-8", "replace").strip()

    def kill(self) -> None:
        """End it with all that its tasks have started."""
        self.pool.stop()
        if self.process is not None and self.process.pid is not None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, SIGKILL)
            self.process.kill()

    def end(self) -> None:
        """Kill it, and leave no zombie, no thread and no open file."""
        self.kill()
        with suppress(Exception):  # whatever pebble finds to say of a worker that is dead
            self.pool.join()
        self._output.close()


class _Context(SpawnContext):
    """How pebble starts the one process of a pool, and no second one in its place."""

    process: SpawnProcess | None = None

    # Pebble asks for these two by these names.

    def Process(self, *args: Any, **keywords: Any) -> SpawnProcess:  # type: ignore[override]
        if self.process is not None:
            raise OSError("the worker has ended")  # which breaks the pool, as is meant
        self.process = _Process(*args, **keywords)
        return self.process

    def RLock(self) -> Any:
        return _NoLock()


class _NoLock:
    """The lock of a pipe that a single worker uses. A semaphore would outlive a parent that is killed."""

    def acquire(self, block: bool = True, timeout: float | None = None) -> bool:
        return True

    def release(self) -> None:
        pass


class _Process(SpawnProcess):
    """A process that does not import the main module, has one order of sets, and starts with Ctrl-C held back."""

    _starting = Lock()

    def start(self) -> None:
        with _Process._starting:
            # Scripts that call `run` need no `if __name__ == "__main__"`: multiprocessing runs what is found here.
            main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
            # Sets of texts have an order that no result may depend on; with a fixed seed none can.
            seed, os.environ["PYTHONHASHSEED"] = os.environ.get("PYTHONHASHSEED"), "0"
            # Python's start has no place for KeyboardInterrupt: it is a fatal error with status 1, or RuntimeError.
            mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                super().start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, mask)
                sys.modules["__main__"] = main
                del os.environ["PYTHONHASHSEED"]
                if seed is not None:
                    os.environ["PYTHONHASHSEED"] = seed


def _record_of(found: dict[str, Any]) -> Record:
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    where = {"host": platform.node(), "versions": _versions(), "finished": finished}
    return Record.from_json({**where, **found})


def is_from_outside(status: int | None) -> bool:
    """Whether a process that ended with this status, as `subprocess` has it, was killed by no doing of its own."""
    return status is not None and status < 0 and -status not in _OWN


def ending(status: int | None) -> str:
    """How a process ended, in words.

    >>> ending(-15), ending(-11), ending(7)
    ('was killed by signal 15 (SIGTERM), from outside', 'was killed by signal 11 (SIGSEGV)', 'ended with status 7')
    """
    if status is None:
        return "closed the pipe for its answers"
    if status >= 0:
        return f"ended with status {status}"
    words = f"was killed by signal {-status}"
    with suppress(ValueError):
        words += f" ({Signals(-status).name})"
    if not is_from_outside(status):
        return words
    return f"{words}, from outside" + (" or for want of memory" if -status == SIGKILL else "")


# In the worker


@dataclass
class _Here:
    """What a worker knows of itself."""

    pid: int = 0
    idle: int | None = None  # bytes of address space before its first task
    documents: dict[str, str] = field(default_factory=dict)


_here = _Here()


def _begin(parent: int, output: Connection) -> None:
    """Prepare the worker: pebble calls this once, before the first task."""
    end_with_parent(parent)
    os.setpgid(0, 0)  # what tasks start ends with the group; and Ctrl-C in a terminal reaches the parent alone
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # pebble's own handler would wait for the end of a call of FLINT
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # which pebble ignores
    # The answers have their own pipe: whatever tasks print goes to the file, and what they read is empty.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(output.fileno(), 1)
    os.dup2(output.fileno(), 2)
    task_kinds()  # importing them is no part of any task
    _here.pid, _here.idle = os.getpid(), _address_space()
    os.fchmod(output.fileno(), S_IRUSR)  # this tells the parent that the worker is ready


def _answer(text: str, memory: int | None, documents: dict[str, str]) -> str:
    """Do the task with this canonical text; the record as text, since nobody knows what a result does when pickled."""
    _here.documents.update(documents)
    found = perform(Task.from_text(text), memory, _here.documents, _here.idle)
    if os.getpid() != _here.pid:
        os._exit(0)  # the task has forked, and this is the copy
    try:
        return canonical(found)
    except (ValueError, TypeError, RecursionError) as error:  # what JSON does not have: nan, a Fraction, an array
        message = f"the result cannot be kept: {error}"[:TAIL]
        return canonical({"key": found["key"], "outcome": Outcome.FAILED, "message": message})


def perform(task: Task, memory: int | None, documents: Mapping[str, str], idle: int | None = None) -> dict[str, Any]:
    """Do a task; what became of it, as plain data for a `Record`.

    `idle` is the address space of a worker that has done nothing yet: what earlier tasks left counts as memory of this
    one, which would otherwise have more of it here than in a new worker.
    """
    with suppress(OSError), open("/proc/self/clear_refs", "w") as file:
        file.write("5")  # from here on the peak is that of the task
    _limit_memory(memory, idle)
    begin = time.perf_counter()
    found: dict[str, Any] = {"key": task.key, "outcome": Outcome.OK}
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
        found |= {"verdict": verdict, "result": result}
    except BaseException as error:  # whatever a task does wrong is its own affair, even SystemExit
        found |= failure(error)
    _limit_memory(None, idle)
    return {**found, "seconds": time.perf_counter() - begin, "peak_memory": _peak_memory()}


def failure(error: BaseException) -> dict[str, Any]:
    """What an error means for the record; one that nobody raised on purpose has its traceback in it."""
    cause: BaseException | None = error
    while cause is not None and not is_out_of_memory(cause):
        cause = cause.__cause__ or cause.__context__
    if cause is not None:  # MemoryError or what says the same, a module not loaded say; or raised from it
        return {"outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"}
    if isinstance(error, InputError):
        return {"outcome": Outcome.FAILED, "message": str(error)[:TAIL]}
    found = {"outcome": Outcome.FAILED, "message": f"{type(error).__name__}: {error}"[:TAIL]}
    return found if isinstance(error, KahanmapsError) else {**found, "stderr": traceback.format_exc()[-TAIL:]}


@cache
def _versions() -> dict[str, str]:
    """The versions that a result may depend on."""
    import flint

    return {
        "kahanmaps": __version__,
        "python": platform.python_version(),
        "python-flint": version("python-flint"),
        "flint": str(getattr(flint, "__FLINT_VERSION__", "unknown")),
    }


def _limit_memory(memory: int | None, idle: int | None) -> None:
    """Bound the address space to `idle`, by default what it is now, and `memory` more; None: to what the user has."""
    with suppress(OSError, ValueError):  # not below what is used already
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        soft = hard
        if memory is not None and (used := idle or _address_space()) is not None:
            soft = used + memory
            soft = soft if hard == resource.RLIM_INFINITY else min(soft, hard)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _address_space() -> int | None:
    """How much of it this process has, in bytes, where that is known."""
    with suppress(OSError), open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    return None


def _peak_memory() -> int:
    """The largest resident size since the task began, in bytes."""
    with suppress(OSError), open("/proc/self/status") as file:
        for line in file:
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
