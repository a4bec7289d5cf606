"""Expressions in the languages that are not run here, read back by the library's own parser, token by token."""

import re

import pytest
from language_helpers import converted, systems

import kahanmaps as km
from kahanmaps.languages.convert import convert
from kahanmaps.languages.language import LANGUAGES, Language

SYSTEMS = systems()
# The entries of a vector that a function gives, in each language.
VECTOR = {
    "maple": r"{name} := proc\([^)]*\)\n(?:  [^\n]*;\n)*?  Vector\(\[(.*?)\]\);\nend proc:",
    "mathematica": r"{name}\[[^\]]*\] := Module[^\n]*\n[^\n]*\n  \{{(.*?)\}}\n\];\n",
    "sage": r"def {name}\(.*?\):\n[^\n]*\n    return vector\(\[(.*?)\]\)\n",
    "julia": r"function {name}\([^)]*\)\n(?:    [^\n]* = [^\n]*\n)*    return \[(.*?)\]\nend\n",
    "pari": r"\{{{name}\([^)]*\) =\n  my\([^)]*\);\n  \[(.*?)\]~\n\}}\n",
}
EXACT = {key: Language.load(key) for key in (*VECTOR, "sympy")}


def entries(language: str, text: str, *words: str) -> list[str]:
    """The expressions of a vector in a converted file, in our own syntax but for names."""
    name = EXACT[language].function(*words)
    (body,) = re.findall(VECTOR[language].format(name=name), text, re.DOTALL)
    return [piece.strip().replace("//", "/") for piece in body.split(",")]


def names_in(language: str, file: km.SystemFile) -> list[str]:
    safe = EXACT[language].safe(file.variables)
    return [safe[name] for name in file.variables]


@pytest.mark.parametrize("language", VECTOR)
def test_the_right_hand_sides_of_every_system_are_read_back_as_the_same_polynomials(language):
    for file in SYSTEMS.values():
        names = names_in(language, file)
        read = [
            km.parse_polynomial(piece, names) for piece in entries(language, convert(file, language), "vector_field")
        ]
        assert [polynomial.to_dict() for polynomial in read] == [polynomial.to_dict() for polynomial in file.system.rhs]


@pytest.mark.parametrize("language", VECTOR)
def test_the_closed_form_of_the_map_is_read_back_and_gives_its_values(language):
    for file in SYSTEMS.values():
        text, asked = converted(language, file)
        for question in asked:
            if question.function != "kahan_map_formula":
                continue
            names = (*names_in(language, file), "eps")
            read = [km.parse_rational_function(piece, names) for piece in entries(language, text, question.function)]
            assert [f.value(km.QQ, (*question.point, question.eps)) for f in read] == question.expected


def test_a_changed_sign_would_be_noticed():
    file = km.load("euler_top")
    text = convert(file, "maple").replace("-2*x1*x3", "2*x1*x3")
    read = [km.parse_polynomial(piece, file.variables) for piece in entries("maple", text, "vector_field")]
    assert read != list(file.system.rhs)


@pytest.mark.parametrize("language", LANGUAGES)
def test_brackets_are_in_pairs_and_every_template_is_filled(language):
    for file in SYSTEMS.values():
        text, _ = converted(language, file)
        code = re.sub(r"(\(\*.*\*\)|^\\\\ .*|^# .*|^// .*|^! .*)$", "", text, flags=re.MULTILINE)
        assert [code.count(mark) for mark in "([{"] == [code.count(mark) for mark in ")]}"]
        assert not re.search(r"<[A-Za-z]+>", text)


@pytest.mark.parametrize("language", LANGUAGES)
def test_long_polynomials_are_wrapped(language):
    text, _ = converted(language, SYSTEMS["family-3"])
    code = [line for line in text.splitlines() if "kahanmaps convert" not in line]
    assert max(map(len, code)) <= 140


@pytest.mark.parametrize("language", LANGUAGES)
def test_fractions_are_written_as_fractions(language):
    file = km.parse_system('variables = ["x"]\n[system]\nrhs = ["x^2/3"]', "third")
    third = {
        "julia": "1//3*x^2",
        "sympy": "Rational(1, 3)*x**2",
        "numpy": "1/3*x**2",
        "c": "1.0/3.0*x*x",
        "fortran": "1.0d0/3.0d0*x**2",
    }.get(language, "1/3*x^2")
    assert third in convert(file, language, ["system"])


def test_the_only_coordinate_of_a_point_is_taken_out_of_it():
    text = convert(km.load("riccati"), "julia", ["system"])
    assert "function vector_field(point)\n    x = exact(point[1])\n    return [x^2 + x - 1]\nend" in text


def test_sage_gets_long_integers_in_the_base_that_every_python_reads():
    long, file = 10**4999, km.parse_system(f'variables = ["x"]\n[system]\nrhs = ["7*x/1{"0" * 4999}"]', "long")
    assert f"7/{hex(long)}*x" in convert(file, "sage", ["system"])


def test_a_large_closed_form_is_refused_with_what_to_do_instead():
    with pytest.raises(km.InputError, match=r"too large.*ask for 'map' instead"):
        convert(km.load("paper_m3"), "pari", ["map-formulas"])
    names = [f"x{k}" for k in range(9)]
    linear = km.SystemFile.from_system(km.QuadraticSystem.from_text(names, names))
    with pytest.raises(km.InputError, match="found dimension 9"):
        convert(linear, "pari", ["map-formulas"])
