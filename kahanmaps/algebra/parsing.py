"""Numbers, points, polynomials and rational functions from text.

    number      -3, 1/2, 0.1 (which is 1/10), .5, 1e-3, 1/10^6
    point       1/2,-1/3,0
    expression  + - * / ^ ** ( ) with names and numbers, for instance (x^2 + y^2)/(1 - eps^2*z^2)

All numbers are exact: a decimal denotes a rational number. The parser computes values while it reads the text; it
builds no tree and executes nothing as code. (Python's `ast` fails for sums of several thousand terms, and for integers
of 4300 digits.) FLINT ends the process when memory is exhausted and does not react to Ctrl-C, so the size of every
result is compared with `ExpressionLimits` before FLINT is called.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple, cast

from flint import fmpq, fmpq_mpoly, fmpq_mpoly_ctx, fmpz

from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.errors import ExpressionError, InexactNumber, InputError, UnknownName, quoted


@dataclass(frozen=True)
class ExpressionLimits:
    """Limits on the length of the text of an expression, and on the size of its value.

    The limits apply to all intermediate values as well; the digits of a value are bounded before it is computed.
    """

    number_digits: int = 1_000_000  # digits of one number read by parse_number or parse_point
    power_of_ten: int = 10_000  # absolute value of the exponent in 1e-3
    characters: int = 200_000  # length of an expression
    depth: int = 100  # nested brackets
    degree: int = 64  # total degree of a numerator or denominator
    exponent: int = 1_000  # absolute value of an exponent
    digits: int = 100_000  # digits of a coefficient over the common denominator of its polynomial
    terms: int = 20_000  # terms of a polynomial
    words: int = 5_000_000  # 64-bit words of all intermediate values and of all products of two terms


LIMITS = ExpressionLimits()
NO_CONSTANTS: Mapping[str, fmpq] = MappingProxyType({})

BLANKS = " \t\r\n"
_NUMBER = re.compile(r"([+-]?)(?:([0-9]+)/([0-9]+)|([0-9]+)?(?:\.([0-9]*))?(?:[eE]([+-]?[0-9]+))?)")
# p/q with powers, as in 10^-6, 1/10**6, 2^10/3^4: the parser of expressions bounds the exponents and the digits.
_POWERS = re.compile(r"(?=[^*^]*[*^])[+-]?[0-9]+(?:(?:\^|\*\*)[+-]?[0-9]+)?(?:/[0-9]+(?:(?:\^|\*\*)[+-]?[0-9]+)?)?")
_START_OF_NUMBER = re.compile(
    r"[+-]?(?:[0-9]+(?:/[0-9]*|\.?[0-9]*(?:[eE][+-]?[0-9]*)?)|\.(?:[0-9]+(?:[eE][+-]?[0-9]*)?)?)?"
)
_NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")
_EXPECTED = "expected an integer, p/q or a decimal such as 0.1"


def is_name(text: str) -> bool:
    """Whether `text` is a valid variable name: ASCII letters, digits and _, not starting with a digit (as in FLINT).

    >>> is_name("x1"), is_name("1x"), is_name("ε")
    (True, False, False)
    """
    return isinstance(text, str) and _NAME.fullmatch(text) is not None


def check_names(names: Sequence[str], *, iterates: bool = False) -> None:
    """Raise `InputError` unless `names` are distinct valid variable names; with `iterates`, names like x~ are valid.

    >>> check_names(["x", "y", "x"])
    Traceback (most recent call last):
    kahanmaps.errors.InputError: found the name 'x' twice, expected distinct names
    """
    if isinstance(names, str):
        raise InputError(f"found the text {quoted(names)}, expected a list of names such as ['x', 'y']")
    previous_names = set()
    for name in names:
        if not is_name(name.rstrip("~") if iterates and isinstance(name, str) else name):
            found_text = quoted(name) if isinstance(name, str) else f"a {type(name).__name__}"
            raise InputError(
                f"found {found_text}, expected a name: ASCII letters, digits and _, not starting with a digit"
            )
        if name in previous_names:
            raise InputError(f"found the name {quoted(name)} twice, expected distinct names")
        previous_names.add(name)


def number_in(text: str, start: int, end: int, digits: int, limits: ExpressionLimits) -> fmpq:
    """Parse the number `text[start:end]` of at most `digits` digits; errors give the column counted from `text[0]`."""
    while start < end and text[start] in BLANKS:
        start += 1
    while start < end and text[end - 1] in BLANKS:
        end -= 1
    if start == end:
        raise ExpressionError(f"found nothing, {_EXPECTED}", text, start)
    if end - start > digits + 20:
        found_text = f"found a number of {end - start} characters"
        raise ExpressionError(f"{found_text}, expected at most {digits} digits", text, start)
    if _POWERS.fullmatch(text, start, end):
        try:
            return parse_constant(text[start:end], limits=limits)
        except ExpressionError as error:
            raise ExpressionError(error.message, text, start + (error.column or 0)) from None
    match = _NUMBER.fullmatch(text, start, end)
    if match is None or not (match[2] or match[4] or match[5]):
        prefix = _START_OF_NUMBER.match(text, start, end)
        column = start if prefix is None else prefix.end()
        raise ExpressionError(f"found {quoted(text[start:end])}, {_EXPECTED}", text, column)
    sign, numerator, denominator, integer_part, fraction_digits, exponent = match.groups()
    if max(len(numerator or ""), len(denominator or ""), len(integer_part or "") + len(fraction_digits or "")) > digits:
        raise ExpressionError(f"found a number of more than {digits} digits, expected at most {digits}", text, start)
    if denominator is not None:
        divisor = fmpz(denominator)
        if divisor == 0:
            raise ExpressionError("found the denominator 0, expected a nonzero integer", text, match.start(3))
        value = fmpq(fmpz(numerator), divisor)
    else:
        value = fmpq(fmpz((integer_part or "") + (fraction_digits or "")))
        shift = -len(fraction_digits or "")
        if exponent is not None:
            # Check the length first: Python's int() raises for more than 4300 digits.
            exponent_digits = exponent.lstrip("+-").lstrip("0")
            if len(exponent_digits) > 9 or int(exponent_digits or "0") > limits.power_of_ten:
                found_text = f"found the power of ten {quoted(exponent)}"
                raise ExpressionError(
                    f"{found_text}, expected at most {limits.power_of_ten} in size", text, match.start(6)
                )
            shift += int(exponent)
        if shift:
            ten = fmpz(10) ** abs(shift)
            value = value * ten if shift > 0 else value / ten
    return -value if sign == "-" else value


def require_text(text: object, expected: str, hint: str) -> None:
    """Raise `InputError` unless `text` is a str. For a float the error is `InexactNumber`."""
    if not isinstance(text, str):
        raise wrong_kind(text, f"{expected} as text", hint)


def wrong_kind(value: Any, expected: str, hint: str) -> InputError:
    """Return the error for a value of a wrong type; its message contains the type, `expected` and `hint`."""
    if isinstance(value, float):
        return InexactNumber(f"found the floating-point number {value!s}, expected {expected}: {hint}")
    return InputError(f"found a value of type {type(value).__name__}, expected {expected}: {hint}")


def parse_number(text: str, *, limits: ExpressionLimits = LIMITS) -> fmpq:
    """Parse a rational number: an integer, p/q or a finite decimal. Blanks around it are ignored.

    In p/q both may be powers, as in 1/10^6. Raises `ExpressionError` for other text and for numbers beyond the limits.

    >>> parse_number("0.1"), parse_number(" -6/4 "), parse_number("1e-3"), parse_number("1/10^3")
    (1/10, -3/2, 1/1000, 1/1000)
    >>> parse_number("1_000")
    Traceback (most recent call last):
    kahanmaps.errors.ExpressionError: found '1_000', expected an integer, p/q or a decimal such as 0.1
      1_000
       ^
    """
    require_text(text, "a number", "write an integer, p/q or a decimal as text, e.g. '1/10'")
    return number_in(text, 0, len(text), limits.number_digits, limits)


def parse_point(text: str, dimension: int | None = None, *, limits: ExpressionLimits = LIMITS) -> tuple[fmpq, ...]:
    """Parse a point: `dimension` numbers (any number if None), separated by commas or blanks, with or without brackets.

    Raises `ExpressionError` with the number of the invalid entry (counted from 1) and the column in the complete text.

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
        found_text = "1 number" if len(entries) == 1 else f"{len(entries)} numbers"
        raise ExpressionError(f"found {found_text}, expected {dimension}, separated by commas", text)
    point = []
    for number, (start, end) in enumerate(entries, 1):
        try:
            point.append(number_in(text, start, end, limits.number_digits, limits))
        except ExpressionError as error:
            raise ExpressionError(f"entry {number}: {error.message}", text, error.column) from None
    return tuple(point)


