"""kahanmaps orbit."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import Arithmetic, PointText, Steps, Whole
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import Progress, TimeLeft, print_stderr
from kahanmaps_cli.screen.streams import is_read
from kahanmaps_cli.signals import interruptible

_FORMATS = ("text", "json", "jsonl", "csv", "npz", "parquet", "npy")
_EXIT_STATUS = {"completed": 0, "periodic": 0, "interrupted": 130}


@click.command("orbit")
@opt.system_options
@click.option(
    "--start",
    type=PointText(True),
    required=True,
    metavar="X",
    help="The initial point, e.g. 1/2,-1/3,0.25, or 1,t with -p 't = root of t^2 + 1'.",
)
@opt.eps_options
@click.option("--steps", type=int, metavar="N", help="Number of steps.")
@click.option("--at", type=Steps(), metavar="N1,N2,...", help="Compute only the iterates with these numbers.")
@click.option("--every", type=Whole(1), metavar="K", default=1, show_default=True, help="Write every K-th iterate.")
@opt.backward_option
@click.option(
    "--arithmetic",
    type=Arithmetic(),
    metavar="KIND",
    default="exact",
    show_default=True,
    help="Arithmetic: exact, float, mod:P, ball:BITS or ball:auto.",
)
@click.option(
    "--method",
    type=click.Choice(("generic", "normal-form", "doubling")),
    help="How steps are computed; by default chosen automatically (-v prints the choice and the reason).",
)
@click.option(
    "--accuracy", type=click.IntRange(1, 100_000), metavar="DIGITS", help="Correct digits for ball:auto (default 15)."
)
@click.option(
    "--kernel", type=click.Choice(("numpy", "numba")), help="Code for float orbits; numba needs kahanmaps[fast]."
)
@opt.integral_option(
    "Add a column with a function: an expression in the variables and eps, the name of an integral of the file, or the "
    "word 'known': all integrals that follow from theorems (not with --arithmetic float)."
)
@click.option("--max-digits", type=Whole(1), metavar="N", help="Stop when a number exceeds N digits (default 200000).")
@click.option("--format", "form", type=click.Choice(_FORMATS), help="Output format (default: by FILE, else text).")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object on standard output.")
@click.option("-o", "--output", type=OutputFile(grows=True), metavar="FILE", help="Write to FILE.")
@click.option("-v", "--verbose", is_flag=True, help="Print the method and its reason on standard error.")
@opt.quiet_option
def command(system: str | None, output: str | None, verbose: bool, quiet: bool, **options: Any) -> int:
    """Iterate the map of SYSTEM from an initial point; a vector field stands for its Kahan map.

    \b
      kahanmaps orbit lotka_volterra --start 1,2 --eps 1/10 --steps 5
      kahanmaps orbit lotka_volterra --start 1,2 --time-step 1/5 \\
          --steps 1000 --arithmetic float -o lv.npz
      kahanmaps orbit paper_m3 --start 1,2,3,4,5,6 --eps 1/10 \\
          --at 1000000000000 --arithmetic mod:2305843009213693951
      kahanmaps orbit paper_m3 --start 1,2,3,4,5,6 --eps 1/10 \\
          --at 10,1000000 --arithmetic ball:auto --accuracy 30
      kahanmaps orbit --vars x,y,z --rhs y*z --rhs=-2*z*x --rhs x*y \\
          --start 1,1/2,1/3 --eps 1/10 --steps 5 --integral y^2+2*x^2
      kahanmaps orbit --vars x,y --image 'y; (3 + y)/x' --start 1,2 --steps 5

    SYSTEM is a file, a name of the catalogue, or - for standard input. Numbers are exact: integers, p/q, decimals.
    SYSTEM may also be another map than Kahan's; --eps is not needed if the map does not depend on eps. Ctrl-C stops
    after the current step and leaves a valid file; a second Ctrl-C stops at once.

    For members of the commuting family steps are computed in normal form, and --at N computes the N-th iterate
    directly, by doublings; modulo P and in balls N may have thirty digits. Over Q indeterminacy points before step N
    are detected; modulo P and in balls they are not.

    --integral adds a column with the values of a function.

    Exit status: 0 done, 2 usage error, 3 stopped early (indeterminacy point, digit limit, ...), 130 interrupted.
    """
    output = None if output == "-" else output
    form = _requested_format(options, output)
    options["quiet"] = quiet
    file, start = opt.load_with_start(options, partial(opt.load_system, system), system)
    eps = opt.eps_of(file, options)
    map_ = file.map
    if isinstance(start, lib.AlgebraicPoint):
        arithmetic = options["arithmetic"]
        map_ = lib.over_number_field(map_, start.root)
        if arithmetic == ("ball", 0):
            raise click.UsageError(
                "--arithmetic ball:auto needs a rational initial point: for an algebraic one use exact, mod:P or "
                "ball:BITS"
            )
        if arithmetic.kind == "float":
            start = start.real_approximation()
        else:
            start = start.over(start.root.number_field if arithmetic.kind == "exact" else arithmetic.field)

    def stop() -> None:  # while the method is chosen, the orbit has no points yet that could be written
        raise KeyboardInterrupt

    with interruptible(stop), Progress(quiet) as progress:
        in_floats = options["arithmetic"].kind == "float"
        functions = {}
        if options["integrals"]:  # imported only if needed: this call loads the checks
            functions = lib.functions_along(file, options["integrals"], in_floats, ("step", *file.variables))
        trajectory = lib.orbit(
            map_,
            start,
            eps,
            hamiltonian=file.hamiltonian,
            member=file.member,
            accuracy=options["accuracy"] or 15,
            progress=progress,
            **opt.pick(options, "steps", "at", "every", "backward", "arithmetic", "method", "max_digits", "kernel"),
        )
    trajectory.integrals = functions
    reason = trajectory.why
    if verbose and not quiet:
        print_stderr(reason)
    on_terminal = output is None and sys.stdout.isatty()
    is_table = on_terminal and form == "text"
    destination: Any = sys.stdout if output is None else output
    if is_table:
        from kahanmaps_cli.screen.orbit_table import OrbitTable  # imported here: this import loads the library

        destination = OrbitTable(destination, file.variables, list(functions))
    last_step = trajectory.header()["steps"]
    time_left = TimeLeft(last_step)
    is_unread = False  # whether the reader of the pipe (such as head) has closed it

    def on_step(step: int) -> None:
        nonlocal is_unread
        progress(f"step {step} of {last_step}{time_left(step) if trajectory.arithmetic.kind == 'exact' else ''}")
        if output is None and not is_read():
            is_unread = True
            trajectory.interrupt()

    with (
        interruptible(trajectory.interrupt),
        Progress(quiet or on_terminal) as progress,
    ):  # on a terminal the printed points already show the progress
        end = trajectory.write(destination, form, file.name, on_step)
    if verbose and not quiet and trajectory.why != reason:
        print_stderr(trajectory.why)
    if output is not None and not quiet:
        print_stderr(f"{output}: {end.text}")
    elif end.status not in _EXIT_STATUS and not (quiet or is_unread or is_table):  # a table already ends with this text
        print_stderr(end.text)
    return 3 if is_unread else _EXIT_STATUS.get(end.status, 3)


def _requested_format(options: dict[str, Any], output: str | None) -> str:
    """Return the requested format, by default that of the suffix of the output file; refuse contradictory options."""
    steps, at = options["steps"], options["at"]
    if (steps is None) == (at is None):
        raise click.UsageError("give either --steps N or --at N1,N2,...")
    if steps is not None and steps < 0:
        raise click.UsageError(f"found --steps {steps}, expected 0 or more (--backward steps by the inverse map)")
    if at is not None and options["every"] != 1:
        raise click.UsageError("give --at N1,N2,... or --every K, not both")
    if options["accuracy"] is not None and options["arithmetic"] != ("ball", 0):
        raise click.UsageError("--accuracy is for --arithmetic ball:auto")
    if options["kernel"] is not None and options["arithmetic"].kind != "float":
        raise click.UsageError("--kernel is for --arithmetic float")
    form: str | None = options["form"]
    if options["as_json"]:
        if form not in (None, "json"):
            raise click.UsageError(f"give --json or --format {form}, not both")
        if output is not None and Path(output).suffix.lower() not in ("", ".json"):
            raise click.UsageError(f"found --json and the name {output}: use the suffix .json, or leave out --json")
        form = "json"
    form = form or lib.form_of(output or "")
    if form in ("npz", "parquet") and output is None and sys.stdout.isatty():
        raise click.UsageError(f"{form} is a binary format: add -o FILE")
    if form == "npy":
        if options["arithmetic"].kind != "float":
            raise click.UsageError(
                "npy is for --arithmetic float: use npz, or jsonl, which holds numbers of any length"
            )
        if output is None:
            raise click.UsageError("npy needs a file: add -o FILE.npy")
        if options["at"] is not None or options["integrals"]:
            raise click.UsageError("npy holds the points of --steps N --every K: for --at or --integral use npz")
    return form
