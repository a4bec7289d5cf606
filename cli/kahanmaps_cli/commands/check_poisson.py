"""kahanmaps check-poisson."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps_cli.options import check_options, load_system, settings_from, system_options
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import print_report


@click.command("check-poisson")
@system_options
@click.option(
    "--tensor",
    "path",
    type=click.Path(),
    metavar="FILE",
    help="A claimed tensor P: a section [poisson] with rows of functions, as find-poisson --toml prints it.",
)
@check_options
def command(system: str | None, path: str | None, **options: Any) -> int:
    """Is Pi(x) = J - eps^2 f'(x)^2 J, or the tensor P of a file, a Poisson tensor that the map of SYSTEM preserves?

    \b
      kahanmaps check-poisson paper_m3
      kahanmaps check-poisson henon_heiles    # Hamiltonian, and it fails
      kahanmaps check-poisson lotka_volterra --tensor p.toml

    Both the transformation law dPhi P(x) dPhi^T = P(x~) and the Jacobi identity are put to the test. Without --eps
    the question is asked for every eps. Without --tensor P is Pi, for Hamiltonian systems.

    Exit status: 0 it is (proved or supported), 1 refuted, 2 usage error, 3 undecided or stopped early.
    """
    from kahanmaps.checks.preserve import check_poisson
    from kahanmaps.invariants.poisson import GivenTensor

    with Progress(options["quiet"]) as progress:
        settings = settings_from(options, progress)
        file = load_system(system, options)
        tensor = None if path is None else GivenTensor.read(path, file.variables, file.parameters)
        report = check_poisson(file, settings, tensor)
    return print_report(report, options["as_json"], options["verbose"], options["quiet"])
