"""Numbers, points, polynomials and rational functions in text.

Any text, however hostile, ends in an `ExpressionError` while FLINT, which would end the process, is still safe.
"""

from pathlib import Path

import pytest
from flint import fmpq, fmpq_mpoly, fmpz
from helpers import quick, refuses, table
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import (
    ExpressionLimits,
    parse_constant,
    parse_number,
    parse_point,
    parse_polynomial,
    parse_rational_function,
)
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.algebra.printing import format_factored, format_number, format_point, format_rational_function
from kahanmaps.errors import ExpressionError

NAMES = ["x", "y", "z"]
RING = ring(NAMES)
x, y, z = RING.gens()
THIRD = fmpq(1, 3)

rationals = st.builds(fmpq, st.integers(-(10**30), 10**30), st.integers(1, 10**15))
polynomials = st.dictionaries(st.tuples(*[st.integers(0, 5)] * 3), rationals, max_size=8).map(RING.from_dict)
nonzero = polynomials.filter(lambda p: not p.is_zero())
rational_functions = st.builds(RationalFunction, polynomials, nonzero)


def mistakes(heading: str) -> list[tuple[str | int, ...]]:
    """The rows of mistakes.txt below a heading: text, column and words."""
    rows = (line.split(" | ") for line in table(Path(__file__).with_name("mistakes.txt"))[heading])
    return [(text, int(column), *words) for column, text, *words in rows]


def error_of(text: str, limits: ExpressionLimits | None = None) -> ExpressionError:
    """The error that a text meets as a rational function of x, y, z."""
    with pytest.raises(ExpressionError) as caught:
        parse_rational_function(text, NAMES, {"a": THIRD}, limits=limits or ExpressionLimits())
    return caught.value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-0", fmpq(0)),
        ("+7", fmpq(7)),
        ("-6/4", fmpq(-3, 2)),
        ("0.1", fmpq(1, 10)),  # not the double next to it
        (".5", fmpq(1, 2)),
        ("-.25", fmpq(-1, 4)),
        ("1e-3", fmpq(1, 1000)),
        ("1.50E+2", fmpq(150)),
        ("0e9999", fmpq(0)),
        (" \t1/2\r\n", fmpq(1, 2)),
        ("1/10^6", fmpq(1, 10**6)),
        ("-2**3/3^2", fmpq(-8, 9)),
        ("10^-6", fmpq(1, 10**6)),
    ],
)
def test_a_number_in_text_is_exact(text: str, value: fmpq):
    assert parse_number(text) == value


@pytest.mark.parametrize(
    ("text", "column"),
    [
        *mistakes("no numbers"),
        ("", 0),
        ("٣", 0),  # Arabic-Indic three: a digit to Python's int()
        ("1\N{NO-BREAK SPACE}", 1),
        ("\N{MINUS SIGN}1", 0),
    ],
)
def test_what_is_not_a_number_is_refused_at_its_column(text: str, column: int):
    with pytest.raises(ExpressionError) as caught:
        parse_number(text)
    assert caught.value.text == text
    assert caught.value.column == min(column, len(text))


def test_numbers_pass_the_4300_digits_at_which_python_stops():
    digits = "123456789" * 2000
    assert format_number(parse_number(digits)) == digits
    assert parse_number(f"{digits}1/{digits}") == fmpq(fmpz(digits) * 10 + 1, fmpz(digits))
    assert format_number(parse_polynomial(f"{digits}*x", NAMES).leading_coefficient()) == digits


@given(st.lists(rationals).map(tuple))
def test_a_printed_point_parses_back(point: tuple[fmpq, ...]):
    assert parse_point(format_point(point), len(point)) == point


@pytest.mark.parametrize("text", ["1/2,-3", "[1/2,-3]", " (1/2, -3) ", "{1/2, -3}", "1/2 -3", "[ 1/2\t-3 ]"])
def test_a_point_may_stand_in_brackets_and_have_blanks_for_commas(text: str):
    assert parse_point(text) == (fmpq(1, 2), fmpq(-3))


