"""What lies beside a database: its journal, and the lock of the one that writes, an advisory lock on a file of its own.

The operating system frees the lock when the process ends, however it ends.
"""

from __future__ import annotations

import errno
import os
import platform
import re
import stat
from collections.abc import Iterator
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


# File systems on which several processes of this machine see one memory map, which WAL needs. A name that is missing
# here costs speed, a wrong one would cost data; FUSE is left out because anything may be behind it.
_LOCAL = """
    apfs bcachefs btrfs exfat ext2 ext3 ext4 f2fs fuseblk hfsplus jfs msdos nilfs2 ntfs ntfs3 overlay ramfs reiserfs
    tmpfs ubifs vfat xfs zfs
"""
_MOUNTS = Path("/proc/self/mounts")


def journal_for(path: Path, mounts: Path | None = None) -> str:
    """How a database here is written: "wal" on local file systems, "delete" (a rollback journal) on all others.

    WAL costs a twentieth for each commit, but its index is shared memory: writers on two machines would not see each
    other and ruin the file.
    """
    return "wal" if file_system(path, mounts) in _LOCAL.split() else "delete"


def file_system(path: Path, mounts: Path | None = None) -> str | None:
    """The type of the file system that `path` lies on, None if it cannot be known."""
    path = Path(os.path.realpath(path))
    best: tuple[int, str] | None = None
    for folder, kind in _mounted(mounts):
        depth = len(folder.parts)
        # Of two on the same folder the later one covers the other.
        if path.is_relative_to(folder) and (best is None or depth >= best[0]):
            best = depth, kind
    return None if best is None else best[1]


def is_mounted(path: Path, mounts: Path | None = None) -> bool:
    """Whether this file is mounted by itself, as containers do it: then it has another name in another folder."""
    return any(folder == path for folder, _ in _mounted(mounts))


def _mounted(mounts: Path | None) -> Iterator[tuple[Path, str]]:
    """What is mounted where, and the types of the file systems."""
    try:
        lines = (mounts or _MOUNTS).read_text(errors="surrogateescape").splitlines()
    except OSError:
        return
    for line in lines:
        fields = line.split(" ")
        if len(fields) >= 3:
            # Blanks and the like are octal: /mnt/my\040disk.
            yield Path(re.sub(r"\\([0-7]{3})", lambda found: chr(int(found[1], 8)), fields[1])), fields[2]
