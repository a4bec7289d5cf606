"""Robust standard streams: a closed stream is replaced, and writing to a pipe without a reader is no error."""

from __future__ import annotations

import io
import os
import stat
import sys
from contextlib import suppress
from typing import Any


class _Pipe(io.FileIO):
    """A pipe that discards everything written after its reader (such as head) has closed it."""

    is_read = True

    def write(self, data: Any) -> int:
        if self.is_read:
            try:
                return super().write(data)
            except BrokenPipeError:
                self.is_read = False
        return memoryview(data).nbytes


class _NullOutput(io.FileIO):
    """The null device in place of a closed standard output; `has_lost` records whether output was discarded."""

    has_lost = False

    def write(self, data: Any) -> int:
        self.has_lost = True
        return super().write(data)


def prepare_standard_streams() -> None:
    """Replace closed streams by the null device; let the exit status not depend on whether a pipe still has a reader.

    Without the replacement, the next opened file would get the descriptor of the closed stream (`>&-`). Characters that
    cannot be represented in the encoding of a stream are written as escape sequences.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            raw = (_NullOutput if name == "stdout" else io.FileIO)(
                os.devnull, mode
            )  # stays open until the process ends
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
    """Whether standard output still had a reader when data were last written to it."""
    raw = _raw_output()
    return not isinstance(raw, _Pipe) or raw.is_read


def output_was_lost() -> bool:
    """Whether output was lost, since standard output was closed from the beginning; flush standard output first."""
    raw = _raw_output()
    return isinstance(raw, _NullOutput) and raw.has_lost


def discard_unwritable_output() -> None:
    """Discard buffered output that cannot be written: at exit Python would retry, fail, and return status 120."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _raw_output() -> Any:
    return getattr(getattr(sys.stdout, "buffer", None), "raw", None)
