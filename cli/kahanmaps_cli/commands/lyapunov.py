"""kahanmaps lyapunov."""

from __future__ import annotations

from math import isfinite
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.ensemble_starts import requested_starts, starts_record
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.screen.render import print_json, record_of
from kahanmaps_cli.screen.terminal import on_terminal, print_stdout, print_table

_MAX_STEPS = 10**9
_DEFAULT_STARTS = 16


@click.command("lyapunov")
@opt.system_options
@opt.random_starts_options
@opt.eps_options
@click.option(
    "--steps", type=int, metavar="N", default=10_000, show_default=True, help="Number of steps to average over."
)
@click.option("--transient", type=int, metavar="K", help="Initial steps to discard (default: a tenth).")
@opt.seconds_option
@opt.output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Estimate Lyapunov exponents of floating-point orbits of the map of SYSTEM, by the exact tangent map.

    \b
      kahanmaps lyapunov lorenz --eps 1/400 --box 5 --steps 20000
      kahanmaps lyapunov euler_top --eps 1/10 --random 100 --seed 1
      kahanmaps lyapunov henon_heiles --eps 1/10 --box 1/3 --json

    The output has exponents per unit of time, which is 1/(2 eps) steps, and per step: means over the initial points,
    their spread, and the difference between the first half of the steps and all of them. The default is 16 random
    initial points.

    Numbers in double precision from finitely many steps are measured, not proved: a small exponent need not be 0, and
    those of integrable maps tend to 0 like log(steps)/steps. The sum is checked against log |det dPhi|.

    Exit status: 0 all orbits completed, 2 usage error, 3 some ended early, or --seconds stopped them.
    """
    steps = options["steps"]
    transient = steps // 10 if options["transient"] is None else options["transient"]
    if options["starts"] is not None and any(options[name] is not None for name in ("count", "box", "seed")):
        raise click.UsageError("--random, --box and --seed draw starts: they do not go with --starts FILE")
    if not 2 <= steps <= _MAX_STEPS or not 0 <= transient <= _MAX_STEPS:
        raise click.UsageError(
            f"found --steps {steps} and --transient {transient}, expected 2 to {_MAX_STEPS} and 0 to {_MAX_STEPS}"
        )
    file = opt.load_system(system, {**options, "quiet": quiet})
    eps = opt.eps_of(file, options)
    starts = requested_starts(file, options, count=_DEFAULT_STARTS)
    with SearchProgress({**options, "quiet": quiet}) as search:
        at = lib.rational(1) if eps is None else eps
        found = lib.lyapunov_exponents(file.map, starts, at, steps, transient=transient, progress=search)
    if as_json:

        def number(value: Any) -> float | None:
            return float(value) if isfinite(value) else None  # JSON knows no NaN

        lists = {"per_time": found.mean, "per_step": found.per_step, "spread": found.spread}
        lists["change_from_half"] = found.change
        record = record_of(
            "lyapunov",
            file,
            "float",
            variables=list(file.variables),
            **lib.eps_record(eps, file.map),
            **starts_record(options, found.orbits),
            steps_asked=steps,
            **lib.attributes(found, "orbits", "ended", "steps", "transient", "stopped"),
            **{name: [number(value) for value in values] for name, values in lists.items()},
            sum=number(found.mean.sum()),
            log_volume=number(found.log_volume.mean()) if len(found.log_volume) else None,
            residual=number(found.residual),
        )
        print_json(record)
    else:
        _print(file, eps, found)
    if found.ended and not quiet:
        print_stderr(f"{found.ended} of {found.orbits} orbits left the range of floats or met a pole")
    return 3 if found.ended or search.is_over else 0


def _print(file: lib.SystemFile, eps: Any, found: lib.Lyapunov) -> None:
    print_stdout(f"# {file.name}{lib.eps_told(eps, file.map)}, double precision")
    print_stdout(f"orbits\t{found.orbits - found.ended} of {found.orbits}")
    if found.stopped and not found.steps:  # the means of nothing would be nan
        print_stdout(f"steps\tnone counted: stopped in the transient, after {found.transient} of its steps")
        return
    print_stdout(f"steps\t{found.steps} after {found.transient}")
    columns = {"per unit of time": found.mean} if file.map.time_steps else {}
    columns |= {"per step": found.per_step, "spread": found.spread, "change from half": found.change}
    rows = [
        [str(k), *(f"{number:.6g}" for number in numbers)]
        for k, numbers in enumerate(zip(*columns.values(), strict=True), 1)
    ]
    print_table([["exponent" if on_terminal() else "# exponent", *columns], *rows])
    volume = found.log_volume.mean() if len(found.log_volume) else float("nan")
    print_stdout(f"sum\t{found.mean.sum():.6g}")
    print_stdout(f"log |det dPhi|\t{volume:.6g}\tresidual {found.residual:.2g}")
