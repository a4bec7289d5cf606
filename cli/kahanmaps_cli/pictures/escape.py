"""kahanmaps plot escape."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import ExactNumber, PointText, Whole
from kahanmaps_cli.pictures.output import Drawing, picture, two_variables, window_from, window_option
from kahanmaps_cli.screen.progress import SearchProgress


@picture(
    "escape",
    opt.system_options,
    opt.eps_options,
    window_option(),
    click.option("--axes", metavar="X,Y", help="The two variables of the window (default: the first two)."),
    click.option("--at", type=PointText(), metavar="X", help="A point with the other coordinates (default: 0)."),
    click.option("--cells", type=Whole(1), metavar="N", default=300, show_default=True, help="Use N x N points."),
    click.option("--steps", type=Whole(1), metavar="N", default=200, show_default=True, help="Number of steps."),
    click.option(
        "--radius", type=ExactNumber(), metavar="R", default=None, help="The ball is max |x_i| <= R (default 1000)."
    ),
    click.option(
        "--show", type=click.Choice(["time", "basin"]), default="time", show_default=True, help="What colors show."
    ),
)
def command(options: dict[str, Any], progress: SearchProgress) -> Drawing:
    """Plot when (or with --show basin, in which direction) float orbits of a plane of initial points leave a ball.

    \b
      kahanmaps plot escape henon_heiles --eps 1/20 --window=-1,1,-1,1 -o out.png
      kahanmaps plot escape lotka_volterra --eps 1/4 --window=-3,3,-3,3 \\
          --show basin -o basins.pdf

    Orbits that stay inside for all steps are white. Kahan maps are unbounded near indeterminacy points, and orbits may
    return from there: an orbit that leaves the ball need not go to infinity.

    Exit status: 0 done, 2 usage error.
    """
    file = opt.load_system(options["system"], options)
    eps = opt.eps_of(file, options)
    escape = lib.survey_escape(
        file.real_approximation.map,
        lib.rational(1) if eps is None else eps,
        window_from(options, 2) or ((-2.0, 2.0), (-2.0, 2.0)),
        two_variables("--axes", options["axes"], file.variables) or (0, 1),
        options["at"],
        cells=options["cells"],
        steps=options["steps"],
        radius=1000.0 if options["radius"] is None else lib.to_float(options["radius"]),
        progress=lambda step: progress(f"step {step} of {options['steps']}"),
    )
    inside = int((escape.times < 0).sum())
    messages = [f"{file.label}: {inside} of {escape.times.size} orbits stay inside for {options['steps']} steps"]
    return Drawing(lib.plot_escape(escape, options["style"], show=options["show"]), file, messages)
