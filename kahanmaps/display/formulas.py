r"""Formulas in HTML: their LaTeX between \( and \), which notebooks set; pages make MathML of it (`reports.report`).

Neither MathJax nor MathML breaks lines. So a long formula is a <span class="formula"> of several pieces, one for each
term, between which the browser wraps; a long quotient is written with a slash.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flint import fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import PLAIN, above_and_below, first_terms
from kahanmaps.display.latex import LATEX, latex_cut, latex_matrix, latex_name
from kahanmaps.display.markup import escape

# A formula of at most so many characters of plain text is one piece: it has room on a telephone.
_ONE_PIECE = 32
_FLAT = replace(LATEX, enclosed="({})".format, fraction="({}) / ({})".format)


def formula(function: fmpq_mpoly | RationalFunction, left: str = "", characters: int | None = None) -> str:
    r"""A polynomial or a rational function as HTML that wraps between its terms, exact.

    `left` is the name of what it is: "I1" makes I_1 = ...; "x1'" is the derivative. Where more than about
    `characters` characters would be shown, the rest is left out, and the number of terms is told.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> print(formula(parse_polynomial("x^2", ["x"]), "H"))
    <span class="formula">\(H = x^2\)</span>
    """
    is_quotient = isinstance(function, RationalFunction) and not function.is_polynomial
    is_negative, *sides = above_and_below(function) if isinstance(function, RationalFunction) else (False, function)
    sides = sides if is_quotient else sides[:1]
    if characters is not None and any(len(first_terms(side, characters)) < len(side) for side in sides):
        cut = [latex_cut(side, characters) for side in sides]
        text, is_long = "-" * is_negative + (f"({cut[0]}) / ({cut[1]})" if is_quotient else cut[0]), True
    else:
        plain = PLAIN.rational(function) if isinstance(function, RationalFunction) else PLAIN.polynomial(function)
        is_long = max(map(len, plain.split("/"))) > _ONE_PIECE if is_quotient else len(plain) > _ONE_PIECE
        notation = _FLAT if is_long else LATEX
        text = notation.rational(function) if isinstance(function, RationalFunction) else notation.polynomial(function)
    if left:
        name = latex_name(left) if left == "'" or not left.endswith("'") else f"{latex_name(left[:-1])}'"
        text = f"{name} = {text}"
    if r"\frac" in text and not is_long:
        text = rf"\displaystyle {text}"  # without it a fraction within a line has the small letters of an index
    return typeset(text, is_long)


def typeset(latex: str, is_long: bool = True) -> str:
    r"""LaTeX of a formula as HTML, one piece for each of its terms where it `is_long`.

    >>> print(typeset(r"\frac{x + 1}{2} - y = 0"))
    <span class="formula">\(\frac{x + 1}{2}\) \({}- y = 0\)</span>
    """
    pieces, depth = [""], 0
    flat = latex.replace(r"\left(", "(").replace(r"\right)", ")")
    for word in flat.split(" ") if is_long else [flat]:
        if word in ("+", "-") and depth == 0 and pieces[-1]:
            pieces.append(f"{{}}{word}")  # an empty group before a sign gives it the spaces that it has between terms
        else:
            pieces[-1] += f" {word}" if pieces[-1] else word
        depth += word.count("{") - word.count("}")
    inside = " ".join(rf"\({escape(piece)}\)" for piece in pieces)
    return f'<span class="formula">{inside}</span>'


def equations(variables: Sequence[str], rhs: Sequence[fmpq_mpoly], characters: int | None = None) -> str:
    """The equations x' = f(x), one below the other, as HTML; long ones wrap, and are cut after `characters` each."""
    lines = (formula(f, f"{name}'", characters) for name, f in zip(variables, rhs, strict=True))
    return "<br/>\n".join(lines)


def matrix(entries: fmpq_mat, left: str = "", most: int = 8) -> str:
    """A matrix over Q as HTML, exact; only its size where it has more than `most` rows or columns, or long entries."""
    text = latex_matrix(entries, most)
    return typeset(f"{latex_name(left)} = {text}" if left else text, False)
