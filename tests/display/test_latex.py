"""Formulas in LaTeX: what is written is read back, by a small reader of its own, as the same polynomial."""

import re

import pytest
from flint import fmpq
from helpers import rationals
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.display.latex import latex_cut, latex_name, latex_number, latex_polynomial, latex_rational_function

NAMES = ["x1", "x12", "al", "eps", "beta", "my_H"]
RING = ring(NAMES)


def plain(latex):
    """A formula in our own syntax: names, then exponents, then quotients, then products."""
    for name in sorted(NAMES, key=len, reverse=True):
        latex = re.sub(
            rf"(?<![A-Za-z\\]){re.escape(latex_name(name))}(?![A-Za-z0-9_])", f"<{NAMES.index(name)}>", latex
        )
    latex = re.sub(r"<(\d)>", lambda match: NAMES[int(match[1])], latex)
    latex = re.sub(r"\^\{([0-9]+)\}", r"^\1", latex).replace(r"\left(", "(").replace(r"\right)", ")")
    latex = re.sub(r"\\frac\{([^{}]*)\}\{([^{}]*)\}", r"((\1)/(\2))", latex)
    return re.sub(r"(?<=[\w)]) (?=[\w(])", "*", latex)


def polynomials():
    exponents = st.tuples(*[st.integers(0, 12)] * len(NAMES))
    terms = st.dictionaries(exponents, rationals().filter(bool), max_size=6)
    return terms.map(lambda result: RING.from_dict(result))


@given(polynomials())
def test_a_polynomial_is_read_back_equal(polynomial):
    assert parse_polynomial(plain(latex_polynomial(polynomial)), NAMES) == polynomial


@given(polynomials(), polynomials().filter(bool))
def test_a_rational_function_is_read_back_equal(numerator, denominator):
    function = RationalFunction(numerator, denominator)
    latex = latex_rational_function(function)
    assert parse_rational_function(plain(latex), NAMES) == function
    assert function.is_polynomial or numerator == 0 or latex.count(r"\frac") == 1


@pytest.mark.parametrize(
    ("text", "latex"),
    [
        ("-1", "-1"),
        ("-x/2", r"-\frac{1}{2} x"),
        ("x^10*y - 3*x*y + 2/3", r"x^{10} y - 3 x y + \frac{2}{3}"),
    ],
)
def test_polynomials_are_written_as_people_write_them(text, latex):
    assert latex_polynomial(parse_polynomial(text, ["x", "y"])) == latex


@pytest.mark.parametrize(
    ("text", "latex"),
    [
        ("x/2", r"\frac{1}{2} x"),
        ("x/(2*y)", r"\frac{x}{2 y}"),
        ("x^2*y + 2*x*y^2", r"x y \left(x + 2 y\right)"),
        ("-x/(1 - y)", r"\frac{x}{y - 1}"),
        ("x/(eps*y - eps^2*x)", r"-\frac{x}{\varepsilon \left(\varepsilon x - y\right)}"),
        ("(x/3 - 1/2)/y", r"\frac{2 x - 3}{6 y}"),
    ],
)
def test_rational_functions_have_no_fractions_within_a_fraction(text, latex):
    assert latex_rational_function(parse_rational_function(text, ["x", "y", "eps"])) == latex


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("m12", "m_{12}"),
        ("eps", r"\varepsilon"),
        ("epsilon", r"\epsilon"),
        ("omicron", "omicron"),
        ("_", r"\mathrm{\_}"),
        ("I 1 {50%}", r"\mathrm{I 1 \{50\%\}}"),
        ("\\", r"\mathrm{\textbackslash{}}"),
    ],
)
def test_names(name, latex):
    assert latex_name(name) == latex


identifiers = st.text("abehptxA_019", min_size=1, max_size=6).filter(str.isidentifier)


@given(identifiers, identifiers)
def test_different_names_are_different_in_latex(first, second):
    assume(first != second)
    assert latex_name(first) != latex_name(second)


def test_numbers():
    assert [latex_number(fmpq(*pair)) for pair in ((-1, 2), (0, 1), (5, 1))] == [r"-\frac{1}{2}", "0", "5"]


def test_what_fits_is_shown_whole_and_what_does_not_is_cut_between_terms():
    square, long = parse_polynomial("x^2 + 2*x*y + y^2", ["x", "y"]), parse_polynomial("(x + y)^30", ["x", "y"])
    assert latex_cut(square, 300) == latex_polynomial(square)
    shown, more = latex_cut(long, 60).split(r" + \cdots\ ")
    assert latex_polynomial(long).startswith(shown + " + ")
    assert more == r"\text{(31 terms)}"
    assert latex_cut(long, 3) == r"\text{(31 terms, not shown)}"
