"""kahanmaps heights."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import PointText, Whole
from kahanmaps_cli.screen.progress import Progress, SearchProgress
from kahanmaps_cli.screen.render import record_of
from kahanmaps_cli.screen.terminal import print_stdout
from kahanmaps_cli.screen.value_rows import Cell, table

# These options are shared with `plot heights`.
height_options: Callable[[opt.F], opt.F] = opt.stack(
    opt.eps_options,
    click.option(
        "--steps", type=int, metavar="N", default=60, show_default=True, help="Number of steps of each orbit."
    ),
    click.option(
        "--max-digits",
        type=Whole(1),
        metavar="N",
        default=20_000,
        show_default=True,
        help="Stop an orbit when a number exceeds N digits.",
    ),
    opt.effort_options,
    opt.seed_option,
)


@click.command("heights")
@opt.system_options
@click.option(
    "--random",
    "--starts",
    "count",
    cls=opt.RenamedOption,
    type=Whole(1),
    metavar="N",
    help="Number of random initial points (default 3).",
)
@click.option(
    "--start",
    "starts",
    type=PointText(),
    multiple=True,
    metavar="X",
    help="Use this initial point instead of random ones, e.g. 1/2,-1/3,0.25. Repeatable.",
)
@height_options
@opt.output_options
def command(system: str | None, **options: Any) -> int:
    """Measure the growth of heights along exact orbits of the map of SYSTEM, from several initial points.

    \b
      kahanmaps heights weierstrass
      kahanmaps heights henon_heiles --eps 1/10 --random 5
      kahanmaps heights euler_top --start 1,2,3 --start 1/2,1,-1 --steps 100
      kahanmaps heights henon_heiles -p c=-2..0:1/2
      kahanmaps heights --vars x,y --rhs 'x*(1-y)' --rhs 'y*(x-1)' --json

    The height of a point is the bit length of the largest integer in its coordinates over a common denominator.
    Quadratic growth indicates an integrable map, exponential growth a nonintegrable one; on special curves growth may
    also be bounded or linear. Without --eps the values 1/10 and 3/11 are compared, since one eps may be special. This
    is evidence, not proof.

    A parameter with a range of values, FIRST..LAST or FIRST..LAST:STEP, gives a table with a line for each value or
    combination of values; with --json one record per line. Values at which the map does not exist are listed at the
    end.

    Exit status: 0 if all orbits whose growth was decided grow alike, 2 for a usage error, 3 if no growth was decided,
    the orbits differ, or the work limit was reached.
    """
    eps = opt.requested_eps(options["eps"], options["time_step"], required=False)
    require_heights(options)

    def cell(file: lib.SystemFile, search: SearchProgress) -> Cell:
        survey = survey_heights(file, eps, options, search)
        undecided = f"undecided: {survey.text}" if survey.kind is lib.Growth.UNDECIDED else ""
        if not survey.is_complete:
            undecided = "stopped early: work limit reached before all orbits were finished; raise --effort"

        def print_text() -> None:
            eps_values = dict.fromkeys(orbit.eps for orbit in survey.orbits)
            eps_text = ", ".join(lib.eps_suffix(value, file.map).removeprefix(", eps = ") for value in eps_values)
            eps = f", eps = {eps_text}" if file.map.has_eps else ""
            print_stdout(f"# {file.name}{eps}, exact arithmetic: measured, not proved")
            print_stdout(str(survey))

        def record() -> dict[str, Any]:
            eps_values = dict.fromkeys(orbit.eps for orbit in survey.orbits)
            steps = [str(step) for value in eps_values if (step := lib.time_step(value, file.map)) is not None]
            entries = {**opt.pick(options, "seed", "steps", "max_digits"), **search.work}
            return record_of(
                "heights", file, "exact", eps=lib.plain([*eps_values]), time_step=steps, **entries, **survey.to_json()
            )

        return Cell(survey.text, record, print_text, undecided)

    return table(system, options, cell)


def require_heights(options: dict[str, Any]) -> None:
    """Raise UsageError for options of the height survey that contradict each other."""
    if options["count"] is not None and options["starts"]:
        raise click.UsageError("give --start X or --random N, not both")


def survey_heights(file: lib.SystemFile, eps: Any, options: dict[str, Any], progress: Progress) -> lib.HeightSurvey:
    """Run the survey of heights of exact orbits with the given options."""
    return lib.height_survey(
        file.map,
        eps,
        starts=options["starts"] or (lib.DEFAULT_STARTS if options["count"] is None else options["count"]),
        normal_form=file.normal_form,
        **opt.pick(options, "steps", "max_digits", "effort", "seed"),
        progress=progress,
    )