def point_entries(text: str) -> list[tuple[int, int]]:
    """Return (begin, end) for each entry of a point in its text; commas or, if there are none, blanks separate entries.

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
    inner_text = text[start:end]
    if not inner_text.strip(BLANKS):
        return []
    separator = "," if "," in inner_text else r"[ \t\r\n]+"
    if separator != ",":
        start += len(inner_text) - len(inner_text.lstrip(BLANKS))
        inner_text = inner_text.strip(BLANKS)
    separators = [match.span() for match in re.finditer(separator, inner_text)]
    starts = [0, *(right for _, right in separators)]
    ends = [*(left for left, _ in separators), len(inner_text)]
    return [(start + left, start + right) for left, right in zip(starts, ends, strict=True)]


def parse_polynomial(
    text: str,
    variables: Sequence[str],
    constants: Mapping[str, fmpq] = NO_CONSTANTS,
    *,
    limits: ExpressionLimits = LIMITS,
) -> fmpq_mpoly:
    """Parse a polynomial in `ring(variables)`; `constants` maps names other than variables to values.

    Division by a nonconstant polynomial is an error, even if it would leave no remainder (`x^2/x`).
    Raises `ExpressionError` with the column of the mistake; `InputError` for invalid names or inexact constants.

    >>> parse_polynomial("x^3/3 + a*x*y^2", ["x", "y"], {"a": fmpq(2, 3)})
    1/3*x^3 + 2/3*x*y^2
    >>> parse_polynomial("2x", ["x"])
    Traceback (most recent call last):
    kahanmaps.errors.ExpressionError: found 'x' right after '2', expected an operator between them: write 2*x
      2x
       ^
    """
    _check_expression(text, variables, constants)
    arithmetic = _Arithmetic(text, ring(variables), constants, limits, quotients=False)
    return arithmetic.polynomial(_parse(arithmetic).numerator)


def parse_rational_function(
    text: str,
    variables: Sequence[str],
    constants: Mapping[str, fmpq] = NO_CONSTANTS,
    *,
    limits: ExpressionLimits = LIMITS,
) -> RationalFunction:
    """Parse a quotient of polynomials in `ring(variables)`; common factors are not canceled.

    Raises the errors of `parse_polynomial`.

    >>> from kahanmaps.algebra.printing import format_rational_function
    >>> format_rational_function(parse_rational_function("x/(y-1) + 1/(y-1)", ["x", "y"]))
    '(x + 1)/(y - 1)'
    """
    _check_expression(text, variables, constants)
    arithmetic = _Arithmetic(text, ring(variables), constants, limits, quotients=True)
    numerator, denominator = _parse(arithmetic)
    if denominator is None or not numerator.element:
        return RationalFunction(arithmetic.polynomial(numerator), arithmetic.ring.constant(1))
    # Make the denominator integral first: otherwise its normalization would compute one lcm for each coefficient.
    return RationalFunction(
        arithmetic.polynomial(numerator) * denominator.common_denominator,
        denominator.element * denominator.common_denominator,
    )


def parse_constant(
    text: str, constants: Mapping[str, fmpq] = NO_CONSTANTS, *, limits: ExpressionLimits = LIMITS
) -> fmpq:
    """Evaluate an expression in numbers and `constants`. Raises the errors of `parse_polynomial`.

    >>> parse_constant("(1 + a)^2/3", {"a": fmpq(1, 2)})
    3/4
    """
    _check_expression(text, (), constants)
    # There are no variables, hence no quotients of polynomials.
    return cast(fmpq, _constant(_parse(_Arithmetic(text, ring(()), constants, limits, quotients=False))))


def _check_expression(text: object, variables: Sequence[str], constants: Mapping[str, fmpq]) -> None:
    require_text(text, "an expression", "write it as text, e.g. '1/10*x^2'")
    check_names(variables, iterates=True)
    check_names([*variables, *constants], iterates=True)
    for name, value in constants.items():
        if not isinstance(value, fmpq):
            raise wrong_kind(value, f"an exact number (fmpq) as {name}", "make one with parse_number('1/10')")


_TOKEN = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)|(?P<name>[A-Za-z_][A-Za-z_0-9]*~*)|\*\*|[-+*/^()]"
)
_END = "end"

_CHARACTER_HINTS = {
    "\u2212": "write the minus sign as -",
    "\u2013": "write the minus sign as -",
    "\u00b7": "write a product as x*y",
    "\u00d7": "write a product as x*y",
    "\u22c5": "write a product as x*y",
    "\u00f7": "write a quotient as x/y",
    "\u00b2": "write the power as ^2",
    "\u00b3": "write the power as ^3",
    "[": "write brackets as ( )",
    "]": "write brackets as ( )",
    "{": "write brackets as ( )",
    "}": "write brackets as ( )",
    "=": "give one expression, not an equation",
    ",": "give one expression, and decimals with a point",
}

_OPERAND = "expected a number, a name or '('"


class _Polynomial(NamedTuple):
    """A polynomial or number `element` (fmpq_mpoly or fmpq), with its size.

    `common_denominator` times `element` has integer coefficients of absolute value at most 2**`bits`.

    FLINT also stores one common denominator for all coefficients, so `bits` measures FLINT's representation as well.
    A number is stored as fmpq, since operations with constant polynomials are much slower.
    """

    element: Any
    common_denominator: fmpz
    bits: int
    terms: int = 1
    degree: int = 0


class _Quotient(NamedTuple):
    """A quotient of polynomials. The denominator is monic of degree at least 1; None stands for the denominator 1."""

    numerator: _Polynomial
    denominator: _Polynomial | None


class Token(str):
    """A token at position `start_pos` of the text; `kind` is "number", "name", "end", or the sign or bracket itself."""

    kind: str
    start_pos: int

    def __new__(cls, text: str, kind: str, start_pos: int) -> Token:
        token = super().__new__(cls, text)
        token.kind, token.start_pos = kind, start_pos
        return token


def _tokens(text: str) -> Iterator[Token]:
    """Yield the tokens lazily, so that the first mistake in the text is reported."""
    column = 0
    while column < len(text):
        if text[column] in BLANKS:
            column += 1
            continue
        match = _TOKEN.match(text, column)
        if match is None:
            hint = _CHARACTER_HINTS.get(text[column], "use numbers, names and + - * / ^ ( )")
            found_text = repr(text[column])
            if not (text[column].isascii() and text[column].isprintable()):
                found_text = f"U+{ord(text[column]):04X} {unicodedata.name(text[column], '')}".rstrip()
            raise ExpressionError(f"found the character {found_text}, {hint}", text, column)
        yield Token(match[0], match.lastgroup or match[0], column)
        column = match.end()
    yield Token("", _END, len(text))


def _parse(arithmetic: _Arithmetic) -> _Quotient:
    """Compute the value of the text. Raises `ExpressionError`."""
    # Check length and brackets first: the recursion below is as deep as the nested brackets.
    text, limits = arithmetic.text, arithmetic.limits
    if len(text) > limits.characters:
        raise ExpressionError(f"found {len(text)} characters, expected at most {limits.characters}", text)
    if not text.strip(BLANKS):
        raise ExpressionError("found nothing, expected an expression such as x^2/2 - y", text)
    open_columns: list[int] = []
    for match in re.finditer(r"[()]", text):
        column = match.start()
        if match[0] == "(":
            open_columns.append(column)
            if len(open_columns) > limits.depth:
                raise ExpressionError(f"found brackets nested more than {limits.depth} deep: simplify", text, column)
        elif open_columns:
            open_columns.pop()
        else:
            raise ExpressionError("found ')' without its '(', expected brackets in pairs", text, column)
    if open_columns:
        raise ExpressionError("found '(' without its ')', expected brackets in pairs", text, open_columns[-1])
    reader = _Parser(arithmetic)
    value = reader.sum()
    if reader.next.kind != _END:
        raise _syntax_error(reader.next, arithmetic)
    return value


class _Parser:
    """A recursive-descent parser of sums of products of powers.

    A sign binds more weakly than a power, so that -x^2 is -(x^2), and powers associate to the right, so that 2^3^2 is
    2^9. Only brackets lead to recursion, and their depth is limited.
    """

    def __init__(self, arithmetic: _Arithmetic) -> None:
        self.arithmetic = arithmetic
        self.tokens = _tokens(arithmetic.text)
        self.next = next(self.tokens)

    def take(self) -> Token:
        token, self.next = self.next, next(self.tokens, self.next)
        return token

    def sum(self) -> _Quotient:
        pieces: list[Any] = [self.product()]
        while self.next.kind in ("+", "-"):
            pieces += [self.take(), self.product()]
        return self.arithmetic.sum(pieces) if len(pieces) > 1 else pieces[0]

    def product(self) -> _Quotient:
        pieces: list[Any] = [self.power()]
        while self.next.kind in ("*", "/"):
            pieces += [self.take(), self.power()]
        return self.arithmetic.product(pieces) if len(pieces) > 1 else pieces[0]

    def power(self) -> _Quotient:
        bases = []
        signs, value = self.signs(), self.atom()
        while self.next.kind in ("^", "**"):
            bases.append((signs, value, self.take()))
            signs, value = self.signs(), self.atom()
        value = self.arithmetic.apply_signs(signs, value)
        for signs, base, operator in reversed(bases):
            value = self.arithmetic.apply_signs(signs, self.arithmetic.power(base, operator, value))
        return value

    def signs(self) -> list[Token]:
        signs = []
        while self.next.kind in ("+", "-"):
            signs.append(self.take())
        return signs

    def atom(self) -> _Quotient:
        token = self.take()
        if token.kind == "(":
            value = self.sum()
            closing_token = self.take()
            if closing_token.kind != ")":
                raise _syntax_error(closing_token, self.arithmetic)
            return value
        if token.kind not in ("number", "name"):
            raise _syntax_error(token, self.arithmetic)
        if self.next.kind in ("number", "name", "("):  # tested first: sin(x) is a call, not an unknown name
            raise _syntax_error(self.next, self.arithmetic)
        return self.arithmetic.number(token) if token.kind == "number" else self.arithmetic.name(token)


def _syntax_error(token: Token, arithmetic: _Arithmetic) -> ExpressionError:
    """Return the error for a token that is not allowed at its position."""
    text = arithmetic.text
    if token.kind == _END:
        return ExpressionError(f"found the end of the text, {_OPERAND}", text, len(text))
    column = token.start_pos
    prefix = text[:column].rstrip(BLANKS)
    if token.kind not in ("name", "number", "(") or not prefix or prefix[-1] in "+-*/^(":
        return ExpressionError(f"found {quoted(token)}, {_OPERAND}", text, column)
    start = len(prefix) - 1
    while start > 0 and (prefix[start - 1].isalnum() or prefix[start - 1] in "_.") and prefix[-1] != ")":
        start -= 1
    operand = prefix[start:]
    if token.kind == "(" and is_name(operand) and operand not in arithmetic.names:
        found_text = f"found {quoted(operand + '(')}, which looks like a function call: only + - * / ^ are available"
        return ExpressionError(f"{found_text}, and products are written with *", text, start)
    example = f"{operand}*{token}" if len(operand) + len(token) < 40 else "x*y"
    found_text = f"found {quoted(token)} right after {quoted(operand)}"
    return ExpressionError(f"{found_text}, expected an operator between them: write {example}", text, column)


class _Arithmetic:
    """The operations in one expression; each raises an error before its result would exceed a limit.

    In an argument `pieces`, operands and operators alternate; `quotients` says whether divisors may contain variables.
    """

    def __init__(
        self,
        text: str,
        ring: fmpq_mpoly_ctx,
        constants: Mapping[str, fmpq],
        limits: ExpressionLimits,
        quotients: bool,
    ) -> None:
        self.text = text
        self.ring = ring
        self.limits = limits
        self.quotients = quotients
        self.words_left = limits.words
        self.max_bits = limits.digits * 3322 // 1000 + 1
        self.names = {name: self.constant(number) for name, number in constants.items()}
        self.one = self.constant(fmpq(1)).numerator
        for name, variable in zip(ring.names(), ring.gens(), strict=True):
            self.names[name] = _Quotient(_Polynomial(variable, fmpz(1), 0, 1, 1), None)

    def constant(self, number: fmpq) -> _Quotient:
        return _Quotient(_Polynomial(number, number.q, _bits(number.p)), None)

    def number(self, token: Token) -> _Quotient:
        start = token.start_pos
        value = number_in(self.text, start, start + len(token), self.limits.digits, self.limits)
        self.count_machine_words(1, value.height_bits(), start)
        return self.constant(value)

    def name(self, token: Token) -> _Quotient:
        value = self.names.get(token)
        if value is None:
            raise self.unknown_name(str(token), token.start_pos)
        self.check_bits(max(value.numerator.bits, _bits(value.numerator.common_denominator)), token.start_pos)
        return value

    def sum(self, pieces: list[Any]) -> _Quotient:
        column = pieces[1].start_pos
        polynomials: list[_Polynomial] = []
        # Add terms with the same denominator before other terms: a/d + b/d = (a + b)/d.
        fractions: list[tuple[_Polynomial, list[_Polynomial]]] = []
        for i in range(0, len(pieces), 2):
            value: _Quotient = pieces[i]
            if i and pieces[i - 1] == "-":
                value = self.negative(value, pieces[i - 1].start_pos)
            if value.denominator is None:
                polynomials.append(value.numerator)
                continue
            for denominator, terms in fractions:
                if denominator.element == value.denominator.element:
                    terms.append(value.numerator)
                    break
            else:
                fractions.append((value.denominator, [value.numerator]))
                degree = sum(denominator.degree for denominator, _ in fractions)
                self.check_degree(degree, "a common denominator", pieces[max(i - 1, 1)].start_pos)

        def sum_of(values: list[_Polynomial]) -> _Polynomial:
            """Return the sum, computed in pairs: adding the values one by one would copy the growing sum each time."""
            while len(values) > 1:
                unpaired_values = values[-1:] if len(values) % 2 else []
                pairs = zip(values[::2], values[1::2], strict=False)
                values = [self.add(left, right, column) for left, right in pairs] + unpaired_values
            return values[0]

        if not fractions:
            return _Quotient(sum_of(polynomials), None)
        common_denominator, numerator = fractions[0][0], sum_of(fractions[0][1])
        for denominator, terms in fractions[1:]:
            cross_product = self.times(sum_of(terms), common_denominator, column)
            numerator = self.add(self.times(numerator, denominator, column), cross_product, column)
            common_denominator = self.times(common_denominator, denominator, column)
        if polynomials:
            numerator = self.add(numerator, self.times(sum_of(polynomials), common_denominator, column), column)
        return _Quotient(numerator, common_denominator)

    def product(self, pieces: list[Any]) -> _Quotient:
        numerator, denominator = self.one, None
        for i in range(0, len(pieces), 2):
            value: _Quotient = pieces[i]
            column = pieces[max(i - 1, 1)].start_pos
            if i and pieces[i - 1] == "/":
                value = self.reciprocal(value, column)
            numerator = self.times(value.numerator, numerator, column)
            if value.denominator is not None:
                denominator = (
                    value.denominator if denominator is None else self.times(denominator, value.denominator, column)
                )
        return _Quotient(numerator, denominator)

    def apply_signs(self, signs: list[Token], value: _Quotient) -> _Quotient:
        is_negative = sum(sign == "-" for sign in signs) % 2
        return self.negative(value, signs[0].start_pos) if is_negative else value

    def power(self, base: _Quotient, operator: Token, exponent_value: _Quotient) -> _Quotient:
        column = operator.start_pos
        exponent = _constant(exponent_value)
        if exponent is None:
            raise self.error_at("found an exponent with variables in it, expected an integer", column)
        if exponent.q != 1 or abs(exponent.p) > self.limits.exponent:
            bits = exponent.height_bits()
            found_text = f"found the exponent {exponent if bits < 100 else f'of about {bits * 1000 // 3322} digits'}"
            raise self.error_at(f"{found_text}, expected an integer of size at most {self.limits.exponent}", column)
        n = int(exponent.p)
        if n < 0:
            base, n = self.reciprocal(base, column), -n
        if n == 0:
            return self.constant(fmpq(1))
        numerator, denominator = base
        return _Quotient(
            self.integer_power(numerator, n, column),
            None if denominator is None else self.integer_power(denominator, n, column),
        )

    def reciprocal(self, value: _Quotient, column: int) -> _Quotient:
        numerator, denominator = value.numerator, value.denominator or self.one
        if not numerator.element:
            raise self.error_at("found a division by 0", column)
        number = _constant(_Quotient(numerator, None))
        if number is not None:
            return _Quotient(self.times_number(denominator, 1 / number, column), None)
        if not self.quotients:
            raise self.error_at("found a division by something with variables in it, expected a polynomial", column)
        leading_coefficient = numerator.element.leading_coefficient()
        if leading_coefficient == 1:
            return _Quotient(denominator, numerator)
        # Make the leading coefficient 1, so that denominators that differ by a constant factor become equal.
        self.count_machine_words(numerator.terms, numerator.bits, column)
        monic_numerator = numerator._replace(
            element=numerator.element / leading_coefficient,
            common_denominator=abs((leading_coefficient * numerator.common_denominator).p),
        )
        return _Quotient(self.times_number(denominator, 1 / leading_coefficient, column), monic_numerator)

    def negative(self, value: _Quotient, column: int) -> _Quotient:
        return _Quotient(self.times_number(value.numerator, fmpq(-1), column), value.denominator)

    # Arithmetic of numbers and polynomials: estimate the size of the result, then raise an error or compute.

    def add(self, left: _Polynomial, right: _Polynomial, column: int) -> _Polynomial:
        common_denominator = left.common_denominator
        bits = max(left.bits, right.bits) + 1
        if left.common_denominator != right.common_denominator:
            common_denominator = left.common_denominator.lcm(right.common_denominator)
            denominator_bits = _bits(common_denominator)
            bits = 2 + max(
                summand.bits + denominator_bits - summand.common_denominator.bit_length() for summand in (left, right)
            )
            self.check_bits(denominator_bits, column)
        self.check_bits(bits, column)
        self.count_machine_words(left.terms + right.terms, bits, column)
        return self.limited_polynomial(left.element + right.element, common_denominator, bits, column)

    def times(self, left: _Polynomial, right: _Polynomial, column: int) -> _Polynomial:
        if right is self.one:
            return left
        self.check_degree(left.degree + right.degree, "a product", column)
        pairs = left.terms * right.terms
        bits = left.bits + right.bits + (max(1, min(left.terms, right.terms)) - 1).bit_length()
        self.check_bits(max(bits, _bits(left.common_denominator) + _bits(right.common_denominator)), column)
        bits_of_pair = bits // 8  # FLINT takes about 50 ns for a pair of terms with coefficients of at most 8 words
        if pairs * (bits_of_pair // 64 + 1) > self.limits.words:
            found_text = f"found a product of polynomials with {left.terms} and {right.terms} terms"
            raise self.error_at(f"{found_text}, which is too large to expand", column)
        self.count_machine_words(pairs, bits_of_pair, column)
        return self.limited_polynomial(
            left.element * right.element, left.common_denominator * right.common_denominator, bits, column
        )

    def times_number(self, value: _Polynomial, number: fmpq, column: int) -> _Polynomial:
        if number == 1:
            return value
        bits = value.bits + _bits(number.p)
        self.check_bits(max(bits, _bits(value.common_denominator) + _bits(number.q)), column)
        self.count_machine_words(value.terms, bits, column)
        return value._replace(
            element=value.element * number, common_denominator=value.common_denominator * number.q, bits=bits
        )

    def integer_power(self, value: _Polynomial, n: int, column: int) -> _Polynomial:
        """Compute the n-th power by squaring, for n > 0; the size of each product is checked."""
        self.check_degree(value.degree * n, "a power", column)
        if value.terms == 1:
            bits = value.bits * n
            self.check_bits(max(bits, _bits(value.common_denominator) * n), column)
            self.count_machine_words(1, bits, column)
            return _Polynomial(value.element**n, value.common_denominator**n, bits, 1, value.degree * n)
        result = value
        for digit in f"{n:b}"[1:]:
            result = self.times(result, result, column)
            if digit == "1":
                result = self.times(result, value, column)
        return result

    # The limits, and the errors raised if a limit is exceeded.

    def limited_polynomial(self, value: Any, common_denominator: fmpz, bits: int, column: int) -> _Polynomial:
        if isinstance(value, fmpq):
            return self.constant(value).numerator
        if len(value) > self.limits.terms:
            found_text = f"found a polynomial of {len(value)} terms"
            raise self.error_at(f"{found_text}, expected at most {self.limits.terms}", column)
        return _Polynomial(value, common_denominator, bits, len(value), int(value.total_degree()))

    def polynomial(self, value: _Polynomial) -> fmpq_mpoly:
        """Return the value as a polynomial, a number as a constant polynomial."""
        return self.ring.constant(value.element) if isinstance(value.element, fmpq) else value.element

    def check_bits(self, bits: int, column: int) -> None:
        if bits > self.max_bits:
            found_text = f"found a number of about {bits * 1000 // 3322} digits"
            raise self.error_at(f"{found_text}, expected at most {self.limits.digits}", column)

    def check_degree(self, degree: int, operation: str, column: int) -> None:
        if degree > self.limits.degree:
            raise self.error_at(f"found {operation} of degree {degree}, expected at most {self.limits.degree}", column)

    def count_machine_words(self, terms: int, bits: int, column: int) -> None:
        """Count the machine words of `terms` terms whose coefficients have `bits` bits."""
        self.words_left -= terms * (bits // 64 + 1)
        if self.words_left < 0:
            raise self.error_at("found an expression that takes too much work to expand: simplify or split it", column)

    def error_at(self, message: str, column: int) -> ExpressionError:
        return ExpressionError(message, self.text, column)

    def unknown_name(self, name: str, column: int | None) -> UnknownName:
        names = list(self.names)
        if not names:
            return UnknownName(f"found the name {quoted(name)}, expected numbers only", self.text, column)
        suggestion = ""
        if len(name) <= 40:  # the search for a similar name takes quadratic time
            by_lowercase = {other.lower(): other for other in names}
            from difflib import get_close_matches

            suggestion = "".join(by_lowercase[other] for other in get_close_matches(name.lower(), by_lowercase, 1, 0.7))
            products = (f"{name[:i]}*{name[i:]}" for i in range(1, len(name)) if {name[:i], name[i:]} <= set(names))
            suggestion = next(products, suggestion)
        hint = f"did you mean {suggestion}? " if suggestion else ""
        names_text = ", ".join(names[:30]) + (", ..." if len(names) > 30 else "")
        return UnknownName(f"found the unknown name {quoted(name)}: {hint}known are {names_text}", self.text, column)


def _constant(value: _Quotient) -> fmpq | None:
    """Return the value as a number; None if it contains variables."""
    numerator = value.numerator.element
    if not numerator:
        return fmpq(0)
    if value.denominator is not None or value.numerator.degree > 0:
        return None
    return numerator if isinstance(numerator, fmpq) else numerator.leading_coefficient()


def _bits(integer: fmpz) -> int:
    """Return the least b >= 0 with |integer| <= 2**b; it is 0 for 1 and -1, since a factor 1 or -1 adds no bits."""
    return int((abs(integer) - 1).bit_length()) if integer else 0
