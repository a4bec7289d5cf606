r"""Names, polynomials and rational functions as MathML, exactly: formulas that a browser shows without JavaScript.

Only MathML Core is used, and the same normal form as in latex.py: terms in the order of the ring, fractions without
fractions inside, factors where they are shorter. Core has no line breaks. So a long formula is a <span class="formula">
of several <math> elements, between which the browser wraps, one for each term. Every <math> has its plain text as
`alttext`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import prod

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.written.reading import PLAIN, Notation, above_and_below, first_terms
from kahanmaps.algebra.written.text import format_number, format_product, shorter_factors, sides
from kahanmaps.display.latex import GREEK_NAMES
from kahanmaps.display.markup import escape
from kahanmaps.errors import InputError, counted

_GREEK = dict(zip(GREEK_NAMES.split("|"), "αβγδϵζηθικλμνξπρστυϕχψωΓΔΘΛΞΠΣΥΦΨΩ", strict=True), eps="ε")
_WITH_INDEX = re.compile(r"([A-Za-z]+)([0-9]*)")
# A formula of at most so many characters of plain text is one <math>: it has room on a telephone.
_ONE_PIECE = 32
# Names of several letters would run together without a little space.
_TIMES = '<mo lspace="0em" rspace="0.12em">\u2062</mo>'
_PRIME = "<mo>′</mo>"
_MINUS = '<mo form="prefix">−</mo>'


def mathml_name(name: str) -> str:
    """A name as MathML: final digits become an index, eps ε, Greek names Greek letters.

    `name` is printable text; what is not letters followed by digits is set upright. Returns an element that belongs
    into <math>. Raises InputError for text that is empty or not printable.

    >>> mathml_name("x1"), mathml_name("eps"), mathml_name("modified_H")
    ('<msub><mi>x</mi><mn>1</mn></msub>', '<mi>ε</mi>', '<mi>modified_H</mi>')
    """
    if not name or not name.isprintable():
        raise InputError(f"found the name {name[:40]!r}, expected printable text")
    match = _WITH_INDEX.fullmatch(name)
    letters, digits = match.groups() if match else (name, "")
    letter = f"<mi>{_GREEK.get(letters) or escape(letters)}</mi>"
    return f"<msub>{letter}<mn>{digits}</mn></msub>" if digits else letter


def mathml_number(value: fmpq) -> str:
    """An exact number as MathML.

    >>> mathml_number(fmpq(-3, 2))
    '<mrow><mo form="prefix">−</mo><mfrac><mn>3</mn><mn>2</mn></mfrac></mrow>'
    """
    above = f"<mn>{abs(value.p)}</mn>"
    size = above if value.q == 1 else f"<mfrac>{above}<mn>{value.q}</mn></mfrac>"
    return f'<mrow><mo form="prefix">−</mo>{size}</mrow>' if value < 0 else size


def mathml_polynomial(polynomial: fmpq_mpoly) -> str:
    """A polynomial over Q as one row of MathML, exact; it belongs into <math>. `formula` breaks long ones.

    >>> from kahanmaps.algebra.written.text import parse_polynomial
    >>> mathml_polynomial(parse_polynomial("x^2 - eps", ["x", "eps"]))
    '<mrow><msup><mi>x</mi><mn>2</mn></msup><mo form="infix">−</mo><mi>ε</mi></mrow>'
    """
    return MATHML.polynomial(polynomial)


def mathml_rational_function(function: RationalFunction) -> str:
    """A quotient of polynomials over Q as MathML, exact, without fractions inside the fraction, in factors where they
    are shorter.

    >>> from kahanmaps.algebra.written.text import parse_rational_function
    >>> mathml_rational_function(parse_rational_function("x/y^2", ["x", "y"]))
    '<mfrac><mrow><mi>x</mi></mrow><mrow><msup><mi>y</mi><mn>2</mn></msup></mrow></mfrac>'
    """
    return MATHML.rational(function)


def formula(function: fmpq_mpoly | RationalFunction, left: str = "", characters: int | None = None) -> str:
    """A polynomial or a rational function as HTML that wraps between its terms, exact.

    `left` is the name of what it is: "I1" makes I_1 = ...; "x1'" is the derivative. Where more than about
    `characters` characters would be shown, the rest is left out, and the number of terms is told.

    >>> from kahanmaps.algebra.written.text import parse_polynomial
    >>> print(formula(parse_polynomial("x^2", ["x"])))
    <span class="formula"><math alttext="x^2"><mrow><msup><mi>x</mi><mn>2</mn></msup></mrow></math></span>
    """
    parts = [_math(f'<mrow>{_left(left)}<mo form="infix">=</mo></mrow>', f"{left} =")] if left else []
    if isinstance(function, RationalFunction):
        parts += _quotient(function, characters)
    else:
        parts += _sum(function, characters)
    if left:  # no break after "I ="
        parts[:2] = ["\u00a0".join(parts[:2])]
    return f'<span class="formula">{" ".join(parts)}</span>'


def equations(variables: Sequence[str], rhs: Sequence[fmpq_mpoly], characters: int | None = None) -> str:
    """The equations x' = f(x), one below the other, as HTML; long ones wrap, and are cut after `characters` each."""
    lines = (formula(f, f"{name}'", characters) for name, f in zip(variables, rhs, strict=True))
    return "<br/>\n".join(lines)


