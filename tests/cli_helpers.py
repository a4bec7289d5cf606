"""What the tests of the command line share: the outcome of a command, a shell and a terminal to run it in."""

import fcntl
import io
import json
import os
import pty
import re
import shlex
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from threading import Thread
from typing import Any
from unittest.mock import patch

from kahanmaps_cli.main import main

_END = b"\0"  # what no command prints

COMMAND = [sys.executable, "-m", "kahanmaps_cli.main"]

# In a shell `kahanmaps` is the one of the interpreter that runs the tests, installed or not.
_PRELUDE = 'kahanmaps() { "$KAHANMAPS_PYTHON" -m kahanmaps_cli.main "$@"; }\n'


def time_is_over(*_: Any, **__: Any) -> None:
    """What a function is replaced by where the time of --seconds is to be over, however much there is."""
    signal.setitimer(signal.ITIMER_REAL, 1e-3)
    signal.pause()


@dataclass(frozen=True)
class Outcome:
    """The exit status of a command, what it printed, and what it said on standard error."""

    status: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Standard output as one JSON object."""
        return json.loads(self.out)

    @property
    def records(self) -> list[dict[str, Any]]:
        """Standard output as JSON lines."""
        return [json.loads(line) for line in self.out.splitlines()]

    @property
    def points(self) -> list[list[Fraction]]:
        """The coordinates of the points of an orbit in JSON lines."""
        return [[Fraction(entry) for entry in record["x"]] for record in self.records if record["record"] == "point"]

    @property
    def rows(self) -> list[list[str]]:
        """The cells of tab-separated lines, comments left out."""
        return [line.split("\t") for line in self.out.splitlines() if not line.startswith("#")]


def with_its_file(line: str) -> str:
    """The command of a line `COMMAND <= CONTENT`, once the file that it names is written; `\\n` is a new line in it."""
    command, is_given, content = line.partition(" <= ")
    if is_given:
        name = next(word for word in command.split() if re.fullmatch(r"s|[a-z]+\.[a-z]+", word))
        Path(name).write_text(content.replace("\\n", "\n"))
    return command


def environment(**more: str) -> dict[str, str]:
    """The environment of the tests without what changes output, and with `more`."""
    kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "COLUMNS", "LINES")}
    return {**kept, "KAHANMAPS_PYTHON": sys.executable, **more}


def shell(script: str, folder: Path, stdin: bytes = b"", **more: str) -> Outcome:
    """Run a script in bash, where `kahanmaps` is the command; `more` are environment variables."""
    done = subprocess.run(
        ["bash", "-c", _PRELUDE + script], cwd=folder, input=stdin, capture_output=True, env=environment(**more)
    )
    return Outcome(done.returncode, done.stdout.decode(), done.stderr.decode())


def interrupted(line: str, path: Path, number: int) -> Outcome:
    """Run a command in a process of its own, and send it a signal once more than 2000 bytes are in its file."""
    command = [*COMMAND, *shlex.split(line), "-o", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        while not path.exists() or path.stat().st_size < 2000:
            time.sleep(0.02)
        process.send_signal(number)
        out, err = process.communicate(timeout=100)
    return Outcome(process.returncode, out, err)


def terminal(*arguments: str, columns: int = 80, **more: str) -> Outcome:
    """Run a command, in this process, with a terminal of that width as its standard output, not standard error."""
    err = io.TextIOWrapper(io.BytesIO(), "utf-8")
    kept = [os.dup(number) for number in (0, 1)]
    with screen(columns) as (descriptor, pieces):
        try:
            for number in (0, 1):  # the size of a terminal is asked of the descriptor
                os.dup2(descriptor, number)
            with (
                open(descriptor, "w", encoding="utf-8", closefd=False) as out,
                patch.dict(os.environ, environment(TERM="xterm-256color", **more), clear=True),
                patch.multiple(sys, stdout=out, stderr=err),
            ):
                status = main(list(arguments))
        finally:
            for number, stream in enumerate(kept):
                os.dup2(stream, number)
                os.close(stream)
    err.flush()
    return Outcome(status, b"".join(pieces).decode().replace("\r\n", "\n"), err.buffer.getvalue().decode())


@contextmanager
def screen(columns: int = 80) -> Iterator[tuple[int, list[bytes]]]:
    """The descriptor of a terminal of that width, and what was written to it: whole when the block is left."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    pieces: list[bytes] = []

    def read() -> None:
        while not (pieces and pieces[-1].endswith(_END)):
            pieces.append(os.read(ours, 65536))
        pieces[-1] = pieces[-1].removesuffix(_END)

    reader = Thread(target=read)
    reader.start()
    try:
        yield theirs, pieces
    finally:
        os.write(theirs, _END)  # to close it would lose what is on its way
        reader.join()
        os.close(theirs)
        os.close(ours)
