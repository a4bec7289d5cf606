"""kahanmaps find-density."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.search import print_search, require_one_form, search_arguments, search_options
from kahanmaps_cli.screen.progress import SearchProgress


@click.command("find-density")
@opt.system_options
@click.option("--flow", is_flag=True, help="Search for densities of the differential equation instead.")
@click.option("--max-degree", type=click.IntRange(0, 20), metavar="D", help="Largest degree of phi.")
@search_options("density")
def command(system: str | None, **options: Any) -> int:
    """Search for denominators phi of invariant volume forms dx/phi of the map of SYSTEM.

    \b
      kahanmaps find-density lotka_volterra
      kahanmaps find-density euler_top --symbolic a1,a2,a3
      kahanmaps find-density nahm_tetrahedral --toml
      kahanmaps find-density zander_120 --flow

    phi is a polynomial of least degree, or a product of powers of known polynomials with exponents of either sign;
    where nothing else is found, factors of integrals are tried too. phi times an integral is again such a denominator:
    the shortest is printed, and --json has all that were found. Each is verified as an identity.

    Exit status: 0 found, 2 usage error, 3 none up to the degree tried.
    """
    require_one_form(options)
    with SearchProgress(options) as search:
        file = opt.load_system(system, options)
        settings = search_arguments(options, "flow", "max_degree")
        if options["flow"] and options["as_toml"]:
            raise click.UsageError("--flow goes without --toml, which is about the map")
        found = lib.find_densities(file, **settings, progress=search)
    further = f"note\t{found.further}" if found.further else ""
    print_search("find-density", found, search, options, [("phi", one, "") for one in found.shown], further)
    return 0 if found.densities else 3
