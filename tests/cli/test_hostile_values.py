"""Hostile values of every option and argument: a sentence and an exit status, whatever was written.

The options are found from the commands themselves, so that a new one is covered by itself; `VALUES` has what is tried
for each kind of them. No outcome is an internal error, none is a traceback, and no line repeats a long text.
"""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from command_tree import LEAST, all_commands

from kahanmaps_cli.main import main

LEAVES = [(words, command) for words, command in all_commands() if not isinstance(command, click.Group)]
STATUSES = (0, 1, 2, 3)
LONGEST_LINE = 1000

# What is tried, by the kind of a value; {end} is the ending of the files that a command knows.
LONG = "x" * 200_000
VALUES = {
    "integer": ["9" * 400, LONG],
    "number of machine": ["nan", "1e400"],
    "path": ["\udcff.{end}", "a\0b.{end}", "loop.{end}"],
}
TAKE_THEIR_TIME = ("plot", "report", "analyze", "verify")
ENDINGS = {"output": "png", "starts": "npy", "record": "json"}
ENDINGS |= dict.fromkeys(("db", "database", "sources", "target"), "db")
PATHS = {"system", "other", "systems", "output", "db", "record", "name"}  # some are names as well
KINDS = {
    "integer": ("ShortInteger", "IntRange", "Whole"),
    "number of machine": ("FloatParamType", "FloatRange", "Seconds"),
    "path": ("Path",),
}


def kinds_of(parameter: click.Parameter) -> Iterator[str]:
    """The kinds of values that a parameter is tried with."""
    of_its_type = [kind for kind, types in KINDS.items() if type(parameter.type).__name__ in types]
    yield from of_its_type
    if parameter.name in PATHS and "path" not in of_its_type:
        yield "path"
    if not of_its_type:
        yield "text"


def line_with(words: str, parameter: click.Parameter, value: str) -> list[str]:
    """The least line of a command with this value in the place of what it has."""
    value = value.replace("{end}", ENDINGS.get(str(parameter.name), "toml"))
    least = shlex.split(LEAST[words])
    if isinstance(parameter, click.Option):
        for k, word in enumerate(least):
            if word in parameter.opts:
                del least[k : k + 2]
                break
        name = parameter.opts[-1]
        return [*words.split(), *least, *([f"{name}={value}"] if name.startswith("--") else [name, value])]
    if least and not least[0].startswith("-"):
        del least[0]
    return [*words.split(), *least, "--", value]


def cases(values: dict[str, list[str]]) -> list[tuple[str, str]]:
    """Commands and their parameters by name."""
    return [
        (words, str(parameter.name))
        for words, command in LEAVES
        for parameter in command.params
        if "--color" not in parameter.opts and not getattr(parameter, "is_flag", False)
        if any(kind in values for kind in kinds_of(parameter))
    ]


def mistakes_of(words: str, name: str, values: dict[str, list[str]], capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What a command should not have done with these values of one parameter."""
    parameter = next(p for p in dict(LEAVES)[words].params if p.name == name)
    results = []
    for kind in kinds_of(parameter):
        for value in values.get(kind, ()):
            line = line_with(words, parameter, value)
            status = main(line)
            out, err = capsys.readouterr()
            longest = max(map(len, err.split("\n")))
            if (
                status not in STATUSES
                or "Traceback" in out + err
                or longest > LONGEST_LINE
                or (status == 2 and not err)
            ):
                results.append(f"{[word[:40] for word in line]}: {status}, {longest}: {err[:300]}")
    return results


@pytest.fixture
def _folder(least_folder: Path) -> None:
    """Where the commands run: small files, and symbolic links that lead round in a circle."""
    for end in {"toml", *ENDINGS.values()}:
        Path(f"loop.{end}").symlink_to(f"loop.{end}")
        Path(f"folder.{end}").mkdir()


def test_every_command_has_its_least_line():
    assert set(LEAST) == {words for words, _ in LEAVES}


@pytest.mark.usefixtures("_folder")
@pytest.mark.parametrize("words", list(LEAST))
def test_numbers_and_paths_that_nobody_means_are_refused_in_a_sentence(words, capsys):
    # Of the commands that take their time, only what ends before they begin.
    values = {**VALUES, "path": VALUES["path"][1:]} if words.split()[0] in TAKE_THEIR_TIME else VALUES
    names = [name for w, name in cases(VALUES) if w == words and (values is VALUES or name != "seed")]
    assert [line for name in names for line in mistakes_of(words, name, values, capsys)] == []


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
