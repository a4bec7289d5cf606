"""Tasks in child processes on this machine: short ones in groups, each within its limits, and no child outlives us.

A child is given one task after the other until it has worked for some seconds; then another one takes its place. What
goes wrong in a child that has done other tasks before, or dies of a signal, is tried once more alone in a new child,
and only that decides: so what is recorded does not depend on the order of tasks. What is killed from outside decides
nothing: it is tried a few times, and then it is lost.
"""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from signal import SIGKILL, Signals
from typing import IO, Any, cast

from kahanmaps.errors import KahanmapsError
from kahanmaps.experiments.records import Documents, Job, Outcome, Record

# How often in all a task is tried while what does it is killed from outside, before it is given up as lost: a lost
# task has no result, and the next run tries it as often again.
TRIES = 5
GROUP_SECONDS = 5.0  # of work for one child: starting it costs about a fifth of a second
_STDERR_KEPT = 2000
_READ = 1 << 16
_READS = 64  # of what a child prints, at most, before somebody else is heard
_LOOK_EVERY = 1.0  # seconds between two looks at who is alive; to be away for longer is to have been stopped
_STARTS = 3  # children that end before they are ready, one after the other: then there is no use in more
_KILLED_STARTS = 20  # the same for children that somebody kills, for each that may work at a time
# Words with which Python, FLINT and GMP end where there is no memory.
_NO_MEMORY = ("allocate memory", "out of memory", "memoryerror", "cannot reallocate", "bad_alloc")


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


@dataclass
class _Work:
    """A job in flight; `alone` says that it is being tried once more, in a child of its own.

    `tries` of it have ended with a child that was killed or stopped from outside; `had_fault`: one with a child that
    died by itself.
    """

    job: Job
    alone: bool = False
    tries: int = 0
    had_fault: bool = False
    begun: float | None = None


