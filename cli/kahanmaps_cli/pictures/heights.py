"""kahanmaps plot heights."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from kahanmaps_cli.commands.heights import require_heights, surveyed
from kahanmaps_cli.options import eps_options, load_system, seconds_option, seed_option, system_options, the_eps
from kahanmaps_cli.params import PointText, Whole
from kahanmaps_cli.pictures.output import PictureCommand, deliver, picture_options, require_output, style_from
from kahanmaps_cli.pictures.records import read_record
from kahanmaps_cli.progress import Progress, say

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile

# Of OrbitEnd: a number limit or a return are ends that the picture is made for, a hole in the map is not.
_EARLY = ("singular",)


@click.command("heights", cls=PictureCommand)
@system_options
@click.option("--from", "record", metavar="FILE", help="Written by heights --json, instead of SYSTEM.")
@eps_options
@click.option("--random", "count", type=Whole(1), metavar="N", help="N starts drawn at random (default 3).")
@click.option("--start", "given", type=PointText(), multiple=True, metavar="X", help="Instead: this start. Repeatable.")
@click.option("--steps", type=int, metavar="N", default=60, show_default=True, help="Steps of each orbit.")
@click.option(
    "--max-digits", type=Whole(1), metavar="N", default=20_000, show_default=True, help="Digit budget of each orbit."
)
@seconds_option(30.0, "Stop after about so many seconds.")
@seed_option
@click.option("--scale", type=click.Choice(["linear", "log", "loglog"]), help="Chosen by itself unless given.")
@picture_options
def command(system: str | None, **options: Any) -> int:
    """Heights of exact orbits against the step: how fast the numbers grow.

    \b
      kahanmaps plot heights weierstrass
      kahanmaps plot heights weierstrass --eps 1/10 --random 5 -o heights.pdf
      kahanmaps plot heights lotka_volterra --scale log -o heights.svg
      kahanmaps heights weierstrass --json | kahanmaps plot heights --from -

    The height is the bit length of the largest integer that a point needs; a
    colour is an eps, a curve an orbit, a line the growth that was fitted.
    Records hold heights at the steps 0, 1, 2, 4, 8, ... only.

    Exit status: 0 done, 2 usage error, 3 some orbit met a singular point, or the
    time was over before all orbits were finished (the picture is written).
    """
    from kahanmaps.plots.growth import draw_heights
    from kahanmaps.plots.height_curves import curves_of_record, height_curves

    require_output(options)
    require_heights(options)
    file: SystemFile | None = None
    whole, digits = True, options["max_digits"]
    if options["record"] is not None:
        if system is not None or options["variables"] or options["rhs"]:
            raise click.UsageError("give a SYSTEM or --from FILE, not both")
        record = read_record(options["record"])
        curves = curves_of_record(record, options["record"])
        whole, digits = record.get("whole") is not False, record.get("max_digits", digits)
    else:
        file = load_system(system, options)
        eps = the_eps(options["eps"], options["time_step"], required=False)
        with Progress(options["quiet"]) as progress:
            survey = surveyed(file, eps, options, progress)
        curves, whole = height_curves(survey), survey.is_whole
    deliver(draw_heights(curves, style_from(options), scale=options["scale"]), options, file)
    early = sum(curve.status in _EARLY for curve in curves)
    if not options["quiet"]:
        short = sum(curve.status == "budget" for curve in curves)
        if short:
            say(f"{short} of {len(curves)} orbits ended where the numbers exceed --max-digits {digits}")
        if early:
            say(f"{early} of {len(curves)} orbits ended early, at a singular point of the map")
        if not whole:
            say("stopped early: the time was over before all orbits were finished")
    return 3 if early or not whole else 0
