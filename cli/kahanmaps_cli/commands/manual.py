"""kahanmaps manual."""

from __future__ import annotations

import click

from kahanmaps_cli import library as lib


@click.command("manual")
def command() -> None:
    """Print the manual page: all commands, their options and examples, exit statuses, environment, files.

    \b
      kahanmaps manual | man -l -
      kahanmaps manual > kahanmaps.1
    """
    from kahanmaps_cli.main import SECTIONS, cli
    from kahanmaps_cli.manual_page import manual_page

    sections = {heading: list(commands) for heading, commands in SECTIONS.items()}
    click.echo(manual_page(cli, sections, lib.__version__), nl=False)
