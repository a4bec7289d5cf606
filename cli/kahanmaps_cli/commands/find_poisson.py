"""kahanmaps find-poisson."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.certificates import write_certificate
from kahanmaps_cli.runs.search import print_search, require_one_form, search_arguments, search_options
from kahanmaps_cli.screen.progress import SearchProgress
from kahanmaps_cli.screen.terminal import print_stdout


@click.command("find-poisson")
@opt.system_options
@click.option(
    "--degree",
    type=click.IntRange(0, 20),
    metavar="D",
    help="Largest degree of the entries P_ij (default: 3 in dimension 3, else 2).",
)
@click.option("--denominator", metavar="EXPR", help="Common denominator of the entries, e.g. a density (default 1).")
@search_options("poisson")
def command(system: str | None, **options: Any) -> int:
    """Search for Poisson tensors that the map of SYSTEM preserves.

    These are skew matrices P(x) with polynomial entries and dPhi P dPhi^T = P(x~).

    \b
      kahanmaps find-poisson lotka_volterra
      kahanmaps find-poisson euler_top
      kahanmaps find-poisson volterra_periodic_4 --degree 3
      kahanmaps find-poisson weierstrass --symbolic g2 --toml

    The output lists the brackets {x_i, x_j} = P_ij, the rank, the Jacobi identity, the Casimirs and the integrals in
    involution. Products of polynomial integrals with other tensors are left out. Without --eps the formulas contain eps
    (the time step is 2 eps).

    Exit status: 0 if a tensor was found, 2 for a usage error, 3 if none was found up to the degree that was tried.
    """
    require_one_form(options)
    with SearchProgress(options) as search:
        file = opt.load_system(system, options)
        settings, denominator = search_arguments(options), None
        if options["denominator"] is not None:
            denominator = lib.parse_rational_function(options["denominator"], (*file.variables, "eps"), file.parameters)
        result = lib.find_poisson(file, options["degree"], denominator=denominator, **settings, progress=search)
    print_search("find-poisson", result, search, options, [(P.name, P, f"{P.statement}; ") for P in result.tensors])
    if not any((options["as_json"], options["as_toml"], options["as_latex"])):
        for integral in result.integrals:
            print_stdout(f"{integral.name}\t{integral.verdict}\t{integral.short_text}")
    status = 0 if result.tensors else 3
    return write_certificate(options, file.name, result.certificate, status)
