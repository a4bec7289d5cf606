"""kahanmaps plot batch."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import click
from click.core import ParameterSource

from kahanmaps_cli import library as lib
from kahanmaps_cli.pictures.output import Drawn, picture, style_from
from kahanmaps_cli.screen.progress import Progress

_TOLD = 1000  # rows between words of progress


@picture(
    "batch",
    click.argument("database", required=False, type=click.Path(dir_okay=False), metavar="[DB]"),
    click.option(
        "--db",
        type=click.Path(dir_okay=False),
        envvar="KAHANMAPS_DB",
        metavar="FILE",
        help="The database of results, instead of DB (or set KAHANMAPS_DB).",
    ),
    click.option("--by", metavar="NAME,...", help="Group by these, e.g. m,eps (default: experiment)."),
    click.option("--value", "values", multiple=True, metavar="NAME", help="The distribution of a number. Repeatable."),
    click.option("--x", metavar="NAME", help="With --y: a dot for each task, along this axis ..."),
    click.option("--y", metavar="NAME", help="... and at the height of this number; --by NAME colours them."),
    click.option("--scale", type=click.Choice(["linear", "log"]), help="Of the numbers (default: by their range)."),
    click.option("-e", "--experiment", "only", multiple=True, metavar="NAME", help="Only this experiment. Repeatable."),
)
def command(options: dict[str, Any], progress: Progress) -> Drawn:
    """Results of a batch: counts, distributions, or one number against another.

    \b
      kahanmaps plot batch study.db --by m,eps
      kahanmaps plot batch study.db --by m --value constant -o constants.pdf
      kahanmaps plot batch study.db --x eps --y constant --by m -o eps.svg

    Without --value: how many tasks of each group are proved, refuted, failed,
    missing and so on. A box holds the middle half of the numbers, with the
    median; whiskers hold nine tenths, dots are the least and the largest. Names
    are those of 'kahanmaps batch summary'. A batch that is running may be drawn.

    Exit status: 0 done, 2 usage error, or there is no task to draw.
    """
    database, db = options["database"], options["db"]
    source = click.get_current_context().get_parameter_source("db")
    if database is not None and source is ParameterSource.COMMANDLINE:
        raise click.UsageError("give DB or --db FILE, not both")
    path = database or db
    if path is None:
        raise click.UsageError("missing DB, the database of a batch (or --db FILE, or set KAHANMAPS_DB)")
    by = [name.strip() for name in (options["by"] or "").split(",") if name.strip()]
    if (options["x"] is None) != (options["y"] is None):
        raise click.UsageError("give --x NAME and --y NAME, both or none")
    if options["x"] is not None and (options["values"] or len(by) > 1):
        raise click.UsageError("found --x with --value or several names in --by, expected at most one name in --by")
    with lib.Store.open(path, readonly=True) as store:
        rows = _told(store.rows(list(options["only"]) or None, missing=True), path, progress)
        return (_groups if options["x"] is None else _pairs)(rows, by, options)


def _groups(rows: Iterable[lib.Row], by: list[str], options: dict[str, Any]) -> Drawn:

    values = list(dict.fromkeys(options["values"]))
    summary = lib.summarise(rows, by or ["experiment"], values)
    missing = sum(group.missing for group in summary.groups)
    talk = [f"{missing} tasks have no result yet"] if missing and values else []
    for name in values:
        if beyond := lib.groups_beyond(summary, name):
            talk.append(
                f"{name}: {lib.counted(beyond, 'group')} with numbers beyond the range of machine floats (1.8e308)"
            )
    return Drawn(lib.draw_batch(summary, values, style_from(options), scale=options["scale"]), talk=talk)


def _pairs(rows: Iterable[lib.Row], by: list[str], options: dict[str, Any]) -> Drawn:

    pairs = lib.value_pairs(rows, options["x"], options["y"], by[0] if by else None)
    talk = []
    if pairs.missing:
        talk.append(f"{pairs.missing} tasks have no result yet")
    if pairs.left_out:
        talk.append(f"{pairs.left_out} results have no {options['x']} or no number {options['y']}: left out")
    if lib.clipped(pairs):
        talk.append(f"{lib.clipped(pairs)} numbers are beyond the range of machine floats (1.8e308): left out")
    return Drawn(lib.draw_pairs(pairs, style_from(options), scale=options["scale"]), talk=talk)


def _told(rows: Iterable[lib.Row], path: str, progress: Progress) -> Iterator[lib.Row]:
    """Rows as they come, with a word of progress now and then. Raises InputError where there is none."""
    count = 0
    for count, row in enumerate(rows, 1):
        if count % _TOLD == 0:
            progress(f"{count} tasks read")
        yield row
    if not count:
        raise lib.InputError(f"found no task in {path}, expected at least one to draw")
