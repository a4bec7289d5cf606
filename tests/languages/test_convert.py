"""The function `convert`: what it refuses, names, comments, and expressions in the languages that are not run here."""

import re
import sys

import pytest
from helpers import refuses
from language_helpers import converted, questions, systems

import kahanmaps as km
from kahanmaps.display.latex import latex_name
from kahanmaps.documents.catalog import load
from kahanmaps.languages.convert import LANGUAGES, convert

SYSTEMS = systems()


def test_wrong_arguments_are_refused():  # others are in wrong_use.txt of the command line
    refuses("found the language 'matlab', expected one of latex, sympy", convert, load("euler_top"), "matlab")
    refuses("found the text 'map', expected a list of parts", convert, load("euler_top"), "pari", "map")
    for part in ("system", "jacobian"):
        words = f"found the part {part} of an explicit map, expected map"
        refuses(words, convert, load("lyness"), "pari", ["map", part])


def test_what_to_install_is_said_where_sympy_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "sympy", None)
    refuses(r"Julia is written by SymPy .*: pip install 'kahanmaps\[sympy\]'", convert, km.load("euler_top"), "julia")
    assert "kahan_map" in convert(km.load("euler_top"), "pari")
    assert "align" in convert(km.load("euler_top"), "latex")


def test_a_closed_form_of_many_variables_is_refused():
    names = [f"x{k}" for k in range(9)]
    linear = km.SystemFile.from_system(km.QuadraticSystem.from_text(names, names))
    refuses("found dimension 9", convert, linear, "pari", ["map-formulas"])


def test_a_number_that_python_does_not_print_is_refused_by_sympy_and_written_for_pari():
    file = km.parse_system(f'variables = ["x"]\n[system]\nrhs = ["{"7" * 5000}*x"]', "long")
    assert "7" * 5000 in convert(file, "pari", ["system"])
    refuses("found a number that is too long for SymPy", convert, file, "julia", ["system"])


# The entries of a vector that a function gives, in each language that is not run here.
VECTOR = {
    "maple": r"{name} := proc\([^)]*\)\n.*?  Vector\(\[(.*?)\]\);\nend proc:",
    "mathematica": r"{name}\[[^\]]*\] := Module\[.*?\n  \{{(.*?)\}}\n\];\n",
    "sage": r"def {name}\(.*?\):\n.*?    return vector\(\[(.*?)\]\)\n",
    "julia": r"function {name}\([^)]*\)\n.*?    return \[(.*?)\]\nend\n",
    "pari": r"\{{{name}\([^)]*\) =\n.*?  \[(.*?)\]~\n\}}\n",
}


def entries(language, text, function):
    """The expressions of a vector in a converted file, in our own syntax."""
    if language == "mathematica":
        function = re.sub("_([a-z])", lambda match: match[1].upper(), function)
    (body,) = re.findall(VECTOR[language].format(name=function), text, re.DOTALL)
    plain = body.replace(" // ", "/").replace(" .^ ", "^").replace(" .* ", "*").replace("**", "^")
    return [piece.strip() for piece in plain.split(",")]


def names_in(language, text, file):
    """The names of the variables in a converted file, which are told where they are others."""
    messages = " ".join(line.lstrip("%#!/*(\\ ") for line in text.split("\n\n")[0].splitlines())
    results = dict(re.findall(r"(\w+) is called (\w+)", messages))
    return [results.get(name, name) for name in file.variables]


@pytest.mark.parametrize("language", VECTOR)
@pytest.mark.parametrize("name", SYSTEMS)
def test_expressions_are_read_back_as_the_same_polynomials_and_values(language, name):
    file = SYSTEMS[name]
    text, requested = converted(language, file)
    names = names_in(language, text, file)
    read = [km.parse_polynomial(piece, names) for piece in entries(language, text, "vector_field")]
    assert [polynomial.to_dict() for polynomial in read] == [polynomial.to_dict() for polynomial in file.system.rhs]
    for question in requested:
        if question.function == "kahan_map_formula":
            closed = entries(language, text, question.function)
            read = [km.parse_rational_function(piece, (*names, "eps")) for piece in closed]
            assert [f.value(km.QQ, (*question.point, question.eps)) for f in read] == question.expected


