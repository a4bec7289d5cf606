"""The list of names that commands take from the library: each is there, and used, and nothing is left in it."""

import re
from pathlib import Path

import kahanmaps_cli
from kahanmaps import internals

FOLDER = Path(kahanmaps_cli.__file__).parent


def test_each_name_is_one_of_the_library_and_is_used():
    used = re.findall(r"(?<![\w.])lib\.(\w+)", "\n".join(path.read_text() for path in FOLDER.rglob("*.py")))
    assert sorted(internals.__all__) == sorted(set(used))
    assert [name for name in used if getattr(internals, name) is None] == []
