"""What `convert` writes for NumPy, C and Fortran: files that compile as they stand and give the values of the library.

Numbers are floats there, and the points of small numerators and denominators: 1e-9 leaves room for the condition of the
linear equations in six dimensions, and is far below what a wrong sign or factor changes.
"""

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers import quick
from language_helpers import Question, converted, run_python, systems

import kahanmaps as km
from kahanmaps.languages.convert import convert

SYSTEMS = systems()
CAPITALS = "nasty-capitals"  # I, E, S, N
COMPILER = {"c": "cc", "fortran": "gfortran"}


def floats(values) -> list[float]:
    return [int(value.p) / int(value.q) for value in values]


def numpy_answers(text: str, asked: list[Question], folder: Path) -> list[float]:
    calls = [f"np.ravel({q.function}({floats(q.point)}, {floats([q.eps])[0]})).tolist()" for q in asked]
    (line,) = run_python({"numpy": f"{text}\nprint(*{' + '.join(calls)})\n"})["numpy"]
    return list(map(float, line.split()))


def c_answers(text: str, asked: list[Question], folder: Path) -> list[float]:
    calls = []
    for q in asked:
        call = f"{q.function}((vector){{{{{', '.join(map(repr, floats(q.point)))}}}}}, {floats([q.eps])[0]!r})"
        kind = {1: "double", len(q.point): "vector"}.get(len(q.expected), "matrix")
        kind = "matrix" if q.function == "kahan_jacobian" else kind
        kind = "double" if q.function.startswith(("integral", "modified", "density")) else kind
        calls.append(f"{{ {kind} value = {call}; show((double *)&value, {len(q.expected)}); }}")
    show = '#include <stdio.h>\nvoid show(double *x, int n) { for (int i = 0; i < n; i++) printf("%.17g\\n", x[i]); }\n'
    return compiled("c", text + show + "int main(void) {\n" + "\n".join(calls) + "\nreturn 0;\n}\n", folder)


def fortran_answers(text: str, asked: list[Question], folder: Path) -> list[float]:
    lines = ["program main", "use kahan_module"]
    for q in asked:
        point = ", &\n".join(f"{x!r}d0" for x in floats(q.point))
        call = f"{q.function}([double precision :: {point}], &\n{floats([q.eps])[0]!r}d0)"
        lines.append(f"print *, {f'transpose({call})' if q.function == 'kahan_jacobian' else call}")
    return compiled("fortran", text + "\n".join([*lines, "end program"]) + "\n", folder)


def compiled(language: str, text: str, folder: Path) -> list[float]:
    """The numbers that a program prints, compiled by the strict standard and without a warning."""
    source, strict = {"c": ("all.c", ["-std=c99", "-Wall", "-Werror", "-Wno-unused"]), "fortran": ("all.f90", [])}[
        language
    ]
    (folder / source).write_text(text)
    command = [COMPILER[language], *strict, source, "-o", "all", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return list(map(float, subprocess.run([folder / "all"], capture_output=True, text=True, timeout=60).stdout.split()))


LANGUAGES: list[tuple[str, Callable[[str, list[Question], Path], list[float]]]] = [
    ("numpy", numpy_answers), ("c", c_answers), ("fortran", fortran_answers)
]  # fmt: skip
each = pytest.mark.parametrize(
    ("language", "answers"), LANGUAGES, ids=lambda value: value if isinstance(value, str) else ""
)


def at_hand(language: str) -> None:
    if language in COMPILER and shutil.which(COMPILER[language]) is None:
        pytest.skip(f"{COMPILER[language]} is not installed")


def agree(found: list[float], asked: list[Question]) -> bool:
    expected = floats(value for question in asked for value in question.expected)
    return len(found) == len(expected) and found == pytest.approx(expected, rel=1e-9, abs=1e-9)


@each
@pytest.mark.parametrize("name", quick(["euler_top", "planar_cubic_hamiltonian", CAPITALS, "constant"], [CAPITALS]))
def test_the_program_gives_the_values_of_the_library(language, answers, name, tmp_path):
    at_hand(language)
    text, asked = converted(language, SYSTEMS[name])
    assert agree(answers(text, asked, tmp_path), asked)


@each
def test_a_wrong_sign_would_be_noticed(language, answers, tmp_path):
    at_hand(language)
    text, asked = converted(language, km.load("euler_top"))
    wrong = text.replace("-x3*eps", "x3*eps")
    assert wrong != text
    assert not agree(answers(wrong, asked, tmp_path), asked)


def test_rows_are_exchanged_where_a_pivot_vanishes(tmp_path):
    at_hand("c")
    rhs = 'variables = ["x", "y"]\n[system]\nrhs = ["2*x + y", "x"]'  # at eps = 1/2, I - eps f' = (0 -1/2; -1/2 1)
    file = km.parse_system(rhs, "pivot")
    image = km.KahanMap(file.system, "1/2").step([3, 5])
    asked = [Question("kahan_map", km.KahanMap(file.system, "1/2").point([3, 5]), km.QQ.convert("1/2"), list(image))]
    assert agree(c_answers(convert(file, "c"), asked, tmp_path), asked)


@pytest.mark.parametrize("language", ["c", "fortran"])
def test_lines_of_fortran_and_c_are_no_longer_than_the_standard_allows(language):
    for file in SYSTEMS.values():
        text, _ = converted(language, file)
        assert max(len(line) for line in text.splitlines() if not line.startswith(("!", "//"))) <= 132
