"""kahanmaps plot degrees."""

from __future__ import annotations

import click

from kahanmaps_cli.pictures.output import PictureCommand


@click.command("degrees", cls=PictureCommand)
def command() -> None:
    """To come.

    \b
      kahanmaps plot degrees
    """
