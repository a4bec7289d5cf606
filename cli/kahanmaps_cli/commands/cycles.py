"""kahanmaps cycles."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.screen.progress import SearchProgress
from kahanmaps_cli.screen.render import record_of
from kahanmaps_cli.screen.terminal import print_stdout
from kahanmaps_cli.screen.value_rows import Cell, table


@click.command("cycles")
@opt.system_options
@click.option(
    "--prime", "primes", type=int, multiple=True, metavar="P", help="The field is GF(P), P an odd prime; repeatable."
)
@opt.several_eps_options
@click.option("--samples", type=int, metavar="N", help="Follow N random points instead of all points.")
@click.option(
    "--steps", type=int, metavar="N", help="With --samples: follow each point for at most N steps (default 10000)."
)
@opt.seconds_option
@opt.seed_option
@opt.output_options
def command(system: str | None, **options: Any) -> int:
    """Count the cycles of the map of SYSTEM on projective space over a finite field, by length.

    \b
      kahanmaps cycles weierstrass --prime 101
      kahanmaps cycles euler_top -p a1=2 --prime 31 --prime 47
      kahanmaps cycles lotka_volterra --prime 997 --eps 1/10 --eps 1/7
      kahanmaps cycles weierstrass --prime 10007 --samples 200 --json
      kahanmaps cycles henon_heiles -p c=-2..0 --prime 11
      kahanmaps cycles --vars x,y --rhs 'x*y' --rhs '-x^2' --prime 31

    All points of P^n over GF(P) are followed, or random points where there are more than two million (above dimension 6
    the limit halves with each dimension). Without --eps two values of eps are tried for each prime, as one may be
    special.

    A point is indeterminate if the map is not defined there; common factors of the forms of the map are divided out
    first (up to dimension 6). A point is pre-indeterminate if its orbit reaches an indeterminate point, and preperiodic
    if its orbit reaches a cycle without the point being on it. The counts are exact. They are not compared with Hasse's
    bound, as cycles of integrable maps, too, may be longer than P + 1 + 2 sqrt P: on level sets with several
    components, and on level sets that the map exchanges.

    A parameter with a range of values, FIRST..LAST or FIRST..LAST:STEP, gives a table with a line for each value or
    combination of values; with --json, a record on each line. Values for which there is no map are listed at the end.

    Exit status: 0 done, 2 usage error, 3 stopped by --seconds.
    """
    if options["steps"] is not None and options["samples"] is None:
        raise click.UsageError("--steps N needs --samples N")
    if not options["primes"]:
        raise click.UsageError("missing --prime P, e.g. --prime 101")

    def cell(file: lib.SystemFile, search: SearchProgress) -> Cell:
        runs = []
        limits = {name: options[name] for name in ("samples", "steps") if options[name] is not None}
        for prime in dict.fromkeys(options["primes"]):
            eps_values = [*options["eps"], *(step / 2 for step in options["time_step"])] or lib.default_eps(prime)
            for eps in eps_values if file.map.has_eps else [1]:
                if not search.is_over:
                    runs.append(lib.cycle_census(file.map, eps, prime, **limits, seed=options["seed"], progress=search))
        outcomes = ("stopped" if run.is_stopped and not run.longest else f"longest cycle {run.longest}" for run in runs)
        line = ", ".join(f"{text} modulo {run.prime}" for text, run in zip(outcomes, runs, strict=True))

        def print_text() -> None:
            map_name = "the Kahan map" if file.is_quadratic else file.map.kind
            about_eps = lib.describe_eps(file.map)
            print_stdout(f"# {file.name}, {map_name} on P^{file.dim} over GF(p){about_eps and ', '}{about_eps}")
            for census in runs:
                at_eps = f", eps = {census.eps}" if file.map.has_eps else ""
                print_stdout(f"\n# p = {census.prime}{at_eps}")
                print_stdout(str(census))

        def record() -> dict[str, Any]:
            return record_of(
                "cycles",
                file,
                "exact modulo primes",
                **opt.pick(options, "seed", "samples", steps_requested="steps"),
                primes=list(dict.fromkeys(options["primes"])),
                runs=[
                    {
                        **lib.attributes(census, "prime", "complete", stopped="is_stopped", examined="examined"),
                        **lib.attributes(census, "indeterminate", "open", "steps"),
                        **lib.attributes(census, "pre_indeterminate", "preperiodic", "periodic", "cycles", "longest"),
                        "eps": str(census.eps),
                        "time_step": lib.eps_record(census.eps, file.map)["time_step"],
                        "points": str(census.points),
                        "lengths": [[length, n] for length, n in census.lengths.items()],
                    }
                    for census in runs
                ],
            )

        return Cell(line, record, print_text)

    return table(system, options, cell)
