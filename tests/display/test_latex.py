"""Formulas in LaTeX: what is written is read back, by a small reader of its own, as the same polynomial."""

import re

import pytest
from flint import fmpq
from helpers import rationals
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.display.latex import (
    latex_cut,
    latex_name,
    latex_number,
    latex_polynomial,
    latex_rational_function,
)

NAMES = ["x1", "x12", "al", "eps", "beta", "my_H"]
RING = ring(NAMES)
BY_LATEX = {latex_name(name): gen for name, gen in zip(NAMES, RING.gens(), strict=True)}
NUMBER = re.compile(r"\\frac\{([0-9]+)\}\{([0-9]+)\}|([0-9]+)")


def read_back(text):
    """The polynomial that the text of `latex_polynomial` stands for."""
    total, sign = RING.constant(0), 1
    if text.startswith("-"):
        sign, text = -1, text[1:]
    for piece in re.split(r" ([+-]) ", text):
        if piece in "+-":
            sign = 1 if piece == "+" else -1
            continue
        term = RING.constant(sign)
        for k, factor in enumerate(piece.split(" ")):
            number = NUMBER.fullmatch(factor)
            if number:
                assert k == 0
                term = term * (fmpq(int(number[1]), int(number[2])) if number[1] else fmpq(int(number[3])))
                assert factor != "1" or piece == "1", "1 before a factor"
            elif factor in BY_LATEX:
                term = term * BY_LATEX[factor]
            else:
                base, exponent = re.fullmatch(r"(.*)\^(?:([2-9])|\{([0-9]{2,})\})", factor).group(1, 2)
                exponent = exponent or re.search(r"\{([0-9]+)\}$", factor)[1]
                term = term * BY_LATEX[base] ** int(exponent)
        total = total + term
    return total


def read_product(text):
    """The product that a side of a fraction stands for: factors in brackets, and one without."""
    found = RING.constant(1)
    for inside, power in re.findall(r"\\left\((.*?)\\right\)(?:\^\{?([0-9]+)\}?)?", text):
        found = found * read_back(inside) ** int(power or 1)
    rest = re.sub(r"\\left\(.*?\\right\)(\^\{[0-9]+\}|\^[0-9])?", "", text).strip()
    return found * read_back(" ".join(rest.split())) if rest else found


def polynomials():
    exponents = st.tuples(*[st.integers(0, 12)] * len(NAMES))
    terms = st.dictionaries(exponents, rationals().filter(bool), max_size=6)
    return terms.map(lambda found: RING.from_dict(found))


@given(polynomials())
def test_a_polynomial_is_read_back_equal(polynomial):
    assert read_back(latex_polynomial(polynomial)) == polynomial


@given(polynomials(), polynomials().filter(lambda polynomial: not polynomial.is_zero()))
def test_a_rational_function_is_read_back_equal(above, below):
    function = RationalFunction(above, below)
    whole = latex_rational_function(function)
    sign, text = (-1, whole[1:]) if whole.startswith("-") else (1, whole)
    # The bar of the whole is where the braces of \frac{...}{...} close.
    depth, ends = 0, []
    for at, mark in enumerate(text):
        if mark in "{}" and text[at - 1] != "\\":
            depth += 1 if mark == "{" else -1
            if depth == 0:
                ends.append(at)
    if not text.startswith(r"\frac{") or ends != [ends[0], len(text) - 1]:
        assert function.is_polynomial or function.numerator.is_zero()
        assert (sign * read_product(text) if r"\left(" in text else read_back(whole)) == function.numerator
        return
    top, bottom = text[6 : ends[0]], text[ends[0] + 2 : ends[1]]
    assert r"\frac" not in top + bottom
    assert not top.startswith("-")
    assert not bottom.startswith("-")
    assert RationalFunction(sign * read_product(top), read_product(bottom)) == function


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
