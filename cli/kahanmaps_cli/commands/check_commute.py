"""kahanmaps check-commute."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps_cli.complete import complete_system
from kahanmaps_cli.options import check_options, inline_options, is_inline, load_pair, settings_from, system_argument
from kahanmaps_cli.params import ExactNumber
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import print_report


@click.command("check-commute")
@system_argument
@click.argument("other", required=False, shell_complete=complete_system)
@inline_options
@click.option("--eps2", type=ExactNumber(), metavar="E", help="Another eps for the second map (needs --eps).")
@check_options
def command(system: str | None, other: str | None, eps2: Any, **options: Any) -> int:
    """Do the maps of SYSTEM and OTHER commute?

    \b
      kahanmaps check-commute paper_m3        # its associated maps, pairwise
      kahanmaps check-commute f.toml g.toml --eps 1/10
      kahanmaps check-commute f.toml g.toml --eps 1/10 --eps2 1/7
      kahanmaps check-commute --vars x,y --rhs y --rhs=-x harmonic
      kahanmaps check-commute paper_m2 --json | jq .verdict

    Without --eps the question is asked for every eps.

    For one SYSTEM of kind [family] the maps of H_0 and H_1, grad H_1 = A grad H_0, come along as a control: they are
    expected NOT to commute, and this does not change the exit status.

    SYSTEM and OTHER are files, names of the catalogue, - for standard input, or equations: "x' = y; y' = -x". -p sets
    a parameter of both, or of the one that has it.

    Exit status: 0 they commute (proved or supported), 1 refuted, 2 usage error, 3 undecided or stopped early.
    """
    from kahanmaps.checks.commute import check_commute

    inline = is_inline(options)
    if inline and system is not None and other is None:
        system, other = None, system  # the inline system is the first, the argument the second
    if system == other == "-":
        raise click.UsageError("found - twice, but standard input holds one system only")
    with Progress(options["quiet"]) as progress:
        settings = settings_from(options, progress)
        file, second = load_pair(system, other, options)
        report = check_commute(file, second, settings, eps2)
    return print_report(report, options["as_json"], options["verbose"], options["quiet"])
