"""To come."""

from __future__ import annotations

import click


@click.command(name="manual")
def command() -> None:
    """To come.

    \b
      kahanmaps manual
    """
