"""kahanmaps plot section."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.errors import counted
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import Whole
from kahanmaps_cli.pictures.output import Drawing, picture, window_from, window_option
from kahanmaps_cli.pictures.portrait import initial_points
from kahanmaps_cli.runs.ensemble_starts import require_one_kind_of_starts
from kahanmaps_cli.screen.progress import Progress


@picture(
    "section",
    opt.system_options,
    opt.eps_options,
    click.option(
        "--plane", metavar="F=C", required=True, help="Hyperplane: a linear equation, e.g. x3=1/2 or x1-x2 (= 0)."
    ),
    opt.starts_options,
    click.option("--steps", type=Whole(), default=20_000, show_default=True, metavar="N", help="Steps of each orbit."),
    click.option(
        "--direction",
        type=click.Choice(["up", "down", "both"]),
        default="up",
        show_default=True,
        help="Show crossings to larger values of F, to smaller ones, or both.",
    ),
    click.option(
        "--axes", metavar="A,B", help="Axes: two variables or expressions (default: the variables of largest spread)."
    ),
    click.option("--no-curves", is_flag=True, help="Draw no level curves of known integrals."),
    window_option(),
    click.option("--equal", is_flag=True, help="Use the same unit of length on both axes."),
)
def command(options: dict[str, Any], progress: Progress) -> Drawing:
    """Draw a Poincare section of SYSTEM: where floating-point orbits cross a hyperplane.

    \b
      kahanmaps plot section euler_top --eps 1/10 --plane x1=0 -o top.pdf
      kahanmaps plot section henon_heiles --eps 1/50 --plane q1=0 \\
          --start 0,1/10,1/4,0 --start 0,1/5,1/5,1/10 --axes q2,p2 -o hh.png

    The system has at least 3 variables. A crossing is interpolated through six points of
    the orbit; if the steps are too long for this, the crossing is omitted and counted.
    Gray lines are level curves of those integrals of the system whose restriction to the
    hyperplane is a function of the two axes.

    By default sixteen initial points are chosen around an equilibrium.

    Exit status: 0 done, 2 usage error, 3 some orbits ended early, 130 interrupted.
    """
    require_one_kind_of_starts(options)
    file = opt.load_system(options["system"], options)
    if file.dim < 3:
        raise lib.InputError(f"found {counted(file.dim, 'variable')}, expected at least 3: see kahanmaps plot portrait")
    eps = opt.eps_of(file, options)
    file.map.at(lib.rational(1) if eps is None else eps)
    hyperplane = lib.hyperplane_of(file, eps, options["plane"])
    texts = None if options["axes"] is None else [text.strip() for text in options["axes"].split(",")]
    if texts is not None and (len(texts) != 2 or texts[0] == texts[1]):
        raise lib.InputError(f"found --axes {options['axes'][:60]}, expected two different ones, as A,B")
    axes = None if texts is None else [lib.requested_axis(file, eps, text) for text in texts]
    starts = initial_points(file, lib.field_of(file), eps, {**options, "backward": False})
    steps = options["steps"]
    ensemble = lib.ensemble_of_file(file, eps, starts, steps)
    section = lib.section_of(
        ensemble,
        hyperplane,
        steps,
        direction=options["direction"],
        progress=lambda step: progress(f"step {step} of {steps}"),
    )
    notes = []
    if axes is None:
        indices = section.widest_axes(hyperplane)
        axes = [lib.requested_axis(file, eps, file.variables[k]) for k in indices]
        notes.append(f"axes {', '.join(axis.name for axis in axes)}: the largest spread (--axes chooses)")
    curves = [] if options["no_curves"] else lib.curves_on(file, eps, hyperplane, axes)
    figure = lib.plot_section(
        section,
        axes,
        options["style"],
        curves=curves,
        window=window_from(options, 2),
        equal=options["equal"],
    )
    at_eps = "" if eps is None else lib.eps_suffix(eps, file.map)
    messages = [
        f"{file.label}: {counted(len(section.points), 'crossing')} of {options['plane']} by "
        f"{counted(len(starts), 'orbit')}, {counted(steps, 'step')}{at_eps}"
    ]
    ended = int((ensemble.failed_at >= 0).sum())
    if ended:
        messages.append(f"{ended} of {counted(len(starts), 'orbit')} ended early")
    if section.skipped:
        notes.append(f"{counted(section.skipped, 'crossing')} left out: the steps are too long to interpolate there")
    return Drawing(figure, file, [*messages, *notes], 3 if ended else 0)