def matrix(entries: fmpq_mat, left: str = "", most: int = 8) -> str:
    """A matrix over Q as HTML, exact; only its size where it has more than `most` rows or columns, or long entries."""
    rows, columns = int(entries.nrows()), int(entries.ncols())
    texts = [[format_number(entry) for entry in row] for row in entries.tolist()]
    if max(rows, columns) > most or any(len(text) > _ONE_PIECE for row in texts for text in row):
        name = f"{left}: " if left else ""
        return f'<span class="formula">{escape(name)}a matrix with {rows} rows and {columns} columns</span>'
    cells = (f"<mtr>{''.join(f'<mtd>{mathml_number(entry)}</mtd>' for entry in row)}</mtr>" for row in entries.tolist())
    name = f'{_left(left)}<mo form="infix">=</mo>' if left else ""
    inside = f"<mrow>{name}<mo>(</mo><mtable>{''.join(cells)}</mtable><mo>)</mo></mrow>"
    plain = ", ".join("[" + ", ".join(row) + "]" for row in texts)
    return f'<span class="formula">{_math(inside, f"{left} = [{plain}]" if left else f"[{plain}]")}</span>'


def _left(name: str) -> str:
    if name == "'" or not name.endswith("'"):
        return mathml_name(name)
    return _raised(mathml_name(name[:-1]), _PRIME)


def _raised(base: str, exponent: str) -> str:
    """An element with an exponent, which stands above the index if there is one."""
    index = base.removeprefix("<msub>").removesuffix("</msub>")
    return f"<msup>{base}{exponent}</msup>" if index == base else f"<msubsup>{index}{exponent}</msubsup>"


def _math(inside: str, alttext: str) -> str:
    return f'<math alttext="{escape(alttext)}">{inside}</math>'


def _sum(polynomial: fmpq_mpoly, characters: int | None = None) -> list[str]:
    """The <math> elements of a sum: one if it is short, else one for each term."""
    shown = polynomial if characters is None else first_terms(polynomial, characters)
    left_out = len(polynomial) - len(shown)
    if left_out and not len(shown):
        return [f"<span>(a polynomial of {counted(len(polynomial), 'term')}, not shown)</span>"]
    if not left_out and (len(shown) <= 1 or len(PLAIN.polynomial(shown)) <= _ONE_PIECE):
        return [_math(mathml_polynomial(shown), PLAIN.polynomial(shown))]
    found = [
        _math(f"<mrow>{piece}</mrow>", text)
        for piece, text in zip(MATHML.terms(shown), PLAIN.terms(shown), strict=True)
    ]
    return [*found, f"<span>+ … ({counted(len(polynomial), 'term')})</span>"] if left_out else found


def _quotient(function: RationalFunction, characters: int | None) -> list[str]:
    """The elements of a fraction, one if it is short, else with a slash; in factors, if all of it is shown."""
    is_negative, above, below = above_and_below(function)
    fits = characters is None or all(len(first_terms(part, characters)) == len(part) for part in (above, below))
    found = shorter_factors(function) if fits else None
    if found is not None:
        is_negative, plain = found[1] < 0, format_product(*found)
        over, under = sides(*found)
        top, bottom, is_whole = _factors(*over), _factors(*under), under == (1, [])
        if len(under[1]) + (under[0] > 1) > 1:
            bottom = _enclosed(bottom)
    elif below.is_one():
        return _sum(above, characters)
    else:
        plain = f"{'-' * is_negative}({PLAIN.polynomial(above)})/({PLAIN.polynomial(below)})"
        top, bottom, is_whole = _bracketed(above, characters), _bracketed(below, characters), False
    if fits and max(map(len, plain.split("/"))) <= _ONE_PIECE + len("()"):
        # Without a style of its own a fraction within a line is set in the small letters of an index.
        return [_math(f'<mstyle displaystyle="true">{mathml_rational_function(function)}</mstyle>', plain)]
    if is_negative:
        top[0] = _math(_MINUS, "-") + top[0]
    return top if is_whole else [*top, _math("<mo>/</mo>", "/"), *bottom]


def _factors(number: int, powers: Sequence[tuple[fmpq_mpoly, int]]) -> list[str]:
    """The elements of one side of a product, the number and the variables together."""
    variables = [g**k for g, k in powers if len(g) == 1]
    parts = [_sum(prod(variables[1:], start=variables[0] * number))] if variables else []
    if not variables and (number > 1 or not powers):
        parts = [[_math(f"<mn>{number}</mn>", str(number))]]
    parts += [_bracketed(g, None, k) for g, k in powers if len(g) > 1]
    for part in parts[:-1]:
        part[-1] += _math(_TIMES, "*")
    return [element for part in parts for element in part]


def _bracketed(polynomial: fmpq_mpoly, characters: int | None, power: int = 1) -> list[str]:
    return _enclosed(_sum(polynomial, characters), power)


def _enclosed(inside: list[str], power: int = 1) -> list[str]:
    """The elements in brackets, with no break between a bracket and what is beside it."""
    opening, closing = (f'<mo stretchy="false">{bracket}</mo>' for bracket in "()")
    end = _math(closing, ")") if power == 1 else _math(_raised(closing, f"<mn>{power}</mn>"), f")^{power}")
    inside[0] = _math(opening, "(") + inside[0]
    inside[-1] += end
    return inside


MATHML = Notation(
    name=mathml_name,
    number=mathml_number,
    power=lambda base, exponent: _raised(base, f"<mn>{exponent}</mn>"),
    signs=(_MINUS, '<mo form="infix">+</mo>', '<mo form="infix">−</mo>'),
    gap="",
    times=_TIMES,
    fraction="<mfrac>{}{}</mfrac>".format,
    enclosed='<mrow><mo stretchy="false">(</mo>{}<mo stretchy="false">)</mo></mrow>'.format,
    row="<mrow>{}</mrow>".format,
)
