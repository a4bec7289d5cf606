"""Wrong use of every command: status 2, a sentence on standard error, nothing on standard output, and no file made.

The table is tests/cli/wrong_use.txt: a command, and behind ` => ` words of what is said. What
lists the checks is made of their table.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers import table

from kahanmaps.checks.table import CHECKS

TABLE = table(Path(__file__).with_name("wrong_use.txt"))
CASES = [tuple(line.split(" => ", 1)) for lines in TABLE.values() for line in lines]
CASES.append(("check euler_top", f"Did you mean {' or '.join(CHECKS)}?"))


@pytest.mark.parametrize(("command", "words"), CASES, ids=[command[:70] for command, _ in CASES])
def test_wrong_use_gives_2_and_says_what_was_found_and_expected(kahanmaps, tmp_path, monkeypatch, command, words):
    monkeypatch.chdir(tmp_path)
    outcome = kahanmaps(command)
    assert (outcome.status, outcome.out, list(tmp_path.iterdir())) == (2, "", [])
    assert words in " ".join(outcome.err.split())
    assert "Traceback" not in outcome.err
