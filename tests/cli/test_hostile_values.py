"""Hostile values of every option and argument: a sentence and an exit status, whatever was written.

The options are found from the commands themselves, so that a new one is covered by itself. No outcome is an internal
error, none is a traceback, and no line repeats a long text.
"""

import re
import shlex
from pathlib import Path

import click
import pytest
from command_tree import LEAST, all_commands

from kahanmaps_cli.main import main

LEAVES = {words: command for words, command in all_commands() if not isinstance(command, click.Group)}

# What is tried, by the type of a parameter.
VALUES = dict.fromkeys(("ShortInteger", "IntRange", "Whole"), ("9" * 400, "x" * 200_000))
VALUES |= dict.fromkeys(("FloatParamType", "FloatRange", "Seconds"), ("nan", "1e400"))
PATHS = ["\udcff.{end}", "a\0b.{end}", "loop.{end}"]  # with the ending of the files that a command knows
ENDINGS = {"output": "png", "starts": "npy", "record": "json"}
ENDINGS |= dict.fromkeys(("db", "database", "sources", "target"), "db")
TAKE_A_PATH = {"system", "other", "systems", "output", "db", "record", "name"}  # some take names as well
TAKE_THEIR_TIME = ("plot", "report", "analyze", "verify")  # of these only what ends before they begin


def hostile_lines(words):
    """The least line of a command with each of the values in the place of what it has."""
    takes_time = words.split()[0] in TAKE_THEIR_TIME
    for parameter in LEAVES[words].params:
        kind, name, least = type(parameter.type).__name__, str(parameter.name), shlex.split(LEAST[words])
        values = [] if takes_time and name == "seed" else list(VALUES.get(kind, ()))
        if kind == "Path" or name in TAKE_A_PATH:
            values += [path.replace("{end}", ENDINGS.get(name, "toml")) for path in PATHS[takes_time:]]
        if isinstance(parameter, click.Option):
            given = next((k for k, word in enumerate(least) if word in parameter.opts), len(least))
            del least[given : given + 2]
            option = parameter.opts[-1]
            ends = ([f"{option}={value}"] if option.startswith("--") else [option, value] for value in values)
        else:
            del least[: int(bool(least) and not least[0].startswith("-"))]
            ends = (["--", value] for value in values)
        yield from ([*words.split(), *least, *end] for end in ends)


@pytest.fixture
def _folder(least_folder: Path) -> None:
    """Where the commands run: small files, and symbolic links that lead round in a circle."""
    for end in {"toml", *ENDINGS.values()}:
        Path(f"loop.{end}").symlink_to(f"loop.{end}")
        Path(f"folder.{end}").mkdir()


def test_every_command_has_its_least_line():
    assert set(LEAST) == set(LEAVES)


@pytest.mark.usefixtures("_folder")
@pytest.mark.parametrize("words", list(LEAST))
def test_numbers_and_paths_that_nobody_means_are_refused_in_a_sentence(words, capsys):
    for line in hostile_lines(words):
        status = main(line)
        out, err = capsys.readouterr()
        said = f"{[word[:40] for word in line]}: {status}, {err[:300]}"
        assert status in (0, 1, 2, 3), said
        assert "Traceback" not in out + err, said
        assert max(map(len, err.split("\n"))) <= 1000, said
        assert err or status != 2, said


LONG_EPS = "9" * 10_100


@pytest.mark.parametrize(
    "line",
    [
        "orbit paper_m3 --start 1,2,3,4,5,6 --steps 1 --eps EPS",
        "orbit harmonic --start 1,EPS --steps 1 --eps 1/10",
        "check-measure lotka_volterra --start EPS,1",
    ],
)
def test_numbers_longer_than_anybody_means_are_refused_before_the_first_step(kahanmaps, line):
    outcome = kahanmaps(line.replace("EPS", LONG_EPS))
    assert outcome.status == 2
    assert re.search("found numbers of about 101.. digits for (eps|start), expected at most 10000", outcome.err)
