"""kahanmaps check-poisson."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps_cli.options import check_options, load_system, settings_from, system_options
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import print_report


@click.command("check-poisson")
@system_options
@check_options
def command(system: str | None, **options: Any) -> int:
    """Is Pi(x) = J - eps^2 f'(x)^2 J a Poisson tensor that the Kahan map of SYSTEM preserves?

    \b
      kahanmaps check-poisson paper_m3
      kahanmaps check-poisson henon_heiles    # Hamiltonian, and it fails

    Both the transformation law dPhi Pi(x) dPhi^T = Pi(x~) and the Jacobi identity are put to the test. Without --eps
    the question is asked for every eps.

    Exit status: 0 it is (proved or supported), 1 refuted, 2 wrong use, 3 undecided or stopped early.
    """
    from kahanmaps.checks.preserve import check_poisson

    with Progress(options["quiet"]) as progress:
        settings = settings_from(options, progress)
        file = load_system(system, options)
        report = check_poisson(file, settings)
    return print_report(report, options["as_json"], options["verbose"], options["quiet"])
