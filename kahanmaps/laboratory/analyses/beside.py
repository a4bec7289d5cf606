"""Parts of an analysis that a second process does, while this one does the others.

It is a copy of this process: it has the map and all that was found so far without being told. What it finds comes back
as pickles, one for each part.
"""

from __future__ import annotations

import os
import pickle
import select
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import IO, Any

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
    """The parts that a second process does, in their order; to be used in a `with` block, whose end is its end."""

    def __init__(self, run: Run, parts: Sequence[Part]) -> None:
        self.waiting = list(parts)
        self._run = run
        self._process: int | None = None
        self._answers: IO[bytes] | None = None
        if not parts:
            return
        parent = os.getpid()
        reading, writing = os.pipe()
        self._answers = os.fdopen(reading, "rb")
        with suppress(OSError):  # no memory for one more process, or too many: then there are no answers
            self._process = os.fork()
        if self._process == 0:
            _work(parent, run, parts, writing)
        os.close(writing)

    @property
    def has_answered(self) -> bool:
        """Whether something of the first one that is waiting has come."""
        return bool(self.waiting and self._answers and select.select([self._answers], [], [], 0)[0])

    def next(self) -> tuple[Part, Any, str]:
        """The first one that is waiting and its outcome; where the process has ended early, it is done here."""
        part = self.waiting.pop(0)
        assert self._answers is not None  # there are no parts without
        try:
            found, reason = pickle.load(self._answers)
        except (EOFError, pickle.UnpicklingError):  # killed, or it met an error, which it will meet here again
            found, reason = outcome(self._run, part)
        return part, found, reason

    def __enter__(self) -> Beside:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            with suppress(ProcessLookupError):
                os.kill(self._process, signal.SIGKILL)
            os.waitpid(self._process, 0)
            self._process = None
        if self._answers is not None:
            self._answers.close()


def _work(parent: int, run: Run, parts: Sequence[Part], writing: int) -> None:
    """Do the parts in this process, which is the copy, and end it."""
    try:
        end_with_parent(parent)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
        run.progress = lambda _: None
        with os.fdopen(writing, "wb") as answers:
            for part in parts:
                found, reason = outcome(run, part)
                if not reason:
                    run.found[part.result] = found
                answers.write(pickle.dumps((found, reason)))
                answers.flush()
    finally:
        os._exit(0)  # nothing of the parent's, such as its buffers, is this one's to end
