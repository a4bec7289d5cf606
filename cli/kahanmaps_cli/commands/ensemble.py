"""kahanmaps ensemble."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.errors import counted, quoted
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import ExactNumber, Whole
from kahanmaps_cli.runs.ensemble_starts import requested_starts, require_one_kind_of_starts, starts_record
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import Progress, print_stderr
from kahanmaps_cli.screen.render import json_number, print_json, record_of, short_float
from kahanmaps_cli.screen.terminal import on_terminal, print_stdout, print_table
from kahanmaps_cli.signals import interruptible

MAX_STEPS = 10**13  # maximal number of steps: more would take years
FAILURES_SHOWN = 20  # maximal number of orbits that ended early and are listed in the output
_MIN_COMPILED_WORK = 5_000_000  # orbits times steps: for less work, numpy is faster than loading and compiling code
_MAX_SAMPLES = 100  # maximal number of steps at which integrals are evaluated, unless --every is given
_MAX_VALUES = 200_000  # maximal number of sampled values of an integral, over all orbits


@click.command("ensemble")
@opt.system_options
@opt.starts_options
@opt.eps_options
@click.option("--steps", type=int, metavar="N", required=True, help="Number of steps.")
@opt.backward_option
@click.option("-o", "--output", type=OutputFile(grows=True), metavar="FILE.npy", help="Write the points to FILE.npy.")
@click.option("--every", type=Whole(1), metavar="K", help="Write every K-th iterate (default: first and last only).")
@opt.integral_option(
    "Measure the drift of a function: an expression in the variables and eps, the name of an integral of the file, or "
    "'known' for all known integrals and H."
)
@click.option("--radius", type=ExactNumber(), metavar="R", help="Count the orbits with max |x_i| > R at some step.")
@click.option("--method", type=click.Choice(("generic", "normal-form")), help="Method of steps (default: automatic).")
@click.option("--kernel", type=click.Choice(("numpy", "numba")), help="Code of steps; it affects only the speed.")
@click.option("--threads", type=Whole(1), metavar="T", help="Threads for --kernel numba (default: one per processor).")
@click.option("-v", "--verbose", is_flag=True, help="Print the method and its reason on standard error.")
@opt.output_options
def command(system: str | None, as_json: bool, quiet: bool, verbose: bool, **options: Any) -> int:
    """Compute many float orbits of the map of SYSTEM: how many are completed or escape; drift of integrals.

    \b
      kahanmaps ensemble paper_m2 --random 1000 --box 1/2 --seed 1 \\
          --eps 1/10 --steps 1000
      kahanmaps ensemble paper_m2 --random 1000 --eps 1/10 --steps 10000 \\
          --every 100 -o orbits.npy
      kahanmaps ensemble euler_top --starts starts.csv --eps 1/20 \\
          --steps 1000 --integral F1
      kahanmaps ensemble henon_heiles --grid q1=-1:1:40,q2=-1:1:40 \\
          --eps 1/20 --steps 500 --radius 100 --integral known

    The drift of an orbit is the largest |I(x_n) - I(x_0)|; the table has its distribution over the completed orbits. An
    orbit escapes at the first step with max |x_i| > R, and may return later, since Kahan maps are unbounded near
    indeterminacy points. In a near-singular step 40 or more of 53 bits are lost by cancellation; the orbit continues.

    FILE.npy is an array (records, orbits, dimension): record k holds the points after k*K steps, where K is the value
    of --every. It is valid at all times, and contains NaN for orbits that ended early. Initial points in text files are
    exact numbers, separated by commas or blanks; # begins a comment, and the first line may name the columns.

    Exit status: 0 all orbits completed, 2 usage error, 3 some orbits ended early, 130 interrupted.
    """
    _require_consistent(system, options)
    file = opt.load_system(system, {**options, "quiet": quiet})
    eps = opt.eps_of(file, options)
    eps_value = lib.rational(1) if eps is None else eps
    requests = [pair for pair in options["integrals"] if pair != ("", "known")]
    claims: dict[str, Any] = lib.functions_along(file, requests, in_floats=True)
    integrals: dict[str, Any] = {  # these are also integrals of the inverse map (--backward)
        name: lib.PointFunction(name, claim.function, eps_value) for name, claim in claims.items()
    }
    if len(requests) < len(options["integrals"]):
        integrals |= {function.name: function for function in lib.known_functions(file.real_approximation, eps_value)}
    file.map.at(eps_value)  # raises the errors of the command orbit for an invalid eps
    starts = requested_starts(file, options)
    normal_form = lib.float_normal_form(file, options["method"])
    if isinstance(normal_form, lib.NoNormalForm) and options["method"] == "normal-form":
        raise lib.InputError(f"the method normal-form needs a normal form, and there is none: {normal_form.reason}")
    form = None if isinstance(normal_form, lib.NoNormalForm) else normal_form.form
    steps, every, output = options["steps"], options["every"], options["output"]
    is_short_run = steps * (30 * min(len(starts), 20) + len(starts)) < _MIN_COMPILED_WORK
    ensemble = lib.FloatEnsemble(
        file.map,
        eps_value,
        starts,
        form=form,
        kernel="numpy" if options["kernel"] is None and is_short_run else options["kernel"],
        backward=options["backward"],
        threads=options["threads"],
        integrals=integrals,
        radius=None if options["radius"] is None else lib.to_float(options["radius"]),
    )
    method = "generic" if form is None else "normal-form"
    if verbose and not quiet:
        reason = normal_form.reason if isinstance(normal_form, lib.NoNormalForm) else normal_form.text
        print_stderr(f"method {method}: {reason}; kernel {ensemble.kernel}")
    # Integrals are evaluated at further steps if only the first and the last point are written.
    record_interval = every or max(1, steps)
    interval = record_interval
    if integrals and not every:
        interval = max(1, -(-steps // max(1, min(_MAX_SAMPLES, _MAX_VALUES // len(starts)))))
    file_of_points = None if output is None else lib.NpyFile(output, starts.shape, "<f8")
    with interruptible(ensemble.interrupt), Progress(quiet) as progress, file_of_points or nullcontext():
        chunks = ensemble.records(steps, interval, progress=lambda k: progress(f"step {k} of {steps}"))
        for k, points in enumerate(chunks):
            if file_of_points is not None and (interval == record_interval or k == 0):
                file_of_points.append(points)
        if file_of_points is not None and interval != record_interval and ensemble.step == steps:
            file_of_points.append(ensemble.x[None])
    records = 0 if file_of_points is None else file_of_points.rows
    failed_orbits, near_singular = (ensemble.failed_at >= 0).nonzero()[0].tolist(), ensemble.near_singular
    near_orbits, near_at = near_singular.nonzero()[0].tolist(), ensemble.near_singular_at
    first_orbit = min(near_orbits, key=lambda k: int(near_at[k]), default=None)
    first_near = None if first_orbit is None else {"orbit": first_orbit, "step": int(near_at[first_orbit])}
    # The largest drift of each integral over all completed orbits, and the index of the orbit that has it.
    completed_orbits = (ensemble.failed_at < 0).nonzero()[0]
    statistics = ensemble.statistics()
    drifts: list[dict[str, Any]] = [{"name": drift.name, "orbits": len(completed_orbits)} for drift in ensemble.drift]
    for record_of_drift, drift in zip(drifts, ensemble.drift if len(completed_orbits) else (), strict=False):
        worst_orbit = int(completed_orbits[drift.largest[completed_orbits].argmax()])
        record_of_drift |= {"largest": lib.json_float(drift.largest[worst_orbit]), "orbit": worst_orbit}
        record_of_drift["initial"] = json_number(drift.initial[worst_orbit])
        record_of_drift["distribution"] = {key: lib.json_float(x) for key, x in statistics[drift.name].items()}
    results = {
        "orbits": ensemble.n,
        "steps": steps,
        "status": "interrupted" if ensemble.step < steps else "completed",
        "steps_taken": ensemble.step,
        "counts": {status: int((ensemble.status == status).sum()) for status in ("completed", "overflow", "singular")},
        "failures": [{"orbit": orbit, **ensemble.end(orbit).to_json()} for orbit in failed_orbits[:FAILURES_SHOWN]],
        "near_singular": {"steps": int(near_singular.sum()), "orbits": len(near_orbits), "first": first_near},
        "drift": drifts,
    }
    if options["radius"] is not None:
        has_escaped = ensemble.escaped_at >= 0
        results["escaped"] = {
            "radius": lib.format_number(options["radius"]),
            "orbits": int(has_escaped.sum()),
            "completed": int((has_escaped & (ensemble.failed_at < 0)).sum()),
            "step": statistics["escape step"],
        }
    if as_json:
        shape = {"shape": [records, *starts.shape], "every": record_interval, "axes": ["record", "orbit", "x"]}
        direction = "backward" if options["backward"] else "forward"
        record = record_of(
            "ensemble",
            file,
            "float",
            **lib.eps_record(eps, file.map),
            variables=list(file.variables),
            method=method,
            kernel=ensemble.kernel,
            direction=direction,
            **starts_record(options, len(starts)),
            **results,
            output=output and {"file": output, **shape},
        )
        print_json(record)
    else:
        _print_results(file, eps, options["backward"], ensemble.kernel, results)
    if not quiet and output is not None:
        print_stderr(f"{output}: {counted(records, 'record')} of {counted(ensemble.n, 'orbit')}")
    if not quiet and ensemble.step < steps:
        print_stderr(f"interrupted after step {ensemble.step}")
    return 130 if ensemble.step < steps else 0 if results["counts"]["completed"] == ensemble.n else 3


def _require_consistent(system: str | None, options: dict[str, Any]) -> None:
    steps, every, output = options["steps"], options["every"], options["output"]
    if require_one_kind_of_starts({**options, "system": system}) is None:
        raise click.UsageError("missing initial points: give --start X, --starts FILE, --grid, --line or --random N")
    if steps < 0:
        raise click.UsageError(f"found --steps {steps}, expected 0 or more (--backward steps by the inverse map)")
    if steps > MAX_STEPS:
        raise click.UsageError(f"found --steps {steps}, expected at most {MAX_STEPS:.0e}: it would take years")
    if every is not None and output is None:
        raise click.UsageError("--every K is for -o FILE.npy")
    if output is not None and not output.endswith(".npy"):
        raise click.UsageError(f"found -o {quoted(output)}, expected a name that ends with .npy")


def _print_results(file: lib.SystemFile, eps: Any, backward: bool, kernel: str, results: dict[str, Any]) -> None:
    """Print the results as lines of tab-separated cells; on a terminal the cells are aligned."""
    print_stdout(f"# {file.name}{lib.eps_suffix(eps, file.map)}, float arithmetic{', backward' if backward else ''}")
    rows = [("orbits", str(results["orbits"])), ("steps", str(results["steps_taken"])), ("kernel", kernel)]
    rows += [(status, str(number)) for status, number in results["counts"].items()]
    near = results["near_singular"]
    first = f", first in orbit {near['first']['orbit']} at step {near['first']['step']}" if near["first"] else ""
    rows.append(("near-singular", f"{counted(near['steps'], 'step')} in {counted(near['orbits'], 'orbit')}{first}"))
    for drift in results["drift"]:
        text = "no orbit was completed"
        if "largest" in drift:
            initial = drift["initial"]
            start = "+-".join(map(short_float, initial)) + "i" if isinstance(initial, list) else short_float(initial)
            text = f"at most {short_float(drift['largest'])} (orbit {drift['orbit']}, from {start})"
        rows.append(("drift", f"{drift['name']}\t{text}"))
    if "escaped" in results:
        escaped = results["escaped"]
        text = f"{escaped['orbits']} of {counted(results['orbits'], 'orbit')}, |x| > {escaped['radius']}"
        rows.append(("escaped", text + (f"; {escaped['completed']} of them completed" if escaped["orbits"] else "")))
    rows += [("ended early", f"orbit {end['orbit']}\t{end['status']}: {end['message']}") for end in results["failures"]]
    remaining = results["orbits"] - results["counts"]["completed"] - len(results["failures"])
    if remaining:
        rows.append(("ended early", f"and {counted(remaining, 'more orbit')}"))
    for name, text in rows:
        print_stdout(f"{name}\t{text}", 15)
    table = [(f"drift of {drift['name']}", drift.get("distribution")) for drift in results["drift"]]
    table += [("escape step", results["escaped"]["step"])] if "escaped" in results else []
    distributions = [(name, numbers) for name, numbers in table if numbers]
    if distributions and results["orbits"] > 1:
        cells = [[name, *map(short_float, numbers.values())] for name, numbers in distributions]
        print_table([["distribution" if on_terminal() else "# distribution", *distributions[0][1]], *cells])
