"""Standard streams: never in the place of a file, and without a reader no reason to fail."""

from __future__ import annotations

import io
import os
import stat
import sys
from contextlib import suppress
from typing import Any


class _Pipe(io.FileIO):
    """A pipe to write to; when its reader has gone (head, say), what is written is dropped."""

    is_read = True

    def write(self, data: Any) -> int:
        if self.is_read:
            try:
                return super().write(data)
            except BrokenPipeError:
                self.is_read = False
        return memoryview(data).nbytes


class _Nowhere(io.FileIO):
    """The null device in place of a closed standard output: what is written is lost, and this is noted."""

    has_lost = False

    def write(self, data: Any) -> int:
        self.has_lost = True
        return super().write(data)


def have_standard_streams() -> None:
    """Have all three of them, and the status of a command not depend on who reads what it prints.

    Where one is closed (`>&-`) the null device takes its place, or the next file opened would. Where the encoding of a
    stream lacks a character, the character is spelt out.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            raw = (_Nowhere if name == "stdout" else io.FileIO)(os.devnull, mode)  # open as long as the process lives
            buffer = io.BufferedReader(raw) if mode == "r" else io.BufferedWriter(raw)
            setattr(sys, name, io.TextIOWrapper(buffer, encoding="utf-8"))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        kind = os.fstat(sys.stdout.fileno()).st_mode
    except (OSError, ValueError):
        return
    is_pipe = stat.S_ISFIFO(kind) or stat.S_ISSOCK(kind)
    if is_pipe and isinstance(sys.stdout, io.TextIOWrapper) and not isinstance(_raw_output(), _Pipe):
        sys.stdout.flush()
        pipe = io.BufferedWriter(_Pipe(sys.stdout.fileno(), "w", closefd=False))
        sys.stdout = io.TextIOWrapper(pipe, encoding=sys.stdout.encoding, errors="backslashreplace")


def is_read() -> bool:
    """Whether somebody may still read what is printed; it is known when a buffer was full, or has been flushed."""
    raw = _raw_output()
    return not isinstance(raw, _Pipe) or raw.is_read


def output_was_lost() -> bool:
    """Whether something was printed though standard output was closed when the program began; once it is flushed."""
    raw = _raw_output()
    return isinstance(raw, _Nowhere) and raw.has_lost


def leave_nothing_to_flush() -> None:
    """Let go of what a stream still holds and cannot write: Python would fail on it once more, and exit with 120."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _raw_output() -> Any:
    """What is below the buffers of standard output."""
    return getattr(getattr(sys.stdout, "buffer", None), "raw", None)
