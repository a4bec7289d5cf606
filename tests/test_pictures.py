"""The pictures of the documentation: each carries its command, and stands in a page below that command."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from kahanmaps.plots.recipe import read_recipe
from kahanmaps_cli.main import main

DOCS = Path(__file__).parent.parent / "docs"
PICTURES = sorted(path for path in (DOCS / "pictures").iterdir() if path.suffix in (".png", ".svg"))
PAGE = (DOCS / "howto" / "pictures.md").read_text(encoding="utf-8")


def test_there_are_pictures():
    assert len(PICTURES) >= 8


@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.name)
def test_a_picture_stands_below_the_command_that_makes_it(picture):
    command = read_recipe(str(picture)).command
    assert shlex.split(command)[:2] == ["kahanmaps", "plot"]
    assert f"-o {picture.name}" in command
    assert f"\n    {command}\n" in PAGE
    assert PAGE.index(command) < PAGE.index(f"](../pictures/{picture.name})")


@pytest.mark.slow
@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.name)
def test_the_command_makes_the_picture(picture, tmp_path, monkeypatch):
    """Not the same bytes, which depend on the version of matplotlib: the same recipe, and a file of about that size."""
    monkeypatch.chdir(tmp_path)
    recipe = read_recipe(str(picture))
    assert main(shlex.split(recipe.command)[1:]) == 0
    made = tmp_path / picture.name
    assert read_recipe(str(made)) == recipe
    assert 0.7 < made.stat().st_size / picture.stat().st_size < 1.4