@pytest.mark.parametrize("language", LANGUAGES)
def test_brackets_are_in_pairs_everything_is_filled_in_and_lines_are_not_long(language):
    for file in SYSTEMS.values():
        text, _ = converted(language, file)
        code = re.sub(r"(\(\*.*\*\)|^\\\\ .*|^# .*|^// .*|^! .*)$", "", text, flags=re.MULTILINE)
        assert [code.count(mark) for mark in "([{"] == [code.count(mark) for mark in ")]}"]
        assert language == "latex" or "$" not in text
        assert max(map(len, code.splitlines())) <= (132 if language == "fortran" else 200)


@pytest.mark.parametrize(
    ("language", "third", "half"),
    [
        ("julia", "x .^ 2 / 3", "1 // 2"),  # of numbers that exact() made
        ("sage", "x**2/3", "1/2"),
        ("maple", "(1/3)*x^2", "1/2"),
        ("mathematica", "(1/3)*x^2", "1/2"),
        ("c", "(1.0/3.0)*pow(x, 2)", "1.0/2.0"),
        ("fortran", "(1.0d0/3.0d0)*x**2", "1.0d0/2.0d0"),
    ],
)
def test_fractions_are_exact_and_never_quotients_of_integers(language, third, half):
    file = km.parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x^2/3", "1/2"]', "third")
    text = convert(file, language, ["system"])
    assert third in text
    assert half in text


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_language_takes_every_kind_of_map_and_says_how_it_was_made(language):
    for name in ("lyness", "duffing_polarised", "lotka_volterra_symplectic_euler", "hky"):
        text = convert(load(name), language)
        assert "Kahan map" not in text
        assert ("time step" in text) == bool(load(name).map.time_steps)
        assert bool(re.search(r"\beps\b", text)) == load(name).map.has_eps
    text = convert(km.load("euler_top", a1="root of t^2 - 2 near 1.4"), language)
    assert "Hirota, K. Kimura. Discretization of the Euler top" in text
    assert "where a1 is a root of t^2 - 2 near 1.414, about 1.41421356237310" in text


def test_the_example_gives_eps_to_maps_that_have_one():
    assert "# For example: map_step([1, 2])\n" in convert(load("lyness"), "sympy")
    assert "# For example: map_step([1, 2], Rational(1, 10))\n" in convert(load("repaired_octahedral"), "sympy")


@pytest.mark.parametrize(
    ("name", "expected", "in_mathematica"),
    [
        ("m12", "m12", "m12"),
        ("a_1", "a_1", "vA1"),
        ("I", "v_I", "vI"),
        ("e", "v_e", "vE"),
        ("lambda", "v_lambda", "vLambda"),
        ("_x", "v_x", "vX"),
        ("_", "v", "v"),
    ],
)
def test_a_reserved_name_is_replaced_and_reported(name, expected, in_mathematica):
    file = km.SystemFile.from_system(km.QuadraticSystem.from_text([name], [f"3*{name}"]))
    for language in LANGUAGES[1:]:
        shown = in_mathematica if language == "mathematica" else expected
        text = convert(file, language, ["system"])
        assert re.search(rf"\b3 ?\* ?{shown}\b", text)
        assert (f"{name} is called {shown}" in text) == (name != shown)


@pytest.mark.parametrize("language", LANGUAGES[1:])
def test_different_names_stay_different_and_avoid_what_the_file_uses(language):
    names = ["a_1", "a1", "_a1", "I", "v_I", "vI", "x", "X", "point", "v_point", "image", "M", "m", "E", "__", "_"]
    file = km.SystemFile.from_system(km.QuadraticSystem.from_text(names, names))
    result = names_in(language, convert(file, language, ["system"]), file)
    assert len({name.lower() for name in result}) == len(names)  # Fortran does not tell x from X
    assert not {"point", "eps", "image", "value"} & set(result)


def test_integrals_whose_names_come_out_alike_get_functions_of_their_own():
    text = 'variables = ["x"]\n[system]\nrhs = ["1"]\n[integrals]\n"H~" = "1"\nH = "2"\n"ε" = "3"'
    shown = convert(km.parse_system(text, "alike"), "julia", ["integrals"])
    assert all(f"function {name}(" in shown for name in ("integral_H", "integral_H_2", "integral"))


