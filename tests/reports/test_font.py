"""The font of formulas: it comes with its licence, is part of a page with formulas, and has their letters."""

import re
import string
from importlib import resources

import pytest
from fontTools.pens.boundsPen import BoundsPen
from fontTools.ttLib import TTFont
from page_helpers import letters_of_formulas, letters_of_the_font

from kahanmaps.algebra.written.text import parse_polynomial
from kahanmaps.display.latex import GREEK_NAMES
from kahanmaps.display.mathml import formula
from kahanmaps.reports.stylesheet import font_face


def test_the_licence_lies_beside_the_font():
    folder = resources.files("kahanmaps.reports") / "fonts"
    assert "LaTeX Project Public License" in (folder / "GUST-FONT-LICENSE.txt").read_text()
    assert re.fullmatch(r'@font-face {[^{}]*url\(data:font/woff;base64,[\w+/=]+\) format\("woff"\); }', font_face())


def test_the_font_has_every_letter_of_formulas():
    names = [*string.ascii_letters, *GREEK_NAMES.split("|"), "eps", "my_name12"]
    polynomial = parse_polynomial("123456789/70" + "".join(f"+{name}^2-{name}" for name in names), names)
    html = formula(polynomial, "x1'") + formula(polynomial, "y", characters=9)
    assert letters_of_formulas(html) - letters_of_the_font() == set()


def test_primes_are_drawn_to_stand_in_an_exponent():
    """They begin near the base line; the ordinary ones are raised already, and would be raised twice."""
    with (resources.files("kahanmaps.reports") / "fonts" / "kahanmaps-math.woff").open("rb") as file:
        font = TTFont(file)
        pen = BoundsPen(font.getGlyphSet())
        font.getGlyphSet()[font.getBestCmap()[ord("′")]].draw(pen)
    x_height = 430  # of Latin Modern, in thousandths; there its ordinary prime begins
    assert pen.bounds is not None
    assert pen.bounds[1] < x_height / 2


@pytest.mark.parametrize("letter", ["я", "\N{MATHEMATICAL BOLD SMALL A}"])
def test_a_letter_that_the_font_lacks_is_noticed(letter):
    assert letters_of_formulas(f"<math><mi>{letter}</mi></math>") - letters_of_the_font() == {letter}
