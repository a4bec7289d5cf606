"""Tasks in child processes on this machine: short ones in groups, each within its limits, and no child outlives us.

A child is given one task after the other until it has worked for some seconds; then another one takes its place. A
task that fails in a reused child, or whose child dies of a signal, is retried once in a fresh one, and only that
decides: so what is recorded does not depend on the order of tasks. What is killed from outside decides nothing: it is
tried a few times, and then it is lost.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from contextlib import suppress
from datetime import UTC, datetime
from signal import SIGKILL, Signals
from tempfile import TemporaryFile
from typing import Any

from kahanmaps.errors import KahanmapsError
from kahanmaps.experiments.results.records import Documents, Job, Outcome, Record

# How often in all a task is tried while what does it is killed from outside, before it is given up as lost: a lost
# task has no result, and the next run tries it as often again.
TRIES = 5
GROUP_SECONDS = 5.0  # of work for one child: starting it costs about a fifth of a second
_STDERR_KEPT = 2000
_STARTS = 20  # children that end before they are ready, one after the other: then there is no use in more
# Words with which Python, FLINT, GMP and OpenBLAS end where there is no memory.
_NO_MEMORY = (
    *("allocate memory", "out of memory", "memoryerror", "cannot reallocate", "bad_alloc", "not enough memory"),
    *("memory allocation", "memory alloc failed", "malloc failed", "too many memory regions"),
)

# A task's own are the signals that the processor or a limit of its own raises: its code, or a library that it called,
# has died. Any other one was sent from outside: by a cancelled job, a service that stops, a shutdown. SIGKILL may also
# come from the system for want of memory, of which the dead say nothing.
_OWN = {
    Signals.SIGSEGV,
    Signals.SIGABRT,
    Signals.SIGFPE,
    Signals.SIGBUS,
    Signals.SIGILL,
    Signals.SIGSYS,
    Signals.SIGTRAP,
    Signals.SIGXCPU,
    Signals.SIGXFSZ,
}


class ChildrenError(KahanmapsError):
    """Child processes cannot be started here."""


class LocalChildren:
    """An executor that runs at most `jobs` child processes on this machine, each looked after by a thread.

    `documents` gives the text of a system document by its digest. A job whose children are killed from outside is lost
    after so many `tries`. `wait` raises ChildrenError where no child can be started.
    """

    def __init__(
        self, jobs: int, documents: Documents, *, group_seconds: float = GROUP_SECONDS, tries: int = TRIES
    ) -> None:
        self.jobs = jobs
        self._documents = documents
        self._group_seconds = group_seconds
        self._tries = tries
        self._threads = ThreadPoolExecutor(jobs, initializer=_hold_ctrl_c)
        self._mine = threading.local()  # the child of a thread, if it has one that may go on
        self._children: list[_Child] = []
        self._running: set[Future[Record | None]] = set()
        self._is_closed = False

    @property
    def is_free(self) -> bool:
        """Whether some child has nothing to do."""
        return self.in_flight < self.jobs

    @property
    def in_flight(self) -> int:
        """The number of jobs not yet handed back."""
        return len(self._running)

    def submit(self, job: Job) -> None:
        """Give a job to an idle child, or to a new one."""
        # Here, not in the thread: documents come from a database that only one thread may use.
        documents = {key: self._documents(key) for key in job.task.documents}
        self._running.add(self._threads.submit(self._record, job, documents))

    def wait(self, timeout: float) -> list[Record]:
        """The records that came in, after at most `timeout` seconds."""
        done, self._running = wait_for(self._running, timeout, FIRST_COMPLETED)
        return [record for future in done if (record := future.result()) is not None]

    def close(self) -> None:
        """Kill every child at once."""
        self._is_closed = True
        for child in list(self._children):
            child.kill()
        self._threads.shutdown(cancel_futures=True)
        for child in list(self._children):
            self._end(child)
        self._running.clear()

    # In the threads

    def _record(self, job: Job, documents: dict[str, str]) -> Record | None:
        """What becomes of a job; None where everything is closed meanwhile."""
        tries, had_fault = 0, False
        child: _Child | None = getattr(self._mine, "child", None)
        while not self._is_closed:
            child = child or self._new_child()
            if self._is_closed:  # while it was starting
                break
            was_fresh, child.is_fresh = child.is_fresh, False
            begun = time.monotonic()
            answer = child.ask(job, documents)
            if answer is not None:
                outcome = answer["outcome"]
                child.seconds += answer.get("seconds", 0.0)
                is_worn = child.seconds >= self._group_seconds or outcome == Outcome.OUT_OF_MEMORY
                self._mine.child = None if is_worn or tries or had_fault else child
                if self._mine.child is None:
                    self._end(child)
                # A traceback: nobody expected this, so it may be the fault of what was done before.
                is_doubtful = outcome == Outcome.OUT_OF_MEMORY or (outcome == Outcome.FAILED and "stderr" in answer)
                if not is_doubtful or was_fresh:
                    return _record_of(child, answer)
            else:
                status, told = child.status(), child.told()
                found = {"key": job.task.key, "stderr": told, "seconds": time.monotonic() - begun}
                self._mine.child = None
                self._end(child)
                if child.is_late:
                    message = f"not done within {job.limits.time:g} seconds"
                    return _record_of(child, {**found, "outcome": Outcome.TIMEOUT, "message": message})
                ended = f"the child {ending(status)}"
                if is_from_outside(status):
                    tries += 1
                    if tries >= self._tries:
                        return _record_of(child, {**found, "outcome": Outcome.LOST, "message": ended})
                elif any(words in told.lower() for words in _NO_MEMORY):
                    if was_fresh:
                        return _record_of(
                            child, {**found, "outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"}
                        )
                # The signal of a fault may have been sent as well, but hardly twice.
                elif was_fresh and (had_fault or (status is not None and status > 0)):
                    return _record_of(child, {**found, "outcome": Outcome.CRASHED, "message": ended})
                else:
                    had_fault = True
            child = None
        return None

    def _new_child(self) -> _Child:
        for _ in range(_STARTS):
            child = _Child()
            self._children.append(child)
            line = child.line(None)
            if line is not None:
                child.ready = line["ready"]
                return child
            status, told = child.status(), child.told()
            self._end(child)
            if self._is_closed or not is_from_outside(status):
                break
        raise ChildrenError(f"a child process cannot start (it {ending(status)}): {told or 'it says nothing'}")

    def _end(self, child: _Child) -> None:
        with suppress(ValueError):
            self._children.remove(child)
        child.end()


class _Child:
    """One process, which is asked one thing after the other."""

    def __init__(self) -> None:
        self.ready: dict[str, Any] = {}  # what it says of itself
        self.seconds = 0.0
        self.is_fresh = True  # it has done nothing yet
        self.is_late = False
        self._documents: set[str] = set()
        self._stderr = TemporaryFile()  # noqa: SIM115 (closed by `end`)
        command = [sys.executable, "-m", "kahanmaps.experiments.running.child", str(os.getpid())]
        try:
            # Sets of texts have an order that no result may depend on; with a fixed seed none can. A group of its own,
            # so that Ctrl-C in a terminal reaches us alone.
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._stderr,
                env={**os.environ, "PYTHONHASHSEED": "0"},
                process_group=0,
            )
        except OSError as error:
            self._stderr.close()
            raise ChildrenError(f"a child process cannot be started: {error.strerror or error}") from error

    def ask(self, job: Job, documents: dict[str, str]) -> dict[str, Any] | None:
        """Its answer to a task; None if it has died, or was `is_late`."""
        os.ftruncate(self._stderr.fileno(), 0)
        os.lseek(self._stderr.fileno(), 0, os.SEEK_SET)  # both have one offset
        new = [{"document": key, "text": text} for key, text in documents.items() if key not in self._documents]
        self._documents.update(documents)
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):  # it has died, as the end of its answers tells
            for message in [*new, {"task": job.task.text, "memory": job.limits.memory}]:
                self.process.stdin.write(json.dumps(message).encode() + b"\n")
            self.process.stdin.flush()
        try:
            return self.line(job.limits.time)
        except (ValueError, RecursionError) as error:  # an integer of more digits than are read here
            message = f"the result cannot be kept: {error}"
            return {"key": job.task.key, "outcome": Outcome.FAILED, "message": message}

    def line(self, seconds: float | None) -> dict[str, Any] | None:
        """The next thing it says, if it does so in time; None at its end."""
        assert self.process.stdout is not None
        poll = select.poll()
        poll.register(self.process.stdout, select.POLLIN)
        self.is_late = not poll.poll(None if seconds is None else 1000 * seconds)
        line = b"" if self.is_late else self.process.stdout.readline()
        found: dict[str, Any] | None = json.loads(line) if line.endswith(b"\n") else None
        return found

    def status(self) -> int | None:
        """How it ended, after the end of its answers; None if it lives on without them."""
        try:
            return self.process.wait(0.0 if self.is_late else 1.0)
        except subprocess.TimeoutExpired:
            return None

    def told(self) -> str:
        """The end of what it printed on standard error since its task began."""
        size = os.fstat(self._stderr.fileno()).st_size
        begin = max(0, size - _STDERR_KEPT)
        return os.pread(self._stderr.fileno(), _STDERR_KEPT, begin).decode("utf-8", "replace").strip()

    def kill(self) -> None:
        """End it with all that its tasks have started."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, SIGKILL)
        with suppress(ProcessLookupError):
            self.process.kill()

    def end(self) -> None:
        """Kill it, and leave no zombie and no open file."""
        self.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self._stderr):
            assert stream is not None
            with suppress(OSError):
                stream.close()


def _hold_ctrl_c() -> None:
    """Have children begin with Ctrl-C held back, until they ignore it: inside an import it ends them in odd ways.

    Python's start has no place for KeyboardInterrupt: it becomes a fatal error with status 1, or RuntimeError.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _record_of(child: _Child, found: dict[str, Any]) -> Record:
    """The record of a job, with where and when."""
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    return Record.from_json({**found, **child.ready, "finished": finished})


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
