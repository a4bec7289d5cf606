"""kahanmaps ensemble."""

from __future__ import annotations

from itertools import islice
from typing import Any

import click

from kahanmaps.errors import counted, quoted
from kahanmaps_cli import library as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import Whole
from kahanmaps_cli.runs.ensemble_run import FAILURES_SHOWN, Asked, EnsembleRun, normal_form_for
from kahanmaps_cli.runs.ensemble_starts import asked_starts
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import Progress, say
from kahanmaps_cli.screen.render import print_json, record_of
from kahanmaps_cli.screen.terminal import tell
from kahanmaps_cli.signals import interruptible

_MAX_STEPS = 10**13  # years


@click.command("ensemble")
@opt.system_options
@opt.random_starts_options
@opt.eps_options
@click.option("--steps", type=int, metavar="N", required=True, help="How many steps to take.")
@opt.backward_option
@click.option("-o", "--output", type=OutputFile(grows=True), metavar="FILE.npy", help="Write the points there.")
@click.option("--every", type=Whole(1), metavar="K", help="Write every K-th iterate (default: the first and the last).")
@opt.integral_option("Watch an expression in the variables and eps, or an integral of the file by its name.")
@click.option("--method", type=click.Choice(("generic", "normal-form")), help="Chosen by itself unless given.")
@click.option("--kernel", type=click.Choice(("numpy", "numba")), help="Makes no difference to numbers, only to speed.")
@click.option("--threads", type=Whole(1), metavar="T", help="For the kernel numba (default: all processors).")
@click.option("-v", "--verbose", is_flag=True, help="Say on standard error how it is computed.")
@opt.output_options
def command(system: str | None, as_json: bool, quiet: bool, verbose: bool, **options: Any) -> int:
    """Many orbits of the map of SYSTEM at once: how many go through, and how well integrals are kept.

    \b
      kahanmaps ensemble paper_m2 --random 1000 --box 1/2 --seed 1 \\
          --eps 1/10 --steps 1000
      kahanmaps ensemble paper_m2 --random 1000 --eps 1/10 --steps 10000 \\
          --every 100 -o orbits.npy
      kahanmaps ensemble euler_top --starts starts.csv --eps 1/20 \\
          --steps 1000 --integral F1

    FILE.npy is an array (records, orbits, dimension): row k holds step k K. It grows while the orbits are walked, and
    is valid at every moment, also after Ctrl-C. Orbits that have ended early are NaN there. Starts in text are exact
    numbers, separated by commas or blanks; # starts a comment, and a first line may name the columns.

    Exit status: 0 all orbits completed, 2 usage error, 3 some ended early, 130 interrupted.
    """
    _require_sense(system, options)
    file = opt.load_system(system, {**options, "quiet": quiet})
    integrals = lib.functions_along(file, options["integrals"], in_floats=True)
    eps = opt.eps_of(file, options)
    number = lib.fmpq(1) if eps is None else eps
    file.map.at(number)  # the demands on eps, in the words of orbit
    starts = asked_starts(file, options)
    normal_form = normal_form_for(file, options["method"])
    form = None if isinstance(normal_form, lib.NoNormalForm) else normal_form.form
    run = EnsembleRun(Asked(file, number, starts, form, integrals, options))
    if verbose and not quiet:
        why = normal_form.reason if isinstance(normal_form, lib.NoNormalForm) else normal_form.text
        say(f"method {run.method}: {why}; kernel {run.kernel}")
    steps, output = options["steps"], options["output"]
    with interruptible(run.interrupt), Progress(quiet) as progress:
        run.walk(lambda k: progress(f"step {k} of {steps}"))
    if as_json:
        print_json(_record(file, eps, options, run))
    else:
        _print(file, eps, options, run)
    interrupted = run.reached < steps
    if not quiet and output is not None:
        say(f"{output}: {counted(run.records, 'record')} of {counted(run.shape[0], 'orbit')}")
    if not quiet and interrupted:
        say(f"interrupted after step {run.reached}")
    return 130 if interrupted else 0 if run.counts["completed"] == run.shape[0] else 3


def _require_sense(system: str | None, options: dict[str, Any]) -> None:
    """Options that contradict each other, or themselves."""
    steps, every, output = options["steps"], options["every"], options["output"]
    if (options["starts"] is None) == (options["count"] is None):
        raise click.UsageError("give --starts FILE or --random N, one of the two")
    if options["starts"] is not None and (options["box"] is not None or options["seed"] is not None):
        raise click.UsageError("--box and --seed are for --random N")
    if options["starts"] == "-" and system == "-":
        raise click.UsageError("found - twice, and there is one standard input")
    if steps < 0:
        raise click.UsageError(f"found --steps {steps}, expected 0 or more (--backward steps by the inverse map)")
    if steps > _MAX_STEPS:
        raise click.UsageError(f"found --steps {steps}, expected at most {_MAX_STEPS:.0e}: it would take years")
    if every is not None and output is None:
        raise click.UsageError("--every K is for -o FILE.npy")
    if output is not None and not output.endswith(".npy"):
        raise click.UsageError(f"found -o {quoted(output)}, expected a name that ends with .npy")


def _print(file: lib.SystemFile, eps: Any, options: dict[str, Any], run: EnsembleRun) -> None:
    """Tab-separated lines, aligned on a terminal."""
    backward = ", backward" if options["backward"] else ""
    tell(f"# {file.name}{lib.eps_told(eps, file.map)}, float arithmetic{backward}")
    rows = [("orbits", str(run.shape[0])), ("steps", str(run.reached)), ("kernel", run.kernel)]
    rows += [(word, str(number)) for word, number in run.counts.items()]
    near = run.near()
    if near is not None:
        where = f", first in orbit {near['first']['orbit']} at step {near['first']['step']}" if near["first"] else ""
        rows.append(("near-singular", f"{counted(near['steps'], 'step')} in {counted(near['orbits'], 'orbit')}{where}"))
    rows += [("drift", line) for line in run.moved_lines()]
    shown = list(islice(run.failures(), FAILURES_SHOWN))
    rows += [("ended early", f"orbit {end['orbit']}\t{end['status']}: {end['message']}") for end in shown]
    more = run.shape[0] - run.counts["completed"] - len(shown)
    if more:
        rows.append(("ended early", f"and {counted(more, 'more orbit')}"))
    for name, text in rows:
        tell(f"{name}\t{text}", 15)


def _record(file: lib.SystemFile, eps: Any, options: dict[str, Any], run: EnsembleRun) -> dict[str, Any]:
    steps, output = options["steps"], options["output"]
    drawn_at_random = options["starts"] is None
    box = None
    if drawn_at_random:
        box = "1" if options["box"] is None else lib.format_number(options["box"])
    every = options["every"] or max(1, steps)
    more = {
        **lib.eps_record(eps, file.map),
        "variables": list(file.variables),
        "method": run.method,
        "kernel": run.kernel,
        "direction": "backward" if options["backward"] else "forward",
        "starts": {"random": options["count"], "box": box} if drawn_at_random else {"file": options["starts"]},
        "seed": (options["seed"] or 0) if drawn_at_random else None,
        "orbits": run.shape[0],
        "steps": steps,
        "status": "interrupted" if run.reached < steps else "completed",
        "steps_taken": run.reached,
        "counts": run.counts,
        "failures": list(islice(run.failures(), FAILURES_SHOWN)),
        "near_singular": run.near(),
        "drift": run.moved(),
        "output": None
        if output is None
        else {"file": output, "shape": [run.records, *run.shape], "every": every, "axes": ["record", "orbit", "x"]},
    }
    return record_of("ensemble", file, "float", **more)
