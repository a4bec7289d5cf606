"""Which journal a database is written with, by the file system that it lies on, and whether it is mounted by itself."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

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
