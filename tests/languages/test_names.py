"""Names that a language reserves or cannot spell are replaced, and different names stay different."""

from __future__ import annotations

import keyword

import pytest
from language_helpers import HAS_GP, gp_prints

import kahanmaps as km
from kahanmaps.languages.convert import LANGUAGES, convert
from kahanmaps.languages.julia import JULIA
from kahanmaps.languages.language import PYTHON_KEYWORDS
from kahanmaps.languages.maple import MAPLE
from kahanmaps.languages.mathematica import MATHEMATICA
from kahanmaps.languages.pari import PARI
from kahanmaps.languages.sage import SAGE
from kahanmaps.languages.sympy import SYMPY

TABLES = [JULIA, MAPLE, MATHEMATICA, PARI, SAGE, SYMPY]

RENAMED = [
    (SYMPY, "I", "v_I"),
    (SYMPY, "lambda", "v_lambda"),
    (SYMPY, "x1", "x1"),
    (PARI, "I", "v_I"),
    (PARI, "gamma", "v_gamma"),
    (PARI, "_x", "x"),
    (PARI, "m12", "m12"),
    (MAPLE, "D", "v_D"),
    (MAPLE, "local", "v_local"),
    (MAPLE, "args", "v_args"),
    (MAPLE, "Order", "v_Order"),
    (MATHEMATICA, "a_1", "a1"),
    (MATHEMATICA, "E", "vE"),
    (MATHEMATICA, "_", "v"),
    (SAGE, "I", "v_I"),
    (SAGE, "ZeroDivisionError", "v_ZeroDivisionError"),
    (JULIA, "end", "v_end"),
    (JULIA, "im", "v_im"),
]


@pytest.mark.parametrize(("table", "name", "expected"), RENAMED, ids=lambda value: getattr(value, "key", value))
def test_a_name_is_replaced_where_the_language_asks_for_it(table, name, expected):
    assert table.naming.safe([name]) == {name: expected}


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.key)
def test_different_names_stay_different_and_avoid_what_the_file_uses(table):
    names = ["a_1", "a1", "_a1", "I", "v_I", "vI", "point", "v_point", "image", "M", "m", "end", "E", "__", "_"]
    safe = table.naming.safe(names, taken=["a1"])
    assert list(safe) == names
    assert len(set(safe.values())) == len(names)
    assert not {"point", "eps", "image", "M", "m", "a1"} & set(safe.values())
    assert not any(table.naming.is_reserved(name) for name in safe.values())


def test_a_replaced_name_is_told_in_the_comment_on_top():
    file = km.parse_system('variables = ["I", "x"]\n[system]\nrhs = ["I*x", "x"]', "imaginary")
    assert "(* Names that Mathematica cannot use or reads otherwise: I is called vI *)" in convert(file, "mathematica")
    assert "cannot use" not in convert(km.load("euler_top"), "mathematica")


def test_integrals_whose_names_come_out_alike_get_functions_of_their_own():
    text = 'variables = ["x"]\n[system]\nrhs = ["1"]\n[integrals]\n"H~" = "1"\nH = "2"\n"ε" = "3"'
    shown = convert(km.parse_system(text, "alike"), "julia", ["integrals"])
    assert all(f"function {name}(" in shown for name in ("integral_H", "integral_H_2", "integral"))


def test_the_keywords_of_python_are_all_known():
    assert set(keyword.kwlist) <= PYTHON_KEYWORDS


@pytest.mark.skipif(not HAS_GP, reason="gp, the program of PARI, is not installed")
def test_every_function_of_gp_is_reserved(tmp_path):
    known = gp_prints("", ["?*"], tmp_path)
    words = [word for line in known for word in line.split() if word.isidentifier()]
    assert {"zeta", "matsolve", "Mod"} <= set(words)
    assert [word for word in words if not PARI.naming.is_reserved(word)] == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_nothing_in_a_name_ends_the_comment_or_the_line(language):
    document = 'name = "x *) (* y"\nvariables = ["x"]\n[catalog]\ntitle = "a\\nb *) c"\n[system]\nrhs = ["1"]'
    text = convert(km.parse_system(document, "comment"), language, command="kahanmaps convert 'a\nb'")
    mark = {"latex": "%", "pari": "\\\\", "mathematica": "(*"}.get(language, "#")
    top = text.split("\n\n")[0].split("\n\\documentclass")[0].splitlines()
    assert all(line.startswith(mark) for line in top)
    if language == "mathematica":
        assert all(line.count("(*") == line.count("*)") == 1 for line in top)


@pytest.mark.parametrize("language", ["sympy", "sage"])
@pytest.mark.parametrize("where", ["name", "title"])
def test_python_takes_no_word_of_a_title_for_an_encoding(language, where):
    name, title = {"name": ("coding: x", "t"), "title": ("n", f"{'long ' * 19}coding=x")}[where]
    document = f'name = "{name}"\nvariables = ["x"]\n[catalog]\ntitle = "{title}"\n[system]\nrhs = ["x/3"]'
    text = convert(km.parse_system(document), language, command="kahanmaps convert -p coding=3")
    assert "coding :" in text or "coding =" in text
    assert "-p coding=3" in text
    compile(text.replace("^", "**").encode(), "file", "exec")


def test_functions_of_mathematica_start_with_a_small_letter():
    text = 'variables = ["x"]\n[system]\nrhs = ["1"]\n[integrals]\n"" = "1/7"'
    shown = convert(km.parse_system(text, "nameless"), "mathematica", name="Sin")
    assert "sinIntegral[{x_}, eps_] :=" in shown
    assert "SinIntegral" not in shown


@pytest.mark.parametrize("language", LANGUAGES)
def test_an_integral_without_a_name_is_written_too(language):
    text = 'variables = ["x"]\n[system]\nrhs = ["1"]\n[integrals]\n"" = "1/7"'
    shown = convert(km.parse_system(text, "nameless"), language, ["integrals"])
    assert "7" in shown
