"""Parts of an analysis that another process does, while this one does others.

It is a copy of this process: it has the map and all that was found so far without being told. What it finds comes back
as pickles, one for each part.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any

import kahanmaps.algebra.written.pickles  # noqa: F401
from kahanmaps.errors import KahanmapsError
from kahanmaps.laboratory.analyses.part import Part, Run
from kahanmaps.processes import end_with_parent

CAN_FORK = sys.platform == "linux"  # elsewhere a copy of a process need not be one that works


def outcome(run: Run, part: Part) -> tuple[Any, str]:
    """What a part found; or None, and why it was not done."""
    if run.left <= 0:
        return None, "the time was over"
    try:
        return part.look(run, **run.budget(part)), ""
    except KahanmapsError as error:
        return None, str(error)


class Beside:
    """The parts that another process does, in their order, from `start` to `end`, which is to be called in any case."""

    def __init__(self, run: Run, parts: Sequence[Part]) -> None:
        self.waiting = list(parts)
        self._run = run
        self._process: int | None = None
        self.answers, self._theirs = Pipe(duplex=False)

    def start(self) -> None:
        """Begin, or have no answers."""
        parent, held = os.getpid(), signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        with suppress(OSError):  # no memory for one more process, or too many
            self._process = os.fork()
        if self._process == 0:
            self.answers.close()
            _work(parent, self._run, self.waiting, self._theirs)
        self._theirs.close()
        signal.pthread_sigmask(signal.SIG_SETMASK, held)  # from here on Ctrl-C finds a process that `end` knows

    def next(self) -> tuple[Part, Any, str]:
        """The first one that is waiting and its outcome; where the process has ended early, it is done here."""
        part = self.waiting.pop(0)
        try:
            found, reason = self.answers.recv()
        except (EOFError, OSError):  # killed, or it met an error, which it will meet here again
            found, reason = outcome(self._run, part)
        return part, found, reason

    def end(self) -> None:
        """The end of the process, if there is one."""
        self.answers.close()
        self._theirs.close()
        if self._process is not None:
            with suppress(ProcessLookupError, ChildProcessError):  # where SIGCHLD is ignored nobody waits for it
                os.kill(self._process, signal.SIGKILL)
                os.waitpid(self._process, 0)


def with_answers(beside: Sequence[Beside], seconds: float | None) -> list[Beside]:
    """Those that are waited for and have answered, or ended, after so many seconds at most."""
    waiting = [one for one in beside if one.waiting]
    answers = wait([one.answers for one in waiting], seconds) if waiting else []
    return [one for one in waiting if one.answers in answers]


def _work(parent: int, run: Run, parts: Sequence[Part], answers: Connection) -> None:
    """Do the parts in this process, which is the copy, and end it. Ctrl-C, still held back, is for the parent."""
    try:
        end_with_parent(parent)
        run.progress = lambda _: None
        for part in parts:
            found, reason = outcome(run, part)
            if not reason:
                run.found[part.result] = found
            answers.send((found, reason))
    finally:
        os._exit(0)  # nothing of the parent's, such as its buffers, is this one's to end
