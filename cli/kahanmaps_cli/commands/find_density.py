"""kahanmaps find-density."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps_cli.commands.find_integrals import heading, scope, symbols_and_eps
from kahanmaps_cli.options import eps_options, load_system, output_options, system_options
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import on_terminal, print_json, shorten


@click.command("find-density")
@system_options
@eps_options
@click.option("--symbolic", metavar="NAMES", help="Parameters that formulas are to contain, e.g. a1,a2 (eps is one).")
@click.option("--max-degree", type=click.IntRange(0, 20), help="Largest degree of phi.")
@click.option("--seconds", type=click.FloatRange(min=1), default=60, show_default=True, help="Time for the search.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of everything drawn at random.")
@click.option("--toml", "as_toml", is_flag=True, help="The section [density] of a system file.")
@click.option("--latex", "as_latex", is_flag=True, help="The formulas in LaTeX.")
@output_options
def command(system: str | None, **options: Any) -> int:
    """Densities of SYSTEM: polynomials phi of the least degree, or 1/phi, for which the measure dx/phi is invariant.

    \b
      kahanmaps find-density lotka_volterra
      kahanmaps find-density euler_top --symbolic a1,a2,a3
      kahanmaps find-density nahm_tetrahedral --toml

    Exit status: 0 found, 2 wrong use, 3 none up to the degree that was tried.
    """
    from kahanmaps.laboratory.densities import find_densities

    if sum((options["as_toml"], options["as_latex"], options["as_json"])) > 1:
        raise click.UsageError("give one of --toml, --latex and --json")
    with Progress(options["quiet"]) as progress:
        file = load_system(system, options["variables"], options["rhs"], options["parameters"])
        symbols, eps = symbols_and_eps(options)
        found = find_densities(
            file,
            symbols=symbols,
            eps=eps,
            max_degree=options["max_degree"],
            seconds=options["seconds"],
            seed=options["seed"],
            progress=progress,
        )
    if options["as_json"]:
        print_json({**heading("find-density", found), **found.to_json(), "document": dict(file.document)})
    elif options["as_toml"]:
        click.echo(found.toml_section(), nl=False)
    elif options["as_latex"]:
        for one in found.densities:
            click.echo(f"phi = {one.to_json()['latex']}")
    else:
        click.echo(f"find-density: {file.name}, {scope(found)}")
        for one in found.densities:
            formula = shorten(one.text, 400) if on_terminal() else one.text
            click.echo(f"phi\t{one.verdict}\t{formula}\n\t{one.evidence.summary}")
        for text in filter(None, (found.note, found.reason)):
            click.echo(f"note\t{text}")
    return 0 if found.densities else 3
