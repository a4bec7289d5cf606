"""Files that are written atomically and durably."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[IO[bytes]]:
    """Open a temporary file; it replaces the file `path` at the end of the block, or is removed if the block raises.

    At any time `path` is either the complete old file or the complete new file. A pipe or a device cannot be replaced:
    it is written to at the end of the block. Raises an OSError that names `path`.
    """
    from shutil import copyfileobj  # loads modules for random numbers and compression
    from tempfile import NamedTemporaryFile, TemporaryFile

    with with_file_name(path):
        if os.path.exists(path) and not os.path.isfile(path):
            with TemporaryFile() as buffer:
                yield buffer
                buffer.seek(0)
                with open(path, "wb") as stream:
                    copyfileobj(buffer, stream)
            return
        target = resolve_path(path)
        os.umask(umask := os.umask(0o022))  # the umask can be read only by setting it
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~umask
        try:
            prefix = f".{target.name}"[:100] + "."
            temporary = NamedTemporaryFile(dir=target.parent, prefix=prefix, delete=False)  # noqa: SIM115
        except OSError as error:  # the error must name the requested file instead of the temporary one
            raise type(error)(error.errno, error.strerror, os.fspath(path)) from None
        with temporary as new_file:
            try:
                yield new_file
                os.chmod(new_file.name, mode)
                sync(new_file)
                os.replace(new_file.name, target)
            except BaseException:
                with suppress(OSError):
                    os.unlink(new_file.name)
                raise
        # Write the new entry of the directory to the disk too, which some file systems do not support.
        with suppress(OSError):
            descriptor = os.open(target.parent, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)


@contextmanager
def open_append(path: str | os.PathLike[str]) -> Iterator[IO[str]]:
    """Open a text file to append to it in place; at the end of the block the appended text is on the disk.

    Raises an OSError that names `path`.
    """
    with with_file_name(path), open(path, "w", encoding="utf-8", errors="backslashreplace") as stream:
        yield stream
        sync(stream)


@contextmanager
def with_file_name(path: str | os.PathLike[str]) -> Iterator[None]:
    """Add the name of the file to an OSError that the block raises; Python's error for a full disk names no file."""
    try:
        yield
    except OSError as error:
        error.filename = os.fspath(path) if error.filename is None else error.filename
        raise


def write_atomically(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content` to the file `path` atomically. Raises OSError if it cannot be written."""
    with atomic_write(path) as stream:
        stream.write(content)


def sync(stream: IO[Any]) -> None:
    """Flush a stream and write its file to the disk; a stream to a pipe or a device is only flushed."""
    stream.flush()
    if stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        os.fsync(stream.fileno())


def resolve_path(path: str | os.PathLike[str]) -> Path:
    """Return `path` without symbolic links. Raises OSError if the links form a cycle, or no file can have this name."""
    try:
        target = os.path.realpath(path)
    except ValueError:  # the name contains a NUL character
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL), os.fspath(path)) from None
    if os.path.islink(target):
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), os.fspath(path))
    return Path(target)