@pytest.mark.parametrize(
    ("text", "entry", "column"),
    [
        ("1,2,x", 3, 4),
        ("1,,2", 2, 2),
        ("1,2,", 3, 4),
        ("(1,2", 1, 0),
        ("1 2 x", 3, 4),
        ("1, 2/0", 2, 5),
        ("1/3^2, 1/2^9999", 2, 10),
        ("1;2", 1, 1),
    ],
)
def test_a_mistake_in_a_point_names_entry_and_column(text: str, entry: int, column: int):
    with pytest.raises(ExpressionError, match=f"^entry {entry}: ") as caught:
        parse_point(text)
    assert caught.value.column == column


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-x^2", -(x**2)),  # the power binds tighter than the sign
        ("(-x)^2", x**2),
        ("- - -x", -x),
        ("2*-x", -2 * x),
        ("2^3^2*x", 512 * x),  # powers from the right
        ("1/2*x/3", x / 6),
        ("0.1*x + 1e-2 + .5", x / 10 + fmpq(51, 100)),
        ("a*x + A", x / 3 + 5),
        ("x^a0", x**2),
        ("2^-1*x", x / 2),
        ("x/(2 - 1/2)", 2 * x / 3),
        ("x^(y - y + 2)", x**2),
        ("x^0 + 0^0", x - x + 2),
        ("\n x\t+\r y ", x + y),
        ("x^64", x**64),
    ],
)
def test_a_polynomial_in_text_means_what_algebra_says(text: str, value: fmpq_mpoly):
    assert parse_polynomial(text, NAMES, {"a": THIRD, "A": fmpq(5), "a0": fmpq(2)}) == value


def test_a_constant_knows_its_constants_only():
    assert parse_constant("(1 + a)^-2", {"a": THIRD}) == fmpq(9, 16)
    refuses("unknown name 'b': known are a", parse_constant, "b", {"a": THIRD}, error=ExpressionError)
    refuses("expected numbers only", parse_constant, "b", error=ExpressionError)


@pytest.mark.parametrize(
    ("text", "above", "below"),
    [
        ("x/(y-1) + 1/(y-1)", x + 1, y - 1),
        ("x/(2*y) + z/(3*y)", (3 * x + 2 * z) / 6, y),  # denominators equal up to a constant
        ("x/(y-1) - x/2 + 1", (2 * x - x * (y - 1) + 2 * (y - 1)) / 2, y - 1),
        ("1/x + 1/y", x + y, x * y),
        ("1/(1/(1/x))", x / x, x),
        ("(x/y)^-2", y**2, x**2),
        ("x/(y/z)", x * z, y),
        ("1/y - 1/y", x - x, x**0),
        ("x^2/x", x**2, x),  # common factors stay
    ],
)
def test_a_quotient_is_kept_simple(text: str, above: fmpq_mpoly, below: fmpq_mpoly):
    function = parse_rational_function(text, NAMES)
    assert (function.numerator, function.denominator) == (above, below)


@pytest.mark.parametrize(
    ("function", "printed"),
    [
        (RationalFunction(x + 1, x**0), "x + 1"),
        (RationalFunction(x - x, y), "0"),
        (RationalFunction(-x, y**2), "-x/y^2"),
        (RationalFunction(x, 2 * y), "x/2/y"),
        (RationalFunction(x, y * z), "x/(y*z)"),
        (RationalFunction(x + 1, 1 - y), "(-x - 1)/(y - 1)"),
    ],
)
def test_a_quotient_is_printed_with_brackets_where_they_are_needed(function: RationalFunction, printed: str):
    assert format_rational_function(function) == printed


@given(rational_functions)
def test_a_printed_rational_function_parses_back(function: RationalFunction):
    assert parse_rational_function(format_rational_function(function), NAMES) == function


