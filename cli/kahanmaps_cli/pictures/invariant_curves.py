"""kahanmaps plot invariant-curves."""

from __future__ import annotations

import click

from kahanmaps_cli.pictures.output import PictureCommand


@click.command("invariant-curves", cls=PictureCommand)
def command() -> None:
    """To come.

    \b
      kahanmaps plot invariant-curves
    """
