"""kahanmaps plot degrees."""

from __future__ import annotations

from functools import partial
from itertools import chain, count
from typing import TYPE_CHECKING, Any

import click

from kahanmaps_cli.commands.degrees import is_done, measured
from kahanmaps_cli.options import (
    eps_options,
    inline_options,
    is_inline,
    load_system,
    seconds_option,
    seed_option,
    the_eps,
)
from kahanmaps_cli.pictures.output import PictureCommand, deliver, picture_options, require_output, style_from
from kahanmaps_cli.pictures.records import read_record
from kahanmaps_cli.progress import Progress, say

if TYPE_CHECKING:
    from kahanmaps.laboratory.growth.degrees import DegreeGrowth


@click.command("degrees", cls=PictureCommand)
@click.argument("systems", nargs=-1, metavar="[SYSTEM]...")
@inline_options
@click.option("--from", "records", multiple=True, metavar="FILE", help="Written by degrees --json. Repeatable.")
@eps_options
@seconds_option(10.0, "Stop each system after about so many.")
@click.option(
    "--terms", type=int, metavar="N", help="Measure d_1, ..., d_N (default: until a recurrence is certain enough)."
)
@click.option(
    "--max-degree", type=int, metavar="N", default=20_000, show_default=True, help="Work out no larger degree."
)
@seed_option
@click.option("--scale", type=click.Choice(["linear", "log", "loglog"]), help="Chosen by itself unless given.")
@picture_options
def command(systems: tuple[str, ...], **options: Any) -> int:
    """Degrees of the iterates of maps, with the recurrence they satisfy.

    \b
      kahanmaps plot degrees euler_top
      kahanmaps plot degrees euler_top lotka_volterra weierstrass -o degrees.pdf
      kahanmaps plot degrees weierstrass --eps 1/10 --scale loglog -o degrees.svg
      kahanmaps degrees euler_top --json | kahanmaps plot degrees --from -

    Marks are measured degrees (docs: kahanmaps degrees --help), a solid line is
    the recurrence they satisfy. Dots join degrees for which none was checked:
    what the legend says of their growth is then estimated.

    Exit status: 0 done, 2 usage error, 3 some system was stopped before a
    recurrence was found (the picture is written).
    """
    from kahanmaps.plots.growth import draw_degrees

    require_output(options)
    growths: dict[str, DegreeGrowth] = {}
    early: list[str] = []
    for path in options["records"]:
        _from_record(path, growths)
    eps = the_eps(options["eps"], options["time_step"], required=False)
    inline = is_inline(options)
    asked: list[str | None] = list(systems)
    if inline or not (asked or growths):
        asked.append(None)
    if inline and len(asked) > 1:
        raise click.UsageError("give SYSTEMs or an inline one, not both")
    if len(asked) > 1 and options["parameters"]:
        raise click.UsageError("-p is for one system: write several as files, or draw --from records")
    files = [load_system(name, options) for name in asked]
    with Progress(options["quiet"]) as progress:
        for file in files:
            found = measured(file, eps, options, partial(_tell, progress, file.label))
            _add(growths, file.label, found)
            if not is_done(found, None):
                early.append(f"{file.label}: stopped early: {found.message}")
    figure = draw_degrees(growths, style_from(options), scale=options["scale"])
    deliver(figure, options, files[0] if len(files) == 1 else None)
    if not options["quiet"]:
        for sentence in early:
            say(sentence)
    return 3 if early else 0


def _tell(progress: Progress, name: str, sentence: str) -> None:
    progress(f"{name}: {sentence}")


def _from_record(path: str, growths: dict[str, DegreeGrowth]) -> None:
    from kahanmaps.plots.degree_records import degrees_of_record

    name, found = degrees_of_record(read_record(path), path)
    _add(growths, name, found)


def _add(growths: dict[str, DegreeGrowth], name: str, found: DegreeGrowth) -> None:
    """Two systems may have one name: the second is called name (2)."""
    names = chain([name], (f"{name} ({k})" for k in count(2)))
    growths[next(free for free in names if free not in growths)] = found
