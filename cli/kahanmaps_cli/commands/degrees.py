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

_MAX_DEGREES_SHOWN = 8  # maximal number of degrees in one line of a table over parameter values


# These options are shared with `plot degrees`.
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
        help="Stop before a degree above D.",
    ),
    opt.seed_option,
)


@click.command("degrees")
@opt.system_options
@degree_options
@click.option(
    "--steps", type=int, metavar="N", help="Follow singularities for N steps (default: that of singularities)."
)
@opt.output_options
def command(system: str | None, **options: Any) -> int:
    """Measure the degrees of the iterates of the map of SYSTEM: their recurrence and the dynamical degree.

    \b
      kahanmaps degrees euler_top
      kahanmaps degrees lotka_volterra --effort 3 --json
      kahanmaps degrees weierstrass --eps 1/10 --terms 60
      kahanmaps degrees --rhs "x' = x*(1-y); y' = y*(x-1)"
      kahanmaps degrees henon_heiles -p c=-2..0:1/2 --terms 6

    The degree of Phi^n as a map of projective space is measured on two random lines, each modulo a random prime of 61
    bits. Without --eps, eps is generic: a random residue for each line. This is evidence, and no proof.

    The images of the exceptional hypersurfaces, those that the map contracts, are followed. From their singularity
    patterns the degrees of all iterates are derived: generating function, recurrence and dynamical degree. (Long
    compositions are followed map by map.) One line for each exceptional hypersurface says at which steps it lowers the
    degree, in which exceptional hypersurfaces its images lie, and whether it is confined. If the degrees cannot be
    derived, a recurrence is accepted if it holds for at least 2 terms more than are needed to determine it, and for
    enough terms beyond the last confinement; otherwise there is only an estimate. After "no confinement" the output
    gives the number of steps that were tried.

    In the plane a dynamical degree above 1 is proved, and its bounds are exact. The growth of monomial maps is proved
    by powers of the exponent matrix, and that of maps with an iterate of degree 1 by composing formulas.

    A parameter with a range of values, FIRST..LAST or FIRST..LAST:STEP, gives a table with a line for each value or
    combination of values; with --json, a record on each line. Values for which there is no map are listed at the end.

    Exit status: 0 a recurrence was found, or all requested terms were measured, or the iterates become undefined or
    constant; 2 usage error; 3 undecided, or stopped early.
    """
    eps = opt.requested_eps(options["eps"], options["time_step"], required=False)

    def cell(file: lib.SystemFile, search: SearchProgress) -> Cell:
        growth = measure(file, eps, options, search)
        ellipsis = ", ..." if len(growth.degrees) > _MAX_DEGREES_SHOWN else ""
        line = f"{', '.join(map(str, growth.degrees[:_MAX_DEGREES_SHOWN]))}{ellipsis}\t{growth.kind_text}"
        undecided = ""
        if not is_done(growth, options["terms"]):
            undecided = f"undecided: {growth.unconfirmed}" if growth.unconfirmed else f"stopped early: {growth.message}"

        def print_text() -> None:
            eps, lines = growth.eps, f"{len(growth.primes)} random lines modulo primes of 61 bits"
            at_eps = ", generic eps" if eps is None and file.map.has_eps else lib.eps_suffix(eps, file.map)
            method_text = f"{lines}: measured, not proved" if growth.primes else "powers of the exponent matrix: exact"
            print_stdout(f"# {file.name}{at_eps}, {method_text}")
            print_stdout(growth.text)

        def record() -> dict[str, Any]:
            time_step = lib.eps_record(growth.eps, file.map)["time_step"]
            return record_of(
                "degrees",
                file,
                "modulo the primes of the lines" if growth.primes else "exact",
                time_step="generic" if time_step == "every" else time_step,
                **search.work,
                **opt.pick(options, "max_degree", terms_requested="terms"),
                **growth.to_json(),
            )

        return Cell(line, record, print_text, undecided)

    return table(system, options, cell)


def measure(
    file: lib.SystemFile, eps: Any, options: dict[str, Any], progress: Callable[[str], None]
) -> lib.DegreeGrowth:
    """Return the degree growth of the map of a file, computed as the options request."""
    arguments = opt.pick(options, "effort", "max_degree", "seed", max_terms="terms")
    return lib.degree_growth(file.map, eps, **arguments, steps=options.get("steps"), progress=progress)


def is_done(growth: lib.DegreeGrowth, terms: int | None) -> bool:
    """Whether the requested result is complete: `terms` degrees, or if `terms` is None, degrees with a recurrence."""
    if growth.ended in ("terms", "constant", "singular"):
        return True
    return terms is None and (growth.proof is not None or growth.recurrence is not None)
