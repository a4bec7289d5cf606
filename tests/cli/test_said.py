"""What commands say: their exit status, words of it, and that what is to be JSON is.

The table is tests/cli/said.txt: a command, behind a number where it does not end with 0, and behind each ` => ` words
of standard output or standard error, blanks for tabs and line breaks; behind ` => not: ` words that are in neither.
Behind ` <= ` stands what is in the file that the command names, with \\n for a new line.
"""

import re
from pathlib import Path

import pytest
from cli_helpers import with_its_file
from helpers import table

TABLE = table(Path(__file__).with_name("said.txt"))
CASES = [(section, *line.split(" => ")) for section, lines in TABLE.items() for line in lines]


@pytest.mark.parametrize("case", CASES, ids=[command[:90] for _, command, *_ in CASES])
def test_a_command_says_what_it_found(kahanmaps, pair, tmp_path, monkeypatch, request, case):
    section, command, *expected = case
    if section.startswith("plot"):
        request.getfixturevalue("unrendered")
    monkeypatch.chdir(tmp_path)
    status, words = re.fullmatch(r"(?:([0-9]+) )?(.*)", command).groups()
    outcome = kahanmaps(with_its_file(words).replace("{pair}", str(pair)))
    assert outcome.status == int(status or 0), outcome.err
    said = " ".join(f"{outcome.out} {outcome.err}".split())
    missing = [entry for entry in expected if not entry.startswith("not: ") and entry not in said]
    wrongly = [entry for entry in expected if entry.startswith("not: ") and entry.removeprefix("not: ") in said]
    assert (missing, wrongly) == ([], []), said
    assert "Traceback" not in said
    if "jsonl" in words or (" --json" in words and not words.startswith("orbit")):  # whose --json is one object
        assert outcome.records
    assert all(Path(name).exists() for name in re.findall(r" -o (\S+)", words))
