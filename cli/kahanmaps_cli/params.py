"""Kinds of option values: exact numbers, points, times, names with values, kinds of arithmetic."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from kahanmaps.errors import InputError, quoted

if TYPE_CHECKING:
    OptionType = click.ParamType[Any]  # generic for the type checker, but not in every version of click we run with
else:
    OptionType = click.ParamType


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
        return click.INT.convert(value, param, ctx)


def with_short_integers(command: click.Command) -> click.Command:
    """The command, and those below it, with integers of bounded length wherever they say `type=int`."""
    for parameter in command.params:
        if parameter.type is click.INT:
            parameter.type = ShortInteger()
    if isinstance(command, click.Group):
        for below in command.commands.values():
            with_short_integers(below)
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
            piece = piece.strip()
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
