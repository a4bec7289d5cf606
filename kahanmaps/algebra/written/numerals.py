"""Numbers and names in text, and what a text may cost: what readers of points and of expressions share."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.errors import ExpressionError, InexactNumber, InputError, quoted


@dataclass(frozen=True)
class Limits:
    """How large a text, and what it stands for, may be. Meant to be out of the way of honest use.

    The limits hold for results and for every value on the way to them. Digits are bounded before anything is computed,
    on the high side.
    """

    number_digits: int = 1_000_000  # of one number read by parse_number or parse_point
    power_of_ten: int = 10_000  # the e in 1e-3, in size
    characters: int = 200_000  # of an expression
    depth: int = 100  # of brackets
    degree: int = 64  # total degree of a numerator or denominator
    exponent: int = 1_000  # in size
    digits: int = 100_000  # of a coefficient written over the common denominator of its polynomial
    terms: int = 20_000  # of a polynomial
    words: int = 5_000_000  # of 64 bits, of all values on the way; pairs of terms that are multiplied count too


LIMITS = Limits()
NO_CONSTANTS: Mapping[str, fmpq] = MappingProxyType({})

BLANKS = " \t\r\n"
_NUMBER = re.compile(r"([+-]?)(?:([0-9]+)/([0-9]+)|([0-9]+)?(?:\.([0-9]*))?(?:[eE]([+-]?[0-9]+))?)")
_START_OF_NUMBER = re.compile(
    r"[+-]?(?:[0-9]+(?:/[0-9]*|\.?[0-9]*(?:[eE][+-]?[0-9]*)?)|\.(?:[0-9]+(?:[eE][+-]?[0-9]*)?)?)?"
)
_NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")
_EXPECTED = "expected an integer, p/q or a decimal such as 0.1"


def is_name(text: str) -> bool:
    """Whether `text` can name a variable: ASCII letters, digits and _, no digit first (FLINT accepts ASCII only).

    >>> is_name("x1"), is_name("1x"), is_name("ε")
    (True, False, False)
    """
    return isinstance(text, str) and _NAME.fullmatch(text) is not None


def check_names(names: Sequence[str], *, iterates: bool = False) -> None:
    """Raise `InputError` unless `names` are distinct and all of them can name a variable, with `iterates` also x~.

    >>> check_names(["x", "y", "x"])
    Traceback (most recent call last):
    kahanmaps.errors.InputError: found the name 'x' twice, expected distinct names
    """
    if isinstance(names, str):
        raise InputError(f"found the text {quoted(names)}, expected a list of names such as ['x', 'y']")
    seen = set()
    for name in names:
        if not is_name(name.rstrip("~") if iterates and isinstance(name, str) else name):
            found = quoted(name) if isinstance(name, str) else f"a {type(name).__name__}"
            raise InputError(f"found {found}, expected a name: ASCII letters, digits and _, not starting with a digit")
        if name in seen:
            raise InputError(f"found the name {quoted(name)} twice, expected distinct names")
        seen.add(name)


def number_in(text: str, start: int, end: int, digits: int, limits: Limits) -> fmpq:
    """The number in `text[start:end]`; mistakes are reported with their column in the whole text."""
    while start < end and text[start] in BLANKS:
        start += 1
    while start < end and text[end - 1] in BLANKS:
        end -= 1
    if start == end:
        raise ExpressionError(f"found nothing, {_EXPECTED}", text, start)
    if end - start > digits + 20:
        found = f"found a number of {end - start} characters"
        raise ExpressionError(f"{found}, expected at most {digits} digits", text, start)
    match = _NUMBER.fullmatch(text, start, end)
    if match is None or not (match[2] or match[4] or match[5]):
        prefix = _START_OF_NUMBER.match(text, start, end)
        column = start if prefix is None else prefix.end()
        raise ExpressionError(f"found {quoted(text[start:end])}, {_EXPECTED}", text, column)
    sign, above, below, whole, fraction, power = match.groups()
    if max(len(above or ""), len(below or ""), len(whole or "") + len(fraction or "")) > digits:
        raise ExpressionError(f"found a number of more than {digits} digits, expected at most so many", text, start)
    if below is not None:
        divisor = fmpz(below)
        if divisor == 0:
            raise ExpressionError("found the denominator 0, expected a nonzero integer", text, match.start(3))
        value = fmpq(fmpz(above), divisor)
    else:
        value = fmpq(fmpz((whole or "") + (fraction or "")))
        shift = -len(fraction or "")
        if power is not None:
            # The length first: Python's int() stops at 4300 digits.
            size = power.lstrip("+-").lstrip("0")
            if len(size) > 9 or int(size or "0") > limits.power_of_ten:
                found = f"found the power of ten {quoted(power)}"
                raise ExpressionError(f"{found}, expected at most {limits.power_of_ten} in size", text, match.start(6))
            shift += int(power)
        if shift:
            ten = fmpz(10) ** abs(shift)
            value = value * ten if shift > 0 else value / ten
    return -value if sign == "-" else value


def require_text(text: object, what: str, hint: str) -> None:
    """Raise `InputError` (for a float `InexactNumber`) unless `text` is a str."""
    if not isinstance(text, str):
        raise wrong_kind(text, f"{what} as text", hint)


def wrong_kind(value: Any, expected: str, hint: str) -> InputError:
    """The error to raise for a value of another type: what it is, what was `expected`, and what to do."""
    if isinstance(value, float):
        return InexactNumber(f"found the machine number {value!s}, expected {expected}: {hint}")
    return InputError(f"found a value of type {type(value).__name__}, expected {expected}: {hint}")
