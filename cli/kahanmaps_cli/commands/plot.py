"""To come."""

from __future__ import annotations

import click


@click.command(name="plot")
def command() -> None:
    """To come.

    \b
      kahanmaps plot
    """
