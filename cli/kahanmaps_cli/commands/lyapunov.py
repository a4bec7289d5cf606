"""kahanmaps lyapunov."""

from __future__ import annotations

from math import isfinite
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.ensemble_starts import requested_starts, require_one_kind_of_starts, starts_record
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.screen.render import print_json, record_of
from kahanmaps_cli.screen.terminal import on_terminal, print_stdout, print_table

_MAX_STEPS = 10**9
_DEFAULT_START_COUNT = 16  # number of random initial points unless initial points are given


@click.command("lyapunov")
@opt.system_options
@opt.starts_options
@opt.eps_options
@click.option(
    "--steps", type=int, metavar="N", default=10_000, show_default=True, help="Number of steps averaged in an orbit."
)
@click.option(
    "--transient", type=int, metavar="K", help="Number of steps before them, which do not count (default: N/10)."
)
@opt.seconds_option
@opt.output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Compute the Lyapunov exponents of float orbits of the map of SYSTEM, by the exact tangent map.

    \b
      kahanmaps lyapunov lorenz --eps 1/400 --box 5 --steps 20000
      kahanmaps lyapunov euler_top --eps 1/10 --random 100 --seed 1
      kahanmaps lyapunov henon_heiles --eps 1/10 --box 1/3 --json

    The exponents are given per unit of time, which is 1/(2 eps) steps, and per step: means over the orbits, their
    spread, and the difference between the first half of the steps and all steps. By default there are 16 random
    initial points.

    Numbers in double precision from finitely many steps are measured, not proved: a small exponent need not be 0, and
    those of integrable maps tend to 0 like log(steps)/steps. The sum is compared with log |det dPhi|; residual is the
    largest difference of an orbit, normally round-off.

    Exit status: 0 all orbits completed, 2 usage error, 3 some orbits ended early or --seconds stopped the run.
    """
    steps = options["steps"]
    transient = steps // 10 if options["transient"] is None else options["transient"]
    require_one_kind_of_starts({**options, "system": system}, random_by_default=True)
    if not 2 <= steps <= _MAX_STEPS or not 0 <= transient <= _MAX_STEPS:
        raise click.UsageError(
            f"found --steps {steps} and --transient {transient}, expected 2 to {_MAX_STEPS} and 0 to {_MAX_STEPS}"
        )
    file = opt.load_system(system, {**options, "quiet": quiet})
    eps = opt.eps_of(file, options)
    starts = requested_starts(file, options, count=_DEFAULT_START_COUNT)
    with SearchProgress({**options, "quiet": quiet}) as search:
        eps_value = lib.rational(1) if eps is None else eps
        result = lib.lyapunov_exponents(file.map, starts, eps_value, steps, transient=transient, progress=search)
    if as_json:

        def number(value: Any) -> float | None:
            return float(value) if isfinite(value) else None  # JSON has no NaN

        arrays = {"per_time": result.mean, "per_step": result.per_step, "spread": result.spread}
        arrays["change_from_half"] = result.change
        record = record_of(
            "lyapunov",
            file,
            "float",
            variables=list(file.variables),
            **lib.eps_record(eps, file.map),
            **starts_record(options, result.orbits),
            steps_requested=steps,
            **lib.attributes(result, "orbits", ended="ended_count", steps="steps", transient="transient"),
            stopped=result.is_stopped,
            **{name: [number(value) for value in values] for name, values in arrays.items()},
            sum=number(result.mean.sum()),
            log_volume=number(result.log_volume.mean()) if len(result.log_volume) else None,
            residual=number(result.residual),
        )
        print_json(record)
    else:
        print_stdout(f"# {file.name}{lib.eps_suffix(eps, file.map)}, double precision")
        print_stdout(f"orbits\t{result.orbits - result.ended_count} of {result.orbits}")
        if result.is_stopped and not result.steps:  # exponents are means over counted steps, and there are none
            print_stdout(f"steps\tnone counted: stopped in the transient, after {result.transient} of its steps")
        else:
            print_stdout(f"steps\t{result.steps} after {result.transient}")
            columns = {"per unit of time": result.mean} if file.map.time_steps else {}
            columns |= {"per step": result.per_step, "spread": result.spread, "change from first half": result.change}
            rows = [
                [str(k), *(f"{number:.6g}" for number in numbers)]
                for k, numbers in enumerate(zip(*columns.values(), strict=True), 1)
            ]
            print_table([["exponent" if on_terminal() else "# exponent", *columns], *rows])
            volume = result.log_volume.mean() if len(result.log_volume) else float("nan")
            print_stdout(f"sum\t{result.mean.sum():.6g}")
            print_stdout(f"log |det dPhi|\t{volume:.6g}\tresidual {result.residual:.2g}")
    if result.ended_count and not quiet:
        print_stderr(f"{result.ended_count} of {result.orbits} orbits overflowed or reached a pole")
    return 3 if result.ended_count or search.is_over else 0