class LocalChildren:
    """An executor that runs at most `jobs` child processes on this machine.

    `documents` gives the text of a system document by its digest. A job whose children are killed from outside is lost
    after so many `tries`. Raises ChildrenError where no child can be started.
    """

    def __init__(
        self, jobs: int, documents: Documents, *, group_seconds: float = GROUP_SECONDS, tries: int = TRIES
    ) -> None:
        self.jobs = jobs
        self._documents = documents
        self._group_seconds = group_seconds
        self._tries = tries
        self._selector = selectors.DefaultSelector()
        self._children: list[_Child] = []
        self._waiting: deque[_Work] = deque()
        self._records: list[Record] = []
        self._stillborn = 0
        self._looked = self._checked = time.monotonic()

    @property
    def is_free(self) -> bool:
        """Whether some child has nothing to do."""
        return self.in_flight < self.jobs

    @property
    def in_flight(self) -> int:
        """The number of jobs not yet handed back."""
        return len(self._waiting) + sum(child.work is not None for child in self._children)

    def submit(self, job: Job) -> None:
        """Give a job to an idle child, or to a new one."""
        self._give(_Work(job))

    def wait(self, timeout: float) -> list[Record]:
        """The records that came in, after at most `timeout` seconds."""
        end = time.monotonic() + timeout
        self._make_up_for(self._looked)
        while self.in_flight and not self._records:
            deadlines = [d for child in self._children if (d := child.deadline()) is not None]
            until = max(self._looked, min([end, *deadlines, self._looked + _LOOK_EVERY]))
            ready = self._selector.select(until - self._looked)
            self._make_up_for(until)
            for key, _ in ready:
                child, stream = key.data
                if child in self._children:
                    self._hear(child, stream)
            if self._looked - self._checked >= _LOOK_EVERY:
                self._checked = self._looked
                self._look_for_the_dead()
            self._end_the_late()
            if time.monotonic() >= end:
                break
        records, self._records = self._records, []
        return records

    def _make_up_for(self, until: float) -> None:
        """Time beyond `until` in which this process was stopped, or busy elsewhere, is nobody's."""
        self._looked = time.monotonic()
        lost = self._looked - until
        if lost > _LOOK_EVERY:
            for child in self._children:
                if child.work is not None and child.work.begun is not None:
                    child.work.begun = min(child.work.begun + lost, self._looked)

    def close(self) -> None:
        """Kill every child at once."""
        for child in list(self._children):
            self._bury(child)
        self._waiting.clear()
        self._selector.close()

    def _give(self, work: _Work) -> None:
        idle = [child for child in self._children if child.work is None]
        fit = [child for child in idle if child.is_fresh] if work.alone else idle
        if fit:
            child = fit[0]
        else:
            if idle:  # only a new child will do, and there is no room for one more
                self._bury(idle[0])
            if len(self._children) >= self.jobs:
                self._waiting.append(work)
                return
            child = self._new_child()
        child.work = work
        if child.ready is not None:
            self._send(child)

    def _new_child(self) -> _Child:
        child = _Child()
        self._children.append(child)
        for stream in (child.answers, child.talk):
            self._selector.register(stream, selectors.EVENT_READ, (child, stream))
        return child

    def _send(self, child: _Child) -> None:
        work = child.work
        assert work is not None
        child.read_the_rest()  # before the task is sent: what comes from now on is its own
        child.stderr.clear()
        try:
            for key in work.job.task.documents:
                if key not in child.documents:
                    child.write({"document": key, "text": self._documents(key)})
                    child.documents.add(key)
            child.write({"task": work.job.task.text, "memory": work.job.limits.memory})
        except BrokenPipeError:
            pass  # it has died; its end of file will tell
        work.begun = time.monotonic()

    def _hear(self, child: _Child, stream: Any) -> None:
        """What a child has to say: answers, talk, or the end of file that means its death."""
        try:
            data = os.read(stream.fileno(), _READ)
        except BlockingIOError:
            return
        if stream is child.answers:
            self._heard(child, data)
        elif data:
            child.stderr.append(data)
        else:
            self._selector.unregister(stream)

    def _heard(self, child: _Child, data: bytes) -> None:
        if not data:
            self._died(child)
        for line in child.lines(data):
            try:
                message = json.loads(line)
            except (ValueError, RecursionError) as error:  # an integer of more digits than are read here
                key = child.work.job.task.key if child.work is not None else ""
                message = {"key": key, "outcome": Outcome.FAILED, "message": f"the result cannot be kept: {error}"}
            if "ready" in message:
                child.ready = message["ready"]
                self._stillborn = 0
                if child.work is not None:
                    self._send(child)
            elif child.work is not None and message["key"] == child.work.job.task.key:
                self._finished(child, child.work, message)

    def _look_for_the_dead(self) -> None:
        """The children that are dead, where something they have started keeps their end of the pipe open."""
        for child in list(self._children):
            while child in self._children and child.process.poll() is not None:
                try:
                    data = os.read(child.answers.fileno(), _READ)
                except BlockingIOError:
                    data = b""
                self._heard(child, data)

    def _finished(self, child: _Child, work: _Work, message: dict[str, Any]) -> None:
        child.work = None
        child.seconds += message.get("seconds", 0.0)
        was_fresh, child.is_fresh = child.is_fresh, False
        out_of_memory = message["outcome"] == Outcome.OUT_OF_MEMORY
        if child.seconds >= self._group_seconds or out_of_memory or work.alone:
            self._bury(child)
        # A traceback: nobody expected this, so it may be the fault of what was done before.
        is_doubtful = out_of_memory or (message["outcome"] == Outcome.FAILED and "stderr" in message)
        if is_doubtful and not was_fresh and not work.alone:
            self._again(work)
        else:
            self._hand_back(child, message)

    def _died(self, child: _Child) -> None:
        status = child.status()
        child.read_the_rest()
        work, told = child.work, child.told()
        self._bury(child)
        if child.ready is None:
            self._stillborn += 1
            if self._stillborn >= (_KILLED_STARTS * self.jobs if is_from_outside(status) else _STARTS):
                raise ChildrenError(f"a child process cannot start (it {ending(status)}): {told or 'it says nothing'}")
            if work is not None:
                work.begun = None
                self._give(work)
        elif work is not None and is_from_outside(status):
            self._ended_from_outside(child, work, f"the child {ending(status)}")
        elif work is not None:
            has_memory = not any(words in told.lower() for words in _NO_MEMORY)
            # The signal of a fault may have been sent as well, but hardly twice. Status 0 is the end of the questions;
            # where there is none, the end may have been slow.
            is_doubtful = has_memory and (status is None or status <= 0) and not work.had_fault
            work.had_fault = work.had_fault or has_memory
            if is_doubtful or not child.is_fresh:
                self._again(work)
            elif has_memory:
                self._failed(child, work, Outcome.CRASHED, f"the child {ending(status)}")
            else:
                self._failed(child, work, Outcome.OUT_OF_MEMORY, "out of memory")

    def _ended_from_outside(self, child: _Child, work: _Work, message: str) -> None:
        """Have the work done by another child; or it is lost."""
        work.tries += 1
        if work.tries < self._tries:
            self._again(work)
        else:
            self._failed(child, work, Outcome.LOST, message)

    def _end_the_late(self) -> None:
        """The children whose time is over."""
        now = time.monotonic()
        for child in list(self._children):
            work = child.work
            if work is not None and (deadline := child.deadline()) is not None and now >= deadline:
                child.read_the_rest()
                was_stopped = child.is_stopped
                self._bury(child)
                message = f"not done within {work.job.limits.time:g} seconds"
                if was_stopped:
                    self._ended_from_outside(child, work, f"{message}, stopped from outside")
                else:
                    self._failed(child, work, Outcome.TIMEOUT, message)

    def _failed(self, child: _Child, work: _Work, outcome: Outcome, message: str) -> None:
        seconds = 0.0 if work.begun is None else time.monotonic() - work.begun
        found = {"key": work.job.task.key, "outcome": outcome, "message": message, "stderr": child.told()}
        self._hand_back(child, {**found, "seconds": seconds})

    def _hand_back(self, child: _Child, found: dict[str, Any]) -> None:
        """The record of a job, with where and when."""
        finished = datetime.now(UTC).isoformat(timespec="seconds")
        self._records.append(Record.from_json({**found, **(child.ready or {}), "finished": finished}))
        self._go_on()

    def _again(self, work: _Work) -> None:
        work.alone, work.begun = True, None
        self._give(work)
        self._go_on()

    def _go_on(self) -> None:
        """Work that had to wait for a child of its own."""
        if self._waiting and (len(self._children) < self.jobs or any(c.work is None for c in self._children)):
            self._give(self._waiting.popleft())

    def _bury(self, child: _Child) -> None:
        if child in self._children:
            self._children.remove(child)
        for stream in (child.answers, child.talk):
            with suppress(KeyError):
                self._selector.unregister(stream)
        child.end()


