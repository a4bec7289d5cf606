"""Names that a language reserves or cannot spell are replaced, and different names stay different."""

import pytest
from language_helpers import HAS_GP, gp_prints

import kahanmaps as km
from kahanmaps.languages.convert import LANGUAGES, convert
from kahanmaps.languages.language import LANGUAGES as TABLES
from kahanmaps.languages.language import Language

RENAMED = [
    ("x1", "x1", "x1"),
    ("m12", "m12", "m12"),
    ("a_1", "a_1", "vA1"),
    ("I", "v_I", "vI"),
    ("E", "v_E", "vE"),
    ("e", "v_e", "vE"),
    ("i", "v_i", "vI"),
    ("lambda", "v_lambda", "vLambda"),
    ("gamma", "v_gamma", "vGamma"),
    ("end", "v_end", "vEnd"),
    ("_x", "v_x", "vX"),
    ("_", "v", "v"),
]


@pytest.mark.parametrize(("name", "expected", "in_mathematica"), RENAMED)
def test_a_name_that_may_mean_something_else_is_replaced(name, expected, in_mathematica):
    found = {table: Language.load(table).safe([name]) for table in TABLES}
    assert found == {table: {name: in_mathematica if table == "mathematica" else expected} for table in TABLES}


@pytest.mark.parametrize("table", TABLES)
def test_different_names_stay_different_and_avoid_what_the_file_uses(table):
    names = ["a_1", "a1", "_a1", "I", "v_I", "vI", "x", "X", "point", "v_point", "image", "M", "m", "E", "__", "_"]
    safe = Language.load(table).safe(names, taken=["a1"])
    assert list(safe) == names
    assert len({name.lower() for name in safe.values()}) == len(names)  # Fortran does not tell x from X
    assert not {"point", "eps", "image", "value", "a1"} & set(safe.values())


def test_a_replaced_name_is_told_in_the_comment_on_top():
    file = km.parse_system('variables = ["I", "x"]\n[system]\nrhs = ["I*x", "x"]', "imaginary")
    assert "(* Names that Mathematica cannot use or reads otherwise: I is called vI *)" in convert(file, "mathematica")
    assert "cannot use" not in convert(km.load("euler_top"), "mathematica")


def test_integrals_whose_names_come_out_alike_get_functions_of_their_own():
    text = 'variables = ["x"]\n[system]\nrhs = ["1"]\n[integrals]\n"H~" = "1"\nH = "2"\n"ε" = "3"'
    shown = convert(km.parse_system(text, "alike"), "julia", ["integrals"])
    assert all(f"function {name}(" in shown for name in ("integral_H", "integral_H_2", "integral"))


@pytest.mark.skipif(not HAS_GP, reason="gp, the program of PARI, is not installed")
def test_every_function_of_gp_is_replaced(tmp_path):
    known = gp_prints("", ["?*"], tmp_path)
    words = [word for line in known for word in line.split() if word.isidentifier()]
    assert {"zeta", "matsolve", "Mod"} <= set(words)
    assert [word for word, used in Language.load("pari").safe(words).items() if word == used] == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_nothing_in_a_name_ends_the_comment_or_the_line(language):
    document = 'name = "x *) (* y"\nvariables = ["x"]\n[catalog]\ntitle = "a\\nb *) c"\n[system]\nrhs = ["1"]'
    text = convert(km.parse_system(document, "comment"), language, command="kahanmaps convert 'a\nb'")
    mark = {"latex": "%", "pari": "\\\\", "mathematica": "(*", "c": "//", "fortran": "!"}.get(language, "#")
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
