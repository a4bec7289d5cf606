"""To come."""

from __future__ import annotations

import click


@click.command(name="convert")
def command() -> None:
    """To come.

    \b
      kahanmaps convert
    """
