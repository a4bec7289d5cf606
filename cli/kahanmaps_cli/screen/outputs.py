"""Output files of commands: a file that is not writable, or is also an input, is refused before the computation.

A Python audit hook records every file that a command opens for reading. Files are compared by device and inode
instead of by name, so that links are recognized.
"""

from __future__ import annotations

import errno
import os
import stat
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import click

from kahanmaps import internals as lib

_KEY = "kahanmaps_cli.files"

Identity = tuple[int, int]


class _Files:
    """The files that a command has read or will write, identified by device and inode."""

    def __init__(self) -> None:
        self.read: set[Identity] = set()
        self.written: dict[Identity, str] = {}
        with suppress(OSError, ValueError, AttributeError):  # standard input may be closed or missing
            self.note(sys.stdin.fileno())

    def note(self, path: Any, is_written: bool = False) -> None:
        """Record a file that is read or will be written; refuse a file that is both."""
        try:
            status = os.stat(path)
        except (OSError, ValueError):
            return
        if not stat.S_ISREG(status.st_mode):
            return  # a pipe or device cannot be overwritten
        identity = status.st_dev, status.st_ino
        if identity in (self.read if is_written else self.written):
            name = path if is_written else self.written[identity]
            raise click.UsageError(
                f"{name} is both an input and an output (-o) and would be overwritten: name another output"
            )
        if is_written:
            self.written[identity] = path
        else:
            self.read.add(identity)


class OutputFile(click.Path):
    """A file to write to, `-` for standard output; it is written in place if `grows`, otherwise replaced atomically."""

    name = "file"

    def __init__(self, grows: bool = False) -> None:
        super().__init__(dir_okay=False)
        self.grows = grows

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = os.fsdecode(super().convert(value, param, ctx))
        if path != "-" and ctx is not None and not ctx.resilient_parsing:
            # Before the computation starts, refuse a file that is not writable.
            folder, target = lib.resolve_path(path).parent, Path(path)
            if not path or not folder.is_dir():
                raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), path)
            is_written_in_place = target.exists() and (self.grows or not target.is_file())
            if not os.access(path if is_written_in_place else folder, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), path)
            _recorded_files(ctx).note(path, is_written=True)
        return path


class OutputFolder(click.Path):
    """A folder for output files: the command calls `will_write` for every file before it writes the first one."""

    def __init__(self) -> None:
        super().__init__(file_okay=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = super().convert(value, param, ctx)
        if ctx is not None:
            _recorded_files(ctx)  # start to record the files that the command reads
        if ctx is None or ctx.resilient_parsing:
            return path
        # Before the computation, refuse a folder that is not writable: create it if it is missing, and remove it again.
        folder = Path(os.fsdecode(path))
        missing = [directory for directory in (folder, *folder.parents) if not directory.exists()]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not os.access(folder, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
        finally:
            for directory in missing:
                if directory.is_dir():
                    directory.rmdir()
        return path


def file_name(name: str) -> str:
    """Replace the characters of `name` that are unsafe in a file name by underscores."""
    return "".join(c if c.isalnum() or c in "._+-" else "_" for c in name)


def deliver(path: str, content: bytes) -> bool:
    """Write `content` to a file atomically, or to standard output for the path `-`; return whether it was a file."""
    if path == "-":
        sys.stdout.buffer.write(content)
        sys.stdout.buffer.flush()
        return False
    lib.write_atomically(path, content)
    return True


def will_write(path: str) -> None:
    """Record a file that the running command will write; refuse it if the command has read it."""
    _recorded_files(click.get_current_context()).note(path, is_written=True)


def _recorded_files(context: click.Context) -> _Files:
    _install_hook()
    files = context.meta.get(_KEY)
    if not isinstance(files, _Files):
        files = context.meta[_KEY] = _Files()
    return files


@cache  # once per process, since an audit hook cannot be removed
def _install_hook() -> None:
    def record(event: str, arguments: tuple[Any, ...]) -> None:
        """Record every file, including every database, that the running command opens for reading."""
        if event == "open" and (arguments[2] or 0) & os.O_ACCMODE == os.O_RDONLY and not isinstance(arguments[0], int):
            path = arguments[0]
        elif event == "sqlite3.connect":
            path = unquote(os.fsdecode(arguments[0]).removeprefix("file:").partition("?")[0])
        else:
            return
        context = click.get_current_context(silent=True)
        if context is not None and _KEY in context.meta:
            context.meta[_KEY].note(path)

    sys.addaudithook(record)
