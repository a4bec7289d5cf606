r"""Names, polynomials and rational functions as LaTeX, or as formulas in HTML.

    x1 -> x_1    x12 -> x_{12}    eps -> \varepsilon    alpha2 -> \alpha_2    al -> al    my_H -> \mathrm{my\_H}
    x1~ -> \tilde{x_1}

The LaTeX is for math mode. Spaces separate factors, so that formulas can be parsed again. In HTML, \( and \) enclose a
formula; notebooks typeset it, and pages convert it to MathML.

Neither MathJax nor MathML breaks lines. Hence a long formula is a <span class="formula"> with one element for each
term, so that the browser can break lines between terms. A long quotient is written with a slash.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import PLAIN, Notation, first_terms, integer_fraction
from kahanmaps.display.markup import escape
from kahanmaps.display_protocols import latex_form
from kahanmaps.errors import InputError, counted

# TeX has no commands for Greek letters that look like Latin ones, such as omicron and capital Alpha.
GREEK_NAMES = (
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|iota|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|upsilon|phi|chi|psi|omega"
    "|Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Upsilon|Phi|Psi|Omega"
)
_INDEXED_NAME = re.compile(r"([A-Za-z]+)([0-9]*)")
_ESCAPES = {
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "$": r"\$",
    **{mark: "\\" + mark for mark in "_{}&#%"},
}


def latex_name(name: str) -> str:
    r"""Return a name as LaTeX: digits at its end become an index; eps and names of Greek letters become these letters.

    A name that is not of the form letters-digits is set upright, and TeX's special characters in it are escaped.
    Different names have different LaTeX. Raises InputError for a text that is empty or not printable.

    >>> print(latex_name("x1"), latex_name("eps"), latex_name("Gamma12"), latex_name("al"), latex_name("modified_H"))
    x_1 \varepsilon \Gamma_{12} al \mathrm{modified\_H}
    """
    if not name or not name.isprintable():
        raise InputError(f"found the name {name[:40]!r}, expected printable text")
    name_without_tildes = name.rstrip("~")  # x~ is the image of x, x~~ the image of x~
    if name_without_tildes and name_without_tildes != name:
        return r"\tilde{" + latex_name(name[:-1]) + "}"
    match = _INDEXED_NAME.fullmatch(name)
    if match is None:
        return r"\mathrm{" + "".join(_ESCAPES.get(mark, mark) for mark in name) + "}"
    letters, digits = match.groups()
    if letters == "eps":
        letters = r"\varepsilon"
    elif re.fullmatch(GREEK_NAMES, letters):
        letters = "\\" + letters
    return letters + ("_" + _braced(digits) if digits else "")


def latex_number(value: fmpq) -> str:
    r"""Return an exact number as LaTeX.

    >>> print(latex_number(fmpq(-3, 2)), latex_number(fmpq(7)))
    -\frac{3}{2} 7
    """
    size = str(abs(value.p)) if value.q == 1 else rf"\frac{{{abs(value.p)}}}{{{value.q}}}"
    return f"-{size}" if value < 0 else size


@latex_form.register
def latex_polynomial(polynomial: fmpq_mpoly) -> str:
    r"""Return a polynomial over Q as LaTeX; the terms are in the order of its ring.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> print(latex_polynomial(parse_polynomial("x1^3/3 - eps^12*x1 + 1/2", ["x1", "eps"])))
    -\varepsilon^{12} x_1 + \frac{1}{3} x_1^3 + \frac{1}{2}
    """
    return LATEX.polynomial(polynomial)


@latex_form.register
def latex_rational_function(function: RationalFunction) -> str:
    r"""Return a rational function over Q as LaTeX, without nested fractions; it is factored if this is shorter.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> print(latex_rational_function(parse_rational_function("(x/2 + 1)/(1 - eps^2*x)", ["x", "eps"])))
    -\frac{x + 2}{2 \varepsilon^2 x - 2}
    >>> print(latex_rational_function(parse_rational_function("-2*(x + 1)^2*y/3", ["x", "y"])))
    -\frac{2 y \left(x + 1\right)^2}{3}
    """
    return LATEX.rational(function)


def latex_cut(polynomial: fmpq_mpoly, characters: int) -> str:
    r"""Return a polynomial as LaTeX; if it is longer than about `characters`, cut it and give its number of terms.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> print(latex_cut(parse_polynomial("(x + 1)^9", ["x"]), 20))
    x^9 + 9 x^8 + \cdots\ \text{(10 terms)}
    """
    shown_terms = first_terms(polynomial, characters)
    if len(shown_terms) == len(polynomial):
        return latex_polynomial(polynomial)
    terms = counted(len(polynomial), "term")
    if len(shown_terms) == 0:
        return rf"\text{{({terms}, not shown)}}"
    return rf"{latex_polynomial(shown_terms)} + \cdots\ \text{{({terms})}}"


def latex_matrix(entries: fmpq_mat, max_size: int = 8) -> str:
    r"""Return a matrix over Q as LaTeX; only its size if it is larger than `max_size`, or an entry has over 100 bits.

    >>> print(latex_matrix(fmpq_mat([[1, 0]])))
    \begin{pmatrix} 1 & 0 \end{pmatrix}
    """
    rows, columns = int(entries.nrows()), int(entries.ncols())
    bits = max((max(int(entry.p.bit_length()), int(entry.q.bit_length())) for entry in entries.entries()), default=0)
    if max(rows, columns) > max_size or bits > 100:
        return rf"\text{{a matrix with {rows} rows and {columns} columns}}"
    lines = r" \\ ".join(" & ".join(map(latex_number, row)) for row in entries.tolist())
    return rf"\begin{{pmatrix}} {lines} \end{{pmatrix}}"


def latex_aligned(equations: Sequence[tuple[str, str]], max_rows: int = 12) -> str:
    r"""Return equations left = right, aligned, as LaTeX; dots replace those after the first `max_rows`.

    >>> print(latex_aligned([("x", "1"), ("y", "2")]))
    $\displaystyle \begin{aligned} x &= 1 \\ y &= 2 \end{aligned}$
    """
    rows = [f"{left} &= {right}" for left, right in equations[:max_rows]]
    if len(equations) > max_rows:
        rows.append(rf"&\ \vdots\ \text{{({len(equations)} equations)}}")
    lines = r" \\ ".join(rows)
    return rf"$\displaystyle \begin{{aligned}} {lines} \end{{aligned}}$"


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


# A formula that has at most this number of characters as plain text fits on a phone without line breaks.
_MAX_UNBROKEN = 32
_ONE_LINE = replace(LATEX, enclosed="({})".format, fraction="({}) / ({})".format)


def formula(function: fmpq_mpoly | RationalFunction, left: str = "", characters: int | None = None) -> str:
    r"""Return a polynomial or a rational function as HTML that can be broken between its terms.

    `left` is the left-hand side: "I1" gives I_1 = ..., and "x1'" a derivative. A formula of more than about
    `characters` characters is cut, and its number of terms is given.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> print(formula(parse_polynomial("x^2", ["x"]), "H"))
    <span class="formula">\(H = x^2\)</span>
    """
    is_quotient = isinstance(function, RationalFunction) and not function.is_polynomial
    is_negative, *sides = integer_fraction(function) if isinstance(function, RationalFunction) else (False, function)
    sides = sides if is_quotient else sides[:1]
    if characters is not None and any(len(first_terms(side, characters)) < len(side) for side in sides):
        texts = [latex_cut(side, characters) for side in sides]
        text, is_long = "-" * is_negative + (f"({texts[0]}) / ({texts[1]})" if is_quotient else texts[0]), True
    else:
        source = PLAIN.rational(function) if isinstance(function, RationalFunction) else PLAIN.polynomial(function)
        is_long = max(map(len, source.split("/"))) > _MAX_UNBROKEN if is_quotient else len(source) > _MAX_UNBROKEN
        notation = _ONE_LINE if is_long else LATEX
        text = notation.rational(function) if isinstance(function, RationalFunction) else notation.polynomial(function)
    if left:
        name = latex_name(left) if left == "'" or not left.endswith("'") else f"{latex_name(left[:-1])}'"
        text = f"{name} = {text}"
    if r"\frac" in text and not is_long:
        text = rf"\displaystyle {text}"  # without it, TeX sets a fraction in a line of text in small type
    return typeset(text, is_long)


def typeset(latex: str, is_long: bool = True) -> str:
    r"""Convert a formula in LaTeX to HTML; if `is_long`, every term is an element of its own.

    >>> print(typeset(r"\frac{x + 1}{2} - y = 0"))
    <span class="formula">\(\frac{x + 1}{2}\) \({}- y = 0\)</span>
    """
    pieces, depth = [""], 0
    one_line = latex.replace(r"\left(", "(").replace(r"\right)", ")")
    for token in one_line.split(" ") if is_long else [one_line]:
        if token in ("+", "-") and depth == 0 and pieces[-1]:
            pieces.append(f"{{}}{token}")  # after the empty group the sign is a binary operator, with spaces around it
        else:
            pieces[-1] += f" {token}" if pieces[-1] else token
        depth += token.count("{") - token.count("}")
    spans = " ".join(rf"\({escape(piece)}\)" for piece in pieces)
    return f'<span class="formula">{spans}</span>'


def equations(variables: Sequence[str], rhs: Sequence[fmpq_mpoly], characters: int | None = None) -> str:
    """Return the equations x' = f(x) as HTML, one a line; each can wrap, and is cut after about `characters`."""
    lines = (formula(f, f"{name}'", characters) for name, f in zip(variables, rhs, strict=True))
    return "<br/>\n".join(lines)


def matrix(entries: fmpq_mat, left: str = "", max_size: int = 8) -> str:
    """Return a matrix over Q with its name `left` as HTML; only its size if it is too large for `latex_matrix`."""
    text = latex_matrix(entries, max_size)
    return typeset(f"{latex_name(left)} = {text}" if left else text, False)
