"""The lock of the one that writes to a database: an advisory lock on a file of its own.

The operating system frees it when the process ends, however it ends.
"""

from __future__ import annotations

import errno
import os
import platform
import re
import stat
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

try:
    import fcntl
except ImportError:  # pragma: no cover - there is none on Windows, where SQLite's own locks must do
    fcntl = None  # type: ignore[assignment]


class LockedByAnother(Exception):
    """Somebody else has the lock: the message says who."""


class NotOurs(Exception):
    """What has the name of a file of ours is something else, and left alone: the message says what."""


@dataclass(eq=False)
class Lock:
    """An advisory lock, free at first.

    Its file cannot be the database itself: to close any descriptor of that would drop the locks that SQLite has.
    """

    path: Path
    _descriptor: int | None = field(default=None, init=False)

    @property
    def is_held(self) -> bool:
        """Whether it is held by this object."""
        return self._descriptor is not None

    def take(self) -> None:
        """Take it; LockedByAnother says who has it, NotOurs and OSError why there can be no such file."""
        if self.is_held or fcntl is None:
            return
        try:
            self._descriptor = descriptor = self._locked()
        except BlockingIOError:
            raise LockedByAnother(self._holder()) from None
        _held.add(self)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        try:
            os.ftruncate(descriptor, 0)
            line = f"process {os.getpid()} on {platform.node()} since {now}\n".encode()
            if os.write(descriptor, line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError:
            self.free()
            raise

    def free(self) -> None:
        """Give it back; nothing if it is not held."""
        if self._descriptor is None:
            return
        descriptor, self._descriptor = self._descriptor, None
        _held.discard(self)
        # The name goes first, while the lock keeps others from taking what it names.
        with suppress(OSError):
            if self._is_named(descriptor):
                self.path.unlink()
        os.close(descriptor)

    def forget(self) -> None:
        """Let go of what belongs to the parent, which keeps it."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _locked(self) -> int:
        """A descriptor of the file, with the lock on it."""
        while True:
            require_plain(self.path)
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # The one before may have removed the file after it was opened here. Whoever locks a file that has no
                # name any longer locks nobody out; whoever holds the one with the name keeps it there.
                if self._is_named(descriptor):
                    require_plain(self.path)
                    if not _LINE.fullmatch(os.pread(descriptor, _LONGEST_LINE, 0)):
                        raise NotOurs(f"{self.path} is not a lock file")
                    return descriptor
            except BaseException:
                os.close(descriptor)
                raise
            os.close(descriptor)

    def _is_named(self, descriptor: int) -> bool:
        try:
            return os.path.samestat(os.fstat(descriptor), os.lstat(self.path))
        except FileNotFoundError:
            return False

    def _holder(self) -> str:
        try:
            line = self.path.read_text(errors="replace").partition("\n")[0][:200]
        except OSError:
            line = ""
        return "".join(c for c in line if c.isprintable()) or "which has only begun"


def require_journal(path: Path) -> None:
    """Raise NotOurs if there is something of this name that SQLite would remove, and did not write."""
    require_plain(path)
    try:
        with path.open("rb") as stream:
            begins = stream.read(4)
    except FileNotFoundError:
        return
    if not _JOURNAL.fullmatch(begins):
        raise NotOurs(f"{path} is not a journal of SQLite")


def require_plain(path: Path) -> None:
    """Raise NotOurs if there is something of this name other than a file with this one name."""
    try:
        found = os.lstat(path)
    except FileNotFoundError:
        return
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        raise NotOurs(f"{path} is not a file of its own, but a link, a folder or a device")


_LONGEST_LINE = 1000
_LINE = re.compile(rb"(?:process [^\n]*\n)?")  # nothing: its writer was killed before it had written it

# A rollback journal, a WAL in either order of bytes; nothing or zeros: its writer was killed before it was complete.
_JOURNAL = re.compile(rb"\xd9\xd5\x05\xf9|\x37\x7f\x06[\x82\x83]|\0*")

_held: set[Lock] = set()


def _forget_locks() -> None:
    """A forked child shares the locks of its parent: without this they would outlive a parent that was killed."""
    for lock in _held:
        lock.forget()
    _held.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_locks)
