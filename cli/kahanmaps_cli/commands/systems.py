"""kahanmaps systems."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps.version import __version__
from kahanmaps_cli.params import NameValue
from kahanmaps_cli.render import on_terminal, print_json, shorten


@click.command("systems")
@click.argument("name", required=False)
@click.option("-p", "--parameter", "parameters", type=NameValue(), multiple=True, help="Set a parameter of the system.")
@click.option("--toml", "as_toml", is_flag=True, help="The system file itself, to copy and change.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
def command(name: str | None, parameters: tuple[tuple[str, str], ...], as_toml: bool, as_json: bool) -> None:
    """List the named systems, or show one: its equations, what is known of it, and from where.

    \b
      kahanmaps systems
      kahanmaps systems euler_top
      kahanmaps systems euler_top -p a1=2 --toml > my-top.toml
    """
    from kahanmaps.systems.catalog import load, names

    if as_toml and as_json:
        raise click.UsageError("give --toml or --json, one of the two")
    if name is None:
        if as_toml or parameters:
            raise click.UsageError("--toml and -p need the NAME of a system")
        rows = [(key, load(key)) for key in names()]
        if as_json:
            print_json({"version": __version__, "systems": [_summary(file) for _, file in rows]})
            return
        width = max(len(key) for key, _ in rows)
        for key, file in rows:
            click.echo(f"{key:<{width}}  {file.system.dim:>2}  {file.catalog.get('title', '')}")
        return
    file = load(name, dict(parameters))
    if as_toml:
        click.echo(file.to_toml(), nl=False)
    elif as_json:
        print_json({**_summary(file), **_equations(file), "document": file.document})
    else:
        _show(file)


def _summary(file: Any) -> dict[str, Any]:
    return {
        "name": file.name,
        "dim": file.system.dim,
        "kind": file.kind,
        "title": file.catalog.get("title", ""),
        "parameters": {name: str(value) for name, value in file.parameters.items()},
    }


def _equations(file: Any) -> dict[str, Any]:
    from kahanmaps.algebra.text import format_polynomial, format_rational_function
    from kahanmaps.sources import source

    return {
        "variables": list(file.variables),
        "rhs": [format_polynomial(polynomial) for polynomial in file.system.rhs],
        "integrals": {name: format_rational_function(function) for name, function in file.integrals.items()},
        "density": format_rational_function(file.density) if file.density is not None else None,
        "facts": list(file.catalog.get("facts", [])),
        "convention": file.catalog.get("convention", ""),
        "sources": [source(key) for key in file.catalog.get("sources", [])],
    }


def _formula(text: str) -> str:
    """A long formula is shortened on a terminal only."""
    return shorten(text, 300) if on_terminal() else text


def _show(file: Any) -> None:
    from kahanmaps.algebra.text import format_polynomial

    facts = _equations(file)
    click.echo(f"{file.name}: {file.catalog.get('title', '')}" if file.catalog.get("title") else file.name)
    for name, value in file.parameters.items():
        click.echo(f"  {name} = {value}")
    for name, text in zip(facts["variables"], facts["rhs"], strict=True):
        click.echo(f"{name}' = {_formula(text)}")
    if file.hamiltonian is not None:
        click.echo(f"H = {_formula(format_polynomial(file.hamiltonian.H))}")
    for name, text in facts["integrals"].items():
        click.echo(f"integral {name} = {_formula(text)}")
    if facts["density"]:
        click.echo(f"density phi = {_formula(facts['density'])}  (dx/phi is invariant)")
    for fact in facts["facts"]:
        click.echo(f"* {fact}")
    if facts["convention"]:
        click.echo(f"step: {facts['convention']}")
    for text in facts["sources"]:
        click.echo(f"source: {text}")
