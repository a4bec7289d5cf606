"""kahanmaps plot degrees and kahanmaps plot heights, computed now or read from the JSON of earlier runs."""

from __future__ import annotations

import json
from itertools import chain, count
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.errors import InputError
from kahanmaps_cli import options as opt
from kahanmaps_cli.commands.degrees import degree_options, is_done, measure
from kahanmaps_cli.commands.heights import height_options, require_heights, survey_heights
from kahanmaps_cli.params import PointText, Whole
from kahanmaps_cli.pictures.output import Drawing, picture
from kahanmaps_cli.screen.progress import SearchProgress

_MAX_BYTES = 64_000_000  # maximal size of a file given by --from
# The statuses of OrbitEnd that the command reports as early ends; a digit limit and a periodic orbit are normal ends.
_EARLY_STATUSES = ("singular",)

_scale_option = click.option(
    "--scale", type=click.Choice(["linear", "log", "loglog"]), help="Scale of the axes (default: by the growth)."
)


@picture(
    "degrees",
    click.argument("systems", nargs=-1, metavar="[SYSTEM]..."),
    opt.inline_options,
    click.option(
        "--from",
        "records",
        multiple=True,
        metavar="FILE",
        help="Read a result of degrees --json; - is standard input. Repeatable.",
    ),
    degree_options,
    _scale_option,
)
def degrees(options: dict[str, Any], progress: SearchProgress) -> Drawing:
    """Plot the degrees of iterates and the recurrence that they satisfy.

    \b
      kahanmaps plot degrees euler_top -o degrees.png
      kahanmaps plot degrees euler_top lotka_volterra weierstrass -o degrees.pdf
      kahanmaps plot degrees weierstrass --eps 1/10 --scale loglog -o degrees.svg
      kahanmaps degrees euler_top --json | kahanmaps plot degrees --from - \\
          -o degrees.svg

    Marks are measured degrees (see kahanmaps degrees --help); a solid line is the
    recurrence that they satisfy. A dotted line joins degrees without a checked
    recurrence; the legend then gives an estimate of their growth.

    Exit status: 0 done, 2 usage error, 3 some system was stopped before a
    recurrence was found (the picture is written).
    """
    growths: dict[str, lib.DegreeGrowth] = {}

    def add(name: str, growth: lib.DegreeGrowth) -> None:
        """Add the degrees of the system `name`; a second result of the same name is called "name (2)"."""
        names = chain([name], (f"{name} ({k})" for k in count(2)))
        growths[next(unused for unused in names if unused not in growths)] = growth

    for path in options["records"]:
        add(*lib.degrees_of_record(read_record(path), path))
    eps = opt.requested_eps(options["eps"], options["time_step"], required=False)
    inline = opt.is_inline(options)
    names: list[str | None] = list(options["systems"])
    if inline or not (names or growths):
        names.append(None)
    if inline and len(names) > 1:
        raise click.UsageError("give SYSTEMs or an inline system, not both")
    if len(names) > 1 and options["parameters"]:
        raise click.UsageError("-p needs a single SYSTEM: write the systems to files, or use --from")
    files = [opt.load_system(name, options) for name in names]
    messages: list[str] = []
    for file in files:
        if progress.is_over:
            break

        def on_progress(sentence: str, name: str = file.label) -> None:
            progress(f"{name}: {sentence}")

        measured_growth = measure(file, eps, options, on_progress)
        add(file.label, measured_growth)
        if not is_done(measured_growth, None):
            messages.append(f"{file.label}: stopped early: {measured_growth.message}")
    figure = lib.plot_degrees(growths, options["style"], scale=options["scale"])
    return Drawing(figure, files[0] if len(files) == 1 else None, messages, 3 if messages or progress.is_over else 0)


@picture(
    "heights",
    opt.system_options,
    click.option(
        "--from",
        "record",
        metavar="FILE",
        help="Read a result of heights --json instead of SYSTEM; - is standard input.",
    ),
    click.option("--random", "count", type=Whole(1), metavar="N", help="Number of random initial points (default 3)."),
    click.option(
        "--start",
        "starts",
        type=PointText(),
        multiple=True,
        metavar="X",
        help="Initial point, instead of random ones. Repeatable.",
    ),
    height_options,
    _scale_option,
)
def heights(options: dict[str, Any], progress: SearchProgress) -> Drawing:
    """Plot the heights of exact orbits (the lengths of the numbers) against the step.

    \b
      kahanmaps plot heights weierstrass -o heights.png
      kahanmaps plot heights weierstrass --eps 1/10 --random 5 -o heights.pdf
      kahanmaps plot heights lotka_volterra --scale log -o heights.svg
      kahanmaps heights weierstrass --json | kahanmaps plot heights --from - \\
          -o heights.svg

    The height of a point is the bit length of the largest integer in its
    coordinates over a common denominator. Each eps has a color; marks are heights, lines are fits. Results
    read by --from contain the heights at the steps 0, 1, 2, 4, 8, ... only.

    Exit status: 0 done, 2 usage error, 3 some orbit met an indeterminacy point, or
    the work limit was reached before all orbits were finished (the picture is written).
    """
    require_heights(options)
    file: lib.SystemFile | None = None
    digits = options["max_digits"]
    if options["record"] is not None:
        if options["system"] is not None or options["variables"] or options["rhs"]:
            raise click.UsageError("give a SYSTEM or --from FILE, not both")
        record = read_record(options["record"])
        curves = lib.curves_of_record(record, options["record"])
        is_complete, digits = record.get("complete") is not False, record.get("max_digits", digits)
    else:
        file = opt.load_system(options["system"], options)
        eps = opt.requested_eps(options["eps"], options["time_step"], required=False)
        survey = survey_heights(file, eps, options, progress)
        curves, is_complete = lib.height_curves(survey), survey.is_complete
    figure = lib.plot_heights(curves, options["style"], scale=options["scale"])
    messages = []
    if budget_count := sum(curve.status == "budget" for curve in curves):
        messages.append(f"{budget_count} of {len(curves)} orbits ended where a number exceeded --max-digits {digits}")
    if early_count := sum(curve.status in _EARLY_STATUSES for curve in curves):
        messages.append(f"{early_count} of {len(curves)} orbits ended early, at a singular point of the map")
    if not is_complete and not progress.is_over:
        messages.append("stopped early: work limit reached before all orbits were finished; raise --effort")
    return Drawing(figure, file, messages, 3 if early_count or not is_complete or progress.is_over else 0)


def read_record(path: str) -> Any:
    """Return the JSON object in a file, or in standard input for `-`. Raises InputError if there is no JSON object."""
    try:
        with click.open_file(path, "rb") as file:
            content = file.read(_MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if len(content) > _MAX_BYTES:
        raise InputError(f"{path}: found more than {_MAX_BYTES // 10**6} MB, expected one record")
    try:
        return json.loads(content)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: found no JSON ({error}), expected an object written by --json") from error
