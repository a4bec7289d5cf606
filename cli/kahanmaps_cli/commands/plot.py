"""The command `plot` with its subcommands, one for each kind of picture."""

from __future__ import annotations

from typing import ClassVar

import click

from kahanmaps_cli.groups import SuggestingGroup
from kahanmaps_cli.pictures import (
    commute,
    compare,
    escape,
    growth,
    invariant_curves,
    portrait,
    rotation,
    scan,
    section,
)


class PlotCommands(SuggestingGroup):
    """The group `plot`, which names replacements of removed subcommands."""

    removed: ClassVar = {
        "batch": "kahanmaps batch export writes tables for pandas and matplotlib",
        "drift": "kahanmaps plot compare draws the drift of more methods, errors against the step, and work",
        "recipe": "exiftool, or any program that shows metadata, prints the command of a picture (its description)",
    }


@click.group("plot", cls=PlotCommands)
def command() -> None:
    """Draw pictures for papers as PDF, SVG or PNG.

    \b
      kahanmaps plot portrait lotka_volterra --eps 1/20 -o portrait.pdf
      kahanmaps plot degrees euler_top -o degrees.svg --size 8.6

    Pictures need matplotlib: pip install 'kahanmaps[plot]'. The command and the system are stored in the metadata of
    each picture.
    """


for _command in (
    portrait.command,
    invariant_curves.command,
    compare.command,
    escape.command,
    growth.heights,
    growth.degrees,
    scan.command,
    rotation.command,
    section.command,
    commute.command,
):
    command.add_command(_command)
