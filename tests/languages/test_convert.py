"""The function `convert`: what it refuses, and that the same input gives the same text."""

import pytest

import kahanmaps as km
from kahanmaps.languages.convert import LANGUAGES, convert


@pytest.mark.parametrize(
    ("language", "what", "more", "told"),
    [
        ("matlab", None, {}, "found the language 'matlab', expected one of latex, sympy"),
        ("pari", ["maps"], {}, "found the part 'maps', expected one of system, map"),
        ("pari", "map", {}, "found the text 'map', expected a list of parts"),
        ("pari", [], {}, "found no part"),
        ("pari", None, {"name": "_x"}, "found the name '_x', expected a letter"),
        ("pari", None, {"name": "a b"}, "found the name 'a b', expected a letter"),
    ],
)
def test_wrong_arguments_are_refused(language, what, more, told):
    with pytest.raises(km.InputError) as error:
        convert(km.load("euler_top"), language, what, **more)
    assert told in str(error.value)


@pytest.mark.parametrize("language", LANGUAGES)
def test_sources_are_cited_in_the_comment_on_top(language):
    assert "Hirota, K. Kimura. Discretization of the Euler top" in convert(km.load("euler_top"), language)


def test_an_algebraic_parameter_is_an_argument_of_the_functions():
    file = km.load("euler_top", a1="root of t^2 - 2 near 1.4")
    assert "where a1 is a root of t^2 - 2 near 1.414, about 1.41421356237310" in convert(file, "sympy")
    for language in LANGUAGES:
        assert "a1" in convert(file, language)
    with pytest.raises(km.InputError, match="found symbols beside a root"):
        convert(file, "pari", symbols=["a2"])
