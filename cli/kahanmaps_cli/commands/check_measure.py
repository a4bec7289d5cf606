"""kahanmaps check-measure."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps_cli.options import check_options, load_system, settings_from, system_options
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import print_report


@click.command("check-measure")
@system_options
@click.option("--density", metavar="EXPR", help="A claimed density phi: a rational function of the variables and eps.")
@check_options
def command(system: str | None, density: str | None, **options: Any) -> int:
    """Is the measure dx/phi invariant under the map of SYSTEM?

    \b
      kahanmaps check-measure paper_m3
      kahanmaps check-measure lotka_volterra --eps 1/10
      kahanmaps check-measure --vars x,y --rhs 'x*(1-y)' --rhs 'y*(x-1)' \\
          --density x*y

    Without --eps the question is asked for every eps. For Hamiltonian systems phi = det(I - eps f'(x)); otherwise the
    [density] of the file, or --density.

    Exit status: 0 invariant (proved or supported), 1 refuted, 2 usage error, 3 undecided or stopped early.
    """
    from kahanmaps.algebra.text import parse_rational_function
    from kahanmaps.checks.preserve import check_measure

    with Progress(options["quiet"]) as progress:
        settings = settings_from(options, progress)
        file = load_system(system, options)
        extra = None
        if density is not None:
            extra = parse_rational_function(density, file.claim_names, file.parameters)
        report = check_measure(file, settings, extra)
    return print_report(report, options["as_json"], options["verbose"], options["quiet"])
