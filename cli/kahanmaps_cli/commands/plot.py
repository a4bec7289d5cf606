"""kahanmaps plot portrait | invariant-curves | drift | heights | degrees | scan | commute | batch | recipe."""

from __future__ import annotations

import click

from kahanmaps_cli.groups import SuggestingGroup
from kahanmaps_cli.pictures import batch, commute, drift, growth, invariant_curves, portrait, recipe, scan


@click.group("plot", cls=SuggestingGroup)
def command() -> None:
    """Pictures as PDF, SVG or PNG for papers, or drawn in the terminal.

    \b
      kahanmaps plot portrait lotka_volterra --eps 1/20
      kahanmaps plot portrait lotka_volterra --eps 1/20 -o portrait.pdf
      kahanmaps plot degrees euler_top -o degrees.svg --size 8.6
      kahanmaps plot recipe portrait.pdf

    Pictures need matplotlib: pip install 'kahanmaps[plot]'. Each of them carries the command that makes it.
    """


for _command in (
    portrait.command,
    invariant_curves.command,
    drift.command,
    growth.heights,
    growth.degrees,
    scan.command,
    commute.command,
    batch.command,
    recipe.command,
):
    command.add_command(_command)
