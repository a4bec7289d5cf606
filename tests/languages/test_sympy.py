"""What `convert` writes for SymPy runs as it stands and gives the same exact values as the library.

Loading SymPy takes a second: all scripts are run by one process, each in a namespace of its own.
"""

import pytest
from flint import fmpq
from language_helpers import converted, numbers, question_in_python, run_python, systems

import kahanmaps as km
from kahanmaps.languages.convert import convert
from kahanmaps.languages.language import Language

SYSTEMS = systems()
FILES = {name: converted("sympy", file) for name, file in SYSTEMS.items()}
TOP, TOP_ASKED = FILES["euler_top"]
WRONG = {
    "eps for 2 eps": TOP.replace("Matrix([[1, -x3*eps", "Matrix([[1, -2*x3*eps"),
    "sign": TOP.replace("Matrix([[1, -x3*eps", "Matrix([[1, x3*eps"),
    "sign of the right side": TOP.replace("Matrix([x1, x2, x3])", "Matrix([x1, -x2, x3])"),
}
# A polynomial of 1365 terms, and an integer of more digits than Python reads.
MANY_TERMS = """
variables = ["x1", "x2", "x3", "x4"]
[system]
rhs = ["1", "1", "1", "1"]
[integrals]
big = "(1 + x1 + 2*x2 + x3/3 - x4)^11"
"""
LONG_NUMBER = f'variables = ["x"]\n[system]\nrhs = ["{"7" * 5000}*x"]'
SPECIAL = """
import builtins, keyword, string, sympy
from sympy import Symbol, sympify
known = (name for name in (*dir(sympy), *dir(builtins), *keyword.kwlist) if len(name) == 2 and name.isalpha())
for name in [*string.ascii_letters, *known, "beta", "gamma", "zeta"]:
    try:
        same = sympify(name) == Symbol(name)
    except Exception:
        same = False
    if not same:
        print(name)
"""


# The image of (1, 1, 1) at eps = 1/4 where a1 is a square root of 2, or 2, against a point over Q(t).
ALGEBRAIC = """
from sympy import Integer, Matrix, Rational, expand, radsimp, sqrt, sympify
for t in (sqrt(2), -sqrt(2), Integer(2)):
    image = kahan_map(Matrix([1, 1, 1]), Rational(1, 4), t)
    print(all(expand(radsimp(a - sympify(b).subs("t", t))) == 0 for a, b in zip(image, POINT, strict=True)))
"""


def prints_of_right_hand_sides(file: km.SystemFile) -> str:
    symbols = ", ".join(f'Symbol("{variable}")' for variable in file.variables)
    return convert(file, "sympy", ["system"]) + f"for entry in vector_field([{symbols}]):\n    print(entry)\n"


@pytest.fixture(scope="module")
def printed() -> dict[str, list[str]]:
    """What each of the scripts prints."""
    scripts = {f"values {name}": text + question_in_python(asked) for name, (text, asked) in FILES.items()}
    scripts |= {f"wrong {name}": text + question_in_python(TOP_ASKED) for name, text in WRONG.items()}
    scripts |= {f"rhs {name}": prints_of_right_hand_sides(file) for name, file in SYSTEMS.items()}
    weierstrass = convert(km.load("weierstrass"), "sympy", ["integrals"])
    scripts["integers"] = weierstrass + "print(integral_modified_H([1, 2], 3))"
    top = km.load("euler_top")
    symbolic = convert(top, "sympy", symbols=["a1", "a3"])
    scripts["symbols"] = symbolic + "print(vector_field([1, 2, 3])[0], vector_field([1, 2, 3], 5, 7)[2])"
    many = convert(km.parse_system(MANY_TERMS, "many"), "sympy", ["integrals"])
    scripts["many terms"] = many + "print(integral_big([3, 1, 3, 6], 1))"
    long = convert(km.parse_system(LONG_NUMBER, "long"), "sympy", ["system"])
    scripts["long number"] = long + "print(vector_field([1])[0] == sum(7*10**k for k in range(5000)))"
    scripts["special"] = SPECIAL
    file = km.load("euler_top", a1="root of t^2 - 2 near 1.4")
    *_, end = km.orbit(file, [1, 1, 1], "1/4", 1)
    scripts["algebraic"] = convert(file, "sympy") + ALGEBRAIC.replace("POINT", repr(list(end.text)))
    return run_python(scripts)


@pytest.mark.parametrize("name", SYSTEMS)
def test_sympy_gives_the_values_of_the_library_exactly(name, printed):
    _, asked = FILES[name]
    answers = [numbers(line) for line in printed[f"values {name}"]]
    assert answers == [question.expected for question in asked]


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_formula_would_be_noticed(name, printed):
    assert WRONG[name] != TOP
    answers = [numbers(line) for line in printed[f"wrong {name}"]]
    assert answers != [question.expected for question in TOP_ASKED]


def test_short_names_that_sympify_reads_otherwise_are_replaced(printed):
    special = printed["special"]
    assert "I" in special
    assert [name for name, used in Language.load("sympy").safe(special).items() if name == used] == []


def test_parameters_that_are_left_as_symbols_are_arguments_and_stand_for_themselves(printed):
    assert printed["symbols"] == ["6*a1 14"]


def test_an_algebraic_parameter_is_an_argument(printed):
    assert printed["algebraic"] == ["True", "True", "False"]


NUMBERS = """
from fractions import Fraction
from flint import fmpq, fmpz
from sympy.external.gmpy import GROUND_TYPES
print(GROUND_TYPES)
for kind in (fmpq, Fraction, Rational, lambda p, q: f"{p}/{q}", lambda p, q: str(p / q), lambda p, q: p / fmpq(q)):
    image = kahan_map([kind(-1, 2), kind(3, 4), fmpz(10) ** 30], kind(1, 8), kind(5, 4))
    print([str(entry) for entry in image])
    print(integral_F1((kind(1, 2), 2, kind(3, 4)), kind(1, 8), kind(5, 4)))
print(kahan_matrix([1, 2, 3], 0.5)[1])
"""


@pytest.mark.parametrize("ground", ["flint", "python"])
def test_numbers_are_exact_whatever_ground_types_sympy_has(ground):
    """sympify makes floats of the numbers of FLINT where SymPy does not work with them itself."""
    text = convert(km.load("euler_top"), "sympy", symbols=["a1"]) + NUMBERS
    ground_types, *lines, of_a_float = run_python({"": text}, SYMPY_GROUND_TYPES=ground)[""]
    top = km.load("euler_top", a1="5/4")
    image = km.map(top, "1/8")(["-1/2", "3/4", 10**30])
    integral = top.integrals["F1"].value(km.QQ, [fmpq(1, 2), fmpq(2), fmpq(3, 4), fmpq(1, 8)])
    assert ground_types == ground
    assert lines == [str([str(entry) for entry in image]), str(integral)] * 6
    assert "." in of_a_float  # control: floats stay floats


def test_a_sum_of_many_terms_does_not_exhaust_the_parser(printed):
    assert printed["many terms"] == [str((1 + 3 + 2 + 1 - 6) ** 11)]


def test_an_integer_of_more_digits_than_python_reads_is_written_in_another_base(printed):
    assert printed["long number"] == ["True"]
