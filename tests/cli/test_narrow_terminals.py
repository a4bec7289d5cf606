"""On a terminal lines are broken at words, whatever its width; in a pipe they stay whole."""

import re
import shlex

import pytest
from cli_helpers import terminal
from command_tree import LEAST

from kahanmaps_cli.screen.terminal import wrapped


def shown(command: str, columns: int) -> list[str]:
    """The lines on a terminal of that width."""
    out = terminal(*shlex.split(command), columns=columns).out
    return re.sub(r"\x1b\[[0-9;]*m", "", out).splitlines()


# What they print is no text for people but for programs, or pictures.
FOR_PROGRAMS = (
    "batch export",
    "batch run",
    "plot",
    "report",
    "convert",
    "completion",
    "family new",
    "family tensor",
)


@pytest.mark.slow
@pytest.mark.usefixtures("least_folder")
@pytest.mark.parametrize("words", [words for words in LEAST if not words.startswith(FOR_PROGRAMS)])
def test_no_line_is_longer_than_the_terminal(words):
    assert [line for line in shown(f"{words} {LEAST[words]}", 60) if len(line) > 60] == []


def test_a_number_in_a_table_is_never_broken():
    command = "lyapunov lorenz --eps 1/100 --random 2 --steps 100"
    wide = shown(command, 120)
    numbers = [word for line in wide for word in line.split() if re.fullmatch(r"-?\d\.\d{4,}", word)]
    narrow = " ".join(shown(command, 50)).split()
    assert len(numbers) > 6
    assert [number for number in numbers if number not in narrow] == []
    assert max(map(len, shown(command, 40))) <= 40


def test_a_point_of_many_coordinates_takes_a_line_for_each():
    lines = shown("orbit paper_m3 --start 1,2,3,4,5,6 --eps 1/10 --steps 1", 50)
    assert "step 0" in lines
    assert "  x6 = 6" in lines


def test_the_report_of_analyze_has_headings_and_coloured_verdicts():
    out = terminal("analyze", "--vars", "x,y", "--rhs", "y", "--rhs=-x", columns=60).out
    assert "\n\x1b[1mintegrals\x1b[0m\n" in out
    assert "\x1b[32mproved\x1b[0m" in out


def talk_to_forty_columns(monkeypatch):
    """Make standard error a terminal; in the test itself, for pytest puts another one there after its fixtures."""
    monkeypatch.setattr("kahanmaps_cli.screen.progress._width", lambda: 40)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)


def test_an_error_is_broken_at_words(kahanmaps, monkeypatch):
    talk_to_forty_columns(monkeypatch)
    lines = kahanmaps("analyze").err.splitlines()
    assert max(map(len, lines)) <= 40
    assert " ".join(" ".join(lines).split()).endswith("or equations: \"x' = x*y; y' = -x^2\"")


# The lines themselves


def test_a_formula_is_broken_before_a_sign():
    assert wrapped("x^2 + y^2 - 2*x*y + 17", 12) == ["x^2 + y^2", "- 2*x*y + 17"]


def test_the_sign_of_a_number_is_no_place_to_break():
    assert wrapped("aaaa -5 + bbbb", 8) == ["aaaa -5", "+ bbbb"]


def test_lines_hang_below_the_text_and_not_below_the_label():
    assert wrapped("one two three", 12, "label  ", "       ") == ["label  one", "       two", "       three"]


def test_a_number_longer_than_a_line_is_shortened_and_its_length_told():
    (*_, last) = lines = wrapped("1" * 100, 40)
    assert lines[0].startswith("1" * 11 + "...")
    assert last.endswith("(100 chars)")


def test_a_long_product_is_folded_after_its_signs():
    assert wrapped("aaaa*bbbb*cccc*dddd", 10) == ["aaaa*bbbb*", "cccc*dddd"]


def test_a_word_without_a_sign_is_folded_where_the_line_ends():
    assert "".join(wrapped("x" * 100, 30)) == "x" * 100
