"""Kinds of option values: exact numbers, points, times, names with values, kinds of arithmetic."""

from __future__ import annotations

import re
from functools import cache
from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from kahanmaps.errors import InputError, quoted

if TYPE_CHECKING:
    OptionType = click.ParamType[Any]  # generic for the type checker, but not in every version of click we run with
else:
    OptionType = click.ParamType


HELP_OPTIONS = ["-h", "--help"]
_WITH_EXPONENT = re.compile(r"([+-]?[0-9]+)(?:\.([0-9]+))?[eE]\+?([0-9]{1,3})")
_MOST_STEP_DIGITS, _MOST_DIGITS = 40, 100  # of a step number, of any other integer: floats go further


class ExactNumber(OptionType):
    """An integer, p/q or a decimal, read exactly."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        from kahanmaps.algebra.text import parse_number

        if not isinstance(value, str):
            return value
        try:
            return parse_number(value)
        except InputError as error:
            self.fail(str(error), param, ctx)


class PointText(OptionType):
    """Numbers separated by commas, read exactly."""

    name = "point"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        from kahanmaps.algebra.text import parse_point

        if not isinstance(value, str):
            return value
        try:
            return parse_point(value)
        except InputError as error:
            self.fail(str(error), param, ctx)


class Whole(OptionType):
    """An integer that is at least `least`."""

    name = "integer"

    def __init__(self, least: int = 0) -> None:
        self.least = least

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        text = str(value).strip()
        text = _spelt_out(text)
        digits = text.removeprefix("-").removeprefix("+")
        # Longer ones are refused before they meet Python's own limit on digits.
        if not (digits.isascii() and digits.isdigit() and len(digits) <= 400 and int(text) >= self.least):
            self.fail(f"found {quoted(text)}, expected an integer, {self.least} or more", param, ctx)
        return int(text)


class ShortInteger(OptionType):
    """An integer that a machine can count to, and many digits more: what `type=int` means in our commands."""

    name = "integer"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, str) and len(value.strip()) > _MOST_DIGITS:
            self.fail(f"found {quoted(value)}, expected an integer of at most {_MOST_DIGITS} digits", param, ctx)
        if isinstance(value, str):
            value = _spelt_out(value.strip())
        return click.INT.convert(value, param, ctx)


def _spelt_out(text: str) -> str:
    """1e6 and 2.5e3 as integers without an exponent; any other text as it is.

    >>> _spelt_out("2.5e3"), _spelt_out("1e-1"), _spelt_out("2.5e0")
    ('2500', '1e-1', '2.5e0')
    """
    match = _WITH_EXPONENT.fullmatch(text)
    if match is None:
        return text
    whole, part, exponent = match[1], match[2] or "", int(match[3])
    return whole + part.ljust(exponent, "0") if len(part) <= exponent else text


def _require_once(command: click.Command, ctx: click.Context, args: list[str]) -> list[str]:
    """The arguments, of which an option with one value may not be given twice: the first one would be lost."""
    _, _, order = command.make_parser(ctx).parse_args(args=list(args))
    for option in order:
        takes_one = isinstance(option, click.Option) and not (option.multiple or option.count or option.is_flag)
        if takes_one and not ctx.resilient_parsing and order.count(option) > 1:
            raise click.UsageError(f"{option.opts[-1]} is given {order.count(option)} times, expected once", ctx)
    return args


@cache  # a command is given its rules once
def with_our_rules(command: click.Command) -> click.Command:
    """The command, and those below it, with integers of bounded length for `type=int`, and no option lost.

    That is to say: none that takes one value is given more than once.
    """
    parse_args = command.parse_args
    # click has no other place for it
    command.parse_args = lambda ctx, args: parse_args(ctx, _require_once(command, ctx, args))  # type: ignore[method-assign]
    # click keeps the option for help as the first context has it, which need not be one below the group.
    command.context_settings.setdefault("help_option_names", HELP_OPTIONS)
    for parameter in command.params:
        if parameter.type is click.INT:
            parameter.type = ShortInteger()
    if isinstance(command, click.Group):
        for below in command.commands.values():
            with_our_rules(below)
    return command


class Seconds(OptionType):
    """A time above 0."""

    name = "seconds"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            seconds = float(value)
        except ValueError:
            seconds = 0.0
        if not (isfinite(seconds) and seconds > 0):
            self.fail(f"found {quoted(str(value))}, expected a number of seconds above 0", param, ctx)
        return seconds


class NameValue(OptionType):
    """NAME=VALUE; without a name the whole text is the value where `name_is_optional`."""

    name = "name=value"

    def __init__(self, name_is_optional: bool = False) -> None:
        self.name_is_optional = name_is_optional

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        left, equals, right = (piece.strip() for piece in value.partition("="))
        if equals and left and right and left.isprintable():
            return left, right
        if self.name_is_optional and not equals and left:
            return "", left
        self.fail(f"found {quoted(value)}, expected NAME=VALUE", param, ctx)


class Arithmetic(OptionType):
    """exact, float, mod:P (P a prime), ball:BITS or ball:auto."""

    name = "kind"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        from kahanmaps.maps import arithmetic

        try:
            return arithmetic.Arithmetic.parse(value)
        except InputError as error:
            self.fail(str(error), param, ctx)


class Steps(OptionType):
    """Step numbers separated by commas."""

    name = "n1,n2,..."

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        steps = []
        for piece in value.split(","):
            piece = _spelt_out(piece.strip())
            if not (piece.isascii() and piece.isdigit()) or len(piece) > _MOST_STEP_DIGITS:
                self.fail(
                    f"found {quoted(piece)}, expected step numbers of at most {_MOST_STEP_DIGITS} digits, separated by "
                    "commas",
                    param,
                    ctx,
                )
            steps.append(int(piece))
        return sorted(set(steps))


class Shard(OptionType):
    """I/N: the I-th of N parts."""

    name = "i/n"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        part, slash, parts = value.partition("/")
        numbers = [int(text) if text.isascii() and text.isdigit() and len(text) < 10 else 0 for text in (part, parts)]
        if not slash or not 1 <= numbers[0] <= numbers[1]:
            self.fail(f"found {value[:40]!r}, expected I/N with 1 <= I <= N, e.g. 3/16", param, ctx)
        return tuple(numbers)
