"""Formulas in HTML: their pieces are the whole formula, MathML of them is sound; in LaTeX they are read back."""

import re
from xml.etree import ElementTree

import pytest
from flint import fmpq, fmpq_mat
from helpers import rationals, some
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.display.latex import (
    equations,
    formula,
    latex_cut,
    latex_name,
    latex_polynomial,
    latex_rational_function,
    matrix,
    typeset,
)
from kahanmaps.reports.page import mathml

NAMES = ["x1", "x12", "al", "eps", "beta", "my_H"]
RING = ring(NAMES)
LONG = parse_polynomial("(x + y + 1)^6", ["x", "y"])
MATHML = {"math", "mrow", "mi", "mn", "mo", "mfrac", "mstyle", "msup", "msub", "msubsup", "mtext", "mover"}
MATHML |= {"mtable", "mtr", "mtd", "mspace"}


def pieces(html):
    """The LaTeX of the pieces of a formula, as a notebook finds it."""
    text = "".join(ElementTree.fromstring(f"<div>{html}</div>").itertext())
    return [piece.removesuffix(r"\)") for piece in text.split(r"\(")[1:] for piece in [piece.strip()]]


def together(html):
    return " ".join(piece.removeprefix("{}") for piece in pieces(html))


def sound(latex):
    """Its MathML, with nothing in it that is no MathML, and no command that was not understood."""
    root = ElementTree.fromstring(mathml(latex))
    assert {element.tag for element in root.iter()} <= MATHML
    assert not [element.text for element in root.iter() if (element.text or "").startswith("\\") and element.text[1:]]
    assert root.get("alttext") == latex
    return root


def polynomials():
    exponents = st.tuples(*[st.integers(0, 12)] * len(NAMES))
    terms = st.dictionaries(exponents, rationals().filter(bool), max_size=6)
    return terms.map(lambda result: RING.from_dict(result))


@some
@given(polynomials(), polynomials().filter(bool))
def test_every_piece_of_a_formula_becomes_sound_mathml(numerator, denominator):
    for html in (formula(numerator, "I1"), formula(RationalFunction(numerator, denominator), "x1'")):
        for piece in pieces(html):
            sound(piece)


@some
@given(polynomials())
def test_the_pieces_of_a_polynomial_are_all_of_it(polynomial):
    assert together(formula(polynomial)).removeprefix(r"\displaystyle ") == latex_polynomial(polynomial)


def test_a_short_formula_is_one_piece_and_a_long_one_has_one_for_each_term():
    assert pieces(formula(parse_polynomial("x^2 - 1", ["x"]), "H")) == ["H = x^2 - 1"]
    assert len(pieces(formula(LONG))) == len(LONG)


def test_a_quotient_is_a_fraction_where_it_is_short_and_has_a_slash_where_it_is_long():
    short = parse_rational_function("x/(1 + y)", ["x", "y"])
    assert pieces(formula(short)) == [rf"\displaystyle {latex_rational_function(short)}"]
    long = parse_rational_function("-3*(x - y)^2*(x + 2*y)^2*(x + 5*y)/(2*y*(x + 3*y)*(x - 7*y)^2)", ["x", "y"])
    shown = together(formula(long))
    plain = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", shown)
    assert r"\frac" not in shown
    assert parse_rational_function(plain, ["x", "y"]) == long


def test_a_long_formula_is_cut_and_its_number_of_terms_is_reported():
    power = parse_polynomial("(x + y)^40", ["x", "y"])
    assert together(formula(power, characters=60)).endswith(r"+ \cdots\ \text{(41 terms)}")
    assert len(pieces(formula(power, characters=10_000))) == 41
    assert pieces(formula(parse_polynomial("10^100*x", ["x"]), characters=60)) == [r"\text{(1 term, not shown)}"]
    assert r"(41 terms)}) / (" in together(formula(RationalFunction(power, LONG), characters=60))


def test_the_derivative_has_a_prime_beside_its_index():
    (piece,) = pieces(equations(["x1"], [parse_polynomial("-x1^2", ["x1"])]))
    assert piece == "x_1' = -x_1^2"
    root = sound(piece)
    assert "".join(next(root.iter("msubsup")).itertext()) == "x1′"
    assert [entry.text for entry in root.iter("mo") if entry.get("form") == "prefix"] == ["−"]


def test_terms_are_not_parted_within_braces_and_no_bracket_needs_its_partner():
    assert pieces(typeset(r"\frac{x - 1}{y} + \left(z - 2\right) = 0")) == [r"\frac{x - 1}{y}", "{}+ (z", "{}- 2) = 0"]


@pytest.mark.parametrize(
    "name", ["m12", "epsilon", "Omega1", "<b>&", "a_b", "\\", "I 1 {50%}", "x^~$#", "{q1,p1}", "x1~"]
)
def test_names_of_every_kind_become_mathml(name):
    assert "b" not in {element.tag for element in sound(latex_name(name)).iter()}


def test_a_name_of_several_letters_does_not_look_like_a_product():
    product, fraction = sound("2 px_1 x py"), sound(r"\frac{x px}{2} + \cdots\ \text{(10 terms)}")
    upright = [entry.text for entry in product.iter("mi") if entry.get("mathvariant") == "normal"]
    assert upright == ["p", "x", "p", "y"]
    assert len(list(product.iter("mspace"))) == 2
    assert "(10\xa0terms)" in "".join(fraction.itertext())


@pytest.mark.parametrize("wrong", [r"x \right)", r"\nothing x", r"\begin{aligned} x &= 1 \\ y &= 2 \end{aligned}"])
def test_what_latex2mathml_cannot_convert_is_shown_as_code(wrong):
    """It raises for the first only; of an unknown command it makes an element, and of `aligned` no XML."""
    assert mathml(wrong).startswith("<code>")


def test_a_matrix_is_shown_row_by_row_up_to_eight_and_by_its_size_beyond():
    (piece,) = pieces(matrix(fmpq_mat([[1, fmpq(-1, 2)], [0, 3]]), "A"))
    rows = [["".join(cell.itertext()) for cell in row] for row in sound(piece).iter("mtr")]
    assert rows == [["1", "−12"], ["0", "3"]]
    assert len(list(sound(pieces(matrix(fmpq_mat(8, 8)))[0]).iter("mtd"))) == 64
    for rows_, columns in ((9, 1), (1, 9)):
        assert f"a matrix with {rows_} rows and {columns} columns" in matrix(fmpq_mat(rows_, columns))
    assert "2 columns" in matrix(fmpq_mat([[1, fmpq(10) ** 100]]))


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
    [("0", "0"), ("-1", "-1"), ("-x/2", r"-\frac{1}{2} x"), ("x^9*y - 3*x*y + 2/3", r"x^9 y - 3 x y + \frac{2}{3}")],
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


def test_what_fits_is_shown_whole_and_what_does_not_is_cut_between_terms():
    square, long = parse_polynomial("x^2 + 2*x*y + y^2", ["x", "y"]), parse_polynomial("(x + y)^30", ["x", "y"])
    assert latex_cut(square, 300) == latex_polynomial(square)
    shown, more = latex_cut(long, 60).split(r" + \cdots\ ")
    assert latex_polynomial(long).startswith(shown + " + ")
    assert more == r"\text{(31 terms)}"
    assert latex_cut(long, 3) == r"\text{(31 terms, not shown)}"
