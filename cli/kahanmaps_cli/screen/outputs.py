"""The door to files that a command writes: those that it reads or cannot write are refused before anything is computed.

What a command reads is known from Python itself, which tells every file before it is opened: no command has to say so,
and none can forget to. A file counts by what it is, not by its name, so links are seen through.
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
    """Which files a command has read, and which it is going to write, by what they are."""

    def __init__(self) -> None:
        self.read: set[Identity] = set()
        self.written: dict[Identity, str] = {}
        with suppress(OSError, ValueError, AttributeError):  # standard input is closed, or there is none
            self.note(sys.stdin.fileno())

    def note(self, path: Any, is_written: bool = False) -> None:
        """Note a file that is about to be read, or one that is going to be written; refuse one that is both."""
        try:
            found = os.stat(path)
        except (OSError, ValueError):
            return
        if not stat.S_ISREG(found.st_mode):
            return  # it holds nothing that could be written over
        identity = found.st_dev, found.st_ino
        if identity in (self.read if is_written else self.written):
            name = path if is_written else self.written[identity]
            raise click.UsageError(f"found {name} both to be read and to be written (-o): it would be written over")
        if is_written:
            self.written[identity] = path
        else:
            self.read.add(identity)


class OutputFile(click.Path):
    """A file to write to, `-` for standard output. With `grows` it is written in its place, else one beside it."""

    name = "file"

    def __init__(self, grows: bool = False) -> None:
        super().__init__(dir_okay=False)
        self.grows = grows

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = os.fsdecode(super().convert(value, param, ctx))
        if path != "-" and ctx is not None and not ctx.resilient_parsing:
            # Whether there is a place for the file is known before anything is computed.
            folder, target = lib.resolved(path).parent, Path(path)
            if not path or not folder.is_dir():
                raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), path)
            in_its_place = target.exists() and (self.grows or not target.is_file())
            if not os.access(path if in_its_place else folder, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), path)
            _files(ctx).note(path, is_written=True)
        return path


class OutputFolder(click.Path):
    """A folder to write files to: each has to be announced by `will_write` before the first is written."""

    def __init__(self) -> None:
        super().__init__(file_okay=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = super().convert(value, param, ctx)
        if ctx is not None:
            _files(ctx)  # notes from now on what is read
        if ctx is None or ctx.resilient_parsing:
            return path
        # Whether files can be written there is found out, before anything is computed, by making it.
        folder = Path(os.fsdecode(path))
        missing = [one for one in (folder, *folder.parents) if not one.exists()]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not os.access(folder, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
        finally:
            for one in missing:
                if one.is_dir():
                    one.rmdir()
        return path


def file_name(name: str) -> str:
    """The name with everything replaced that might lead out of a folder, or that no file should be called."""
    return "".join(c if c.isalnum() or c in "._+-" else "_" for c in name)


def deliver(path: str, content: bytes) -> bool:
    """Write to a file, whole or not at all, or to standard output for `-`; whether it was a file."""
    if path == "-":
        sys.stdout.buffer.write(content)
        sys.stdout.buffer.flush()
        return False
    lib.write_atomically(path, content)
    return True


def will_write(path: str) -> None:
    """Refuse a file that this command has read."""
    _files(click.get_current_context()).note(path, is_written=True)


def _files(context: click.Context) -> _Files:
    _listen()
    found = context.meta.get(_KEY)
    if not isinstance(found, _Files):
        found = context.meta[_KEY] = _Files()
    return found


@cache  # a hook stays as long as the process
def _listen() -> None:
    def hear(event: str, arguments: tuple[Any, ...]) -> None:
        """Tell the command that is running of every file that is opened to be read, also databases of results."""
        if event == "open" and (arguments[2] or 0) & os.O_ACCMODE == os.O_RDONLY and not isinstance(arguments[0], int):
            path = arguments[0]
        elif event == "sqlite3.connect":
            path = unquote(os.fsdecode(arguments[0]).removeprefix("file:").partition("?")[0])
        else:
            return
        context = click.get_current_context(silent=True)
        if context is not None and _KEY in context.meta:
            context.meta[_KEY].note(path)

    sys.addaudithook(hear)
