"""kahanmaps plot portrait."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.errors import counted
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import PointText
from kahanmaps_cli.pictures.output import Drawing, picture, window_from, window_option
from kahanmaps_cli.runs.ensemble_starts import requested_starts, require_one_kind_of_starts
from kahanmaps_cli.screen.progress import Progress

_MAX_STEPS = 10**9
# Orbits in one variable are plotted against the step number; a hundred steps suffice to see their beginning.
_DEFAULT_STEPS, _DEFAULT_STEPS_IN_ONE_VARIABLE = 1000, 100


@picture(
    "portrait",
    opt.system_options,
    opt.eps_options,
    opt.starts_options,
    click.option(
        "--steps", type=int, metavar="N", help="Number of steps of each orbit (default 1000; with one variable 100)."
    ),
    opt.backward_option,
    click.option(
        "--axes", metavar="A,B[,C]", help="Axes: two or three variables or expressions, or step (the step number)."
    ),
    click.option("--3d", "three_axes", is_flag=True, help="Draw three axes, chosen automatically."),
    click.option(
        "--colour-by",
        "--color-by",
        "color_by",
        default="orbit",
        show_default=True,
        metavar="F",
        help="Color points by orbit, step, an integral (or H) by its name, or an expression.",
    ),
    click.option(
        "--lines",
        is_flag=True,
        help="Join the points of each orbit: neighbors on the curve that it fills, else consecutive points.",
    ),
    click.option(
        "--levels", metavar="F", help="Draw level curves of an integral or expression in the plane of the axes."
    ),
    click.option(
        "--levels-at",
        type=PointText(),
        metavar="C1,C2,...",
        help="With --levels: draw these levels instead of those of the initial points.",
    ),
    click.option("--euler", is_flag=True, help="Add orbits of the explicit Euler method in gray."),
    click.option(
        "--flow", is_flag=True, help="Add solutions of the differential equation through the initial points as lines."
    ),
    click.option(
        "--no-field", is_flag=True, help="Omit the vector field, equilibria and separatrices of a planar system."
    ),
    window_option(),
    click.option("--equal", is_flag=True, help="Use the same unit of length on both axes."),
)
def command(options: dict[str, Any], progress: Progress) -> Drawing:
    """Draw the phase portrait of SYSTEM: projected floating-point orbits of its map.

    \b
      kahanmaps plot portrait lotka_volterra --eps 1/20 -o portrait.png
      kahanmaps plot portrait euler_top --eps 1/10 --3d --lines -o top.pdf
      kahanmaps plot portrait weierstrass --eps 1/20 --levels modified_H -o w.svg
      kahanmaps plot portrait lotka_volterra --eps 1/10 --flow -o flow.pdf

    The picture of a planar system also has its vector field (unless --levels or
    --euler is given), equilibria, and separatrices of saddles. Triangles are
    initial points.

    By default sixteen initial points are chosen around an equilibrium, and the
    projection with the largest spread is drawn. Messages on standard error say
    what was chosen, how many points lie outside the window, and which orbits
    ended early. Colors of many orbits go from dark to light; the widest are drawn first.

    Exit status: 0 done, 2 usage error, 3 some orbits ended early, 130 interrupted.
    """
    _require_consistent(options)
    file = opt.load_system(options["system"], options)
    eps = opt.eps_of(file, options)
    file.map.at(lib.rational(1) if eps is None else eps)  # raises the errors of other commands for an invalid eps
    notes: list[str] = []
    field = lib.field_of(file)
    starts = initial_points(file, field, eps, options)
    default_steps = _DEFAULT_STEPS if file.dim > 1 else _DEFAULT_STEPS_IN_ONE_VARIABLE
    steps = default_steps if options["steps"] is None else options["steps"]
    color = options["color_by"]
    if color not in ("orbit", "step"):
        color = lib.requested_function(file, eps, color)
    levels = None if options["levels"] is None else lib.requested_axis(file, eps, options["levels"])
    axes = _requested_axes(file, eps, options)
    orbits = lib.follow_orbits(
        lib.ensemble_of_file(file, eps, starts, steps, backward=options["backward"]),
        steps,
        lambda step: progress(f"step {step} of {steps}"),
    )
    if axes is None:
        count = 3 if options["three_axes"] else 2
        axis_names = [file.variables[k] for k in lib.fullest_axes(orbits.points.reshape(-1, file.dim), count)]
        axes = tuple(lib.requested_axis(file, eps, name) for name in axis_names)
        if file.dim > count:
            notes.append(f"axes {', '.join(axis_names)}: the projection with the largest spread (--axes chooses)")
    euler = None
    if options["euler"]:
        # `file.system` raises InputError for a map that is no Kahan map of a quadratic vector field.
        arguments = (field or file.system, -eps if options["backward"] else eps, starts, "euler")
        euler = lib.follow_orbits(lib.MethodEnsemble(*arguments, kernel="numpy"), steps)
        notes += [f"explicit Euler: {counted(count, 'orbit')} {reason}" for reason, count in euler.ended.items()]
    window = window_from(options, len(axes))
    portrait = lib.portrait_of(orbits, axes, color=color, window=window, euler=euler, join=options["lines"])
    plane = [axis.variable for axis in axes if not isinstance(axis, str) and axis.variable is not None]
    if field is None and options["flow"]:
        raise lib.InputError("--flow draws solutions of x' = f(x): name a system with a quadratic field")
    if field is not None:
        flow = lib.plane_flow(field, plane if len(axes) == 2 and not options["no_field"] else [], portrait.window)
        if options["levels"] or options["euler"]:  # arrows of the field would be invisible between gray lines
            flow = replace(flow, places=flow.places[:0], arrows=flow.arrows[:0])
        if options["flow"]:
            flow = replace(flow, solutions=lib.projected_solutions(field, eps, axes, orbits, options["backward"]))
        portrait = replace(portrait, flow=flow)
    if levels is not None:
        if len(plane) != 2 or len(axes) != 2:
            raise lib.InputError("--levels needs two variables as axes: give --axes X,Y")
        levels_at = options["levels_at"]
        values = lib.levels_through(levels, starts) if levels_at is None else lib.to_floats(levels_at).tolist()
        curves = lib.level_curves(levels, plane, file.dim, values, portrait.window)
        if missing_count := sum(not pieces for pieces in curves):
            notes.append(f"{missing_count} of {len(values)} levels of {levels.name} have no curve in the window")
        portrait = replace(portrait, levels=curves)
    note = f"{portrait.left_out} points outside" if portrait.left_out and window is None else ""
    figure = lib.plot_portrait(portrait, options["style"], lines=options["lines"], equal=options["equal"], note=note)

    orbit_count = counted(orbits.orbits, "orbit")
    origin = " from automatic initial points" if require_one_kind_of_starts(options) is None else ""
    backward = ", backward" if options["backward"] else ""
    at_eps = "" if eps is None else lib.eps_suffix(eps, file.map)
    messages = [f"{file.label}: {orbit_count}{origin}, {counted(len(orbits.points) - 1, 'step')}{backward}{at_eps}"]
    messages += [f"{count} of {orbit_count} ended early: {reason}" for reason, count in orbits.ended.items()]
    points = orbits.points.shape[0] * orbits.points.shape[1]
    if unfilled := sum(curve is None for curve in portrait.joined):
        orbits_text = f"{unfilled} of {counted(len(portrait.joined), 'orbit')}"
        notes.append(f"{orbits_text} do not fill a curve: their lines join consecutive steps")
    if portrait.left_out:
        notes.append(f"{portrait.left_out} of {points} points lie outside the window (--window)")
    if portrait.undefined:
        notes.append(f"{portrait.undefined} of {points} points are left out: an axis or the color has a pole there")
    return Drawing(figure, file, [*messages, *notes], 3 if orbits.ended else 0)


def _require_consistent(options: dict[str, Any]) -> None:
    require_one_kind_of_starts(options)
    steps = options["steps"]
    if steps is not None and not 0 <= steps <= _MAX_STEPS:
        raise click.UsageError(f"found --steps {steps}, expected 0 to {_MAX_STEPS} (--backward steps backward)")
    if options["three_axes"] and options["axes"] is not None:
        raise click.UsageError("give --axes A,B,C or --3d, not both")
    if options["levels_at"] is not None and options["levels"] is None:
        raise click.UsageError("--levels-at needs --levels F")


def initial_points(file: lib.SystemFile, field: lib.QuadraticSystem | None, eps: Any, options: dict[str, Any]) -> Any:
    """Return the initial points given by the options; by default choose them around an equilibrium of `field`."""
    if require_one_kind_of_starts(options) is not None:
        return requested_starts(file, options)
    if field is None:
        raise lib.InputError(
            f"found no initial points for {file.map.kind}, expected --start X, --starts FILE, --grid, --line or "
            "--random N: automatic ones need a vector field"
        )
    texts = [text.strip() for text in (options["axes"] or "").split(",")]
    plane = [file.variables.index(text) for text in texts if text in file.variables]
    plane = [*plane, *(k for k in range(file.dim) if k not in plane)][:2]
    return lib.automatic_starts(field, eps, plane, backward=options["backward"])


def _requested_axes(
    file: lib.SystemFile, eps: Any, options: dict[str, Any]
) -> tuple[lib.PointFunction | str, ...] | None:
    """Return the axes given by the options, or the only possible axes; None if the points of the orbits decide."""
    text, count = options["axes"], 3 if options["three_axes"] else 2
    if text is not None:
        texts = [axis_text.strip() for axis_text in text.split(",")]
        if len(texts) not in (2, 3) or not all(texts):
            raise lib.InputError(f"found --axes {text[:60]}, expected two or three: x,y or x,y,z")
        if len(set(texts)) < len(texts):
            raise lib.InputError(f"found --axes {text[:60]}, expected different axes")
        return tuple(
            "step" if axis_text == "step" and "step" not in file.variables else lib.requested_axis(file, eps, axis_text)
            for axis_text in texts
        )
    if file.dim == 1 and count == 2:
        return "step", lib.requested_axis(file, eps, file.variables[0])
    if file.dim < count:
        raise lib.InputError(f"found {file.dim} variables, expected at least {count}, one for each axis")
    return None
