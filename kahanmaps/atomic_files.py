"""Files that are written whole or not at all, and on the disk before anything relies on them."""

from __future__ import annotations

import errno
import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryFile
from typing import IO, Any


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[IO[bytes]]:
    """A stream to a file beside `path`, which takes its place at the end of the block; if that raises, it goes.

    What stood there stays until then: whoever looks, at any moment and after any end, finds the old file or the new
    one. A pipe or a device cannot be replaced: it gets everything at the end. Raises OSError that names `path`.
    """
    with named(path):
        if os.path.exists(path) and not os.path.isfile(path):
            with TemporaryFile() as held:
                yield held
                held.seek(0)
                with open(path, "wb") as stream:
                    shutil.copyfileobj(held, stream)
            return
        target = resolved(path)
        os.umask(umask := os.umask(0o022))  # there is no other way to ask for it
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~umask
        try:
            prefix = f".{target.name}"[:100] + "."
            beside = NamedTemporaryFile(dir=target.parent, prefix=prefix, delete=False)  # noqa: SIM115
        except OSError as error:  # about the file that was asked for, not about the one beside it
            raise type(error)(error.errno, error.strerror, os.fspath(path)) from None
        with beside as part:
            try:
                yield part
                os.chmod(part.name, mode)
                sync(part)
                os.replace(part.name, target)
            except BaseException:
                with suppress(OSError):
                    os.unlink(part.name)
                raise
        # The new name is on the disk, too; some file systems know no such thing, and have it anyway.
        with suppress(OSError):
            descriptor = os.open(target.parent, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)


@contextmanager
def open_append(path: str | os.PathLike[str]) -> Iterator[IO[str]]:
    """A stream of text to a file that whoever looks sees grow; it is on the disk at the end of the block.

    Raises OSError that names `path`.
    """
    with named(path), open(path, "w", encoding="utf-8", errors="backslashreplace") as stream:
        yield stream
        sync(stream)


@contextmanager
def named(path: str | os.PathLike[str]) -> Iterator[None]:
    """Let an OSError in the block name the file that it is about: a full disk comes without a name."""
    try:
        yield
    except OSError as error:
        error.filename = os.fspath(path) if error.filename is None else error.filename
        raise


def write_atomically(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file as `atomic_write` does. Raises OSError where it cannot be written."""
    with atomic_write(path) as stream:
        stream.write(content)


def sync(stream: IO[Any]) -> None:
    """Have on the disk what was written, where it goes to one: not only with the operating system."""
    stream.flush()
    if stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        os.fsync(stream.fileno())


def resolved(path: str | os.PathLike[str]) -> Path:
    """The path without symbolic links; OSError where they lead round in a circle, or no file can have this name."""
    try:
        found = os.path.realpath(path)
    except ValueError:  # a zero byte in it
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL), os.fspath(path)) from None
    if os.path.islink(found):
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), os.fspath(path))
    return Path(found)
