"""kahanmaps degrees."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from kahanmaps_cli.options import (
    eps_options,
    load_system,
    output_options,
    seconds_option,
    seed_option,
    system_options,
    the_eps,
)
from kahanmaps_cli.progress import Progress, say
from kahanmaps_cli.render import envelope, print_json
from kahanmaps_cli.terminal import tell
from kahanmaps_cli.value_rows import Cell, table

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.laboratory.growth.degrees import DegreeGrowth

_SHOWN = 8  # degrees in a line of a table


@click.command("degrees")
@system_options
@eps_options
@seconds_option(10.0, "Stop after about so many seconds.")
@click.option(
    "--terms", type=int, metavar="N", help="Measure d_1, ..., d_N (default: until a recurrence is certain enough)."
)
@click.option(
    "--max-degree", type=int, metavar="D", default=20_000, show_default=True, help="Work out no larger degree."
)
@click.option(
    "--steps", type=int, metavar="N", help="Steps to follow singularities for (default: as singularities does)."
)
@seed_option
@output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Degrees of the iterates of the map of SYSTEM, their recurrence and the dynamical degree.

    \b
      kahanmaps degrees euler_top
      kahanmaps degrees lotka_volterra --seconds 20 --json
      kahanmaps degrees weierstrass --eps 1/10 --terms 60
      kahanmaps degrees --rhs "x' = x*(1-y); y' = y*(x-1)"
      kahanmaps degrees henon_heiles -p c=-2..0:1/2 --terms 6

    The degree of Phi^n as a map of projective space, measured on random lines modulo random primes of 63 bits, two of
    each. Without --eps: for generic eps, a random residue with each line. This is evidence, and no proof.

    The hypersurfaces that the map contracts are followed, and explain the degrees for all times: generating function,
    recurrence, dynamical degree; of long compositions, map by map. A line for each of them says when it comes
    back, and what it costs. Where they explain nothing, a recurrence is accepted that holds for at least 2 terms more
    than determine it, with terms enough beyond the last confinement, and else there is an estimate only. "no
    confinement" is said with the number of steps that were tried.

    In the plane a dynamical degree above 1 is proved: its bounds are then exact.

    A parameter with a range of values, FIRST..LAST or FIRST..LAST:STEP, gives a table, a line for each value or
    combination of values; with --json a record a line. Values without a map are named at the end.

    Exit status: 0 a recurrence was found, or all terms asked for were measured, or the iterates cease to exist or to
    vary; 2 wrong use; 3 undecided, or stopped early.
    """
    eps = the_eps(options["eps"], options["time_step"], required=False)

    def cell(file: SystemFile, progress: Progress) -> Cell:
        found = _measured(file, eps, options, progress)
        more = ", ..." if len(found.degrees) > _SHOWN else ""
        line = f"{', '.join(map(str, found.degrees[:_SHOWN]))}{more}\t{found.kind_text}"
        return Cell(line, lambda: _record(file, options, found), _is_done(found, options["terms"]))

    status = table(system, {**options, "as_json": as_json}, quiet, cell)
    if status is not None:
        return status
    file = load_system(system, options)
    with Progress(quiet) as progress:
        found = _measured(file, eps, options, progress)
    if as_json:
        print_json(_record(file, options, found))
    else:
        lines = f"{len(found.primes)} random lines modulo primes of 63 bits"
        at = "generic eps" if eps is None else f"eps = {eps} (time step 2 eps = {2 * eps})"
        if not file.map.has_time_step:
            at = at if eps is None else f"eps = {eps}"
        at = f"{at}, " if file.map.has_eps else ""
        tell(f"# {file.name}, {at}{lines}: measured, not proved")
        tell(found.text)
    if _is_done(found, options["terms"]):
        return 0
    if not quiet:
        say(f"undecided: {found.unconfirmed}" if found.unconfirmed else f"stopped early: {found.message}")
    return 3


def _measured(file: SystemFile, eps: Any, options: dict[str, Any], progress: Progress) -> DegreeGrowth:
    from kahanmaps.laboratory.growth.degrees import degree_growth

    return degree_growth(
        file.map,
        eps,
        seconds=options["seconds"],
        max_terms=options["terms"],
        max_degree=options["max_degree"],
        seed=options["seed"],
        steps=options["steps"],
        progress=progress,
    )


def _is_done(found: DegreeGrowth, terms: int | None) -> bool:
    if found.ended in ("terms", "constant", "singular"):
        return True
    return terms is None and found.recurrence is not None


def _time_step(file: SystemFile, found: DegreeGrowth) -> str | None:
    from kahanmaps.algebra.text import format_number

    if not file.map.has_time_step:
        return None
    return "generic" if found.eps is None else format_number(2 * found.eps)


def _record(file: SystemFile, options: dict[str, Any], found: DegreeGrowth) -> dict[str, Any]:
    from kahanmaps.maps.convention import convention

    return {
        **envelope("degrees"),
        "system": file.name,
        "time_step": _time_step(file, found),
        "convention": convention(file.map),
        "arithmetic": "modulo the primes of the lines",
        "seconds": options["seconds"],
        "terms_asked": options["terms"],
        "max_degree": options["max_degree"],
        **found.to_json(),
        "document": dict(file.document),
    }
