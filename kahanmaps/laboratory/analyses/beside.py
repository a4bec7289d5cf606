"""Parts of an analysis that another process does, while this one does others.

It is a copy of this process: it has the map and all that was found so far without being told. What it finds comes back
as pickles, one for each part.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Pipe
from typing import Any

from kahanmaps.errors import KahanmapsError
from kahanmaps.laboratory.analyses.part import Part, Run
from kahanmaps.processes import end_with_parent

CAN_FORK = sys.platform == "linux"  # elsewhere a copy of a process need not be one that works
_MOST = 256  # lists: their numbers are bytes
_ANSWERS = 1 << 20  # bytes, as long as Linux has a pipe for anybody; what is found is seldom longer than a tenth of it


def outcome(run: Run, part: Part) -> tuple[Any, str]:
    """What a part found; or None, and why it was not done."""
    if run.left <= 0 and part.share:
        return None, "the time was over"
    try:
        return part.look(run, **run.budget(part)), ""
    except KahanmapsError as error:
        return None, str(error)


class Beside:
    """Parts that another process does, from `start` to `end`, which is to be called in any case.

    Each list of parts belongs to the process that is the first to be free for it, which may be this one: `claim`.
    """

    def __init__(self, run: Run, parts: Sequence[Sequence[Part]]) -> None:
        self._run, self._parts = run, parts[:_MOST]
        self._all = [part for some in self._parts for part in some]
        self.waiting = list(self._all)
        self._process: int | None = None
        self.answers, self._theirs = Pipe(duplex=False)
        self._numbers, numbers = os.pipe()  # of the lists that nobody has begun with
        os.write(numbers, bytes(range(len(self._parts))))
        os.close(numbers)

    def start(self) -> None:
        """Begin, or have no answers."""
        from fcntl import F_SETPIPE_SZ, fcntl

        with suppress(PermissionError):  # it may be that a user has too many long pipes: then answers wait to be taken
            fcntl(self._theirs.fileno(), F_SETPIPE_SZ, _ANSWERS)
        parent, held = os.getpid(), signal.pthread_sigmask(signal.SIG_BLOCK, ())
        try:
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
            with suppress(OSError):  # no memory for one more process, or too many
                self._process = os.fork()
            if self._process == 0:
                self._work(parent)
        finally:
            if self._process == 0:
                os._exit(0)  # nothing of the parent's, such as its buffers, is this one's to end
            signal.pthread_sigmask(signal.SIG_SETMASK, held)  # from here on Ctrl-C finds a process that `end` knows
        self._theirs.close()

    def claim(self) -> Sequence[Part]:
        """Parts that nobody has begun with, for this process; none where there are none."""
        claimed = self._next_parts()
        for part in claimed:
            self.waiting.remove(part)
        return claimed

    def _next_parts(self) -> Sequence[Part]:
        number = os.read(self._numbers, 1)
        return self._parts[number[0]] if number else ()

    def next(self) -> tuple[Part, Any, str]:
        """A part with its outcome that has come; where the process has ended early, one that waits is done here."""
        try:
            number, found, reason = self.answers.recv()
            part = self._all[number]
            self.waiting.remove(part)
        except (EOFError, OSError):  # killed, or it met an error, which it will meet here again
            while self._next_parts():
                pass
            part = self.waiting.pop(0)
            found, reason = outcome(self._run, part)
        return part, found, reason

    def end(self) -> None:
        """The end of the process, if there is one."""
        self.answers.close()
        self._theirs.close()
        os.close(self._numbers)
        if self._process is not None:
            with suppress(ProcessLookupError, ChildProcessError):  # where SIGCHLD is ignored nobody waits for it
                os.kill(self._process, signal.SIGKILL)
                os.waitpid(self._process, 0)

    def _work(self, parent: int) -> None:
        """Do parts in this process, which is the copy. Signals, still held back, are for the parent."""
        end_with_parent(parent)
        self.answers.close()
        self._run.progress = lambda _: None
        while parts := self._next_parts():
            for part in parts:
                found, reason = outcome(self._run, part)
                if not reason:
                    self._run.found[part.result] = found
                self._theirs.send((self._all.index(part), found, reason))


def together(parts: Sequence[Part], unmet: Callable[[Part], set[str]]) -> list[list[Part]]:
    """Those of the parts that may be done apart, in lists of which none waits for anything but earlier ones of its own.

    `unmet` has the names of parts that one has to wait for.
    """
    found: list[list[Part]] = []
    for part in parts:
        before = unmet(part)
        if part.is_apart and not before:
            found.append([part])
        elif part.is_apart:
            with_it = next((some for some in found if before.issubset(one.name for one in some)), None)
            if with_it is not None:
                with_it.append(part)
    return found
