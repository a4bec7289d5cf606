"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path
from tempfile import NamedTemporaryFile


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside its place and put it there when it is complete; what stood there stays until then.

    Raises OSError where it cannot be written.
    """
    if path.exists() and not path.is_file():  # /dev/stdout and its relatives take bytes, but cannot be replaced
        path.write_bytes(content)
        return
    target = resolved(path)
    mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask()
    try:
        part = NamedTemporaryFile(dir=target.parent, prefix=f".{target.name}.", delete=False)  # noqa: SIM115
    except OSError as error:  # about the file that was asked for, not about the one beside it
        raise type(error)(error.errno, error.strerror, str(path)) from None
    with part:
        try:
            part.write(content)
            part.flush()
            os.chmod(part.name, mode)
            os.replace(part.name, target)
        except BaseException:
            with suppress(OSError):
                os.unlink(part.name)
            raise


def resolved(path: str | os.PathLike[str]) -> Path:
    """The path without symbolic links; OSError where they lead round in a circle."""
    found = os.path.realpath(path)
    if os.path.islink(found):
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), os.fspath(path))
    return Path(found)


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
