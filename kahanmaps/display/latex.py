r"""Names, polynomials and rational functions as LaTeX for formulas, exactly.

    x1 -> x_1    x12 -> x_{12}    eps -> \varepsilon    alpha2 -> \alpha_2    al -> al    my_H -> \mathrm{my\_H}
    x1~ -> \tilde{x_1}

The text belongs into math mode. Products are written with a space, so that a reader, and a program, can take the
factors apart again.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import Notation, first_terms
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

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> print(latex_polynomial(parse_polynomial("x1^3/3 - eps^12*x1 + 1/2", ["x1", "eps"])))
    -\varepsilon^{12} x_1 + \frac{1}{3} x_1^3 + \frac{1}{2}
    """
    return LATEX.polynomial(polynomial)


@latex_form.register
def latex_rational_function(function: RationalFunction) -> str:
    r"""A quotient of polynomials over Q as LaTeX, exact, without fractions inside the fraction, in factors where they
    are shorter.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> print(latex_rational_function(parse_rational_function("(x/2 + 1)/(1 - eps^2*x)", ["x", "eps"])))
    -\frac{x + 2}{2 \varepsilon^2 x - 2}
    >>> print(latex_rational_function(parse_rational_function("-2*(x + 1)^2*y/3", ["x", "y"])))
    -\frac{2 y \left(x + 1\right)^2}{3}
    """
    return LATEX.rational(function)


def latex_cut(polynomial: fmpq_mpoly, characters: int) -> str:
    r"""A polynomial as LaTeX; only its beginning and the number of its terms where it takes more characters, about.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
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


def latex_matrix(entries: fmpq_mat, most: int = 8) -> str:
    r"""A matrix over Q; only its size where it has more than `most` rows or columns, or entries of many digits.

    >>> print(latex_matrix(fmpq_mat([[1, 0]])))
    \begin{pmatrix} 1 & 0 \end{pmatrix}
    """
    rows, columns = int(entries.nrows()), int(entries.ncols())
    bits = max((max(int(entry.p.bit_length()), int(entry.q.bit_length())) for entry in entries.entries()), default=0)
    if max(rows, columns) > most or bits > 100:
        return rf"\text{{a matrix with {rows} rows and {columns} columns}}"
    lines = r" \\ ".join(" & ".join(map(latex_number, row)) for row in entries.tolist())
    return rf"\begin{{pmatrix}} {lines} \end{{pmatrix}}"


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


def _braced(digits: str) -> str:
    return digits if len(digits) == 1 else f"{{{digits}}}"


LATEX = Notation(
    name=latex_name,
    number=latex_number,
    power=lambda base, exponent: f"{base}^{_braced(str(exponent))}",
    times=" ",
    fraction=r"\frac{{{}}}{{{}}}".format,
    enclosed=r"\left({}\right)".format,
)
