"""The list of names that commands take from the library: each is there, and used, and nothing is left in it."""

import re
from pathlib import Path

import pytest

import kahanmaps_cli
from kahanmaps_cli import library

FOLDER = Path(kahanmaps_cli.__file__).parent
NAMES = re.findall(r"^from \S+ import (\w+) as \1$", (FOLDER / "library.pyi").read_text(), re.MULTILINE)


def test_each_name_is_one_of_the_library():
    assert [name for name in NAMES if getattr(library, name) is None] == []


def test_no_name_is_there_twice_and_none_is_unused():
    used = set(re.findall(r"(?<![\w.])lib\.(\w+)", "\n".join(path.read_text() for path in FOLDER.rglob("*.py"))))
    assert sorted(NAMES) == sorted(used)


def test_a_name_that_the_list_does_not_have_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"library\.pyi has no name nothing"):
        library.nothing  # type: ignore[attr-defined]  # noqa: B018
