"""kahanmaps plot commute."""

from __future__ import annotations

import click

from kahanmaps_cli.pictures.output import PictureCommand


@click.command("commute", cls=PictureCommand)
def command() -> None:
    """To come.

    \b
      kahanmaps plot commute
    """
