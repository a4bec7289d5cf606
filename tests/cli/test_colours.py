"""Colours: where they go, who decides, and that they are readable and never alone."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from cli_helpers import COMMAND, environment, screen, shell, terminal

import kahanmaps_cli
from kahanmaps_cli.terminal import COLOURS

ESCAPE = "\x1b["
CHECK = "check-integrals euler_top --integral x1"
GREEN, RED = "\x1b[32m", "\x1b[31m"


@pytest.fixture(autouse=True)
def no_wishes(monkeypatch):
    for name in ("NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize("command", ["systems", CHECK, "degrees weierstrass"])
def test_a_pipe_gets_no_colours(kahanmaps, command):
    assert ESCAPE not in kahanmaps(command).out


@pytest.mark.parametrize("command", ["systems", CHECK, "degrees weierstrass"])
def test_always_gives_them_to_a_pipe_and_changes_nothing_else(kahanmaps, command):
    coloured = kahanmaps("--color always", command).out
    assert ESCAPE in coloured
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured) == kahanmaps(command).out


def test_the_option_may_stand_before_the_command_and_after_it(kahanmaps):
    assert kahanmaps("--color always", CHECK) == kahanmaps(CHECK, "--color always")


def test_the_option_after_the_command_has_the_last_word(kahanmaps):
    assert kahanmaps("--color always", CHECK, "--color never") == kahanmaps(CHECK)


def test_a_choice_is_forgotten_with_the_command(kahanmaps):
    kahanmaps("--color always systems")
    assert ESCAPE not in kahanmaps("systems").out


@pytest.mark.parametrize("name", ["FORCE_COLOR", "CLICOLOR_FORCE"])
def test_the_environment_can_ask_for_colours(kahanmaps, monkeypatch, name):
    monkeypatch.setenv(name, "1")
    assert ESCAPE in kahanmaps("systems").out
    monkeypatch.setenv(name, "0")
    assert ESCAPE not in kahanmaps("systems").out


def test_no_colour_is_stronger_than_force_and_the_option_stronger_than_both(kahanmaps, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert ESCAPE not in kahanmaps("systems").out
    assert ESCAPE in kahanmaps("--color always systems").out


def test_always_is_seen_behind_a_pipe(tmp_path):
    assert ESCAPE in shell("kahanmaps --color always systems | cat", tmp_path).out


@pytest.mark.parametrize(
    ("words", "more"),
    [(["--color", "never"], {}), ([], {"NO_COLOR": "1"})],
    ids=["option", "environment"],
)
def test_a_terminal_can_be_without_any_escape_sequence(words, more):
    assert ESCAPE not in terminal(*words, *CHECK.split(), **more).out


def test_a_terminal_gets_colours():
    out = terminal(*CHECK.split()).out
    assert GREEN in out
    assert RED in out


def test_a_process_of_its_own_says_to_a_terminal_what_the_tests_of_terminals_see():
    env = environment(TERM="xterm-256color", COLUMNS="80")
    words = [*COMMAND, "check-integrals", "euler_top"]
    with screen() as (descriptor, pieces):
        process = subprocess.run(words, stdin=descriptor, stdout=descriptor, stderr=subprocess.PIPE, env=env)
    said = b"".join(pieces).decode().replace("\r\n", "\n")
    assert process.stderr == b""
    assert (process.returncode, said) == (0, terminal("check-integrals", "euler_top").out)
    assert GREEN in said


def test_a_dumb_terminal_gets_none(kahanmaps, monkeypatch):
    monkeypatch.setattr("kahanmaps_cli.terminal.on_terminal", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    assert ESCAPE in kahanmaps("systems").out
    monkeypatch.setenv("TERM", "dumb")
    assert ESCAPE not in kahanmaps("systems").out


def test_json_is_never_coloured(kahanmaps):
    assert ESCAPE not in kahanmaps("--color always", CHECK, "--json").out


def test_verdicts_are_words_in_every_colour(kahanmaps):
    assert set(COLOURS) == {"proved", "supported", "refuted", "undecided"}
    out = kahanmaps("--color always", CHECK).out
    assert f"{GREEN}proved\x1b[0m\t" in out
    assert f"{RED}refuted\x1b[0m\t" in out


@pytest.mark.parametrize("style", ["yellow", "blue", "bright_", "dim", "white", "black"])
def test_no_colour_is_used_that_one_ground_swallows(style):
    folder = Path(kahanmaps_cli.__file__).parent
    own = [*folder.glob("*.py"), *(folder / "commands").glob("*.py")]
    named = re.compile(rf"""(style|fg|COLOURS)[^\n]*["'](bold )?{style}""")
    assert [path.name for path in own if named.search(path.read_text())] == []
