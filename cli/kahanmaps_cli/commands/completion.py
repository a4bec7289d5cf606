"""To come."""

from __future__ import annotations

import click


@click.command(name="completion")
def command() -> None:
    """To come.

    \b
      kahanmaps completion
    """
