"""Colours: where they go, who decides, and that they are readable and never alone."""

import re
from pathlib import Path

import pytest
from cli_helpers import terminal

import kahanmaps_cli

ESCAPE = "\x1b["
CHECK = "check-integrals euler_top --integral x1 --integral known"
GREEN, RED = "\x1b[32m", "\x1b[31m"


@pytest.fixture(autouse=True)
def no_wishes(monkeypatch):
    for name in ("NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize("command", ["systems", CHECK, "degrees weierstrass"])
def test_always_gives_them_to_a_pipe_and_changes_nothing_else(kahanmaps, command):
    coloured = kahanmaps("--color always", command).out
    assert ESCAPE in coloured
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured) == kahanmaps(command).out


def test_the_option_may_stand_before_the_command_and_after_it(kahanmaps):
    assert kahanmaps("--color always", CHECK) == kahanmaps(CHECK, "--color always")


def test_no_colour_is_stronger_than_force_and_the_option_stronger_than_both(kahanmaps, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert ESCAPE not in kahanmaps("systems").out
    assert ESCAPE in kahanmaps("--color always systems").out


def test_a_terminal_gets_colours():
    out = terminal(*CHECK.split()).out
    assert GREEN in out
    assert RED in out


@pytest.mark.parametrize("style", ["yellow", "blue", "bright_", "dim", "white", "black"])
def test_no_colour_is_used_that_one_ground_swallows(style):
    folder = Path(kahanmaps_cli.__file__).parent
    own = [*folder.glob("*.py"), *(folder / "commands").glob("*.py")]
    named = re.compile(rf"""(style|fg|COLOURS)[^\n]*["'](bold )?{style}""")
    assert [path.name for path in own if named.search(path.read_text())] == []
