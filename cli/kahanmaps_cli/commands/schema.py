"""To come."""

from __future__ import annotations

import click


@click.command(name="schema")
def command() -> None:
    """To come.

    \b
      kahanmaps schema
    """
