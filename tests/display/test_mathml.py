"""Formulas in MathML: what is shown is read back, by a small reader of its own, as the same polynomial."""

from dataclasses import replace
from xml.etree import ElementTree

import pytest
from flint import fmpq, fmpq_mat
from helpers import rationals, some
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.algebra.written.numerals import LIMITS
from kahanmaps.algebra.written.text import parse_polynomial, parse_rational_function
from kahanmaps.display.mathml import (
    equations,
    formula,
    mathml_name,
    mathml_number,
    mathml_rational_function,
    matrix,
)

NAMES = ["x1", "x12", "al", "eps", "beta", "my_H"]
RING = ring(NAMES)
BY_MATHML = {mathml_name(name): gen for name, gen in zip(NAMES, RING.gens(), strict=True)}
CORE = {"math", "mrow", "mi", "mn", "mo", "mfrac", "mstyle", "msup", "msub", "msubsup", "span", "br"}
LONG = parse_polynomial("(x + y + 1)^6", ["x", "y"])
POWER = parse_polynomial("(x + y)^40", ["x", "y"])


def element(html):
    return ElementTree.fromstring(f"<div>{html}</div>")


def read_row(children):
    """The polynomial that the elements of a sum stand for."""
    total, sign, term = RING.constant(0), 1, None
    for child in children:
        if child.tag == "mo" and child.text in "+−":
            if term is not None:
                total = total + sign * term
            sign, term = (1 if child.text == "+" else -1), None
        elif child.tag == "mo":
            assert child.text == "\u2062"  # times
        else:
            factor = read_factor(child)
            term = factor if term is None else term * factor
    return total if term is None else total + sign * term


def read_factor(child):
    text = ElementTree.tostring(child, encoding="unicode")
    if text in BY_MATHML:
        return BY_MATHML[text]
    if child.tag == "mn":
        return RING.constant(int(child.text))
    if child.tag == "mrow":  # the monomial of a product, or a factor in brackets
        return read_row(child[1] if child[0].text == "(" else child)
    if child.tag == "mfrac":
        above, below = map(read_factor, child)
        return above / below
    if child.tag == "mrow":
        return read_row(child[1]) if child[0].text == "(" else read_row(child)
    assert child.tag in ("msup", "msubsup")
    *base, exponent = child
    assert int(exponent.text) > 1
    inside = "".join(ElementTree.tostring(one, encoding="unicode") for one in base)
    name = ElementTree.fromstring(inside if child.tag == "msup" else f"<msub>{inside}</msub>")
    return read_factor(name) ** int(exponent.text)


def polynomials():
    exponents = st.tuples(*[st.integers(0, 12)] * len(NAMES))
    terms = st.dictionaries(exponents, rationals().filter(bool), max_size=6)
    return terms.map(lambda found: RING.from_dict(found))


@some
@given(polynomials(), polynomials().filter(lambda polynomial: not polynomial.is_zero()))
def test_a_rational_function_is_read_back_equal(above, below):
    function = RationalFunction(above, below)
    found = ElementTree.fromstring(mathml_rational_function(function))
    sign = 1
    if [one.tag for one in found] == ["mo", "mfrac"] and found[1][0].tag == "mrow":
        minus, found = found
        assert minus.text == "−"
        sign = -1
    if found.tag != "mfrac":
        assert function.is_polynomial or function.numerator.is_zero()
        assert read_row(found) == function.numerator
        return
    assert RationalFunction(sign * read_row(found[0]), read_row(found[1])) == function
    assert len(list(found.iter("mfrac"))) == 1, "a fraction within the fraction"


@some
@given(polynomials(), polynomials().filter(lambda polynomial: not polynomial.is_zero()))
def test_the_plain_text_of_a_formula_is_read_back_equal(above, below):
    function = RationalFunction(above, below)
    pieces = [math.get("alttext") for math in element(formula(function)).iter("math")]
    assert parse_rational_function(" ".join(pieces), NAMES, limits=replace(LIMITS, degree=200)) == function


@some
@given(polynomials(), polynomials().filter(lambda polynomial: not polynomial.is_zero()))
def test_only_elements_of_mathml_core_are_used(above, below):
    found = element(formula(RationalFunction(above, below), "I1") + equations(["x"], [above]))
    assert {one.tag for one in found.iter()} <= {*CORE, "div"}


def test_a_short_formula_is_one_piece_and_a_long_one_has_one_for_each_term():
    x = parse_polynomial("x^2 - 1", ["x"])
    assert len(list(element(formula(x)).iter("math"))) == 1
    assert len(list(element(formula(LONG)).iter("math"))) == len(LONG)


