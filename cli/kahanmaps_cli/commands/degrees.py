"""kahanmaps degrees."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.screen.progress import SearchProgress
from kahanmaps_cli.screen.render import record_of
from kahanmaps_cli.screen.terminal import print_stdout
from kahanmaps_cli.screen.value_rows import Cell, table

_SHOWN = 8  # degrees in a line of a table


# Of the picture as well.
degree_options: Callable[[opt.F], opt.F] = opt.stack(
    opt.eps_options,
    opt.effort_options,
    click.option(
        "--terms", type=int, metavar="N", help="Compute d_1, ..., d_N (default: until a recurrence is certain)."
    ),
    click.option(
        "--max-degree",
        type=int,
        metavar="D",
        default=lib.ITERATE_DEGREE,
        show_default=True,
        help="Compute no larger degree.",
    ),
    opt.seed_option,
)


@click.command("degrees")
@opt.system_options
@degree_options
@click.option(
    "--steps", type=int, metavar="N", help="Number of steps to trace singularities (default: as in singularities)."
)
@opt.output_options
def command(system: str | None, **options: Any) -> int:
    """Compute the degrees of the iterates of the map of SYSTEM, their recurrence and the dynamical degree.

    \b
      kahanmaps degrees euler_top
      kahanmaps degrees lotka_volterra --effort 3 --json
      kahanmaps degrees weierstrass --eps 1/10 --terms 60
      kahanmaps degrees --rhs "x' = x*(1-y); y' = y*(x-1)"
      kahanmaps degrees henon_heiles -p c=-2..0:1/2 --terms 6

    The degree of Phi^n as a map of projective space is measured on two random lines modulo random primes of 61 bits.
    Without --eps, eps is a random residue. Measured degrees are evidence, not proof.

    The hypersurfaces that the map contracts are followed, and explain the degrees for all times: generating function,
    recurrence, dynamical degree; of long compositions, map by map. A line for each of them says when it comes
    back, and what it costs. Where they explain nothing, a recurrence is accepted that holds for at least 2 terms more
    than determine it, with terms enough beyond the last confinement, and else there is an estimate only. "no
    confinement" is said with the number of steps that were tried.

    In the plane a dynamical degree above 1 is proved by exact bounds. The growth of monomial maps is proved by powers
    of the exponent matrix, and that of maps with an iterate of degree 1 by composing formulas.

    A parameter with a range of values, FIRST..LAST or FIRST..LAST:STEP, gives a table with a line (with --json a
    record) for each combination of values. Values at which the map is undefined are listed at the end.

    Exit status: 0 a recurrence was found, all requested terms were computed, or the iterates are constant or undefined
    from some step on; 2 usage error; 3 undecided, or stopped early.
    """
    eps = opt.the_eps(options["eps"], options["time_step"], required=False)

    def cell(file: lib.SystemFile, search: SearchProgress) -> Cell:
        found = measured(file, eps, options, search)
        more = ", ..." if len(found.degrees) > _SHOWN else ""
        line = f"{', '.join(map(str, found.degrees[:_SHOWN]))}{more}\t{found.kind_text}"
        undecided = ""
        if not is_done(found, options["terms"]):
            undecided = f"undecided: {found.unconfirmed}" if found.unconfirmed else f"stopped early: {found.message}"
        return Cell(line, lambda: _record(file, options, found, search), lambda: _print(file, found), undecided)

    return table(system, options, cell)


def measured(
    file: lib.SystemFile, eps: Any, options: dict[str, Any], progress: Callable[[str], None]
) -> lib.DegreeGrowth:
    """The degrees that the options ask for."""
    asked = opt.given(options, "effort", "max_degree", "seed", max_terms="terms")
    return lib.degree_growth(file.map, eps, **asked, steps=options.get("steps"), progress=progress)


def is_done(found: lib.DegreeGrowth, terms: int | None) -> bool:
    """Whether nothing was left open that was asked for: `terms` degrees, or (None) a recurrence."""
    if found.ended in ("terms", "constant", "singular"):
        return True
    return terms is None and (found.proof is not None or found.recurrence is not None)


def _print(file: lib.SystemFile, found: lib.DegreeGrowth) -> None:
    eps, lines = found.eps, f"{len(found.primes)} random lines modulo primes of 61 bits"
    at = ", generic eps" if eps is None and file.map.has_eps else lib.eps_told(eps, file.map)
    how = f"{lines}: measured, not proved" if found.primes else "powers of the exponent matrix: exact"
    print_stdout(f"# {file.name}{at}, {how}")
    print_stdout(found.text)


def _record(
    file: lib.SystemFile, options: dict[str, Any], found: lib.DegreeGrowth, search: SearchProgress
) -> dict[str, Any]:
    time_step = lib.eps_record(found.eps, file.map)["time_step"]
    return record_of(
        "degrees",
        file,
        "modulo the primes of the lines" if found.primes else "exact",
        time_step="generic" if time_step == "every" else time_step,
        **search.work,
        **opt.given(options, "max_degree", terms_asked="terms"),
        **found.to_json(),
    )
