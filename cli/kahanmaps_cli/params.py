"""Types of option values: exact numbers, points, times, names with values, kinds of arithmetic."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache, partial
from math import isfinite
from typing import TYPE_CHECKING, Any

import click

import kahanmaps.internals as lib  # `from kahanmaps import internals` would first look for a public name
from kahanmaps.errors import ExpressionError, InputError, quoted
from kahanmaps_cli.screen.terminal import color_option

if TYPE_CHECKING:
    OptionType = click.ParamType[Any]  # generic only in recent versions of click
else:
    OptionType = click.ParamType


HELP_OPTIONS = ["-h", "--help"]
_NAME = re.compile(r"(?<![0-9.A-Za-z_])[A-Za-z_]")
_WITH_EXPONENT = re.compile(r"([+-]?[0-9]+)(?:\.([0-9]+))?[eE]\+?([0-9]{1,3})")
_HINTS = {"\u2212\u2013": "write the minus sign as -", ";": "separate the numbers of a point by commas"}
_MAX_STEP_DIGITS, _MAX_DIGITS = 40, 100  # maximal number of digits of a number of steps, and of any other integer


class ParameterKind(OptionType):
    """A type of option values: `read(text, *settings)` converts a text, and its InputError becomes a usage error.

    A value that is not a string is a default and is returned unchanged.
    """

    def __init__(self, name: str, read: Callable[..., Any], *settings: Any) -> None:
        self.name = name
        self._read = read
        self._settings = settings

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        try:
            return self._read(value, *self._settings)
        except InputError as error:
            self.fail(str(error), param, ctx)


def _read_number(text: str, read: Callable[[str], Any] | None = None) -> Any:
    """Read a number or, with `read`, a point; the error for an invalid text has hints on frequent typing mistakes."""
    try:
        return (read or lib.parse_number)(text)
    except ExpressionError as error:
        hints = [hint for characters, hint in _HINTS.items() if any(c in text for c in characters)]
        raise ExpressionError("; ".join([error.message, *hints]), text, error.column) from None


ExactNumber = partial(ParameterKind, "number", _read_number)  # an integer, p/q or a decimal, read exactly
Arithmetic = partial(
    ParameterKind, "kind", lambda text: lib.Arithmetic.parse(text)
)  # exact, float, mod:P with a prime P, ball:BITS or ball:auto


def PointText(has_names: bool = False) -> ParameterKind:
    """Return the type of points: exact numbers separated by commas; with `has_names` they may contain parameters."""

    def read(text: str) -> Any:
        if has_names and _NAME.search(text):
            return text  # the values of the parameters are inserted when the system is loaded
        return _read_number(text, lib.parse_point)

    return ParameterKind("point", read)


def Seconds() -> ParameterKind:
    """Return the type of positive times in seconds."""

    def read(text: str) -> float:
        try:
            seconds = float(text)
        except ValueError:
            seconds = 0.0
        if not (isfinite(seconds) and seconds > 0):
            raise InputError(f"found {quoted(text)}, expected a number of seconds above 0")
        return seconds

    return ParameterKind("seconds", read)


def Steps() -> ParameterKind:
    """Return the type of step numbers separated by commas."""

    def read(text: str) -> list[int]:
        steps = set()
        for piece in text.split(","):
            piece = _without_exponent(piece.strip())
            if not (piece.isascii() and piece.isdigit()) or len(piece) > _MAX_STEP_DIGITS:
                expected = f"step numbers of at most {_MAX_STEP_DIGITS} digits, separated by commas"
                raise InputError(f"found {quoted(piece)}, expected {expected}")
            steps.add(int(piece))
        return sorted(steps)

    return ParameterKind("n1,n2,...", read)


def Shard() -> ParameterKind:
    """Return the type of texts I/N, which select the I-th of N parts of a batch."""

    def read(text: str) -> tuple[int, ...]:
        pieces = text.partition("/")[::2]
        numbers = tuple(int(part) if part.isascii() and part.isdigit() and len(part) < 10 else 0 for part in pieces)
        if not 1 <= numbers[0] <= numbers[1]:
            raise InputError(f"found {text[:40]!r}, expected I/N with 1 <= I <= N, e.g. 3/16")
        return numbers

    return ParameterKind("i/n", read)


def Section() -> ParameterKind:
    """Return the type of sections of `verify`: a number, or the name of a section that the paper does not number."""

    def read(text: str) -> int:
        name = text.strip()
        if name in lib.SECTION_NAMES:
            return lib.SECTION_NAMES[name]
        if not (name.isascii() and name.isdigit() and len(name) < 10):
            raise InputError(f"found {quoted(text)}, expected 1 to 9, {' or '.join(lib.SECTION_NAMES)}")
        return int(name)

    return ParameterKind("section", read)


def ShortInteger() -> ParameterKind:
    """Return the type of integers of at most 100 digits, which replaces `type=int` in all commands."""

    def read(text: str) -> int:
        text = text.strip()
        if len(text) > _MAX_DIGITS:
            raise InputError(f"found {quoted(text)}, expected an integer of at most {_MAX_DIGITS} digits")
        return int(click.INT(_without_exponent(text)))

    return ParameterKind("integer", read)


def Whole(minimum: int = 0) -> ParameterKind:
    """Return the type of integers that are at least `minimum`."""

    def read(text: str) -> int:
        text = _without_exponent(text.strip())
        digits = text.removeprefix("-").removeprefix("+")
        # The limit on digits avoids Python's own error for long integers.
        if not (digits.isascii() and digits.isdigit() and len(digits) <= 400 and int(text) >= minimum):
            raise InputError(f"found {quoted(text)}, expected an integer, {minimum} or more")
        return int(text)

    return ParameterKind("integer", read)


def NameValue(name_is_optional: bool = False) -> ParameterKind:
    """Return the type of NAME=VALUE; if `name_is_optional`, a text without = is the value, and its name is empty."""

    def read(text: str) -> tuple[str, str]:
        name, equals, value = (piece.strip() for piece in text.partition("="))
        if name_is_optional and "," in name:  # a formula without a name, then definitions of letters
            return "", text.strip()
        if equals and name and value and name.isprintable():
            return name, value
        if name_is_optional and not equals and name:
            return "", name
        hint = f" (for a prime use --prime {text.strip()})" if re.fullmatch("[0-9]{1,20}", text.strip()) else ""
        raise InputError(f"found {quoted(text)}, expected NAME=VALUE{hint}")

    return ParameterKind("name=value", read)


def _without_exponent(text: str) -> str:
    """Write an integer such as 2.5e3 without an exponent; return any other text unchanged.

    >>> _without_exponent("2.5e3"), _without_exponent("1e-1"), _without_exponent("2.5e0")
    ('2500', '1e-1', '2.5e0')
    """
    match = _WITH_EXPONENT.fullmatch(text)
    if match is None:
        return text
    integer, decimals, exponent = match[1], match[2] or "", int(match[3])
    return integer + decimals.ljust(exponent, "0") if len(decimals) <= exponent else text


@cache  # called more than once for a command, but the rules must be applied only once
def with_common_rules(command: click.Command) -> click.Command:
    """Add to a command and its subcommands: --color, a bound on the digits of integers, no repeated options."""
    parse_args = command.parse_args

    def parse_once(ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse an option for one value that is given several times: click would silently use the last value only."""
        _, _, order = command.make_parser(ctx).parse_args(args=list(args))
        for option in order:
            takes_one = isinstance(option, click.Option) and not (option.multiple or option.count or option.is_flag)
            if takes_one and not ctx.resilient_parsing and order.count(option) > 1:
                raise click.UsageError(f"{option.opts[-1]} is given {order.count(option)} times, expected once", ctx)
        return parse_args(ctx, args)

    command.parse_args = parse_once  # type: ignore[method-assign]  # click has no hook for this check
    # Otherwise click would take the names of the help option from the context in which the command is first used.
    command.context_settings.setdefault("help_option_names", HELP_OPTIONS)
    for parameter in command.params:
        if parameter.type is click.INT:
            parameter.type = ShortInteger()
    command.params.append(color_option())
    if isinstance(command, click.Group):
        for subcommand in command.commands.values():
            with_common_rules(subcommand)
    return command
