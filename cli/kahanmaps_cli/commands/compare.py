"""kahanmaps compare."""

from __future__ import annotations

import time
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.errors import counted, quoted
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.comparison import comparison_options, early_messages, requested_comparison
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.screen.render import print_json, record_of
from kahanmaps_cli.screen.terminal import print_stdout, print_table


@click.command("compare")
@comparison_options
@click.option("--kernel", type=click.Choice(("numpy", "numba")), help="Code of steps; it affects only the speed.")
@click.option("--timings", is_flag=True, help="Print the seconds of each method (with compilation).")
@click.option(
    "-o", "--output", type=OutputFile(), metavar="FILE", help="Write the measured curves to FILE.csv or FILE.parquet."
)
@opt.output_options
def command(as_json: bool, quiet: bool, timings: bool, output: str | None, **options: Any) -> int:
    """Compare Kahan's method with other methods for SYSTEM: drift of integrals, errors, measured orders, work.

    \b
      kahanmaps compare henon_heiles --eps 1/20
      kahanmaps compare euler_top --start 1,1/2,1/3 --eps 1/20 \\
          --methods kahan,midpoint,rk4 --steps 100000
      kahanmaps compare henon_heiles --eps 1/20 -o curves.csv \\
          --methods kahan,symplectic-euler,stormer-verlet,gauss4
      kahanmaps compare "x' = x*(1-y); y' = y*(x-1)" --start 1,2 --eps 1/20

    drift is the largest relative error |I(x_n) - I(x_0)|/|I(x_0)| over all steps and initial points (absolute where
    I(x_0) = 0). Integrals are those of the file, those that theorems give, or those that a quick search finds; an
    integral whose limit for eps -> 0 is a constant is normalized. The limits for eps -> 0 are compared as well: the
    flow conserves them, and the Kahan map in general does not.

    error is the difference at a fixed time from a Taylor solution in balls; the column measured has the order, log_2 of
    the ratio of errors at two time steps with the ratio 2. Equations of implicit methods are solved by Newton's method
    to rounding; orbits in which this method fails are counted. symplectic-euler and stormer-verlet need a Hamiltonian
    T(p) + V(q). yoshida4, suzuki4 and yoshida6 are compositions of Kahan's method, which is symmetric. The work is
    given as evaluations of f and solutions of linear systems per step.

    FILE has the columns kind (drift or error), method, function, eps, step, value and evaluations of f.

    Exit status: 0 done, 2 usage error, 3 some orbits ended early.
    """
    if output is not None and not output.endswith((".csv", ".parquet")):
        raise click.UsageError(f"found -o {quoted(output)}, expected a name that ends with .csv or .parquet")
    clock = time.perf_counter if timings else None
    with SearchProgress({**options, "quiet": quiet}) as progress:
        result = requested_comparison({**options, "quiet": quiet}, progress, kernel=options["kernel"], clock=clock)
    if output is not None:
        result.write(output)
        if not quiet:
            print_stderr(f"{output}: {counted(len(result.rows()), 'row')}")
    if as_json:
        entries = {**lib.eps_record(result.eps), "seed": options["seed"], **result.to_json()}
        print_json(record_of("compare", result.file, "float", **entries))
    else:
        print_stdout(result.text.partition("\n")[0])
        for table in result.tables():
            print_table(table)
        for sentence in result.remarks():
            print_stdout(sentence)
    messages = early_messages(result)
    for sentence in () if quiet else messages:
        print_stderr(sentence)
    return 3 if messages else 0
