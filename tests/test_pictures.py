"""The pictures of the documentation: each carries its command, and stands in some page below that command."""

import shlex
import sys
from pathlib import Path

import pytest

from kahanmaps_cli.main import main

DOCS = Path(__file__).parent.parent / "docs"
sys.path.insert(0, str(DOCS / "_ext"))
from redraw import command_of  # noqa: E402

PICTURES = sorted(path for path in (DOCS / "pictures").iterdir() if path.suffix in (".png", ".svg"))


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_the_metadata_hold_the_command_and_the_system(tmp_path, kind):
    picture = tmp_path / f"é <&> (1).{kind}"
    words = [
        *["plot", "portrait", "harmonic", "--eps", "1/20", "--start", "1,2", "--steps", "3", "-q", "-o"],
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
