"""--color, which every command knows, before its name and after it."""

from __future__ import annotations

from typing import Any

import click

_WHEN = {"auto": None, "always": True, "never": False}


def _choose(context: click.Context, parameter: click.Parameter, value: Any) -> None:
    if value is not None:
        context.color = _WHEN[value]


def colour_option() -> click.Option:
    """The option --color auto|always|never."""
    return click.Option(
        ["--color"],
        type=click.Choice(list(_WHEN)),
        metavar="WHEN",
        callback=_choose,
        expose_value=False,
        is_eager=True,
        help="Colours: auto (the default), always or never.",
    )


def with_colour_option(command: click.Command) -> click.Command:
    """The command, which knows --color from now on, as do the commands below it."""
    if all("--color" not in parameter.opts for parameter in command.params):
        command.params.append(colour_option())
    if isinstance(command, click.Group):
        for below in command.commands.values():
            with_colour_option(below)
    return command