class _Child:
    """One process, and what it is doing."""

    def __init__(self) -> None:
        self.work: _Work | None = None
        self.ready: dict[str, Any] | None = None  # what it says of itself when it can take tasks
        self.seconds = 0.0
        self.is_fresh = True  # it has done nothing yet
        self.documents: set[str] = set()
        self.stderr: deque[bytes] = deque(maxlen=_READS)
        self._unread: list[bytes] = []
        command = [sys.executable, "-m", "kahanmaps.experiments.child", str(os.getpid())]
        # Sets of texts have an order that no result may depend on; with a fixed seed none can. A group of its own,
        # so that Ctrl-C in a terminal reaches us alone.
        environment = {**os.environ, "PYTHONHASHSEED": "0"}
        try:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                bufsize=0,
                env=environment,
                process_group=0,
            )
        except OSError as error:
            raise ChildrenError(f"a child process cannot be started: {error.strerror or error}") from error
        pipes = (self.process.stdin, self.process.stdout, self.process.stderr)
        self.input, self.answers, self.talk = cast("tuple[IO[bytes], IO[bytes], IO[bytes]]", pipes)
        for stream in (self.answers, self.talk):
            os.set_blocking(stream.fileno(), False)

    def deadline(self) -> float | None:
        """When its task has to be done; None if it may take its time, or is done and being told."""
        if self.work is None or self.work.begun is None or self.work.job.limits.time is None or any(self._unread):
            return None
        return self.work.begun + self.work.job.limits.time

    def status(self) -> int | None:
        """How it ended, after the end of its answers; None if it lives on without them."""
        try:
            return self.process.wait(1.0)
        except subprocess.TimeoutExpired:
            return None

    @property
    def is_stopped(self) -> bool:
        """Whether somebody has stopped it (SIGSTOP) and not let it go on, where that can be known."""
        with suppress(AttributeError, ChildProcessError):
            return os.waitid(os.P_PID, self.process.pid, os.WSTOPPED | os.WNOHANG | os.WNOWAIT) is not None
        return False

    def write(self, message: dict[str, Any]) -> None:
        """Send a message; a pipe takes whole lines or fails."""
        data = memoryview(json.dumps(message).encode() + b"\n")
        while data:
            data = data[self.input.write(data) or 0 :]

    def lines(self, data: bytes) -> Sequence[bytes]:
        """The lines that are complete now."""
        *pieces, rest = data.split(b"\n")
        if not pieces:
            self._unread.append(rest)
            return []
        pieces[0] = b"".join((*self._unread, pieces[0]))
        self._unread = [rest]
        return pieces

    def read_the_rest(self) -> None:
        """What it printed on standard error and nobody has read."""
        with suppress(OSError):
            for _ in range(_READS):
                if not (data := os.read(self.talk.fileno(), _READ)):
                    break
                self.stderr.append(data)

    def told(self) -> str:
        """The end of what it printed on standard error since its task began."""
        return b"".join(self.stderr).decode("utf-8", "replace")[-_STDERR_KEPT:].strip()

    def end(self) -> None:
        """Kill it with all that its tasks have started, and leave no zombie and no open file."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, SIGKILL)
        with suppress(ProcessLookupError):
            self.process.kill()
        self.process.wait()
        for stream in (self.input, self.answers, self.talk):
            with suppress(OSError):
                stream.close()


def is_from_outside(status: int | None) -> bool:
    """Whether a process that ended with this status, as `subprocess` has it, was killed by no doing of its own."""
    return status is not None and status < 0 and -status not in _OWN


def ending(status: int | None) -> str:
    """How a process ended, in words.

    >>> ending(-15), ending(7)
    ('was killed by signal 15 (SIGTERM), from outside', 'ended with status 7')
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
