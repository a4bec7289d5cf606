r"""Names, polynomials and rational functions as LaTeX for formulas, exactly.

    x1 -> x_1    x12 -> x_{12}    eps -> \varepsilon    alpha2 -> \alpha_2    al -> al    my_H -> \mathrm{my\_H}
    x1~ -> \tilde{x_1}

The text belongs into math mode. Products are written with a space, so that a reader, and a program, can take the
factors apart again.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, common_denominator, names_of
from kahanmaps.algebra.reading import factors_of, first_terms, terms_of
from kahanmaps.algebra.text import shorter_factors, sides
from kahanmaps.displayed import latex_form
from kahanmaps.errors import InputError, counted

# TeX has no commands for the letters that look Latin, such as omicron and capital Alpha.
GREEK_NAMES = (
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|iota|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|upsilon|phi|chi|psi|omega"
    "|Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Upsilon|Phi|Psi|Omega"
)
_WITH_INDEX = re.compile(r"([A-Za-z]+)([0-9]*)")
_ESCAPES = {
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "$": r"\$",
    **{mark: "\\" + mark for mark in "_{}&#%"},
}


def latex_name(name: str) -> str:
    r"""A name as LaTeX: final digits become an index, eps \varepsilon, Greek names Greek letters.

    `name` is printable text; what is not letters followed by digits is set upright, with TeX's special characters
    escaped. Different names give different text. Raises InputError for text that is empty or not printable.

    >>> print(latex_name("x1"), latex_name("eps"), latex_name("Gamma12"), latex_name("al"), latex_name("modified_H"))
    x_1 \varepsilon \Gamma_{12} al \mathrm{modified\_H}
    """
    if not name or not name.isprintable():
        raise InputError(f"found the name {name[:40]!r}, expected printable text")
    bare = name.rstrip("~")  # x~ is the image of x, x~~ that of x~
    if bare and bare != name:
        return r"\tilde{" + latex_name(name[:-1]) + "}"
    match = _WITH_INDEX.fullmatch(name)
    if match is None:
        return r"\mathrm{" + "".join(_ESCAPES.get(mark, mark) for mark in name) + "}"
    letters, digits = match.groups()
    if letters == "eps":
        letters = r"\varepsilon"
    elif re.fullmatch(GREEK_NAMES, letters):
        letters = "\\" + letters
    return letters + ("_" + _braced(digits) if digits else "")


def latex_number(value: fmpq) -> str:
    r"""An exact number as LaTeX.

    >>> print(latex_number(fmpq(-3, 2)), latex_number(fmpq(7)))
    -\frac{3}{2} 7
    """
    size = str(abs(value.p)) if value.q == 1 else rf"\frac{{{abs(value.p)}}}{{{value.q}}}"
    return f"-{size}" if value < 0 else size


@latex_form.register
def latex_polynomial(polynomial: fmpq_mpoly) -> str:
    r"""A polynomial over Q as LaTeX, exact: its terms in the order of its ring, as in plain text.

    >>> from kahanmaps.algebra.text import parse_polynomial
    >>> print(latex_polynomial(parse_polynomial("x1^3/3 - eps^12*x1 + 1/2", ["x1", "eps"])))
    -\varepsilon^{12} x_1 + \frac{1}{3} x_1^3 + \frac{1}{2}
    """
    names = names_of(polynomial)
    order = sorted(range(len(names)), key=lambda k: names[k] != "eps")
    ordered = [latex_name(names[k]) for k in order]
    text = ""
    for monomial, coefficient in terms_of(polynomial):
        term = " ".join(factors_of(abs(coefficient), [monomial[k] for k in order], ordered, _power, latex_number))
        if coefficient < 0:
            text += f" - {term}" if text else f"-{term}"
        else:
            text += f" + {term}" if text else term
    return text or "0"


@latex_form.register
def latex_rational_function(function: RationalFunction) -> str:
    r"""A quotient of polynomials over Q as LaTeX, exact, without fractions inside the fraction, in factors where they
    are shorter.

    Both sides of a fraction start with a positive term. Common factors stay, as they do in `RationalFunction`.

    >>> from kahanmaps.algebra.text import parse_rational_function
    >>> print(latex_rational_function(parse_rational_function("(x/2 + 1)/(1 - eps^2*x)", ["x", "eps"])))
    -\frac{x + 2}{2 \varepsilon^2 x - 2}
    >>> print(latex_rational_function(parse_rational_function("-2*(x + 1)^2*y/3", ["x", "y"])))
    -\frac{2 y \left(x + 1\right)^2}{3}
    """
    found = shorter_factors(function)
    if found is not None and is_product(found[0]):
        factors, constant = found
        above, below = (
            latex_polynomial(powers[0][0])
            if number == 1 and [k for _, k in powers] == [1]
            else " ".join([str(number)] * (number > 1 or not powers) + [_latex_power(g, k) for g, k in powers])
            for number, powers in sides(factors, constant)
        )
        return ("-" if constant < 0 else "") + (above if below == "1" else rf"\frac{{{above}}}{{{below}}}")
    sign, *parts = above_and_below(function)
    above, below = map(latex_polynomial, parts)
    return above if below == "1" else rf"{sign}\frac{{{above}}}{{{below}}}"


def above_and_below(function: RationalFunction) -> tuple[str, fmpq_mpoly, fmpq_mpoly]:
    """Sign, numerator and denominator of a fraction as they are written: without fractions, the first terms positive.

    Polynomials have the denominator 1 and their own signs.
    """
    above, below = function.numerator, function.denominator
    if function.is_polynomial or above.is_zero():
        return "", above, above.context().constant(1)
    factor = fmpq(common_denominator(above))
    signs = [1 if part.coefficient(0) > 0 else -1 for part in (above, below)]
    return "-" if signs[0] != signs[1] else "", above * (factor * signs[0]), below * (factor * signs[1])


def latex_cut(polynomial: fmpq_mpoly, characters: int) -> str:
    r"""A polynomial as LaTeX; only its beginning and the number of its terms where it takes more characters, about.

    >>> from kahanmaps.algebra.text import parse_polynomial
    >>> print(latex_cut(parse_polynomial("(x + 1)^9", ["x"]), 20))
    x^9 + 9 x^8 + \cdots\ \text{(10 terms)}
    """
    shown = first_terms(polynomial, characters)
    if len(shown) == len(polynomial):
        return latex_polynomial(polynomial)
    terms = counted(len(polynomial), "term")
    if len(shown) == 0:
        return rf"\text{{({terms}, not shown)}}"
    return rf"{latex_polynomial(shown)} + \cdots\ \text{{({terms})}}"


def latex_aligned(equations: Sequence[tuple[str, str]], most: int = 12) -> str:
    r"""Equations left = right, both LaTeX, one below the other, for a notebook; at most so many, and then dots.

    >>> print(latex_aligned([("x", "1"), ("y", "2")]))
    $\displaystyle \begin{aligned} x &= 1 \\ y &= 2 \end{aligned}$
    """
    rows = [f"{left} &= {right}" for left, right in equations[:most]]
    if len(equations) > most:
        rows.append(rf"&\ \vdots\ \text{{({len(equations)} equations)}}")
    inside = r" \\ ".join(rows)
    return rf"$\displaystyle \begin{{aligned}} {inside} \end{{aligned}}$"


def is_product(factors: Sequence[tuple[fmpq_mpoly, int]]) -> bool:
    """Whether above or below the line a sum has other factors beside it, or is a power."""
    sides = ([(len(g) > 1, abs(k)) for g, k in factors if sign * k > 0] for sign in (1, -1))
    return any(any(is_sum for is_sum, _ in side) and sum(k for _, k in side) > 1 for side in sides)


def _latex_power(polynomial: fmpq_mpoly, exponent: int) -> str:
    if len(polynomial) == 1:
        return latex_polynomial(polynomial**exponent)
    power = "" if exponent == 1 else f"^{_braced(str(exponent))}"
    return rf"\left({latex_polynomial(polynomial)}\right){power}"


def _power(name: str, exponent: int) -> str:
    return f"{name}^{_braced(str(exponent))}"


def _braced(digits: str) -> str:
    return digits if len(digits) == 1 else f"{{{digits}}}"
