"""The pictures of the documentation: each carries its command, and stands in some page below that command."""

import re
import shlex
import sys
from pathlib import Path

import pytest

from kahanmaps_cli.main import main

DOCS = Path(__file__).parent.parent / "docs"
sys.path.insert(0, str(DOCS / "_ext"))
from redraw import command_of  # noqa: E402

PICTURES = sorted(path for path in (DOCS / "pictures").iterdir() if path.suffix in (".png", ".svg"))
PAGES = [path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md")]


@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.name)
def test_a_picture_stands_below_the_command_that_makes_it(picture):
    words = shlex.split(command_of(picture))
    assert words[:2] == ["kahanmaps", "plot"]
    assert words[words.index("-o") + 1] == picture.name
    assert any(shows(page, words, picture.name) for page in PAGES)


def shows(page: str, words: list[str], name: str) -> bool:
    """Whether a page has the command of these words, and later the picture of that name."""
    commands = re.findall(r"^    (kahanmaps plot .*)$", page.partition(f"pictures/{name})")[0], re.MULTILINE)
    return f"pictures/{name})" in page and words in map(shlex.split, commands)


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_the_metadata_hold_the_command_and_the_system(tmp_path, kind):
    picture = tmp_path / f"é <&> (1).{kind}"
    words = [
        "plot",
        "portrait",
        "harmonic",
        "--eps",
        "1/20",
        "--start",
        "1,2",
        "--steps",
        "3",
        "-q",
        "-o",
        str(picture),
    ]
    assert main(words) == 0
    assert b"[hamiltonian]" in picture.read_bytes()
    if kind != "pdf":
        assert shlex.split(command_of(picture)) == ["kahanmaps", *words]


@pytest.mark.slow
@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.name)
def test_the_command_makes_the_picture(picture, tmp_path, monkeypatch):
    """Not the same bytes, which depend on the version of matplotlib: the same command, and a file of that size."""
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command_of(picture))[1:]) == 0
    made = tmp_path / picture.name
    assert command_of(made) == command_of(picture)
    assert 0.7 < made.stat().st_size / picture.stat().st_size < 1.4
