"""kahanmaps schema."""

from __future__ import annotations

import json

import click

from kahanmaps_cli.screen.render import envelope, print_json


def _complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    from kahanmaps_cli.schema_files import schema_titles

    return [name for name in schema_titles() if name.startswith(incomplete)]


@click.command("schema")
@click.argument("names", metavar="[NAME]", nargs=-1, shell_complete=_complete)
@click.option("--json", "as_json", is_flag=True, help="The list as one JSON object.")
def command(names: tuple[str, ...], as_json: bool) -> None:
    """JSON schemas (draft 2020-12) of system files, batch specs and of what --json prints; without NAME, the list.

    \b
      kahanmaps schema
      kahanmaps schema orbit > orbit.schema.json
      kahanmaps schema check-commute
      kahanmaps schema family show

    NAME is that of a command, or system-file or batch-spec. A schema is complete in itself and strict: a key that it
    does not name is an error. Where a command prints one JSON object a line, the schema is that of a line.
    """
    from kahanmaps_cli.schema_files import DIALECT, schema, schema_titles

    if names:
        click.echo(json.dumps(schema("-".join(names)), indent=2))
        return
    titles = schema_titles()
    if as_json:
        rows = [{"name": name, "title": title} for name, title in titles.items()]
        print_json({**envelope("schema"), "dialect": DIALECT, "schemas": rows})
        return
    width = max(map(len, titles))
    for name, title in titles.items():
        click.echo(f"{name:<{width}}  {title}")
