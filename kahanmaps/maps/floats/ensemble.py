"""Ensembles of float orbits, which are advanced together.

There are two methods: "normal form", if a NormalForm of the system is given (see planar_blocks.py, which defines h, D
and chi), and "generic" for any map; steps.py defines a step. There are two kernels: "numpy", always available, and
"numba", machine code (the extra `fast`; machine_code.py). The results depend on method, kernel and initial points, but
not on the number of threads, or on the number of steps computed in one portion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.errors import InputError, counted
from kahanmaps.family.planar import NormalForm
from kahanmaps.hints import AttributeHints
from kahanmaps.maps.convention import either, resolve_eps
from kahanmaps.maps.floats.float_conversion import FloatArray, float_function, to_float, to_floats
from kahanmaps.maps.floats.planar_blocks import PlanarBlocks, planar_blocks, require_same_system
from kahanmaps.maps.floats.steps import (
    RUNNING,
    SINGULAR,
    STATUS,
    BatchState,
    RecordTable,
    advance_by_numpy,
    map_step,
    planar_step,
)
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import SystemLike, as_map
from kahanmaps.maps.kernels import choose_kernel, has_llvm
from kahanmaps.maps.orbits.iteration import OrbitEnd, require_steps
from kahanmaps.maps.values import start_rows
from kahanmaps.processes import processors
from kahanmaps.systems.quadratic import QuadraticSystem

SAMPLE_INTERVAL = 1000  # default number of steps from one sample of the integrals to the next
_MAX_SCALAR_ORBITS = 4  # up to this number of orbits, machine code advances one orbit after the other
_CHUNKS_PER_THREAD = 8  # more than one, since a thread is slower while another program occupies its core
_RECORDED_NUMBERS = 1_000_000  # number of coordinates in a portion of recorded points

# A function of one point; if it has a true attribute `of_arrays`, its argument is an array (n, dim) of n points.
Function = Callable[[Any], Any]
_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # probabilities of the quantiles in `distribution`


@dataclass(frozen=True, eq=False)
class Drift:
    """The drift of an integral, that is, the distance of its values from the initial value, with an entry per orbit.

    `initial` is the value at the initial point (complex for a block at a complex root, see planar_blocks.py). `largest`
    is the largest distance from `initial` at the sampled points, `last` the distance at the last sampled point (NaN if
    the orbit has ended). The distance of a value that is not finite is infinity.
    """

    name: str
    initial: NDArray[Any]
    largest: FloatArray
    last: FloatArray

    def of(self, orbit: int) -> Drift:
        """Return the drift of one orbit; its entries are numbers."""
        return Drift(self.name, self.initial[orbit], self.largest[orbit], self.last[orbit])


def distribution(values: NDArray[Any]) -> dict[str, float]:
    """Return the minimum, quantiles, maximum and mean of an array; quantiles are entries of it. {} if it is empty.

    >>> distribution(np.array([4.0, 1.0, 2.0, np.inf]))
    {'min': 1.0, '5%': 1.0, '25%': 1.0, '50%': 2.0, '75%': 4.0, '95%': inf, 'max': inf, 'mean': inf}
    """
    if not len(values):
        return {}
    quantiles = np.quantile(values, _QUANTILES, method="inverted_cdf").tolist()
    with np.errstate(over="ignore"):
        mean = float(values.mean())
    quantiles_by_name = {
        f"{100 * probability:g}%": float(value) for probability, value in zip(_QUANTILES, quantiles, strict=True)
    }
    return {"min": float(values.min()), **quantiles_by_name, "max": float(values.max()), "mean": mean}


class FloatEnsemble(AttributeHints):
    """The orbits of many initial points in double precision, advanced together.

    Args:
        system: a map, or a quadratic system, which stands for its Kahan map.
        eps: an exact number, half the time step.
        starts: the initial points, one per row: an array of floats, or a sequence of points with exact entries.
        backward: whether steps are taken by the inverse map.
        form: the normal form of the system; a step then takes a few operations for each pair of coordinates instead of
            an elimination, and loses fewer digits.
        kernel: "numpy" or "numba" (default: numba if installed).
        threads: the number of cores that numba may use (default: all).
        integrals: a dict {name: function}, such as `load(name).integrals`; each function has one point as argument, or
            is a rational function of the variables and eps. Its drift is measured at recorded points.
        sample_interval: the number of steps from one sample to the next, for the integrals of the normal form, and for
            `integrals` if no points are recorded.
        radius: if given, every step is examined, and for each orbit the first point with max |x_i| > radius is stored.

    >>> import numpy as np
    >>> top = QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"])
    >>> ensemble = FloatEnsemble(top, "1/10", np.array([[1.0, 0.5, 0.25], [1.0, 0.0, 0.0]]), kernel="numpy")
    >>> ensemble.advance(100)
    >>> ensemble.x[1], ensemble.status.tolist(), ensemble.kernel
    (array([1., 0., 0.]), ['completed', 'completed'], 'numpy generic')
    """

    def __init__(
        self,
        system: QuadraticSystem | MapFamily,
        eps: Any,
        starts: Any,
        *,
        backward: bool = False,
        form: NormalForm | None = None,
        kernel: str | None = None,
        threads: int | None = None,
        integrals: Mapping[str, Function] | None = None,
        sample_interval: int = SAMPLE_INTERVAL,
        radius: float | None = None,
    ) -> None:
        epsilon = rational(eps)
        if sample_interval < 1:
            raise InputError(f"found a sample every {sample_interval} steps, expected at least 1")
        self.system = as_map(system)
        if isinstance(starts, np.ndarray) and starts.dtype.kind in "fiu":
            self._starts = np.array(starts, dtype=np.float64, order="C")
        else:
            self._starts = np.array([to_floats(start) for start in starts], dtype=np.float64)
        shape = self._starts.shape
        if len(shape) != 2 or shape[1] != self.system.dim or not shape[0]:
            raise InputError(
                f"found initial points of shape {shape}, expected (n, {self.system.dim}): one row for each point, "
                f"with columns {', '.join(self.system.variables)}"
            )
        if not np.isfinite(self._starts).all():
            raise InputError("found an initial point with a coordinate that is not finite")
        if to_float(epsilon) == 0.0:
            raise InputError("eps rounds to 0 as a floating-point number: choose a larger eps")
        is_compiled = choose_kernel(kernel, is_long=True) == "numba" and has_llvm()
        if radius is not None and not radius > 0:
            raise InputError(f"found the radius {radius:g}, expected a number above 0")
        if threads is not None and threads < 1:
            raise InputError(f"found {threads} threads, expected at least 1")
        map_ = self.system.real_approximation
        map_over = map_.at(epsilon)
        self._matrix_name = map_over.denominator_name(backward)
        self._blocks: PlanarBlocks | None = None
        state = self._starts.T
        if form is not None:
            require_same_system(form, map_)
            self._blocks = planar_blocks(form, -epsilon if backward else epsilon)
            state = _multiply(self._blocks.x_to_state, state)
            self._initial_values = self._blocks.integrals(state)
            self._largest_drift = np.zeros(self._initial_values.shape)
        self._factors = (map_over.inverse if backward else map_over).factors
        self._build_step()
        self._batch = BatchState.of(state)
        is_compiled = is_compiled and self._step.careful_code is not None
        self._threads = (threads or processors()) if is_compiled else 1
        method = "generic" if form is None else "normal form"
        #: The kernel, the method and the number of threads, for example "numba normal form, 2 threads".
        self.kernel = f"numba {method}, {counted(self._threads, 'thread')}" if is_compiled else f"numpy {method}"
        self._is_compiled = is_compiled
        self._watched_functions = []
        for name, integral in (integrals or {}).items():
            function: Function = integral
            if isinstance(integral, RationalFunction):
                function = _float_integral(integral, to_float(epsilon))
            self._watched_functions.append(WatchedFunction(name, function, self._starts))
        self._sample_interval = sample_interval
        self._interrupted = False
        self._radius = radius
        self._escaped_at = np.full(self.n, -1)
        self._escaped_to = np.full(shape, np.nan)
        self.backward = backward
        self.step = 0
        self._record_escapes(0, self._starts[None])

    def _build_step(self) -> None:
        self._step = map_step(self._factors) if self._blocks is None else planar_step(self._blocks)
        self._machine_code: Any = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for `pickle` without the step, which is built and compiled again after loading."""
        return {name: value for name, value in vars(self).items() if name not in ("_step", "_machine_code")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._build_step()

    def __repr__(self) -> str:
        running_count = int((self._batch.status == RUNNING).sum())
        return f"<FloatEnsemble: {self.n} orbits after {counted(self.step, 'step')}, {running_count} completed>"

    @property
    def n(self) -> int:
        """The number of orbits."""
        return len(self._starts)

    @property
    def x(self) -> FloatArray:
        """The current points, an array (n, dim); NaN for orbits that have ended."""
        if self.step == 0:
            return self._starts.copy()
        x: FloatArray = self._points_of(self._batch.z[None].copy())[0]
        x[self._batch.status != RUNNING] = np.nan
        return x

    @property
    def status(self) -> NDArray[Any]:
        """The status of each orbit: "completed" (all steps so far were taken), "overflow" or "singular"."""
        names: NDArray[Any] = np.array(STATUS)[self._batch.status]
        return names

    @property
    def failed_at(self) -> NDArray[np.int64]:
        """The index of the first iterate that does not exist, for each orbit; -1 for orbits that have not ended."""
        return self._batch.failed_at.copy()

    @property
    def near_singular(self) -> NDArray[np.int64]:
        """The number of near-singular steps of each orbit (see steps.py)."""
        return self._batch.near_singular.copy()

    @property
    def near_singular_at(self) -> NDArray[np.int64]:
        """The index of the point before the first near-singular step of each orbit; -1 if there was no such step."""
        return self._batch.near_singular_at.copy()

    @property
    def escaped_at(self) -> NDArray[np.int64]:
        """The first step at which max |x_i| > radius, for each orbit; -1 if no such point was seen."""
        return self._escaped_at.copy()

    @property
    def escaped_to(self) -> FloatArray:
        """The points (n, dim) at the steps `escaped_at`; NaN for orbits without such a step."""
        return self._escaped_to.copy()

    def statistics(self) -> dict[str, dict[str, float]]:
        """Return distributions over the orbits: of the largest drift of each integral, and of the escape steps.

        The drift distributions (keys: the names of the integrals) are over the orbits that completed their steps.
        With a radius, "escape step" is the distribution of `escaped_at` over the escaped orbits. See `distribution`.
        """
        is_complete = self._batch.status == RUNNING
        results = {drift.name: distribution(drift.largest[is_complete]) for drift in self.drift}
        if self._radius is not None:
            results["escape step"] = distribution(self._escaped_at[self._escaped_at >= 0])
        return results

    @property
    def drift(self) -> tuple[Drift, ...]:
        """The drift of h/(1 + eps^2 D) for each planar block (planar_blocks.py), and of each of `integrals`."""
        drifts = []
        if self._blocks is not None:
            current_drift = self._blocks.distances(self._batch.z, self._initial_values)
            current_drift[:, self._batch.status != RUNNING] = np.nan
            largest = np.fmax(self._largest_drift, current_drift)
            for r, label in enumerate(self._blocks.labels):
                values = self._initial_values[r]
                initial: NDArray[Any] = (values.real if r < self._blocks.real_count else values).copy()
                drifts.append(Drift(f"h/(1 + eps^2 D) at t = {label}", initial, largest[r], current_drift[r]))
        return (*drifts, *(function.drift for function in self._watched_functions))

    def end(self, orbit: int) -> OrbitEnd:
        """Return how one orbit has ended."""
        code, last = int(self._batch.status[orbit]), int(self._batch.failed_at[orbit]) - 1
        if code == RUNNING:
            return OrbitEnd("completed", self.step, counted(self.step, "step"))
        if code == SINGULAR:
            return OrbitEnd("singular", last, f"{self._matrix_name} is singular in floating point at step {last}")
        return OrbitEnd("overflow", last, f"step {last + 1} leaves the range of floating-point numbers")

    def interrupt(self) -> None:
        """Stop `advance` or `records` after the current or the next portion; safe to call from a signal handler."""
        self._interrupted = True

    def advance(self, steps: int, *, progress: Callable[[int], None] | None = None) -> None:
        """Take `steps` steps; `progress` is called with the current step about ten times a second."""
        require_steps(steps)
        if self._watched_functions or self._radius is not None:
            for _ in self.records(steps, self._sample_interval, progress=progress):
                pass
            for watched in self._watched_functions:
                watched.observe(self.x[None])
            return
        for _ in self._record_steps(steps, 0, progress):
            pass

    def records(self, steps: int, every: int, *, progress: Callable[[int], None] | None = None) -> Iterator[FloatArray]:
        """Take `steps` steps lazily, and yield the points at multiples of `every` in portions, arrays (count, n, dim).

        The initial points are included; points after the end of an orbit are NaN.
        """
        require_steps(steps)
        require_every(every)
        if self.step == 0:
            for function in self._watched_functions:
                function.observe(self._starts[None])
            yield self._starts[None].copy()
        else:
            yield np.empty((0, self.n, self.system.dim))
        for record in self._record_steps(steps, every if self._radius is None else 1, progress):
            if len(record):
                x = self._points_of(record)
                if self._radius is not None:
                    first_step = self.step - len(x) + 1
                    self._record_escapes(first_step, x)
                    x = x[-first_step % every :: every]
                for function in self._watched_functions:
                    function.observe(x)
                if len(x):
                    yield x

    def _record_escapes(self, first_step: int, x: FloatArray) -> None:
        """Store for each orbit the first point outside the radius among the steps first_step, first_step + 1, ..."""
        if self._radius is None:
            return
        inside_orbits = np.flatnonzero(self._escaped_at < 0)
        with np.errstate(invalid="ignore"):
            is_outside = np.abs(x[:, inside_orbits]).max(axis=2) > self._radius
        escaping_indices = np.flatnonzero(is_outside.any(axis=0))
        indices = is_outside[:, escaping_indices].argmax(axis=0)
        orbits = inside_orbits[escaping_indices]
        self._escaped_at[orbits], self._escaped_to[orbits] = first_step + indices, x[indices, orbits]

    def _record_steps(self, steps: int, every: int, progress: Callable[[int], None] | None) -> Iterator[FloatArray]:
        """Take steps in portions of about 0.1 s, and yield the states at multiples of `every` (0: no states)."""
        batch, last_step, rows = self._batch, self.step + steps, self._step.rows
        # Rough estimates of the seconds per step; with numpy, only a part is proportional to the number of orbits.
        if self._is_compiled:
            speed = 8e9 if self.n > _MAX_SCALAR_ORBITS else 1.5e9
            seconds = self.n * self._step.operations / speed / self._threads
        else:
            seconds = self._step.operations * (1e-6 + self.n * 1e-9)
        portion_steps = max(1, int(0.1 / seconds))
        intervals = [every, 0 if self._blocks is None else self._sample_interval]
        for interval in filter(None, intervals):
            portion_steps = min(portion_steps, interval * max(1, _RECORDED_NUMBERS // (self.n * rows)))
        if self._is_compiled and self._machine_code is None and self.step < last_step:
            from kahanmaps.maps.floats.machine_code import MachineCode

            width = 1 if self.n <= _MAX_SCALAR_ORBITS else 32 if rows <= 2 else 16 if rows <= 8 else 8
            self._machine_code = MachineCode(self._step, width)
        chunk_size = self.n if self._threads == 1 else -(-self.n // (self._threads * _CHUNKS_PER_THREAD * 64)) * 64
        chunk_starts = range(0, self.n, chunk_size)
        while self.step < last_step:
            first_step, count = self.step, min(portion_steps, last_step - self.step)
            tables = []
            for interval in intervals:
                record_count = (first_step + count) // interval - first_step // interval if interval else 0
                tables.append(RecordTable(interval, np.empty((record_count, rows, self.n))))
            nonempty_tables = [table for table in tables if len(table.states)]
            if self._is_compiled:

                def advance(
                    start: int, first_step: int = first_step, count: int = count, nonempty_tables: Any = nonempty_tables
                ) -> None:
                    self._machine_code.advance(
                        batch, start, min(self.n, start + chunk_size), first_step, count, nonempty_tables
                    )

                with ThreadPoolExecutor(self._threads) if len(chunk_starts) > 1 else nullcontext() as pool:
                    list(map(advance, chunk_starts) if pool is None else pool.map(advance, chunk_starts))
            else:
                advance_by_numpy(self._step, batch, first_step, count, nonempty_tables)
            self.step = first_step + count
            for interval, states in tables:  # states after the end of an orbit become NaN
                if len(states) and (batch.status != RUNNING).any():
                    recorded_steps = (first_step // interval + 1 + np.arange(len(states))) * interval
                    after_end = (batch.failed_at >= 0) & (recorded_steps[:, None] >= batch.failed_at)
                    states.transpose(0, 2, 1)[after_end] = np.nan
            if self._blocks is not None and len(tables[1].states):
                states = tables[1].states.transpose(1, 0, 2)
                distances = self._blocks.distances(states, self._initial_values[:, None])
                distances[:, np.isnan(states).any(axis=0)] = 0.0
                np.maximum(self._largest_drift, distances.max(axis=1), out=self._largest_drift)
            yield tables[0].states
            if progress is not None:
                progress(self.step)
            if self._interrupted:
                break
        self._interrupted = False

    def _points_of(self, record: FloatArray) -> FloatArray:
        """Return the points of n orbits, an array (records, n, dim), from their states, an array (records, rows, n)."""
        records, _, n = record.shape
        if self._blocks is None:
            return np.ascontiguousarray(record.transpose(0, 2, 1))
        if n == 1:  # a product of contiguous arrays is fastest
            record = np.ascontiguousarray(record[:, :, 0].T)[None]
        x = _multiply(self._blocks.state_to_x, record)
        return np.ascontiguousarray(x.transpose(0, 2, 1)).reshape(records, n, self.system.dim)


class WatchedFunction:
    """A function of points, and its drift from its values at the initial points."""

    def __init__(self, name: str, function: Function, starts: FloatArray) -> None:
        self.name = name
        self._function = function
        self._initial = self._values(starts)
        self._largest = np.zeros(len(starts))
        self._last = np.zeros(len(starts))

    def observe(self, x: FloatArray) -> None:
        """Update the drift with points (count, n, dim); points with NaN are skipped."""
        for points in x:
            is_finite = ~np.isnan(points).any(axis=1)
            self._last[~is_finite] = np.nan
            distance = np.abs(self._values(points[is_finite]) - self._initial[is_finite])
            distance[np.isnan(distance)] = np.inf
            self._last[is_finite] = distance
            self._largest[is_finite] = np.maximum(self._largest[is_finite], distance)

    @property
    def drift(self) -> Drift:
        """The drift at the points observed so far."""
        return Drift(self.name, self._initial.copy(), self._largest.copy(), self._last.copy())

    def _values(self, points: FloatArray) -> FloatArray:
        if getattr(self._function, "of_arrays", False):
            return np.asarray(self._function(points), dtype=np.float64)
        values = (self._function(point) for point in points.tolist())
        return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _float_integral(function: RationalFunction, eps: float) -> Function:
    in_floats, has_eps = float_function(function), function.names[-1:] == ("eps",)
    return lambda x: in_floats([*x, eps] if has_eps else x)


def ensemble(
    system: SystemLike,
    starts: Any = None,
    eps: Any = None,
    steps: int | None = None,
    *,
    x0: Any = None,
    time_step: Any = None,
    h: Any = None,
    n: int | None = None,
    backward: bool = False,
    form: NormalForm | None = None,
    kernel: str | None = None,
    threads: int | None = None,
    integrals: Mapping[str, Function] | None = None,
    sample_interval: int = SAMPLE_INTERVAL,
    radius: float | None = None,
) -> FloatEnsemble:
    """Return the float orbits of many initial points after `steps` steps.

    The arguments are those of `FloatEnsemble`; `x0` is another name of `starts`, `n` of `steps`, and `time_step` or `h`
    give 2 eps. A text for `starts` describes a grid, as "x=-1:1:20, y=1/2", or points on a line, as "0,0:1,2:50".
    Raises InputError for a negative number of steps and for invalid arguments.

    >>> top = QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"])
    >>> ensemble(top, [[1, 0, 0], [0, "1/2", 0]], "1/10", 100, kernel="numpy").x.tolist()
    [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]
    >>> spin = ensemble(top, "x=1/4:1:4, y=1/2, z=1/3", "1/10", 100, integrals={"x": lambda x: x[0]}, kernel="numpy")
    >>> {name: round(value, 3) for name, value in spin.statistics()["x"].items() if name in ("min", "50%", "max")}
    {'min': 0.018, '50%': 0.06, 'max': 0.566}
    """
    starts, steps = either(starts=starts, x0=x0), either(steps=steps, n=n)
    if starts is None:
        raise InputError("found no initial points, expected x0=, an array of shape (points, dimension)")
    require_steps(steps)
    options: dict[str, Any] = {"backward": backward, "form": form, "kernel": kernel, "threads": threads}
    epsilon = resolve_eps(eps, time_step, h, floats=True)
    map_ = as_map(system)
    options |= {"integrals": integrals, "sample_interval": sample_interval, "radius": radius}
    result = FloatEnsemble(map_, epsilon, start_rows(starts, map_.variables), **options)
    if steps:
        result.advance(steps)
    return result


def require_every(every: int) -> None:
    """Raise InputError unless every >= 1."""
    if every < 1:
        raise InputError(f"found a record every {every} steps, expected at least 1")


def _multiply(matrix: FloatArray, columns: FloatArray) -> FloatArray:
    """Return matrix @ columns, for columns of shape (..., rows, n), with each sum taken from left to right.

    BLAS is not used, since its order of summation depends on the shapes of the arrays.
    """
    with np.errstate(all="ignore"):  # an overflow is reported as a status, not as a warning
        total: FloatArray = matrix[:, :1] * columns[..., :1, :]
        for j in range(1, matrix.shape[1]):
            total += matrix[:, j, None] * columns[..., j : j + 1, :]
    return total
