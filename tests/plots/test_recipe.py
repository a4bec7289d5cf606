"""A picture tells how it was made: the recipe goes into PDF, SVG and PNG and comes out as it went in."""

import pytest
from helpers import together

from kahanmaps.errors import InputError
from kahanmaps.plots.figures import FORMATS, drawing, new_figure, picture_bytes, write_picture
from kahanmaps.plots.recipe import Recipe, read_recipe
from kahanmaps.plots.style import Style

STYLE = Style(width=4)
RECIPES = {
    "plain": Recipe("kahanmaps plot portrait euler_top --eps 1/10", 'name = "euler_top"\n'),
    "brackets, quotes and backslashes": Recipe(
        r"kahanmaps plot portrait 'a (b) \ c.toml' -p 'a=(1/2)'", "x = '\\\\)('\n"
    ),
    "letters beyond Latin-1": Recipe("kahanmaps plot portrait 'é α→.toml'", 'name = "ä→"\nvariables = ["α"]\n'),
    "markup": Recipe("kahanmaps plot portrait '<&>.toml'", 'name = "<script>&amp;</script>"\n'),
    "no system": Recipe("kahanmaps plot batch runs.db"),
}


def a_figure():
    with drawing(STYLE):
        return new_figure(STYLE)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("recipe", RECIPES.values(), ids=RECIPES)
def test_the_recipe_comes_out_as_it_went_in(tmp_path, kind, recipe):
    path = str(tmp_path / f"picture.{kind}")
    write_picture(a_figure(), path, kind, STYLE, recipe)
    assert read_recipe(path) == recipe


@together("length", range(60))
def test_what_stands_behind_the_recipe_is_no_part_of_it(tmp_path, length):
    """In PNG a checksum follows, which may begin with any letters."""
    recipe = Recipe("kahanmaps plot " + "x" * length)
    path = tmp_path / "x.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + recipe.metadata("png")["Comment"].encode() + b"Ab1/")
    assert read_recipe(str(path)) == recipe


@pytest.mark.parametrize("kind", FORMATS)
def test_a_picture_of_somebody_else_has_no_recipe(tmp_path, kind):
    path = tmp_path / f"picture.{kind}"
    a_figure().savefig(path)
    with pytest.raises(InputError, match="no recipe"):
        read_recipe(str(path))


def test_a_file_that_is_no_picture_is_refused(tmp_path):
    (tmp_path / "x.pdf").write_bytes(b"nothing of the kind")
    with pytest.raises(InputError, match="neither PDF nor SVG nor PNG"):
        read_recipe(str(tmp_path / "x.pdf"))


@pytest.mark.parametrize("cut", [9, 20, 40])
def test_a_picture_cut_short_is_refused(tmp_path, cut):
    path = tmp_path / "x.png"
    path.write_bytes(picture_bytes(a_figure(), "png", STYLE, RECIPES["plain"])[:cut])
    with pytest.raises(InputError, match="no recipe"):
        read_recipe(str(path))


@pytest.mark.parametrize("word", ["AAAA", "AAA", "eyJhIjogMX0="])
def test_a_damaged_recipe_is_told(tmp_path, word):
    path = tmp_path / "x.pdf"
    path.write_bytes(b"%PDF-1.4 (kahanmaps:" + word.encode() + b".)")
    with pytest.raises(InputError, match="cannot be read"):
        read_recipe(str(path))
