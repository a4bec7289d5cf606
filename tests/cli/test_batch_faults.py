"""Faults while a batch is written, merged and exported: a status that says so, nothing lost, and the same end at last.

A command runs in a process of its own, in which the N-th call of a kind fails, or which may not write large files. The
kinds are statements of SQLite and what Python asks of the system: to open a file for writing, to rename, remove, lock.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from cli_helpers import Outcome, environment

SPEC = """
[experiments.space]
task = "family-space"
system = "family"
axes = { m = "2..3", seed = "0..3" }
[experiments.orbit]
task = "orbit"
system = "euler_top"
options = { eps = "1/10", start = "1,2,3", steps = 4 }
"""

# Arguments: the kind of call, which one is to fail (0: none), where their number is written, and the command.
RUNNER = """
import errno, os, resource, sqlite3, sys

kind, failing, counted, *arguments = sys.argv[1:]
calls = 0

def count():
    global calls
    calls += 1
    return calls == int(failing)

class Connection(sqlite3.Connection):
    def execute(self, sql, *more):
        if kind == "statement" and count():
            error = sqlite3.OperationalError("disk I/O error")
            error.sqlite_errorcode = sqlite3.SQLITE_IOERR
            raise error
        return super().execute(sql, *more)

def hook(event, values):
    is_opened = event == "open" and isinstance(values[2], int) and values[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
    if is_opened and str(values[0]).endswith((".pyc", "null")) or values and values[0] == counted:
        return
    if is_opened or event in ("os.rename", "os.remove", "os.truncate", "fcntl.flock"):
        if count():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

from kahanmaps_cli.main import main
connect = sqlite3.connect
sqlite3.connect = lambda *values, **named: connect(*values, factory=Connection, **named)
if kind == "size" and int(failing):
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(failing), resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
if kind == "call":
    sys.addaudithook(hook)
status = main(arguments)
sys.stdout.flush()
if kind == "size":
    calls = max((entry.stat().st_size for entry in os.scandir()), default=0)
if not int(failing):
    with open(counted, "w") as file:
        file.write(str(calls))
os._exit(status)
"""

Run = Callable[..., Outcome]


def disturbed(kind: str, failing: int, command: str) -> tuple[int, str]:
    """The status of a command with one fault, and what it said."""
    arguments = [sys.executable, "-c", RUNNER, kind, str(failing), "../calls", *command.split()]
    done = subprocess.run(arguments, capture_output=True, text=True, env=environment(), timeout=120)
    return done.returncode, done.stderr


def export_of(kahanmaps: Run, db: str) -> Outcome:
    return kahanmaps(f"batch export --jsonl --stable --db {db}")


@pytest.fixture
def folder(kahanmaps: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that is made anew for each fault, beside two shards to be merged and the whole."""
    (tmp_path / "spec.toml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    for part in (1, 2):
        assert kahanmaps(f"batch run spec.toml -q -j 1 --shard {part}/2 --db part{part}.db").status in (0, 3)
    assert kahanmaps("batch merge whole.db part1.db part2.db").status == 0
    return tmp_path


COMMANDS = {
    "run": "batch run ../spec.toml -q -j 1 --db new.db",
    "merge": "batch merge -q new.db ../part1.db ../part2.db",
    "csv": "batch export --csv --stable --db ../whole.db -o new.csv",
    "jsonl": "batch export --jsonl --stable --db ../whole.db -o new.jsonl",
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["statement", "call", "size"])
@pytest.mark.parametrize("name", COMMANDS)
def test_after_any_fault_the_same_command_comes_to_the_same_end(
    kahanmaps: Run, folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, kind: str
):
    def begin(number: int) -> None:
        new = folder / f"{kind}{number}"
        new.mkdir()
        monkeypatch.chdir(new)

    def result() -> object:
        if name in ("csv", "jsonl"):
            return Path(f"new.{name}").read_bytes()
        return export_of(kahanmaps, "new.db")

    begin(0)
    assert disturbed(kind, 0, COMMANDS[name])[0] == 0
    expected, files, calls = result(), sorted(os.listdir()), int((folder / "calls").read_text())
    assert calls >= 3
    wrong = []
    for number in sorted({1 + (calls - 1) * k // 11 for k in range(12)}):
        begin(number)
        status, said = disturbed(kind, number, COMMANDS[name])
        is_told = status == 3 and said.startswith("Error: ") and "\n" not in said.rstrip("\n")
        if not is_told and (status != 0 or result() != expected):
            wrong.append((number, status, said))
        again = kahanmaps(COMMANDS[name])
        if again.status != 0 or result() != expected or sorted(os.listdir()) != files:
            wrong.append((number, again, os.listdir()))
        if name in ("run", "merge") and kahanmaps("batch check --db new.db").status != 0:
            wrong.append((number, "is damaged"))
    assert wrong == []
