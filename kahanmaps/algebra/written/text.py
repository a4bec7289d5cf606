"""Numbers, points, polynomials and rational functions in text: parsed and printed with an exact round trip.

    number      -3, 1/2, 0.1 (which is 1/10), .5, 1e-3
    point       1/2,-1/3,0
    expression  + - * / ^ ** ( ) with names and numbers, for instance (x^2 + y^2)/(1 - eps^2*z^2)

Text is exact: a decimal means the rational number that it spells. Nothing is evaluated as code, and `Limits` bounds
what a text may cost before FLINT is asked, since FLINT ends the process where Python would raise.

What is printed parses back to the same value wherever that value lies within the limits.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import prod

from flint import fmpq, fmpq_mpoly, fmpq_poly

from kahanmaps.algebra.polynomials import RationalFunction, names_of, primitive_part, ring
from kahanmaps.algebra.written.numerals import (
    BLANKS,
    LIMITS,
    NO_CONSTANTS,
    Limits,
    check_names,
    number_in,
    require_text,
    wrong_kind,
)
from kahanmaps.errors import ExpressionError

_MOST_FACTORED = 2000  # terms of a polynomial that is printed in factors
_ONE = fmpq(1)


def parse_number(text: str, *, limits: Limits = LIMITS) -> fmpq:
    """The rational number that `text` spells: an integer, p/q or a finite decimal, with blanks around it.

    Raises `ExpressionError` for anything else, and for numbers beyond the limits.

    >>> parse_number("0.1"), parse_number(" -6/4 "), parse_number("1e-3")
    (1/10, -3/2, 1/1000)
    >>> parse_number("1_000")
    Traceback (most recent call last):
    kahanmaps.errors.ExpressionError: found '1_000', expected an integer, p/q or a decimal such as 0.1
      1_000
       ^
    """
    require_text(text, "a number", "write an integer, p/q or a decimal as text, e.g. '1/10'")
    return number_in(text, 0, len(text), limits.number_digits, limits)


def format_number(value: fmpq) -> str:
    """The number as `p` or `p/q` in lowest terms, of any length.

    >>> format_number(fmpq(-2, 4)), format_number(fmpq(3))
    ('-1/2', '3')
    """
    if not isinstance(value, fmpq):
        raise wrong_kind(value, "an exact number (fmpq)", "make one with parse_number('1/10')")
    return str(value)


def parse_point(text: str, dimension: int | None = None, *, limits: Limits = LIMITS) -> tuple[fmpq, ...]:
    """The numbers in a list, with commas between them or blanks, perhaps in brackets; `dimension` of them, if given.

    Raises `ExpressionError`, which names the entry (counted from 1) and its column in the whole text.

    >>> parse_point("1/2, -1/3, 0"), parse_point("[1 2]")
    ((1/2, -1/3, 0), (1, 2))
    >>> parse_point("1,2", 3)
    Traceback (most recent call last):
    kahanmaps.errors.ExpressionError: found 2 numbers, expected 3, separated by commas
    """
    require_text(text, "a point", "write its numbers as text, separated by commas, e.g. '1/2,-1/3,0'")
    entries = point_entries(text)
    if not entries:
        if dimension == 0:
            return ()
        raise ExpressionError("found nothing, expected a point: numbers separated by commas, e.g. 1/2,-1/3,0", text)
    if dimension is not None and len(entries) != dimension:
        found = "1 number" if len(entries) == 1 else f"{len(entries)} numbers"
        raise ExpressionError(f"found {found}, expected {dimension}, separated by commas", text)
    point = []
    for entry, (start, end) in enumerate(entries, 1):
        try:
            point.append(number_in(text, start, end, limits.number_digits, limits))
        except ExpressionError as error:
            raise ExpressionError(f"entry {entry}: {error.message}", text, error.column) from None
    return tuple(point)


def point_entries(text: str) -> list[tuple[int, int]]:
    """Where the entries of a point begin and end in its text: between commas, or blanks where there are no commas.

    >>> point_entries("(1,2)"), point_entries("1 2"), point_entries("")
    ([(1, 2), (3, 4)], [(0, 1), (2, 3)], [])
    """
    start, end = 0, len(text)
    while start < end and text[start] in BLANKS:
        start += 1
    while start < end and text[end - 1] in BLANKS:
        end -= 1
    if text[start : start + 1] + text[end - 1 : end] in ("[]", "()", "{}"):
        start, end = start + 1, end - 1
    inside = text[start:end]
    if not inside.strip(BLANKS):
        return []
    between = "," if "," in inside else r"[ \t\r\n]+"
    if between != ",":
        start += len(inside) - len(inside.lstrip(BLANKS))
        inside = inside.strip(BLANKS)
    places = [match.span() for match in re.finditer(between, inside)]
    starts = [0, *(last for _, last in places)]
    ends = [*(first for first, _ in places), len(inside)]
    return [(start + first, start + last) for first, last in zip(starts, ends, strict=True)]


def format_point(point: Sequence[fmpq]) -> str:
    """The numbers of a point, separated by commas: the inverse of `parse_point`.

    >>> format_point((fmpq(1, 2), fmpq(-1, 3), fmpq(0)))
    '1/2,-1/3,0'
    """
    return ",".join(format_number(entry) for entry in point)


def parse_polynomial(
    text: str, variables: Sequence[str], constants: Mapping[str, fmpq] = NO_CONSTANTS, *, limits: Limits = LIMITS
) -> fmpq_mpoly:
    """The polynomial in `ring(variables)` that `text` spells; `constants` are names that stand for numbers.

    A division by something that is not constant is refused, even where it would leave no remainder (`x^2/x`).
    Raises `ExpressionError` with the column of the mistake; `InputError` for bad names or inexact constants.

    >>> parse_polynomial("x^3/3 + a*x*y^2", ["x", "y"], {"a": fmpq(2, 3)})
    1/3*x^3 + 2/3*x*y^2
    >>> parse_polynomial("2x", ["x"])
    Traceback (most recent call last):
    kahanmaps.errors.ExpressionError: found 'x' right after '2', expected an operator between them: write 2*x
      2x
       ^
    """
    from kahanmaps.algebra.written.expressions import read_polynomial

    _check_expression(text, variables, constants)
    return read_polynomial(text, ring(variables), constants, limits)


def parse_rational_function(
    text: str, variables: Sequence[str], constants: Mapping[str, fmpq] = NO_CONSTANTS, *, limits: Limits = LIMITS
) -> RationalFunction:
    """The quotient of polynomials in `ring(variables)` that `text` spells; common factors stay as they are written.

    Raises as `parse_polynomial` does.

    >>> format_rational_function(parse_rational_function("x/(y-1) + 1/(y-1)", ["x", "y"]))
    '(x + 1)/(y - 1)'
    """
    from kahanmaps.algebra.written.expressions import read_rational_function

    _check_expression(text, variables, constants)
    return read_rational_function(text, ring(variables), constants, limits)


def parse_constant(text: str, constants: Mapping[str, fmpq] = NO_CONSTANTS, *, limits: Limits = LIMITS) -> fmpq:
    """The number that an expression in numbers and `constants` comes to. Raises as `parse_polynomial` does.

    >>> parse_constant("(1 + a)^2/3", {"a": fmpq(1, 2)})
    3/4
    """
    from kahanmaps.algebra.written.expressions import read_constant

    _check_expression(text, (), constants)
    return read_constant(text, constants, limits)


def format_polynomial(polynomial: fmpq_mpoly) -> str:
    """The polynomial, its terms in the order of its ring: the inverse of `parse_polynomial`.

    >>> x, y = ring(["x", "y"]).gens()
    >>> format_polynomial(x**3/3 + fmpq(2, 3)*x*y**2 - y)
    'x^3/3 + 2/3*x*y^2 - y'
    """
    if not isinstance(polynomial, fmpq_mpoly):
        raise wrong_kind(polynomial, "a polynomial (fmpq_mpoly)", "make one with parse_polynomial")
    names = names_of(polynomial)
    pieces: list[str] = []
    for monomial, coefficient in polynomial.terms():
        if coefficient < 0:
            pieces.append(" - " if pieces else "-")
            coefficient = -coefficient
        elif pieces:
            pieces.append(" + ")
        powers = [n if k == 1 else f"{n}^{k}" for n, k in zip(names, monomial, strict=True) if k]
        product = "*".join(powers if coefficient.p == 1 and powers else [str(coefficient), *powers])
        pieces.append(f"{product}/{coefficient.q}" if coefficient.p == 1 and powers and coefficient.q != 1 else product)
    return "".join(pieces) or "0"


def format_univariate(polynomial: fmpq_poly, name: str = "t") -> str:
    """A polynomial in one variable as people write it.

    >>> format_univariate(fmpq_poly([-2, 0, 1]))
    't^2 - 2'
    """
    text = ""
    for power in range(polynomial.degree(), -1, -1):
        coefficient = polynomial[power]
        if coefficient == 0:
            continue
        size, sign = abs(coefficient), "-" if coefficient < 0 else "+"
        letter = "" if power == 0 else name if power == 1 else f"{name}^{power}"
        number = "" if size == 1 and letter else format_number(size) + ("*" if letter else "")
        text += f" {sign} {number}{letter}" if text else f"{'-' if sign == '-' else ''}{number}{letter}"
    return text or "0"


def format_rational_function(function: RationalFunction) -> str:
    """The quotient, with brackets only where they are needed: the inverse of `parse_rational_function`.

    >>> x, y = ring(["x", "y"]).gens()
    >>> format_rational_function(RationalFunction(x + 1, 2*y)), format_rational_function(RationalFunction(x, y**2))
    ('(x/2 + 1/2)/y', 'x/y^2')
    """
    if not isinstance(function, RationalFunction):
        raise wrong_kind(function, "a RationalFunction", "make one with parse_rational_function")
    above = format_polynomial(function.numerator)
    if function.numerator.is_zero() or function.denominator.is_one():
        return above
    below = format_polynomial(function.denominator)
    if len(function.numerator) > 1:
        above = f"({above})"
    # A name or its power stands by itself; a/2*y would be a*y/2.
    if any(sign in below for sign in "*+- "):
        below = f"({below})"
    return f"{above}/{below}"


def format_factored(function: RationalFunction) -> str:
    """The quotient, above and below in irreducible factors over Q where that is shorter.

    >>> x, y = ring(["x", "y"]).gens()
    >>> format_factored(RationalFunction(2*x**3*y - 2*x*y, (x - y)**2)), format_factored(RationalFunction(x + 1, 2*y))
    ('2*x*y*(x^2 - 1)/(x - y)^2', '(x/2 + 1/2)/y')
    """
    found = shorter_factors(function)
    return format_rational_function(function) if found is None else format_product(*found)


def shorter_factors(function: RationalFunction) -> tuple[list[tuple[fmpq_mpoly, int]], fmpq] | None:
    """Polynomials of coprime integers with exponents, and a number, that multiply to a function; None if not shorter.

    Numerator and denominator are each in irreducible factors over Q, or one polynomial times variables.
    """
    factors, constant, is_shorter = list[tuple[fmpq_mpoly, int]](), fmpq(1), False
    for sign, polynomial in ((1, function.numerator), (-1, function.denominator)):
        if len(polynomial) == 0 or len(polynomial) > _MOST_FACTORED:
            return None
        content, whole = primitive_part(polynomial)
        constant *= content**sign
        powers = [(primitive_part(g)[1], int(k)) for g, k in whole.factor()[1]]
        variables = [one for one in powers if len(one[0]) == 1]
        rest = whole / prod(g**k for g, k in variables) if variables else whole
        choices = [powers, [*variables, *([(rest, 1)] if len(rest) > 1 else [])]]
        chosen = min(choices, key=lambda powers: len(format_product(powers)))
        is_shorter |= len(chosen) > 1 or any(k > 1 for _, k in chosen)
        factors += [(g, sign * k) for g, k in chosen]
    return (factors, constant) if is_shorter else None


def format_product(factors: Sequence[tuple[fmpq_mpoly, int]], constant: fmpq = _ONE) -> str:
    """A number times powers of polynomials, short ones first, those with negative exponents below a line.

    >>> x, y = ring(["x", "y"]).gens()
    >>> format_product([(x + y, 2), (y, -1), (x - 1, -3)], fmpq(-2, 3)), format_product([(x + y, 1)])
    ('-2*(x + y)^2/(3*y*(x - 1)^3)', 'x + y')
    """
    parts = []
    for number, powers in sides(factors, constant):
        bases = [(f"({format_polynomial(g)})" if len(g) > 1 else format_polynomial(g), k) for g, k in powers]
        told = [base + (f"^{k}" if k > 1 else "") for base, k in bases]
        parts.append(([str(number)] if number > 1 else []) + told)
    above, below = ("*".join(part) for part in parts)
    if len(factors) == 1 and factors[0][1] == 1 and constant == 1:
        return format_polynomial(factors[0][0])
    sign = "-" if constant < 0 else ""
    if not below:
        return f"{sign}{above or 1}"
    return f"{sign}{above or 1}/({below})" if len(parts[1]) > 1 else f"{sign}{above or 1}/{below}"


def sides(factors: Sequence[tuple[fmpq_mpoly, int]], constant: fmpq) -> list[tuple[int, list[tuple[fmpq_mpoly, int]]]]:
    """The positive number and the powers, short ones first, of a product that stand above a line, and below it."""

    def size(power: tuple[fmpq_mpoly, int]) -> tuple[int, list[int]]:
        return len(power[0]), [-int(e) for e in power[0].monoms()[0]]

    return [
        (number, sorted(((g, sign * k) for g, k in factors if sign * k > 0), key=size))
        for sign, number in ((1, abs(int(constant.p))), (-1, int(constant.q)))
    ]


def _check_expression(text: object, variables: Sequence[str], constants: Mapping[str, fmpq]) -> None:
    require_text(text, "an expression", "write it as text, e.g. '1/10*x^2'")
    check_names(variables, iterates=True)
    check_names([*variables, *constants], iterates=True)
    for name, value in constants.items():
        if not isinstance(value, fmpq):
            raise wrong_kind(value, f"an exact number (fmpq) as {name}", "make one with parse_number('1/10')")
