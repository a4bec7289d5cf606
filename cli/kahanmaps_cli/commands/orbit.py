"""kahanmaps orbit."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import copyfileobj, get_terminal_size
from tempfile import TemporaryFile
from typing import IO, Any

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import Arithmetic, PointText, Steps, Whole
from kahanmaps_cli.runs.orbit_formats import Csv, Json, JsonLines, Npz, OutputFull, Text, Writer, meta_of
from kahanmaps_cli.runs.orbit_run import OrbitRun
from kahanmaps_cli.screen.numbers import json_float, short_float
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import Progress, TimeLeft, say
from kahanmaps_cli.screen.render import ending
from kahanmaps_cli.screen.streams import is_read
from kahanmaps_cli.signals import interruptible

_FORMATS = ("text", "json", "jsonl", "csv", "npz", "npy")
_TEXT = ("", ".txt", ".tsv", ".out", ".dat", ".log")  # endings of files of text
_STATUS = {"completed": 0, "periodic": 0, "interrupted": 130}


@click.command("orbit")
@opt.system_options
@click.option("--start", type=PointText(), required=True, metavar="X", help="The start, e.g. 1/2,-1/3,0.25.")
@opt.eps_options
@click.option("--steps", type=int, metavar="N", help="How many steps to take.")
@click.option("--at", type=Steps(), metavar="N1,N2,...", help="Only these iterates, instead of --steps.")
@click.option("--every", type=Whole(1), metavar="K", default=1, show_default=True, help="Only every K-th iterate.")
@opt.backward_option
@click.option(
    "--arithmetic",
    type=Arithmetic(),
    metavar="KIND",
    default="exact",
    show_default=True,
    help="exact, float, mod:P, ball:BITS or ball:auto.",
)
@click.option(
    "--method",
    type=click.Choice(("generic", "normal-form", "doubling")),
    help="How to compute it; chosen by itself unless given (-v says which and why).",
)
@click.option("--accuracy", type=click.IntRange(1, 100_000), metavar="DIGITS", help="For ball:auto; default 15.")
@click.option("--kernel", type=click.Choice(("numpy", "numba")), help="What computes float orbits; numba needs [fast].")
@opt.integral_option(
    "A column beside the point: an expression in the variables and eps, the name of an integral of the file, or "
    "the word known for all that theorems give (not in floats)."
)
@click.option("--max-digits", type=Whole(1), metavar="N", help="Digit budget (exact arithmetic; default 200000).")
@click.option("--format", "form", type=click.Choice(_FORMATS), help="Default text, or what the name of FILE says.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
@click.option("-o", "--output", type=OutputFile(grows=True), metavar="FILE", help="Write to FILE.")
@click.option("-v", "--verbose", is_flag=True, help="Say on standard error how it is computed.")
@opt.quiet_option
def command(
    system: str | None,
    form: str | None,
    as_json: bool,
    output: str | None,
    verbose: bool,
    quiet: bool,
    **options: Any,
) -> int:
    """Iterate the map of SYSTEM from a start; a vector field stands for its Kahan map.

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
    A map may be another than Kahan's; one that does not depend on eps needs none.
    Ctrl-C ends after the step in flight and leaves a valid file; a second and third one end at once.

    Members of the commuting family are stepped in their normal form, and --at reaches an iterate directly, by
    doublings: modulo P and in balls for steps of thirty digits. Poles on the way are passed over then, except over Q.

    --integral adds a column: an expression, the name of an integral of the file, or the word known for all that
    theorems give (not in floats).

    Exit status: 0 done, 2 usage error, 3 stopped early (singular point, digit budget, ...), 130 interrupted.
    """
    steps, at, every = options["steps"], options["at"], options["every"]
    if (steps is None) == (at is None):
        raise click.UsageError("give --steps N or --at N1,N2,..., one of the two")
    if steps is not None and steps < 0:
        raise click.UsageError(f"found --steps {steps}, expected 0 or more (--backward steps by the inverse map)")
    if at is not None and every != 1:
        raise click.UsageError("give --at N1,N2,... or --every K, not both")
    file = opt.load_system(system, options)
    eps = opt.eps_of(file, options)
    if options["accuracy"] is not None and options["arithmetic"] != ("ball", 0):
        raise click.UsageError("--accuracy is for --arithmetic ball:auto")
    if options["kernel"] is not None and options["arithmetic"][0] != "float":
        raise click.UsageError("--kernel is for --arithmetic float")
    options["accuracy"] = options["accuracy"] or 15
    output = None if output == "-" else output
    if as_json and form not in (None, "json"):
        raise click.UsageError(f"give --json or --format {form}, not both")
    if as_json and output is not None and Path(output).suffix.lower() not in ("", ".json"):
        raise click.UsageError(f"found --json and the name {output}: give it the ending .json, or leave out --json")
    form = "json" if as_json else form or _form_from_name(output)
    if form == "npy":
        _require_npy(options, output)
    hidden = quiet or (output is None and sys.stdout.isatty())  # the points themselves show the progress
    with interruptible(_stop), Progress(quiet) as progress:
        run = OrbitRun(file, eps, {**options, "progress": progress})
    if verbose and not quiet:
        say(run.walk.why)
    if form == "npy" and output is not None:
        return _stream(run, output, quiet)
    with (
        _opened(output, form) as stream,
        interruptible(run.walk.interrupt),
        Progress(hidden) as progress,
    ):
        writer = _writer(form, stream, run, output)
        writer.header(run.header())
        left = TimeLeft(run.steps)
        try:
            for step, texts, values in run.points():
                progress(f"step {step} of {run.steps}{left(step) if run.kind == 'exact' else ''}")
                if texts is not None:
                    writer.point(step, texts, values)
                if output is None and not is_read():
                    return 3  # the reader (head, say) has what it wanted, and the orbit may be long
            end = run.walk.end
        except OutputFull as full:
            end = lib.OrbitEnd("budget", full.steps, str(full))
        record = _end_record(end, run)
        writer.end(record)
    told = output is None and form == "text" and sys.stdout.isatty()  # the last line says how it ended
    if not quiet and not told and (output is not None or end.status not in _STATUS):
        where = f"{output}: " if output is not None else ""
        say(f"{where}{ending(end.status, record['message'])}")
    return _STATUS.get(end.status, 3)


def _require_npy(options: dict[str, Any], output: str | None) -> None:
    """The points of a float orbit and nothing else go to a .npy file."""
    if options["arithmetic"][0] != "float":
        raise click.UsageError("npy is for --arithmetic float: take npz, or jsonl, which holds numbers of any length")
    if output is None:
        raise click.UsageError("npy grows in a file: add -o FILE.npy")
    if options["at"] is not None or options["integrals"]:
        raise click.UsageError("npy holds the points of --steps N --every K: for --at or --integral take npz")


def _stream(run: OrbitRun, output: str, quiet: bool) -> int:
    """Float points, as fast as they come."""
    try:
        with interruptible(run.walk.interrupt), Progress(quiet) as progress:
            end = lib.stream_orbit(
                run.walk.orbit, output, progress=lambda step: progress(f"step {step} of {run.steps}")
            )
    except OSError as error:  # a full disk comes without a name
        error.filename = error.filename or output
        raise
    if not quiet:
        say(f"{output}: {ending(end.status, _end_record(end, run)['message'])}")
    return _STATUS.get(end.status, 3)


def _stop() -> None:
    """While the way to compute is being chosen there is nothing yet to keep."""
    raise KeyboardInterrupt


def _end_record(end: lib.OrbitEnd, run: OrbitRun) -> dict[str, Any]:
    record: dict[str, Any] = {"status": end.status, "steps": end.steps, "message": end.message}
    if end.period is not None:
        record["period"] = end.period
    if run.kind == "float":
        record["near_singular"] = near = run.walk.orbit.near_singular
        drift = {drift.name: json_float(drift.largest) for drift in run.walk.orbit.drift}
        if drift:
            record["drift"] = drift
            largest = max(float(drift.largest) for drift in run.walk.orbit.drift)
            record["message"] += f"; block integrals moved by at most {short_float(largest)} where looked at"
        if near:
            record["message"] += f"; near-singular steps: {near}, the first from step {run.walk.orbit.near_singular_at}"
    return record


def _writer(form: str, stream: IO[Any], run: OrbitRun, output: str | None) -> Writer:
    columns, integrals = run.file.variables, [name for name, _ in run.columns]
    if form == "jsonl":
        return JsonLines(stream, columns, integrals)
    if form == "json":
        return Json(stream, columns, integrals)
    if form == "csv":
        return Csv(stream, columns, integrals, None if output is None else meta_of(output))
    if form == "npz":
        return Npz(stream, columns, integrals, run.storage)
    on_terminal = output is None and sys.stdout.isatty()
    return Text(stream, columns, integrals, get_terminal_size().columns if on_terminal else None)


def _form_from_name(output: str | None) -> str:
    suffix = "" if output is None else Path(output).suffix.lower()
    if suffix in _TEXT:
        return "text"
    if suffix[1:] not in _FORMATS:
        endings = ", ".join(f".{form}" for form in _FORMATS[1:])
        raise click.UsageError(f"found the ending {suffix} of {output}, expected .txt, {endings}, or --format")
    return suffix[1:]


@contextmanager
def _opened(output: str | None, form: str) -> Iterator[IO[Any]]:
    if output is not None and form == "npz":
        with lib.whole_file(output) as stream:
            yield stream
    elif output is not None:
        if form == "csv" and os.path.isdir(meta_of(output)):  # said before an older table is lost
            raise click.UsageError(f"found a folder {meta_of(output)}, where what the table is of is written")
        try:
            with open(output, "w", encoding="utf-8", errors="backslashreplace") as stream:
                yield stream
                lib.sync(stream)
        except OSError as error:  # a full disk comes without a name
            error.filename = error.filename or output
            raise
    elif form != "npz":
        yield sys.stdout
    elif sys.stdout.isatty():
        raise click.UsageError("npz is not for a terminal: add -o FILE")
    else:
        with TemporaryFile() as held:  # a zip archive needs a stream that can seek
            yield held
            held.seek(0)
            copyfileobj(held, sys.stdout.buffer)
