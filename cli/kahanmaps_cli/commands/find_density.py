"""kahanmaps find-density."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.certificates import write_certificate
from kahanmaps_cli.runs.search import print_search, require_one_form, search_arguments, search_options
from kahanmaps_cli.screen.progress import SearchProgress


@click.command("find-density")
@opt.system_options
@click.option("--flow", is_flag=True, help="Search for densities of the differential equation instead of the map.")
@click.option("--max-degree", type=click.IntRange(0, 20), metavar="D", help="Largest degree of phi (default 12).")
@search_options("density")
def command(system: str | None, **options: Any) -> int:
    """Search for denominators phi of invariant volume forms dx/phi of the map of SYSTEM.

    \b
      kahanmaps find-density lotka_volterra
      kahanmaps find-density euler_top --symbolic a1,a2,a3
      kahanmaps find-density nahm_tetrahedral --toml
      kahanmaps find-density zander_120 --flow

    phi is called density here. The command searches for a polynomial of least degree. It also tries products of
    positive and negative powers of polynomials that it knows from the map, such as the variables and the factors of
    Jacobi determinants. If it finds neither, it searches for integrals and tries their factors, too. Every formula is
    verified as an identity.

    phi times any integral is a density again: the shortest density found is shown, and --json lists all of them.

    Exit status: 0 if a density was found, 2 for a usage error, 3 if none was found up to the degree that was tried.
    """
    require_one_form(options)
    if options["flow"] and options["certificate"] is not None:
        raise click.UsageError("--flow cannot be combined with --certificate, which is for the map")
    with SearchProgress(options) as search:
        file = opt.load_system(system, options)
        settings = search_arguments(options, "flow", "max_degree")
        if options["flow"] and options["as_toml"]:
            raise click.UsageError("--flow cannot be combined with --toml, which is for the map")
        result = lib.find_densities(file, **settings, progress=search)
    further_line = f"note\t{result.further}" if result.further else ""
    print_search("find-density", result, search, options, [("phi", phi, "") for phi in result.shown], further_line)
    status = 0 if result.densities else 3
    return write_certificate(options, file.name, result.certificate, status)
