"""Files of commands: none is written over that is read, or half written, or an internal error where it is damaged."""

import io
import json
import os
import random
import shlex
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest
from cli_helpers import COMMAND
from helpers import table
from small_databases import ok, planned

from kahanmaps.errors import InputError
from kahanmaps.plots.growth import curves_of_record, degrees_of_record
from kahanmaps_cli.main import main
from kahanmaps_cli.pictures.growth import read_record
from kahanmaps_cli.runs.ensemble_starts import read_starts

# Commands with -o: the ending of their files, and a line for each way to hand them a file, by the option or argument.
READS = {
    heading.split(" => ")[0]: (heading.split(" => ")[1], dict(line.split(" => ") for line in lines))
    for heading, lines in table(Path(__file__).with_name("reads.txt")).items()
}
# Made before each test: what is in the file, by the name of what takes it.
CONTENT = {"starts": "starts.npy", "record": "heights.json", "records": "degrees.json"}
CONTENT |= dict.fromkeys(("db", "database"), "study.db")
CASES = [(words, name) for words, (_, lines) in READS.items() for name in lines]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of every kind that a command reads."""
    folder = tmp_path_factory.mktemp("made")
    planned(folder / "study.db", 1, records=[ok(1)])
    np.save(folder / "starts.npy", np.ones((1, 2)))
    for name, line in {
        "system.toml": "systems harmonic --toml",
        "member.toml": "systems paper_m2 --toml",
        "heights.json": "heights harmonic --steps 3 --json -q",
        "degrees.json": "degrees harmonic --terms 3 --json -q",
    }.items():
        with redirect_stdout(io.StringIO()) as out:
            assert main(shlex.split(line)) in (0, 3)
        (folder / name).write_text(out.getvalue())
    return folder


@pytest.fixture
def given(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that commands run in, with copies of these files."""
    monkeypatch.chdir(tmp_path)
    for path in made.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


@pytest.mark.parametrize(
    ("words", "name", "way"),
    [*((*case, "the same") for case in CASES), *((*CASES[0], way) for way in ("hard link", "symbolic link"))],
)
def test_no_file_is_written_over_that_is_read(kahanmaps, given, words, name, way):
    ending, lines = READS[words]
    source = Path("in" + ending)
    taken = CONTENT.get(name, "member.toml" if words == "plot invariant-curves" else "system.toml")
    source.write_bytes(Path(taken).read_bytes())
    before = source.read_bytes()
    target = Path("./in" + ending) if way == "the same" else Path("out" + ending)
    if way == "hard link":
        target.hardlink_to(source)
    elif way == "symbolic link":
        target.symlink_to(source)
    outcome = kahanmaps(lines[name].replace("IN", str(source)), "-o", target)
    assert (outcome.status, outcome.out, source.read_bytes()) == (2, "", before)
    assert "would be overwritten" in outcome.err


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_an_npz_file_is_the_old_one_or_the_new_one_whatever_ends_the_orbit(tmp_path, number):
    target = tmp_path / "orbit.npz"
    target.write_bytes(b"before")
    words = f"orbit harmonic --start 1,2 --eps 1/10 --steps {10**12} --arithmetic mod:10007 --every 100 -q -o {target}"
    process = subprocess.Popen([*COMMAND, *shlex.split(words)])
    try:
        while len(list(tmp_path.iterdir())) == 1:  # the new one, beside it
            time.sleep(0.01)
        time.sleep(0.1)
        process.send_signal(number)
        process.wait(60)
    finally:
        process.kill()  # it would go on for days
    if number == signal.SIGKILL:
        assert target.read_bytes() == b"before"
    else:
        assert list(tmp_path.iterdir()) == [target]
        assert json.loads(str(np.load(target)["meta"]))["end"]["status"] == "interrupted"


READERS = {
    "starts.npy": lambda path: read_starts(path, ["x", "y"]),
    "heights.json": lambda path: curves_of_record(read_record(path), path),
    "degrees.json": lambda path: degrees_of_record(read_record(path), path),
}


def damages(content: bytes, count: int) -> Iterator[bytes]:
    """The content cut off, with bits turned, bytes left out and others put in."""
    drawn = random.Random(1)
    for _ in range(count):
        at = drawn.randrange(len(content))
        yield content[:at]
        yield content[:at] + bytes([content[at] ^ 1 << drawn.randrange(8)]) + content[at + 1 :]
        yield content[:at] + content[at + drawn.randrange(1, 40) :]
        yield content[:at] + drawn.choice([b"{", b'"', b"(", b"9" * 400, b"NaN", b"\0" * 9, b"\xff"]) + content[at:]


@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_refused_with_its_name(made, tmp_path, name):
    content = (made / name).read_bytes()
    path = tmp_path / name
    for damaged in damages(content, 12):
        path.write_bytes(damaged)
        try:
            READERS[name](str(path))
        except InputError as error:
            assert str(path) in str(error)  # noqa: PT017


@pytest.mark.parametrize(
    ("line", "status"),
    [
        ("check-integrals euler_top --integral x1", 1),
        ("orbit --vars x --rhs x^2 --start 1 --eps 1/2 --steps 2", 3),
        ("find-density lorenz --effort -20", 3),
        ("heights harmonic --effort -20", 3),
        ("degrees lorenz --effort -20", 3),
        ("batch run FAILS --jsonl -q", 3),
        ("batch export --db DB --jsonl", 0),
        ("convert harmonic --to latex", 0),
        ("--help", 0),
        ("orbit --help", 0),
        ("nonsense", 2),
    ],
)
def test_a_reader_that_has_left_changes_no_exit_status(kahanmaps, monkeypatch, least_folder, line, status):
    Path("FAILS").write_text('[experiments.a]\ntask = "check-integrals"\nsystem = "lorenz"\n')
    assert kahanmaps(line).status == status
    ours, theirs = os.pipe()
    os.close(ours)
    with open(theirs, "w") as pipe:  # which nobody reads any longer
        monkeypatch.setattr("sys.stdout", pipe)
        assert main(shlex.split(line)) == status
