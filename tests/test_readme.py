"""What README and docs show is what happens: their console sessions are run and compared, their Python sessions too."""

from __future__ import annotations

import doctest
import re
import shlex
from pathlib import Path

import pytest

from kahanmaps_cli.main import main

ROOT = Path(__file__).parent.parent
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
FLAGS = doctest.ELLIPSIS


def sessions(page: Path) -> list[tuple[str, str]]:
    """Commands and expected output of the ```console blocks of a page, in order."""
    found = []
    for block in re.findall(r"```console\n(.*?)```", page.read_text(), re.DOTALL):
        for piece in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, output = piece.partition("\n")
            found.append((command, output))
    return found


@pytest.mark.parametrize("page", [page for page in PAGES if sessions(page)], ids=lambda page: page.name)
def test_console_sessions_print_what_the_page_shows(page, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    checker = doctest.OutputChecker()
    for command, expected in sessions(page):
        words = shlex.split(command)
        assert words[0] == "kahanmaps", command
        main(words[1:])
        out, err = capfd.readouterr()
        assert checker.check_output(expected, err + out, FLAGS), f"$ {command}\n{err + out}"


@pytest.mark.parametrize("page", [page for page in PAGES if ">>> " in page.read_text()], ids=lambda page: page.name)
def test_python_sessions_print_what_the_page_shows(page):
    outcome = doctest.testfile(str(page), module_relative=False, optionflags=FLAGS)
    assert outcome.attempted > 0
    assert outcome.failed == 0


def test_a_session_that_shows_something_else_would_be_noticed(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```console\n$ kahanmaps --version\nkahanmaps 999\n```\n")
    ((command, expected),) = sessions(page)
    assert command == "kahanmaps --version"
    assert not doctest.OutputChecker().check_output(expected, "kahanmaps 0.1.0\n", FLAGS)
