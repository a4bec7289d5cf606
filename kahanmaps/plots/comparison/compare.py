"""Numerical experiments with Kahan's method and other methods: drift of functions, errors, orders, work.

All methods use the float engine (maps/floats), which advances all initial points together. All numbers are measured in
double precision and do not depend on the kernel; nothing is proved.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, log2, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import QQ, rational
from kahanmaps.algebra.parsing import parse_point
from kahanmaps.algebra.printing import all_fields, attributes, csv_line, format_number, json_float
from kahanmaps.atomic_files import write_atomically
from kahanmaps.display_protocols import ResultPart, data_frame
from kahanmaps.documents.files import SystemFile, float_normal_form
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError, counted
from kahanmaps.family.system_normal_form import NoNormalForm
from kahanmaps.maps.convention import either, eps_record_suffix, resolve_eps
from kahanmaps.maps.floats.classical import IMPLICIT, METHODS, SEPARABLE, MethodEnsemble, separated, work
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.floats.float_conversion import FloatArray, exact, to_float, to_floats
from kahanmaps.maps.floats.starts import starts_on
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.maps.orbits.iteration import OrbitEnd
from kahanmaps.maps.values import as_point
from kahanmaps.plots.comparison.functions import WatchedFunction, requested_functions, watched_functions
from kahanmaps.systems.quadratic import QuadraticSystem
from kahanmaps.systems.taylor import solution

DEFAULT_METHODS = ("kahan", "midpoint", "rk4", "gauss4", "suzuki4", "yoshida6")
BINS = 200  # number of bins of step numbers; a drift curve contains the largest error in each bin
MAX_STEPS = 10**9
MAX_FUNCTIONS = 12  # maximal number of functions whose drift is measured
MAX_STARTS = 100_000  # maximal number of initial points
_CANDIDATE_STARTS = 40  # number of initial points that are tried if none is given
_STARTS_PER_SIZE = 5  # number of candidates of one size; the next candidates have coordinates half as large
_PROBE_STEPS = 1000  # number of RK4 steps that the orbit of a candidate must complete
_REFERENCE_STARTS = 4  # maximal number of initial points for which errors are measured
_MAX_HALVINGS = 6  # number of times at which the reference solution is tried; each time is half of the previous one
_MIN_LOG_STEPS, _MAX_LOG_STEPS = 1, 14  # log2 of the smallest and of the largest number of steps
_MIN_SIZES = 5  # minimal number of step sizes before the measured order counts as converged
_MAX_SLOPE_CHANGE = 0.004  # maximal change of the slope log2(error ratio) between step sizes for a converged order
_ROUNDING_ERROR = 1000 * 2.0**-53  # times the root of the number of steps: smaller relative errors are rounding errors
_MIN_COMPILED_STEPS = 20_000  # steps of all orbits together: for fewer, numpy is faster than compiled code
_MAX_NUMBER_CHARACTERS = 60  # maximal length of a printed number; JSON output has all characters
_COLUMNS = ("kind", "method", "function", "eps", "step", "value", "evaluations")


@dataclass(frozen=True, eq=False)
class DriftCurve:
    """The drift of a function along the orbits of a method: the largest error in each bin of step numbers.

    `errors` has the largest error of each bin, exactly 0 if all values in the bin equal the initial values; `steps` has
    the step at which it occurs. Bins without values are omitted; `undefined` counts the points at which the function
    is undefined. `last` is the error at the last step, NaN if undefined.
    """

    method: str
    function: str
    steps: NDArray[np.int64]
    errors: FloatArray
    undefined: int
    last: float

    @property
    def largest(self) -> float:
        """The largest error over all steps; NaN if there are no values."""
        return float(self.errors.max()) if len(self.errors) else float("nan")


@dataclass(frozen=True)
class StepError:
    """The largest error of a method at a fixed time that is reached in `steps` steps; `eps` is half their length.

    `evaluations` is the number of evaluations of f for one initial point.
    """

    eps: fmpq
    steps: int
    error: float
    evaluations: float


@dataclass(frozen=True, eq=False)
class MethodRun:
    """The measurements for one method in a comparison.

    `ends` says how the orbit of each initial point ended. Sums over all orbits are `evaluations` of f, solved linear
    `systems`, `repeated` steps (with additional iterations of an implicit method), and `failures` (orbits for which
    Newton's method found no solution). `errors` are those at the time of the reference solution, by decreasing step
    size. `order` is log2 of the quotient of the errors for a step size and half of it, the smallest above the rounding
    error (None: there are none). `seconds` is None without a clock.
    """

    method: str
    ends: tuple[OrbitEnd, ...]
    evaluations: float
    systems: int
    repeated: int
    failures: int
    errors: tuple[StepError, ...]
    order: float | None
    seconds: float | None

    @property
    def early(self) -> list[OrbitEnd]:
        """The ends of those orbits that did not complete their steps."""
        return [end for end in self.ends if not end.is_complete]


@dataclass(frozen=True, eq=False)
class Comparison(ResultPart):
    """The result of `compare`.

    `labels`, `origins` and `relative` are dicts from the name of a function I: to its label in plots; to its origin,
    which is declared, theorem, found, flow or requested; and to True if its errors are divided by |I(x_0)|, to False if
    they are absolute. `time` is the time at which errors are measured, None without a reference solution. `skipped`
    maps each requested method that the system does not admit to the reason. `eps` is exact, half the time step.
    """

    file: SystemFile = field(repr=False)
    eps: fmpq
    starts: tuple[tuple[fmpq, ...], ...]
    steps: int
    labels: Mapping[str, str]
    origins: Mapping[str, str]
    relative: Mapping[str, bool]
    runs: tuple[MethodRun, ...]
    curves: tuple[DriftCurve, ...]
    time: fmpq | None
    skipped: Mapping[str, str]
    notes: tuple[str, ...]

    def drift(self, method: str, function: str) -> DriftCurve:
        """Return the drift of the function named `function` along the orbits of the method named `method`."""
        return next(curve for curve in self.curves if (curve.method, curve.function) == (method, function))

    def rows(self) -> list[dict[str, Any]]:
        """Return the drift and error curves as rows of one table; the entry "kind" of a row is drift or error."""
        rows: list[tuple[Any, ...]] = []
        for curve in self.curves:
            for step, value in zip(curve.steps.tolist(), curve.errors.tolist(), strict=True):
                rows.append(("drift", curve.method, curve.function, format_number(self.eps), step, value, None))
        for run in self.runs:
            for sample in run.errors:
                eps = format_number(sample.eps)
                rows.append(("error", run.method, None, eps, sample.steps, sample.error, sample.evaluations))
        return [dict(zip(_COLUMNS, row, strict=True)) for row in rows]

    def to_pandas(self) -> Any:
        """Return `rows()` as a DataFrame. Raises InputError if pandas is not installed."""
        return data_frame(self.rows())

    def write(self, path: str | Path) -> None:
        """Write `rows` to a .csv or .parquet file; the format .parquet needs pandas and pyarrow."""
        rows, suffix = self.rows(), Path(path).suffix
        if suffix not in (".csv", ".parquet"):
            raise InputError(f"found {path}, expected a name that ends with .csv or .parquet")
        if suffix == ".csv":
            lines = [["" if x is None else str(x) for x in row.values()] for row in rows]
            write_atomically(path, "".join(map(csv_line, [_COLUMNS, *lines])).encode())
        else:
            write_atomically(path, self.to_pandas().to_parquet(index=False))

    def to_json(self) -> dict[str, Any]:
        """Return plain data without the drift curves, which `rows` contains."""
        methods = []
        for run in self.runs:
            drift = {c.function: attributes(c, "largest", "last") for c in self.curves if c.method == run.method}
            ended = [{"orbit": k, **end.to_json()} for k, end in enumerate(run.ends) if not end.is_complete]
            record = {
                **attributes(run, "method", "evaluations", "systems", "repeated", measured_order="order"),
                **attributes(METHODS[run.method], "title", "order"),
                "newton_failures": run.failures,
                "completed": len(run.ends) - len(run.early),
                "ended": ended[:20],
                "errors": [all_fields(sample) for sample in run.errors],
                "drift": {name: {key: json_float(x) for key, x in sizes.items()} for name, sizes in drift.items()},
            }
            methods.append(record | ({} if run.seconds is None else {"seconds": run.seconds}))
        return {
            "starts": [[format_number(entry) for entry in start] for start in self.starts[:20]],
            "orbits": len(self.starts),
            "steps": self.steps,
            "time": None if self.time is None else format_number(self.time),
            "functions": [{"name": f, "origin": self.origins[f], "relative": self.relative[f]} for f in self.labels],
            "methods": methods,
            "reasons": dict(self.skipped),
            "notes": list(self.notes),
        }

    def tables(self) -> Iterator[list[list[str]]]:
        """Yield tables, each a list of rows of cells: one of the methods, and one of the drift of each function."""
        head = ["# method", "order", "measured", "error", "f per step", "systems per step", "orbits"]
        has_seconds = any(run.seconds is not None for run in self.runs)
        rows = [head + ["seconds"] * has_seconds]
        for run in self.runs:
            steps = max(1, sum(end.steps for end in run.ends))
            error = next((sample.error for sample in run.errors if sample.eps == self.eps), None)
            cells = [METHODS[run.method].title, str(METHODS[run.method].order)]
            cells += ["-" if run.order is None else f"{run.order:.2f}", "-" if error is None else f"{error:.2g}"]
            cells += [f"{run.evaluations / steps:.4g}", f"{run.systems / steps:.4g}"]
            cells += [f"{len(run.ends) - len(run.early)} of {len(run.ends)}"]
            rows.append(cells + ([] if run.seconds is None else [f"{run.seconds:.3f}"]))
        yield rows
        if self.labels:
            rows = [["# drift", *self.labels]]
            for run in self.runs:
                rows.append([METHODS[run.method].title])
                rows[-1] += [f"{self.drift(run.method, name).largest:.2g}" for name in self.labels]
            yield rows

    @property
    def text(self) -> str:
        """The tables and notes as text, as `print` shows them."""
        eps = eps_record_suffix({"eps": _short_number(self.eps), "time_step": _short_number(2 * self.eps)})
        lines = [f"# {self.file.name}{eps}, {counted(self.steps, 'step')}, measured in floating point"]
        for rows in self.tables():
            lines += ["\t".join(cells) for cells in rows]
        return "\n".join([*lines, *self.remarks()])

    def __str__(self) -> str:
        return self.text

    def remarks(self) -> list[str]:
        """Return sentences that explain the numbers in the tables and say what could not be measured."""
        sentences = []
        if self.time is not None:
            sentences.append(f"error: at time {_short_number(self.time)}, against Taylor solutions in balls")
        if absolute := [name for name in self.labels if not self.relative[name]]:
            sentences.append(f"absolute drift: {', '.join(absolute)}, for it is 0 at an initial point")
        for run in (run for run in self.runs if run.failures):
            number = counted(run.failures, "orbit")
            sentences.append(f"{METHODS[run.method].title}: Newton's method failed in {number}")
        return [*sentences, *(f"{METHODS[m].title} left out: {why}" for m, why in self.skipped.items()), *self.notes]


def compare(
    system: SystemLike,
    start: Any = None,
    eps: Any = None,
    steps: int | None = None,
    *,
    x0: Any = None,
    time_step: Any = None,
    h: Any = None,
    n: int | None = None,
    methods: Sequence[str] | None = None,
    integrals: str | Sequence[str | tuple[str, str]] | None = None,
    linear_bins: bool = False,
    orders: bool = True,
    seed: int = 0,
    kernel: str | None = None,
    clock: Callable[[], float] | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Compare Kahan's method with other methods: drift of integrals, errors, measured orders and work.

    Args:
        system: a quadratic system.
        start, x0: one initial point or several, exact; floats are taken exactly. By default a small random point.
        eps: half the time step of all methods (exact).
        time_step, h: the time step 2 eps, instead of eps.
        steps, n: the number of steps over which the drift is measured, by default 10,000.
        methods: names in `METHODS`, by default kahan, midpoint, rk4, gauss4, suzuki4 and yoshida6.
        integrals: functions, as texts or pairs (name, text); by default known integrals or results of a quick search.
        linear_bins: whether all bins of the drift have the same length; by default later bins are longer.
        orders: whether to measure errors and orders, for which a reference solution is computed.
        seed: the random seed of the default initial point.
        kernel: "numpy" or "numba" (default: numba if installed); the numbers are the same.
        clock: a function such as `time.perf_counter` that measures the seconds of each method; by default none.
        progress: called with a sentence at each stage.

    Returns:
        A `Comparison`: for each function I the errors |I(x_n) - I(x_0)|/|I(x_0)| (maximum over all initial points and
        the steps n in each of about 200 bins), and the errors of orbits against a Taylor solution in ball arithmetic.
        All errors are measured.

    Raises:
        InputError: for invalid values, and for a function that is undefined at an initial point.

    >>> result = compare("euler_top", [1, "1/2", "1/3"], "1/20", 1000, methods=["kahan", "rk4"], kernel="numpy")
    >>> [f"{run.method} {run.order:.2f}" for run in result.runs]
    ['kahan 2.00', 'rk4 4.00']
    >>> for curve in result.curves[::4]:
    ...     print(curve.method, curve.function, curve.largest < 1e-13)
    kahan (-F1 + 1)/eps^2 True
    rk4 (-F1 + 1)/eps^2 False
    """
    file = as_file(system).real_approximation
    field, eps = file.system, resolve_eps(eps, time_step, h, floats=True)
    if eps is None:
        raise InputError("found no eps, expected eps= or h=, e.g. h=0.1")
    eps, steps = rational(eps), either(steps=steps, n=n)
    steps = 10_000 if steps is None else steps
    if eps == 0:
        raise InputError("found eps = 0, expected another number: at eps = 0 no method moves a point")
    if not isinstance(steps, int) or not 1 <= steps <= MAX_STEPS:
        raise InputError(f"found {steps} steps, expected 1 to {MAX_STEPS}")
    starts = _exact_starts(field, either(start=start, x0=x0), eps, seed)
    method_names, skipped, ensemble_of = _choose_methods(file, eps, starts, methods, kernel)
    notes: list[str] = []
    if integrals is None:
        functions, origins = watched_functions(file, eps, progress)
        if not functions:
            notes.append(
                "no drift: no integral of the map is known, and a quick search found none (--integral gives one)"
            )
    else:
        integrals = [integrals] if isinstance(integrals, str) else integrals
        requests = [("", request) if isinstance(request, str) else request for request in integrals]
        functions = requested_functions(file, eps, requests)
        origins = {function.name: "requested" for function in functions}
    if len(functions) > MAX_FUNCTIONS:
        notes.append(f"shown: {MAX_FUNCTIONS} of {len(functions)} functions")
        functions = functions[:MAX_FUNCTIONS]
    initial, relative = _initial_values(functions, starts)
    time, references = _references(field, starts[:_REFERENCE_STARTS], eps, progress) if orders else (None, None)
    if orders and time is None:
        notes.append("no errors are measured: the solution is constant, or reaches a pole at once")
    runs, curves = [], []
    edges = _bin_edges(steps, linear_bins)
    for name in method_names:
        function_bins = [_Bins(edges) for _ in functions]
        begin = None if clock is None else clock()
        ensemble = ensemble_of(name, eps, len(starts), steps)
        for k, points in enumerate(ensemble.records(steps, 1 if functions else steps)):
            with np.errstate(all="ignore"):
                for function, bins, (initial_value, scale) in zip(functions, function_bins, initial, strict=True):
                    if k:  # at step 0 every error is 0 by definition
                        bins.add(ensemble.step - len(points) + 1, np.abs(function(points) - initial_value) / scale)
            progress(f"{METHODS[name].title}: step {ensemble.step} of {steps}")
            if (ensemble.failed_at >= 0).all():
                break
        seconds = None if clock is None or begin is None else clock() - begin
        ends = tuple(ensemble.end(k) for k in range(len(starts)))
        for function, bins in zip(functions, function_bins, strict=True):
            curves.append(bins.curve(name, function.name))
        errors: tuple[StepError, ...] = ()
        order = None
        if time is not None and references is not None:
            errors, order = _measure_errors(name, ensemble_of, time, eps, references, progress)
        repeated = int(ensemble.near_singular.sum()) if name in IMPLICIT else 0
        evaluations, systems = work(name, sum(end.steps for end in ends), repeated)
        failures = sum(end.status == "singular" for end in ends) if name in IMPLICIT else 0
        runs.append(MethodRun(name, ends, evaluations, systems, repeated, failures, errors, order, seconds))
    labels = {function.name: function.label for function in functions}
    origins = {name: origins[name] for name in labels}
    return Comparison(
        file, eps, starts, steps, labels, origins, relative, tuple(runs), tuple(curves), time, skipped, tuple(notes)
    )


def small_start(system: QuadraticSystem, eps: Any, seed: int = 0) -> tuple[fmpq, ...]:
    """Return a random initial point with small rational coordinates, which `seed` determines.

    Of 40 candidates of decreasing size, the function returns the first from which RK4 completes a thousand steps, so
    that the methods can be compared; if there is none, it returns the first candidate. `eps` is half the time step.

    >>> small_start(QuadraticSystem.from_text(["x", "y"], ["y", "-x"]), "1/10")
    (1/2, 2/3)
    """
    rng = random.Random(f"drift {seed}")
    starts = []
    for k in range(_CANDIDATE_STARTS):
        sizes = ((rng.choice((-1, 1)) * rng.randint(1, 6), rng.randint(9, 16)) for _ in range(system.dim))
        starts.append(tuple(fmpq(p, q << k // _STARTS_PER_SIZE) for p, q in sizes))
    ensemble = MethodEnsemble(system, eps, starts, "rk4", kernel="numpy")
    ensemble.advance(_PROBE_STEPS)
    complete = np.flatnonzero(ensemble.failed_at < 0)
    return starts[complete[0] if len(complete) else 0]


def _short_number(number: fmpq) -> str:
    text = format_number(number)
    return text if len(text) <= _MAX_NUMBER_CHARACTERS else f"about {to_float(number):.6g}"


def _exact_starts(system: QuadraticSystem, points: Any, eps: fmpq, seed: int) -> tuple[tuple[fmpq, ...], ...]:
    if points is None:
        return (small_start(system, eps, seed),)
    if isinstance(points, str):
        points = starts_on(points, system.variables) if ":" in points else parse_point(points)
    if isinstance(points, Mapping):
        points = as_point(points, system.variables)
    if not hasattr(points, "__len__"):
        raise InputError(f"found the initial point {points!r}, expected a sequence of numbers, or several")
    rows = points.tolist() if isinstance(points, np.ndarray) else points
    rows = rows if len(rows) and isinstance(rows[0], list | tuple | np.ndarray) else [rows]
    if len(rows) > MAX_STARTS:
        raise InputError(f"found {len(rows)} initial points, expected at most {MAX_STARTS}")
    starts = []
    for row in rows:
        starts.append(tuple(exact(float(x)) if isinstance(x, float) and isfinite(x) else rational(x) for x in row))
        if len(row) != system.dim:
            raise InputError(f"found an initial point with {counted(len(row), 'coordinate')}, expected {system.dim}")
    return tuple(starts)


def _choose_methods(
    file: SystemFile, eps: fmpq, starts: Sequence[Any], requested: Sequence[str] | None, kernel: str | None
) -> tuple[list[str], dict[str, str], Callable[[str, fmpq, int, int], FloatEnsemble]]:
    """Return the admitted methods, a dict {omitted method: reason}, and a function that starts orbits of a method."""
    if isinstance(requested, str) or not hasattr(requested or (), "__iter__"):
        raise InputError(f"found methods = {requested!r}, expected a list such as ['kahan', 'rk4']")
    names = list(dict.fromkeys(DEFAULT_METHODS if requested is None else requested))
    for name in names:
        if name not in METHODS:
            raise InputError(f"found the method {str(name)[:40]!r}, expected one of {', '.join(METHODS)}")
    skipped = {}
    halves = separated(file.system, file.hamiltonian)
    if isinstance(halves, str):
        skipped = {name: halves for name in names if name in SEPARABLE}
    normal_form = float_normal_form(file, None if "normal-form" in names else "generic")
    form = None if isinstance(normal_form, NoNormalForm) else normal_form.form
    if isinstance(normal_form, NoNormalForm) and "normal-form" in names:
        skipped["normal-form"] = normal_form.reason
    if len(skipped) == len(names):
        problems = [f"the method {name} is not available: {reason}" for name, reason in skipped.items()]
        raise InputError("; ".join(problems) or f"found no method, expected some of {', '.join(METHODS)}")
    points = np.array([to_floats(start) for start in starts])

    def ensemble_of(name: str, method_eps: fmpq, count: int, steps: int) -> FloatEnsemble:
        chosen_kernel = kernel or (None if steps * count > _MIN_COMPILED_STEPS else "numpy")
        if name in ("kahan", "normal-form"):
            kahan_form = form if name == "normal-form" else None
            return FloatEnsemble(file.system, method_eps, points[:count], form=kahan_form, kernel=chosen_kernel)
        system_halves = None if isinstance(halves, str) else halves
        return MethodEnsemble(file.system, method_eps, points[:count], name, halves=system_halves, kernel=chosen_kernel)

    return [name for name in names if name not in skipped], skipped, ensemble_of


def _initial_values(
    functions: Sequence[WatchedFunction], starts: Sequence[Sequence[fmpq]]
) -> tuple[list[tuple[FloatArray, FloatArray]], dict[str, bool]]:
    """Return (initial values, divisors of the errors) of each function, and {name: whether its errors are relative}."""
    points = np.array([to_floats(start) for start in starts])
    initial, relative = [], {}
    for function in functions:
        values, exact_values = function(points), [function.at(start) for start in starts]
        if None in exact_values or not np.isfinite(values).all():
            problem = "is not defined in floating point at the initial point: choose another one"
            raise InputError(f"{function.name} {problem}")
        # Whether I(x_0) = 0 is decided exactly: in doubles a value that is 0 may be a rounding error.
        relative[function.name] = all(value != 0 for value in exact_values) and bool((values != 0.0).all())
        initial.append((values, np.abs(values) if relative[function.name] else np.ones_like(values)))
    return initial, relative


def _references(
    system: QuadraticSystem, starts: Sequence[Sequence[fmpq]], eps: fmpq, progress: Callable[[str], None]
) -> tuple[fmpq | None, FloatArray | None]:
    """Return a time in which each solution changes by about its own norm, and the solutions at this time.

    The time is a power of 2 times the time step, with the sign of eps. If no solution can be computed, both are None.
    """
    speeds = [max(abs(entry) for entry in system.over(QQ).value(start)) for start in starts]
    times = [max(abs(entry) for entry in x) / v for x, v in zip(starts, speeds, strict=True) if v != 0]
    if not times:
        return None, None
    step_ratio = min(times) / abs(2 * eps)
    time = 2 * eps * (1 << max(0, (int(step_ratio.p) // int(step_ratio.q)).bit_length() - 1))
    for _ in range(_MAX_HALVINGS):
        progress(f"the solution at time {format_number(time)}")
        end_points = [solution(system, start, time) for start in starts]
        if all(point is not None for point in end_points):
            return time, np.array([[float(ball.mid()) for ball in point or ()] for point in end_points])
        time /= 2
    return None, None


def _measure_errors(
    name: str,
    ensemble_of: Callable[[str, fmpq, int, int], FloatEnsemble],
    time: fmpq,
    eps: fmpq,
    references: FloatArray,
    progress: Callable[[str], None],
) -> tuple[tuple[StepError, ...], float | None]:
    """Return the errors at `time` by decreasing step size, and the measured order, None if it could not be measured."""
    errors: dict[int, StepError] = {}
    reference_size = float(np.abs(references).max())

    def measure(steps: int) -> StepError:
        half_step = time / (2 * steps)
        ensemble = ensemble_of(name, half_step, len(references), steps)
        ensemble.advance(steps)
        repeated = int(ensemble.near_singular.sum()) if name in IMPLICIT else 0
        evaluations = work(name, steps * len(references), repeated)[0] / len(references)
        error = float(np.abs(ensemble.x - references).max())  # NaN if an orbit ended early
        return StepError(half_step, steps, error, evaluations)

    slopes: list[float] = []
    for k in range(_MIN_LOG_STEPS, _MAX_LOG_STEPS + 1):
        steps = 1 << k
        errors[steps] = measure(steps)
        progress(f"{METHODS[name].title}: error with {steps} steps")
        error, previous = errors[steps].error, errors.get(steps // 2)
        if not np.isfinite(error):
            continue
        if error <= _ROUNDING_ERROR * reference_size * sqrt(steps):
            break
        if previous is not None and np.isfinite(previous.error):
            slopes.append(log2(previous.error / error))
        is_settled = len(slopes) >= 3 and max(abs(slopes[-1] - slope) for slope in slopes[-3:-1]) < _MAX_SLOPE_CHANGE
        if len(errors) >= _MIN_SIZES and is_settled and error < 0.01 * reference_size:
            break
    requested_steps = time / (2 * eps)
    steps = int(requested_steps.p)
    if requested_steps.q == 1 and steps not in errors and steps <= MAX_STEPS:
        errors[steps] = measure(steps)
    sorted_errors = [errors[steps] for steps in sorted(errors) if np.isfinite(errors[steps].error)]
    return tuple(sorted_errors), slopes[-1] if slopes else None


def _bin_edges(steps: int, linear: bool) -> NDArray[np.int64]:
    """Return the ends 0 = e_0 < e_1 < ... = steps of the bins; bin k contains the steps n with e_(k-1) < n <= e_k."""
    if steps <= BINS:
        return np.arange(steps + 1)
    ends = np.linspace(0, steps, BINS + 1) if linear else np.geomspace(1, steps, BINS)
    return np.unique(np.concatenate(([0], np.rint(ends).astype(np.int64), [steps])))


class _Bins:
    """The largest error in each bin of steps, updated when errors are added."""

    def __init__(self, edges: NDArray[np.int64]) -> None:
        self._bin_edges = edges
        self._largest = np.full(len(edges) - 1, -1.0)
        self._steps = np.zeros(len(edges) - 1, dtype=np.int64)
        self._undefined = 0
        self._last = float("nan")

    def add(self, first: int, errors: FloatArray) -> None:
        """Add `errors` (steps, orbits) at the steps `first`, `first` + 1, ...; NaN stands for undefined errors."""
        is_missing = ~np.isfinite(errors)
        self._undefined += int(is_missing.sum())
        errors = np.where(is_missing, -1.0, errors).max(axis=1)
        self._last = float(errors[-1]) if errors[-1] >= 0 else float("nan")
        bins = np.searchsorted(self._bin_edges, np.arange(first, first + len(errors))) - 1
        for rows in np.split(np.arange(len(errors)), np.flatnonzero(np.diff(bins)) + 1):
            row = rows[errors[rows].argmax()]
            if errors[row] > self._largest[bins[row]]:
                self._largest[bins[row]], self._steps[bins[row]] = errors[row], first + row

    def curve(self, method: str, function: str) -> DriftCurve:
        """Return the drift curve of the largest errors; empty bins are omitted."""
        is_used = self._largest >= 0
        return DriftCurve(method, function, self._steps[is_used], self._largest[is_used], self._undefined, self._last)
