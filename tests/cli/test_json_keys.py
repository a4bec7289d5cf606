"""The keys of what commands print as JSON do not change by accident.

json_keys.txt has commands with the keys that each prints: `a.b` is b inside of a, `a[].b` is b inside of the entries
of a, `*` a name that comes from the input. After an intended change this writes the keys anew:

    python tests/cli/test_json_keys.py
"""

import io
import json
import shlex
import sys
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

from kahanmaps_cli.main import main

TABLE = Path(__file__).with_name("json_keys.txt")
LINES = [line.partition(" => ") for line in TABLE.read_text(encoding="utf-8").splitlines() if " => " in line]
# Objects whose keys are names of variables, parameters, integrals, options or reasons; the echo of a system file.
NAMED_BY_INPUT = {"parameters", "reasons", "options", "vectors", "counts", "failures", "integrals", "drift"}
ECHO = {"document", "other_document"}


def keys(value: Any, path: str = "") -> Iterator[str]:
    """The paths of all keys in a value."""
    if isinstance(value, dict):
        for key, entry in value.items():
            here = f"{path}.{'*' if path.rpartition('.')[2] in NAMED_BY_INPUT else key}".lstrip(".")
            yield here
            if key not in ECHO:
                yield from keys(entry, here)
    elif isinstance(value, list):
        for entry in value:
            yield from keys(entry, f"{path}[]")


def printed_keys(command: str, folder: Path) -> list[str]:
    """The keys of what a command prints, JSON lines included; {pair} is a member with m = 2, {here} a folder."""
    pair = folder / "pair.toml"
    if not pair.exists():
        main(["family", "new", "--eigenvalues", "1,-2", "--seed", "7", "-q", "-o", str(pair)])
    out = io.StringIO()
    with redirect_stdout(out), redirect_stderr(io.StringIO()):
        status = main(shlex.split(command.format(pair=pair, here=folder)))
    assert status in (0, 1, 3), command
    return sorted({key for line in out.getvalue().splitlines() for key in keys(json.loads(line))})


@pytest.mark.parametrize(("command", "_", "expected"), LINES, ids=[command for command, _, _ in LINES])
def test_json_has_the_keys_of_the_table(tmp_path, command, _, expected):
    assert printed_keys(command, tmp_path) == expected.split()


def test_a_key_that_is_added_or_left_out_is_seen():
    record = {"a": 1, "b": [{"c": 2}], "parameters": {"g": "1"}, "document": {"name": "x"}}
    assert list(keys(record)) == ["a", "b", "b[].c", "parameters", "parameters.*", "document"]
    assert list(keys({**record, "b": [{"d": 2}]})) != list(keys(record))


if __name__ == "__main__":
    text = TABLE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        for command, _, expected in LINES:
            text = text.replace(
                f"{command} => {expected}\n", f"{command} => {' '.join(printed_keys(command, Path(name)))}\n"
            )
            print(command, file=sys.stderr)
    TABLE.write_text(text, encoding="utf-8")