@given(rational_functions, rational_functions)
def test_arithmetic_of_texts_is_arithmetic_of_functions(left: RationalFunction, right: RationalFunction):
    a, b = format_rational_function(left), format_rational_function(right)
    product = RationalFunction(left.numerator * right.numerator, left.denominator * right.denominator)
    crossed = left.numerator * right.denominator - right.numerator * left.denominator
    assert parse_rational_function(f"({a})*({b})", NAMES) == product
    assert parse_rational_function(f"{a} - ({b})", NAMES) == RationalFunction(crossed, product.denominator)


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [
        *mistakes("no expressions"),
        ("", None, "found nothing, expected an expression"),
        ("x\N{MINUS SIGN}y", 1, "U+2212 MINUS SIGN, write the minus sign as -"),
        ("x\N{SUPERSCRIPT TWO}", 1, "write the power as ^2"),
        ("ε*x", 0, "U+03B5 GREEK SMALL LETTER EPSILON"),
        ("x\N{NO-BREAK SPACE}+ y", 1, "U+00A0 NO-BREAK SPACE"),
        ("\ud800", 0, "U+D800"),
    ],
)
def test_a_mistake_is_named_at_its_column(text: str, column: int | None, message: str):
    error = error_of(text)
    assert error.column == column
    assert message in error.message


# Limits

HOSTILE = {
    "code": "__import__('os').system('true')",
    "higher tower": "9**9**9**9",
    "power of a power": "(9^1000)^1000",
    "exponent": "x^1001",
    "nested powers of sums": "((((x + y)^8 + z)^8)^8)^8",
    "degree of a product": "*".join(["x"] * 65),
    "a million brackets": "(" * 10**6,
    "a megabyte": "x+" * 500_000 + "x",
    "length": "x" + " " * 200_000,
    "dense power": "(x + y + z + 1)^64",
    "long product of sums": "*".join(f"(x + {i}*y + z + 1)" for i in range(64)),
    "growing denominators": "+".join(f"1/(x + {i})" for i in range(1, 10_000)),
    "continued fraction": "1/(x + " * 99 + "1" + ")" * 99,
    "digits": "9" * 100_001,
    "large numbers": "+".join(["(9^999)^99"] * 18_000),
    "large decimals": "+".join(["1e9999"] * 5_000),
    "large coefficients": "(9^900*x + 7^900*y + 5^900*z + 3)^20",
    "a bad end": "x+" * 9_990 + "$",
    "a missing end": "x+" * 9_990,
    "signs without end": "-" * 19_999,
}


@pytest.mark.parametrize(
    "name", quick(HOSTILE, HOSTILE.keys() - {"growing denominators", "large numbers", "large decimals"})
)
def test_a_hostile_text_is_refused(name: str):
    text = HOSTILE[name]
    error = error_of(text)
    assert error.text == text
    assert len(str(error)) < 400


@pytest.mark.parametrize(
    ("limits", "good", "bad"),
    [
        (ExpressionLimits(characters=5), "x + y", "x  + y"),
        (ExpressionLimits(depth=2), "((x)) + ((y))", "(((x)))"),
        (ExpressionLimits(degree=3), "(x + y)^3/(x + z)^3", "(x + y)^2*(x + z)^2"),
        (ExpressionLimits(exponent=3), "2^-3*x^3", "2^4"),
        (ExpressionLimits(digits=3), "999*x", "1000*x"),
        (ExpressionLimits(digits=3), "31^2", "32^2*3"),
        (ExpressionLimits(digits=3), "x/999", "x/999 + y/998"),
        (ExpressionLimits(terms=3), "(x + y)^2", "(x + y)^3"),
        (ExpressionLimits(power_of_ten=3), "1e3*x", "1e-4*x"),
        (ExpressionLimits(words=100), "(x + y)^2", "(x + y + z)^9"),
    ],
)
def test_every_limit_has_two_sides(limits: ExpressionLimits, good: str, bad: str):
    parse_rational_function(good, NAMES, limits=limits)
    error_of(bad, limits)


@given(rational_functions, nonzero, st.integers(0, 3))
def test_what_is_printed_in_factors_is_read_back(function, factor, power):
    product = RationalFunction(function.numerator * factor**power, function.denominator * factor)
    for entry in (product, RationalFunction(product.numerator, RING.constant(3))):
        assert parse_rational_function(format_factored(entry), NAMES) == entry