def test_a_long_quotient_is_written_with_a_slash():
    short = element(formula(parse_rational_function("x/(1 + y)", ["x", "y"])))
    assert [one.tag for one in short.iter("mfrac")] == ["mfrac"]
    long = element(formula(RationalFunction(LONG + 1, parse_polynomial("x*y", ["x", "y"])), "I"))
    texts = [math.get("alttext") for math in long.iter("math")]
    assert (texts[:2], texts[-4:]) == (["I =", "("], ["/", "(", "x*y", ")"])


@pytest.mark.parametrize(
    ("text", "plain", "first"),
    [
        ("(x^2 - 1)*y/(1 - x*y)^2", "y*(x^2 - 1)/(x*y - 1)^2", "mstyle"),
        ("-3*(x - y)^2*(x + y)^3*(x + 2*y)^2*(x + 5*y)/(2*y*(x + 3*y)*(x - 7*y)^2)", None, "mo"),
        ("(x + 1)^4*y", "y*(x + 1)^4", "mstyle"),
    ],
)
def test_products_are_shown_in_factors_with_powers_behind_the_brackets(text, plain, first):
    function = parse_rational_function(text, ["x", "y"])
    pieces = list(element(formula(function)).iter("math"))
    assert pieces[0][0].tag == first
    shown = " ".join(math.get("alttext") for math in pieces)
    assert parse_rational_function(shown, ["x", "y"]) == function
    assert "(" in shown
    assert plain in (None, shown)


def test_what_is_too_long_is_cut_and_its_terms_are_told():
    cut = element(formula(POWER, characters=60))
    assert len(list(cut.iter("math"))) < 6
    assert "".join(cut.itertext()).endswith("+ … (41 terms)")
    whole = element(formula(POWER, characters=10_000))
    assert len(list(whole.iter("math"))) == 41


def test_a_coefficient_that_is_too_long_is_not_shown():
    found = element(formula(parse_polynomial("10^100*x", ["x"]), characters=60))
    assert "".join(found.itertext()) == "(a polynomial of 1 term, not shown)"


def test_the_derivative_has_a_prime():
    found = element(equations(["x1"], [parse_polynomial("x1^2", ["x1"])]))
    assert next(found.iter("math")).get("alttext") == "x1' ="
    assert "".join(next(found.iter("msubsup")).itertext()) == "x1′"


@pytest.mark.parametrize(
    ("name", "mathml"),
    [
        ("m12", "<msub><mi>m</mi><mn>12</mn></msub>"),
        ("eps", "<mi>ε</mi>"),
        ("epsilon", "<mi>ϵ</mi>"),
        ("Omega1", "<msub><mi>Ω</mi><mn>1</mn></msub>"),
        ("<b>&", "<mi>&lt;b&gt;&amp;</mi>"),
    ],
)
def test_names(name, mathml):
    assert mathml_name(name) == mathml


def test_numbers():
    assert mathml_number(fmpq(5)) == "<mn>5</mn>"
    assert mathml_number(fmpq(1, 2)) == "<mfrac><mn>1</mn><mn>2</mn></mfrac>"
    assert mathml_number(fmpq(-5)) == '<mrow><mo form="prefix">−</mo><mn>5</mn></mrow>'


def test_a_matrix_is_shown_row_by_row_up_to_eight_and_by_its_size_beyond():
    found = element(matrix(fmpq_mat([[1, fmpq(-1, 2)], [0, 3]]), "A"))
    assert next(found.iter("math")).get("alttext") == "A = [[1, -1/2], [0, 3]]"
    rows = [["".join(cell.itertext()) for cell in row.iter("mtd")] for row in found.iter("mtr")]
    assert rows == [["1", "−12"], ["0", "3"]]
    assert next(element(matrix(fmpq_mat([[1, 2]]))).iter("math")).get("alttext") == "[[1, 2]]"
    assert len(list(element(matrix(fmpq_mat(8, 8))).iter("mtd"))) == 64
    for rows_, columns in ((9, 1), (1, 9)):
        told = f"a matrix with {rows_} rows and {columns} columns"
        assert "".join(element(matrix(fmpq_mat(rows_, columns), "J")).itertext()) == f"J: {told}"
        assert "".join(element(matrix(fmpq_mat(rows_, columns))).itertext()) == told
    assert "2 columns" in matrix(fmpq_mat([[1, fmpq(10) ** 100]]))
