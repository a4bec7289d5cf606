"""What `convert` writes runs as it stands and gives the values of the library, wherever the program is at hand.

SymPy and GP compute exactly. NumPy, C and Fortran have floats: 1e-9 is far below what a wrong sign or factor changes.
"""

import re
import shutil
import subprocess

import pytest
from flint import fmpq
from language_helpers import Question, converted, run_python, systems

import kahanmaps as km
from kahanmaps.documents.catalog import load
from kahanmaps.languages.convert import convert

SYSTEMS = systems()
TOP = SYSTEMS["euler_top"]
# What is asked, changed in the converted text of the Euler top: each is a mistake that has to be noticed.
WRONG = {"eps for 2 eps": ("-eps*x3", "-2*eps*x3"), "sign": ("-eps*x3", "eps*x3"), "inverse": ("-eps)\n", "eps)\n")}


def answers_of(line):
    """The exact numbers of a printed list; anything else in it, such as a decimal point, is an error."""
    assert re.fullmatch(r"[-0-9/, \[\];~]+", line), line
    return [fmpq(*map(int, piece.split("/"))) for piece in re.findall(r"-?\d+(?:/\d+)?", line)]


def script(text, requested):
    """A converted file for SymPy that prints its answers."""
    lines = [text]
    for q in requested:
        point = ", ".join(f"Rational({x.p}, {x.q})" for x in q.point)
        lines.append(f"value = {q.function}([{point}], Rational({q.eps.p}, {q.eps.q}))")
        lines.append("print(list(value) if hasattr(value, 'shape') else [value])")
    return "\n".join(lines) + "\n"


MAPS = {name: load(name) for name in ("lyness", "mcmillan", "repaired_octahedral", "lotka_volterra_symplectic_euler")}
MAPS["adjusted"] = km.parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x*y + eps*x^2", "y^2 - eps"]', "adjusted")
NUMBERS = """
from fractions import Fraction
from flint import fmpq, fmpz
for kind in (fmpq, Fraction, Rational, lambda p, q: f"{p}/{q}", lambda p, q: str(p / q)):
    print([str(entry) for entry in kahan_map([kind(-1, 2), kind(3, 4), fmpz(10) ** 30], kind(1, 8), kind(5, 4))])
print(kahan_matrix([1, 2, 3], 0.5)[1])
"""
# The image of (1, 1, 1) at eps = 1/4 where a1 is a square root of 2, or 2, against a point over Q(t).
ALGEBRAIC = """
from sympy import Integer, expand, radsimp, sqrt
for t in (sqrt(2), -sqrt(2), Integer(2)):
    image = kahan_map(Matrix([1, 1, 1]), Rational(1, 4), t)
    print(all(expand(radsimp(a - sympify(b).subs("t", t))) == 0 for a, b in zip(image, POINT, strict=True)))
"""
MANY_TERMS = 'variables = ["x", "y", "z"]\n[system]\nrhs = ["1", "1", "1"]\n[integrals]\nbig = "(1 + x + 2*y + z/3)^18"'


def start_of(file):
    return tuple(fmpq(k + 2, 2 * k + 7) for k in range(file.dim))


@pytest.fixture(scope="module")
def printed():
    """What each of the scripts prints; loading SymPy takes a second, so all are run by one process."""
    scripts = {name: script(*converted("sympy", file)) for name, file in SYSTEMS.items()}
    text, requested = converted("sympy", TOP)
    for name, (right, wrong) in WRONG.items():
        assert right in text
        scripts[f"wrong {name}"] = script(text.replace(right, wrong), requested)
    for name, file in MAPS.items():
        point = f"[{', '.join(f'Rational({x.p}, {x.q})' for x in start_of(file))}]"
        eps = ", Rational(1, 3)" if file.map.has_eps else ""
        calls = f"image = map_step({point}{eps})", f"map_step_formula({point}{eps})", f"map_inverse(image{eps})"
        scripts[name] = convert(file, "sympy", ["map", "map-formulas", "inverse"])
        scripts[name] += f"{calls[0]}\n" + "".join(f"print(list({call}))\n" for call in ("image", *calls[1:]))
    symbolic = convert(TOP, "sympy", symbols=["a1", "a3"])
    scripts["symbols"] = f"{symbolic}print(vector_field([1, 2, 3])[0], vector_field([1, 2, 3], 5, 7)[2])"
    scripts["numbers"] = convert(TOP, "sympy", symbols=["a1"]) + NUMBERS
    file = km.load("euler_top", a1="root of t^2 - 2 near 1.4")
    *_, end = km.orbit(file, [1, 1, 1], "1/4", 1)
    scripts["algebraic"] = convert(file, "sympy") + ALGEBRAIC.replace("POINT", repr(list(end.text)))
    many = convert(km.parse_system(MANY_TERMS, "many"), "sympy", ["integrals"])
    scripts["many terms"] = f"{many}print(integral_big([3, 1, 3], 1))"
    return run_python(scripts)


@pytest.mark.parametrize("name", SYSTEMS)
def test_sympy_gives_the_values_of_the_library_exactly(name, printed):
    _, requested = converted("sympy", SYSTEMS[name])
    assert list(map(answers_of, printed[name])) == [question.expected for question in requested]


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_formula_would_be_noticed(name, printed):
    _, requested = converted("sympy", TOP)
    assert list(map(answers_of, printed[f"wrong {name}"])) != [question.expected for question in requested]


@pytest.mark.parametrize("name", MAPS)
def test_another_map_its_formulas_and_its_inverse_are_those_of_the_library(name, printed):
    start = start_of(MAPS[name])
    image = MAPS[name].map.at("1/3").step(start)
    assert list(map(answers_of, printed[name])) == [list(image), list(image), list(start)]


