"""kahanmaps plot portrait."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from kahanmaps.errors import counted
from kahanmaps_cli import library as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import PointText
from kahanmaps_cli.pictures.output import Drawn, picture, style_from, window_from, window_option
from kahanmaps_cli.pictures.portrait_orbits import Orbits
from kahanmaps_cli.screen.progress import Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_MAX_STEPS = 10**9
_STEPS, _STEPS_ON_A_LINE, _DENSITY_STEPS = 1000, 100, 100_000
_WALKING = ("start", "starts", "count", "box", "seed", "steps", "backward", "euler")


@picture(
    "portrait",
    opt.system_options,
    opt.eps_options,
    click.option(
        "--start", type=PointText(), multiple=True, metavar="X", help="A start, 1/2,-1/3; again for more orbits."
    ),
    opt.random_starts_options,
    click.option(
        "--steps",
        type=int,
        metavar="N",
        help="Steps of each orbit (default 1000; of one variable 100; with --density 100000).",
    ),
    opt.backward_option,
    click.option(
        "--from",
        "stored",
        type=click.Path(exists=True, dir_okay=False),
        metavar="FILE",
        help="Draw the orbits in a .npy, .npz, .jsonl or .csv file that orbit or ensemble wrote; SYSTEM may be left "
        "out.",
    ),
    click.option(
        "--axes", metavar="A,B[,C]", help="Two or three variables or expressions; step is the number of the step."
    ),
    click.option("--3d", "space", is_flag=True, help="Three axes, chosen by themselves."),
    click.option(
        "--colour-by",
        "--color-by",
        "colour",
        default="orbit",
        show_default=True,
        metavar="F",
        help="orbit, step, an integral (or H) by its name, or an expression.",
    ),
    click.option(
        "--lines", is_flag=True, help="Join the points of each orbit: neighbours on a curve, or one step and the next."
    ),
    click.option("--levels", metavar="F", help="Level curves of an integral or expression in the plane of the axes."),
    click.option(
        "--levels-at", type=PointText(), metavar="C1,C2,...", help="... at these values, not through the starts."
    ),
    click.option("--density", is_flag=True, help="Count the points in cells: for 10^5 to 10^10 of them."),
    click.option("--euler", is_flag=True, help="Explicit Euler from the same starts too, in grey below."),
    click.option(
        "--flow", is_flag=True, help="The solutions of the differential equation through the starts, as lines."
    ),
    click.option("--no-field", is_flag=True, help="No arrows, equilibria and separatrices of a planar system."),
    window_option(),
    click.option("--equal", is_flag=True, help="The same unit of length along both axes."),
)
def command(options: dict[str, Any], progress: Progress) -> Drawn:
    """The phase portrait of SYSTEM: float orbits of its map, projected.

    \b
      kahanmaps plot portrait lotka_volterra --eps 1/20
      kahanmaps plot portrait euler_top --eps 1/10 --3d --lines -o top.pdf
      kahanmaps plot portrait weierstrass --eps 1/20 --levels modified_H -o w.svg
      kahanmaps plot portrait lotka_volterra --eps 1/10 --flow -o flow.pdf
      kahanmaps plot portrait henon_heiles --eps 1/10 --density -o heat.png

    In the plane of a planar system grey arrows show the direction of the flow,
    marks its equilibria, and dashes the separatrices of saddles; rings or marks
    are starts. With --levels or --euler there are no arrows.

    Without starts sixteen are chosen around an equilibrium. Without --axes the
    plane is drawn that the points fill most. Standard error says what was chosen,
    how many points lie outside, and which orbits ended early. Colours go from dark
    to light with the value; the widest orbits are drawn first.

    Ctrl-C ends it without a picture.

    Exit status: 0 done, 2 usage error, 3 some orbits ended early, 130 interrupted.
    """
    system = options["system"]
    _require_sense(system, options)
    orbits = _stored(system, options) if options["stored"] else _walked(system, options)
    figure = (_density if options["density"] else _portrait)(orbits, options, progress)
    talk = () if orbits.walked is None else (*orbits.told(), *orbits.notes)
    return Drawn(figure, orbits.file, talk, 3 if orbits.ended else 0)


def _require_sense(system: str | None, options: dict[str, Any]) -> None:
    """Options that contradict each other, or themselves."""
    if options["stored"]:
        given = next((name for name in _WALKING if options[name] not in (None, (), False)), None)
        if given is not None:
            raise click.UsageError(f"--from draws orbits that are there: it does not go with --{_word(given)}")
    kinds = [name for name in ("start", "starts", "count") if options[name] not in (None, ())]
    if len(kinds) > 1:
        raise click.UsageError(f"give --{_word(kinds[0])} or --{_word(kinds[1])}, not both")
    if options["count"] is None and (options["box"] is not None or options["seed"] is not None):
        raise click.UsageError("--box and --seed are for --random N")
    if options["starts"] == "-" and system == "-":
        raise click.UsageError("found - twice, and there is one standard input")
    steps = options["steps"]
    if steps is not None and not 0 <= steps <= _MAX_STEPS:
        raise click.UsageError(f"found --steps {steps}, expected 0 to {_MAX_STEPS} (--backward steps backward)")
    if options["space"] and options["axes"] is not None:
        raise click.UsageError("give --axes A,B,C or --3d, not both")
    if options["levels_at"] is not None and options["levels"] is None:
        raise click.UsageError("--levels-at says where: add --levels F, of which function")
    if options["density"]:
        for name in ("space", "lines", "levels", "euler", "flow"):
            if options[name]:
                raise click.UsageError(f"--density counts points in a plane: it does not go with --{_word(name)}")
        if options["colour"] != "orbit":
            raise click.UsageError("--density shows counts by colour: it does not go with --colour-by")


def _word(name: str) -> str:
    return {"count": "random", "space": "3d"}.get(name, name)


def _stored(system: str | None, options: dict[str, Any]) -> Orbits:

    file = None
    if system is not None or opt.is_inline(options):
        file = opt.load_system(system, options)
    elif options["parameters"]:
        raise click.UsageError("-p sets a parameter of the system: name the SYSTEM as well")
    eps = opt.the_eps(options["eps"], options["time_step"], required=False)
    stored = lib.read_orbits(options["stored"], None if file is None else file.variables)
    told = stored.header.get("eps")
    try:
        if eps is None and isinstance(told, str):
            eps = lib.parse_number(told)
        return Orbits.of_file(stored, file, eps, lib.printable(str(stored.header.get("system", options["stored"]))))
    except lib.InputError as error:
        raise lib.InputError(f"{options['stored']}: {error}") from error


def _walked(system: str | None, options: dict[str, Any]) -> Orbits:

    from kahanmaps_cli.runs.ensemble_starts import drawn, read_starts

    file = opt.load_system(system, options)
    eps = opt.eps_of(file, options)
    file.map.at(lib.fmpq(1) if eps is None else eps)  # the demands of all commands on eps, in the same words
    starts: Any = None
    if options["start"]:
        wrong = next((x for x in options["start"] if len(x) != file.dim), None)
        if wrong is not None:
            raise click.UsageError(
                f"found a start with {len(wrong)} coordinates, expected {file.dim}: {', '.join(file.variables)}"
            )
        starts = lib.to_floats([entry for x in options["start"] for entry in x]).reshape(-1, file.dim)
    elif options["starts"] is not None:
        starts = read_starts(options["starts"], file.variables)
    elif options["count"] is not None:
        box = 1 if options["box"] is None else options["box"]
        starts = drawn(options["count"], file.dim, box, options["seed"] or 0)
    steps = options["steps"]
    if steps is None:
        # in one variable the map is a fraction: all there is to be seen happens at the beginning, drawn over the step
        few = _STEPS if file.dim > 1 else _STEPS_ON_A_LINE
        steps = _DENSITY_STEPS if options["density"] else few
    return Orbits.to_walk(file, eps, starts, steps, backward=options["backward"], axes=options["axes"])


def _portrait(orbits: Orbits, options: dict[str, Any], progress: Progress) -> Figure:
    from dataclasses import replace

    colour = options["colour"] if options["colour"] in ("orbit", "step") else orbits.colouring(options["colour"])
    levels = None if options["levels"] is None else orbits.function(options["levels"])
    found = orbits.walk(progress)
    axes = orbits.axes_from(options["axes"], 3 if options["space"] else 2)
    window = window_from(options, len(axes))
    euler = orbits.euler() if options["euler"] else None
    shown = lib.portrait_of(found, axes, colour=colour, window=window, euler=euler, join=options["lines"])
    shown = replace(shown, flow=orbits.flow(axes, shown.window, options))
    chords = sum(one is None for one in shown.joined)
    if chords:
        what = f"{chords} of {counted(len(shown.joined), 'orbit')}"
        orbits.notes.append(f"{what} fill no curve that could be followed: lines join each point with the next step")
    if levels is not None:
        shown = replace(shown, levels=_levels(orbits, levels, axes, options["levels_at"], shown.window))
    count = found.points.shape[0] * found.points.shape[1]
    orbits.note_outside(shown.left_out, count)
    if orbits.counts_records and "step" in (colour, *axes):
        orbits.notes.append("step is the number of the record here: a .npy file does not say which steps it holds")
    if shown.undefined:
        orbits.notes.append(f"{shown.undefined} of {count} points are left out: an axis or the colour has a pole there")
    note = f"{shown.left_out} points outside" if shown.left_out and window is None else ""
    return lib.draw_portrait(shown, style_from(options), lines=options["lines"], equal=options["equal"], note=note)


def _levels(orbits: Orbits, function: Any, axes: Sequence[Any], at: Any, window: lib.Window) -> lib.LevelCurves:

    plane = [axis.variable for axis in axes if not isinstance(axis, str) and axis.variable is not None]
    if len(plane) != 2 or len(axes) != 2:
        raise lib.InputError("level curves are drawn in the plane of two variables: take --axes X,Y with two of them")
    values = lib.levels_through(function, orbits.starts) if at is None else lib.to_floats(at).tolist()
    found = lib.level_curves(function, plane, len(orbits.variables), values, window)
    if found.missing:
        orbits.notes.append(f"{found.missing} of {len(values)} levels of {function.name} have no curve in the window")
    return found


def _density(orbits: Orbits, options: dict[str, Any], progress: Progress) -> Figure:

    pilot = orbits.pilot()
    axes: Any = orbits.axes_from(options["axes"], 2, pilot)
    if len(axes) != 2 or any(isinstance(axis, str) for axis in axes):
        raise click.UsageError("--density counts points in a plane: it takes two axes, and step is not one")
    window = window_from(options, 2)
    if window is None:
        import numpy as np

        points, starts = (np.stack([axis(x) for axis in axes], axis=-1) for x in (pilot, orbits.starts))
        window = lib.window_of(points, starts)
    style = style_from(options)
    found = orbits.count(axes, window, lib.cells_for(style), progress)
    orbits.note_outside(found.outside, found.points)
    note = f"{found.outside} points outside" if found.outside and options["window"] is None else ""
    return lib.draw_density(found, style, equal=options["equal"], note=note)
