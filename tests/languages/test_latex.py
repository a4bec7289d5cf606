"""What `convert` writes as LaTeX: whole documents, in which everything that opens is closed and nothing is left out."""

import re

import pytest
from language_helpers import questions, systems

import kahanmaps as km
from kahanmaps.display.latex import latex_name
from kahanmaps.languages.convert import convert

SYSTEMS = systems()
DOCUMENTS = {name: convert(file, "latex", questions(file)[0]) for name, file in SYSTEMS.items()}


def mistakes(document: str) -> list[str]:
    """Braces, environments and alignment marks that do not fit together."""
    results = []
    body = "\n".join(line for line in document.splitlines() if not line.startswith("%"))
    text = body.replace("\\\\", " NEWLINE ").replace("\\{", "").replace("\\}", "")
    depth = 0
    for character in text:
        depth += {"{": 1, "}": -1}.get(character, 0)
        if depth < 0:
            results.append("} without {")
            break
    if depth > 0:
        results.append("{ without }")
    opened: list[str] = []
    for what, name in re.findall(r"\\(begin|end)\{([a-z*]+)\}", body):
        if what == "begin":
            opened.append(name)
        elif not opened or opened.pop() != name:
            results.append(f"\\end{{{name}}} does not close what is open")
    results += [f"{name} is not closed" for name in opened]
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
    math = re.findall(r"\\mathrm\{[^}]*\} &=", document)
    assert math == [r"\mathrm{a\_b} &="]
    assert document.isascii()
