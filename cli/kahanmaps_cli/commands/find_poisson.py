"""kahanmaps find-poisson."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.search import print_search, require_one_form, search_arguments, search_options
from kahanmaps_cli.screen.progress import SearchProgress
from kahanmaps_cli.screen.terminal import print_stdout


@click.command("find-poisson")
@opt.system_options
@click.option(
    "--degree",
    type=click.IntRange(0, 20),
    metavar="D",
    help="Largest degree of entries (default: 3 in dimension 3, else 2).",
)
@click.option("--denominator", metavar="EXPR", help="Common denominator of the entries, e.g. a density.")
@search_options("poisson")
def command(system: str | None, **options: Any) -> int:
    """Search for Poisson tensors P with polynomial entries that the map of SYSTEM preserves: dPhi P dPhi^T = P(x~).

    \b
      kahanmaps find-poisson lotka_volterra
      kahanmaps find-poisson euler_top
      kahanmaps find-poisson volterra_periodic_4 --degree 3
      kahanmaps find-poisson weierstrass --symbolic g2 --toml

    Each is printed by its brackets {x_i, x_j} = P_ij, with its rank, the Jacobi identity, Casimirs, and integrals in
    involution; products with polynomial integrals are omitted. Without --eps the formulas contain eps (the time step is
    2 eps).

    Exit status: 0 found, 2 usage error, 3 none up to the degree tried.
    """
    require_one_form(options)
    with SearchProgress(options) as search:
        file = opt.load_system(system, options)
        settings, denominator = search_arguments(options), None
        if options["denominator"] is not None:
            denominator = lib.parse_rational_function(options["denominator"], (*file.variables, "eps"), file.parameters)
        found = lib.find_poisson(file, options["degree"], denominator=denominator, **settings, progress=search)
    print_search(
        "find-poisson", found, search, options, [(one.name, one, f"{one.statement}; ") for one in found.tensors]
    )
    if not any((options["as_json"], options["as_toml"], options["as_latex"])):
        for integral in found.integrals:
            print_stdout(f"{integral.name}\t{integral.verdict}\t{integral.short_text}")
    return 0 if found.tensors else 3
