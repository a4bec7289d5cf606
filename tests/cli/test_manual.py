"""The manual page: everything the commands say, current, the same everywhere, and clean roff."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from command_tree import all_commands, options_of

PAGE = Path(__file__).parent.parent.parent / "docs" / "man" / "kahanmaps.1"


@pytest.fixture(scope="module")
def page() -> str:
    """The page as text, with nothing of roff in it that is not a request at the beginning of a line."""
    return PAGE.read_text()


def test_the_page_in_the_repository_is_current(kahanmaps, page):
    assert kahanmaps("manual").out == page, "kahanmaps manual > docs/man/kahanmaps.1"


def test_the_page_does_not_depend_on_the_terminal(kahanmaps, monkeypatch, page):
    monkeypatch.setenv("COLUMNS", "40")
    assert kahanmaps("manual").out == page


def test_every_command_is_in_it(page):
    headings = [line.removeprefix(".SS ").replace("\\-", "-") for line in page.splitlines() if line.startswith(".SS ")]
    assert [words for words, _ in all_commands() if words and f"kahanmaps {words}" not in headings] == []


def test_every_option_is_in_the_section_of_its_command(page):
    sections = dict(part.split("\n", 1) for part in page.replace("\\-", "-").split(".SS ")[1:])
    missing = [
        (words, option.opts[0])
        for words, command in all_commands()
        for option in options_of(command)
        if words and not re.search(rf"^  .*{re.escape(option.opts[0])}\b", sections[f"kahanmaps {words}"], re.MULTILINE)
    ]
    assert missing == []


@pytest.mark.skipif(shutil.which("groff") is None, reason="no groff here")
def test_groff_has_nothing_to_complain_about(page):
    done = subprocess.run(
        ["groff", "-man", "-ww", "-Tutf8"], input=page.encode(), capture_output=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (0, b"")
