"""The function `convert`: what it refuses, and that the same input gives the same text."""

from __future__ import annotations

import pytest

import kahanmaps as km
from kahanmaps.languages.convert import LANGUAGES, convert

CALL = "import kahanmaps as km; from kahanmaps.languages.convert import convert, PARTS; "
CALL += "print(convert(km.load('weierstrass'), 'julia', PARTS), end='')"


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


def test_integrals_and_density_of_a_hamiltonian_system_come_from_theorems():
    hamiltonian = km.CubicHamiltonian(km.parse_polynomial("x^3 + y^2", ["x", "y"]), km.standard_structure(2))
    text = convert(km.SystemFile.from_hamiltonian(hamiltonian), "sage")
    assert "def modified_hamiltonian(point, eps):" in text
    assert "def density(point, eps):" in text
