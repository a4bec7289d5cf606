"""docs/surprises.md: the commands of each row print what the row quotes."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from kahanmaps_cli.main import main

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "surprises.md"
SLOW = ("henon_heiles", "Painlevé", "eighth degree", "Lotka", "1/7")  # words of rows that take seconds


def rows(text: str) -> list[tuple[str, list[str], list[str]]]:
    """The text of each row of the table, its commands, and the parts of their output."""
    results = []
    for line in re.findall(r"^\| .* \|$", text, re.MULTILINE)[1:]:
        *words, commands, quoted = line.strip("| ").split(" | ")
        results.append((" ".join(words), *(re.findall("`(.*?)`", cell) for cell in (commands, quoted))))
    return results


def missing(commands: list[str], quoted: list[str], output_of) -> list[str]:
    """What the output of the commands does not have, read in order; white space counts as one space."""
    rest = " ".join("\n".join(map(output_of, commands)).split())
    results = []
    for part in quoted:
        _, found, after = rest.partition(part)
        if found:
            rest = after
        else:
            results.append(part)
    return results


ROWS = rows(PAGE.read_text(encoding="utf-8"))
CASES = [
    pytest.param(
        commands, quoted, id=text[:40], marks=[pytest.mark.slow] * any(word in f"{text}{commands}" for word in SLOW)
    )
    for text, commands, quoted in ROWS
]


@pytest.fixture
def output_of(monkeypatch, capfd):
    """Run a command of the page, and return what it prints."""
    monkeypatch.chdir(ROOT)

    def run(command: str) -> str:
        program, *words = shlex.split(command)
        if program == "python":
            return subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True).stdout
        assert program == "kahanmaps"
        main(words)
        return capfd.readouterr().out

    return run


@pytest.mark.parametrize(("commands", "quoted"), CASES)
def test_the_commands_of_a_row_print_what_it_quotes(commands, quoted, output_of):
    assert missing(commands, quoted, output_of) == []


def test_a_wrong_quotation_is_noticed(output_of):
    commands = ["kahanmaps degrees euler_top --terms 3"]
    assert missing(commands, ["1, 3, 9, 19", "1, 3, 9"], output_of) == ["1, 3, 9"]
    assert missing(commands, ["1, 3, 9, 20"], output_of) == ["1, 3, 9, 20"]
