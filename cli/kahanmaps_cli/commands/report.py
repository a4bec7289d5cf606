"""To come."""

from __future__ import annotations

import click


@click.command(name="report")
def command() -> None:
    """To come.

    \b
      kahanmaps report
    """
