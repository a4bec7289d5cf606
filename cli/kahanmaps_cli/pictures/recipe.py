"""kahanmaps plot recipe."""

from __future__ import annotations

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli.screen.render import print_json
from kahanmaps_cli.screen.terminal import echo


@click.command("recipe")
@click.argument("picture", type=click.Path(exists=True, dir_okay=False))
@click.option("--system", "show_system", is_flag=True, help="The system file that was drawn, instead of the command.")
@click.option("--json", "as_json", is_flag=True, help="Command, system and version as one JSON object.")
def command(picture: str, show_system: bool, as_json: bool) -> None:
    """The command that makes a picture, read from the picture.

    \b
      kahanmaps plot recipe orbit.pdf
      kahanmaps plot recipe orbit.pdf --system > system.toml

    The system is kept as well, so that the picture can be remade where its system file has changed or was typed in.
    """
    recipe = lib.read_recipe(picture)
    if as_json:
        print_json({"command": recipe.command, "system": recipe.system or None, "version": recipe.version})
    elif show_system:
        if not recipe.system:
            raise click.UsageError(f"{picture}: found a picture without one system, expected one of a system")
        echo(recipe.system, end="")
    else:
        echo(recipe.command)