@pytest.mark.parametrize("language", LANGUAGES)
def test_nothing_in_a_name_ends_the_comment_or_the_line(language):
    document = 'name = "x *) (* y"\nvariables = ["x"]\n[catalog]\ntitle = "a\\nb *) c\\\\"\n[system]\nrhs = ["1"]'
    text = convert(km.parse_system(document, "comment"), language, command="kahanmaps convert 'a\nb'")
    mark = {"latex": "%", "pari": "\\\\", "mathematica": "(*", "c": "//", "fortran": "!"}.get(language, "#")
    top = text.split("\n\n")[0].split("\n\\documentclass")[0].splitlines()
    assert all(line.startswith(mark) for line in top)
    if language == "mathematica":
        assert all(line.count("(*") == line.count("*)") == 1 for line in top)
    assert language == "latex" or not any(line.endswith("\\") for line in top)


def test_python_takes_no_word_of_a_title_for_an_encoding():
    document = 'name = "coding: x"\nvariables = ["x"]\n[catalog]\ntitle = "t"\n[system]\nrhs = ["x/3"]'
    text = convert(km.parse_system(document), "sympy", command="kahanmaps convert -p coding=3")
    assert "coding :" in text
    assert "-p coding=3" in text
    compile(text.encode(), "file", "exec")


DOCUMENTS = {name: convert(file, "latex", questions(file)[0]) for name, file in SYSTEMS.items()}


def mistakes(document):
    """Braces, environments and alignment marks that do not fit together."""
    body = "\n".join(line for line in document.splitlines() if not line.startswith("%"))
    braces = re.sub(r"[^{}]", "", body.replace("\\\\", "").replace("\\{", "").replace("\\}", ""))
    environments = "".join(f"{what} {name};" for what, name in re.findall(r"\\(begin|end)\{([a-z*]+)\}", body))
    for _ in range(20):  # what is innermost goes first
        braces, environments = braces.replace("{}", ""), re.sub(r"begin ([^;]*);end \1;", "", environments)
    results = [text for text in (braces, environments) if text]
    for rows in re.findall(r"\\begin\{align\*\}(.*?)\\end\{align\*\}", body, re.DOTALL):
        outer = re.sub(r"\\begin\{pmatrix\}.*?\\end\{pmatrix\}", "", rows, flags=re.DOTALL)
        results += [f"not one & in {row}" for row in outer.split("\\\\") if row.count("&") != 1]
        if "\n\n" in rows:
            results.append("an empty line in a display")
    for matrix in re.findall(r"\\begin\{pmatrix\}(.*?)\\end\{pmatrix\}", body, re.DOTALL):
        if len({row.count("&") for row in matrix.split("\\\\")}) != 1:
            results.append("rows of different length")
    return results


@pytest.mark.parametrize("name", DOCUMENTS)
def test_everything_that_opens_is_closed(name):
    assert mistakes(DOCUMENTS[name]) == []


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("\\end{align*}", "\\end{aligned}"),
        (" &= ", " = "),
        ("\\frac{", "\\frac"),
        ("f(\\mathbf x) \\\\", "f(\\mathbf x) \\\\ & & \\\\"),
        ("\\end{document}", ""),
    ],
)
def test_a_mistake_would_be_noticed(right, wrong):
    document = DOCUMENTS["euler_top"]
    assert right in document
    assert mistakes(document.replace(right, wrong, 1)) != []


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_lines_of_a_right_hand_side_together_are_all_of_it(name):
    complete = re.sub(r" \\\\\n&\\quad", "", DOCUMENTS[name])
    for variable, polynomial in zip(SYSTEMS[name].variables, SYSTEMS[name].system.rhs, strict=True):
        assert rf"\dot{{{latex_name(variable)}}} &= {km.latex_polynomial(polynomial)}" in complete


def test_matrices_of_more_than_ten_columns_are_announced():
    names = [f"x{k}" for k in range(1, 13)]
    file = km.SystemFile.from_system(km.QuadraticSystem.from_text(names, names))
    assert "\\setcounter{MaxMatrixCols}{12}" in convert(file, "latex")
    assert "MaxMatrixCols" not in DOCUMENTS["euler_top"]


def test_names_of_integrals_are_set_as_text_where_math_mode_has_no_such_marks():
    names = ["H~", "H^2", "a b", "a\\\\b", "ε", "a_b"]
    claims = "\n".join(f'"{name}" = "{k}"' for k, name in enumerate(names, 2))
    text = f'variables = ["x"]\n[system]\nrhs = ["1"]\n[integrals]\n{claims}'
    document = convert(km.parse_system(text, "names"), "latex", ["integrals"])
    assert mistakes(document) == []
    assert re.findall(r"\\mathrm\{[^}]*\} &=", document) == [r"\mathrm{a\_b} &="]
    assert document.isascii()
