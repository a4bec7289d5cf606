"""What `convert` writes for PARI/GP is read by gp as it stands and gives the same exact values as the library."""

import pytest
from flint import fmpq
from language_helpers import CATALOGUE, HAS_GP, ask_gp, converted, gp_prints, questions, systems

import kahanmaps as km
from kahanmaps.algebra.written.text import parse_polynomial
from kahanmaps.languages.convert import convert

pytestmark = pytest.mark.skipif(not HAS_GP, reason="gp, the program of PARI, is not installed")

SYSTEMS = systems()


@pytest.mark.parametrize("name", SYSTEMS)
def test_gp_gives_the_values_of_the_library_exactly(name, tmp_path):
    text, asked = converted("pari", SYSTEMS[name])
    assert ask_gp(text, asked, tmp_path) == [question.expected for question in asked]


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        pytest.param("Mat([1, -x3*eps", "Mat([1, -2*x3*eps", id="eps for 2 eps"),
        pytest.param("Mat([1, -x3*eps", "Mat([1, x3*eps", id="sign"),
        pytest.param("[x1, x2, x3]~", "[x1, -x2, x3]~", id="sign of the right side"),
        pytest.param("kahan_map(point, -eps)", "kahan_map(point, eps)", id="inverse"),
    ],
)
def test_a_wrong_formula_would_be_noticed(right, wrong, tmp_path):
    text, asked = converted("pari", km.load("euler_top"))
    assert text.count(right) == 1
    answers = ask_gp(text.replace(right, wrong), asked, tmp_path)
    assert answers != [question.expected for question in asked]


def test_parameters_that_are_left_as_symbols_are_arguments_and_stand_for_themselves(tmp_path):
    file = km.load("euler_top")
    text = convert(file, "pari", symbols=["a1", "a2", "a3"])
    x, eps = (fmpq(1), fmpq(1, 2), fmpq(-3)), fmpq(1, 7)
    lines = [
        "print(kahan_map([1, 1/2, -3]~, 1/7, 5, 2, -1/3));",
        "print(vector_field([1, 1/2, -3]~));",
    ]
    there, field = gp_prints(text, lines, tmp_path)
    other = km.load("euler_top", {"a1": "5", "a2": "2", "a3": "-1/3"})
    assert there == f"[{', '.join(map(str, km.KahanMap(other.system, eps).step(x)))}]~"
    names = ("a1", "a2", "a3")
    found = [parse_polynomial(piece, names) for piece in field.strip("[]~").split(", ")]
    assert found == [parse_polynomial(piece, names) for piece in ("-3/2*a1", "-3*a2", "a3/2")]


WITH_PARAMETERS = [name for name in CATALOGUE if SYSTEMS[name].parameters and SYSTEMS[name].kind != "family"]


@pytest.mark.parametrize("name", WITH_PARAMETERS)
def test_symbols_get_any_values_afterwards(name, tmp_path):
    symbols = list(SYSTEMS[name].parameters)
    values = {symbol: f"{2 * k + 3}/{k + 2}" for k, symbol in enumerate(symbols)}
    parts, asked = questions(km.load(name, values))
    text = convert(SYSTEMS[name], "pari", parts, symbols=symbols)
    answers = ask_gp(text, asked, tmp_path, more="".join(f", {value}" for value in values.values()))
    assert answers == [question.expected for question in asked]
