"""Wrong use of every command: status 2, a sentence on standard error, nothing on standard output, and no file made.

The table is tests/cli/wrong_use.txt: a command, and behind ` => ` words of what is said; behind ` => not: ` words that
are not said. Behind ` <= ` stands what is in the file that the command names, with \\n for a new line. What lists the
checks is made of their table.
"""

from pathlib import Path

import pytest
from cli_helpers import with_its_file
from helpers import table, together

from kahanmaps.checks.table import CHECKS

TABLE = table(Path(__file__).with_name("wrong_use.txt"))
TABLE["checks are listed"] = [f"check euler_top => Did you mean {' or '.join(CHECKS)}?"]


@pytest.mark.parametrize("lines", TABLE.values(), ids=TABLE.keys())
def test_wrong_use_gives_2_and_says_what_was_found_and_expected(kahanmaps, tmp_path, monkeypatch, lines):
    @together("line", lines)
    def each(line):
        command, *expected = line.split(" => ")
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        folder.mkdir()
        monkeypatch.chdir(folder)
        outcome = kahanmaps(with_its_file(command))
        assert (outcome.status, outcome.out, len(list(folder.iterdir()))) == (2, "", " <= " in command)
        said = " ".join(outcome.err.split())
        for words in expected:
            assert (words.removeprefix("not: ") in said) is not words.startswith("not: ")
        assert "Traceback" not in outcome.err

    each()