def test_parameters_left_as_symbols_are_arguments_and_stand_for_themselves(printed):
    assert printed["symbols"] == ["6*a1 14"]


def test_sympy_takes_exact_numbers_of_every_kind_and_leaves_floats_floats(printed):
    *lines, of_a_float = printed["numbers"]
    image = km.map(km.load("euler_top", a1="5/4"), "1/8")(["-1/2", "3/4", 10**30])
    assert lines == [str([str(entry) for entry in image])] * 5
    assert "." in of_a_float


def test_an_algebraic_parameter_is_an_argument(printed):
    assert printed["algebraic"] == ["True", "True", "False"]


def test_a_sum_of_a_thousand_terms_does_not_exhaust_the_parser(printed):
    assert printed["many terms"] == [str((1 + 3 + 2 + 1) ** 18)]


def gp(text, lines, folder):
    """The lines that GP prints after it has read a file."""
    needs("gp")
    (folder / "system.gp").write_text(text)
    return run(["gp", "-q", "-f", "system.gp"], folder, input="\n".join(lines) + "\n").splitlines()


def needs(program):
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")


def run(command, folder, **more):
    """What a program prints, which has nothing to complain of."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, **more)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.mark.parametrize("name", SYSTEMS)
def test_gp_gives_the_values_of_the_library_exactly(name, tmp_path):
    text, requested = converted("pari", SYSTEMS[name])
    lines = [f"print({q.function}([{', '.join(map(str, q.point))}]~, {q.eps}));" for q in requested]
    results = [answers_of(line.removeprefix("Mat(").rstrip(")")) for line in gp(text, lines, tmp_path)]
    assert results == [question.expected for question in requested]


def test_arguments_of_gp_that_are_left_out_stay_symbols(tmp_path):
    text = convert(TOP, "pari", symbols=["a1", "a2", "a3"])
    assert gp(text, ["print(vector_field([1, 1/2, -3]~)[1] + 3/2*a1)"], tmp_path) == ["0"]


def numpy_answers(text: str, requested: list[Question], folder):
    calls = [f"np.ravel({q.function}({floats(q.point)}, {floats([q.eps])[0]})).tolist()" for q in requested]
    (line,) = run_python({"numpy": f"{text}\nprint(*{' + '.join(calls)})\n"})["numpy"]
    return list(map(float, line.split()))


def c_answers(text: str, requested: list[Question], folder):
    calls = []
    for q in requested:
        call = f"{q.function}((vector){{{{{', '.join(map(repr, floats(q.point)))}}}}}, {floats([q.eps])[0]!r})"
        kind = "double" if q.function.startswith(("integral", "modified", "density")) else "vector"
        kind = "matrix" if q.function == "kahan_jacobian" else kind
        calls.append(f"{{ {kind} value = {call}; show((double *)&value, {len(q.expected)}); }}")
    show = '#include <stdio.h>\nvoid show(double *x, int n) { for (int i = 0; i < n; i++) printf("%.17g\\n", x[i]); }\n'
    program = text + show + "int main(void) {\n" + "\n".join(calls) + "\nreturn 0;\n}\n"
    return compiled(["cc", "-std=c99", "-Wall", "-Werror", "-Wno-unused", "all.c", "-o", "all", "-lm"], program, folder)


def fortran_answers(text: str, requested: list[Question], folder):
    lines = ["program main", "use kahan_module"]
    for q in requested:
        point = ", &\n".join(f"{x!r}d0" for x in floats(q.point))
        call = f"{q.function}([double precision :: {point}], &\n{floats([q.eps])[0]!r}d0)"
        lines.append(f"print *, {f'transpose({call})' if q.function == 'kahan_jacobian' else call}")
    program = text + "\n".join([*lines, "end program"]) + "\n"
    return compiled(["gfortran", "all.f90", "-o", "all"], program, folder)


def compiled(command, program, folder):
    """The numbers that a program prints, compiled by the strict standard and without a warning."""
    needs(command[0])
    (folder / next(word for word in command if word.startswith("all."))).write_text(program)
    run(command, folder)
    return list(map(float, run([folder / "all"], folder).split()))


def floats(values):
    return [int(value.p) / int(value.q) for value in values]


FLOATS = {"numpy": numpy_answers, "c": c_answers, "fortran": fortran_answers}


@pytest.mark.parametrize("language", FLOATS)
@pytest.mark.parametrize("name", ["euler_top", "nasty-capitals", "constant"])
def test_floats_are_near_the_values_of_the_library(language, name, tmp_path):
    text, requested = converted(language, SYSTEMS[name])
    expected = floats(value for question in requested for value in question.expected)
    assert FLOATS[language](text, requested, tmp_path) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    if name == "euler_top":  # and a wrong sign is seen
        wrong = FLOATS[language](text.replace("-eps*x3", "eps*x3"), requested, tmp_path)
        assert wrong != pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_rows_are_exchanged_in_c_where_a_pivot_vanishes_and_long_integers_are_floats(tmp_path):
    rhs = f'variables = ["x", "y"]\n[system]\nrhs = ["2*x + y", "x"]\n[integrals]\nI = "{10**30}*x/3"'
    file = km.parse_system(rhs, "pivot")  # at eps = 1/2, I - eps f' = (0 -1/2; -1/2 1)
    x, half = (fmpq(3), fmpq(5)), fmpq(1, 2)
    image = list(km.KahanMap(file.system, half).step(x))
    requested = [Question("kahan_map", x, half, image), Question("integral_I", x, half, [fmpq(10) ** 30])]
    result = c_answers(convert(file, "c"), requested, tmp_path)
    assert result == pytest.approx([*floats(image), 1e30], rel=1e-12)
