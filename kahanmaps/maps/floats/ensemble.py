"""Many float orbits at once, and the choice of the kernel that computes them.

Two methods: "normal form" where a NormalForm of the system is given (blocks.py), "generic" elimination for any
quadratic system. Two kernels: numpy, always there, and numba (the extra `fast`). Method, kernel and start settle the
numbers; threads, and the way steps are portioned, only settle how fast they come (steps.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError, counted
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.floats.advance import NOTHING, Engine, Kept, Word
from kahanmaps.maps.floats.blocks import planar_blocks, require_same_system
from kahanmaps.maps.floats.doubles import FloatArray, to_float, to_floats
from kahanmaps.maps.floats.steps import (
    RUNNING,
    SINGULAR,
    STATUS,
    GenericEquation,
    Lanes,
    PlanarRows,
    generic_equation,
)
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.kahan import as_map
from kahanmaps.maps.kernels import choose_kernel
from kahanmaps.maps.orbits.iteration import OrbitEnd, require_steps
from kahanmaps.processes import processors
from kahanmaps.systems.quadratic import QuadraticSystem

SAMPLED = 1000  # steps between samples of the block integrals

Function = Callable[[Sequence[float]], float | None]


@dataclass(frozen=True, eq=False)
class Drift:
    """How far an integral has moved, one entry an orbit.

    `initial` is the value at the start (complex at a complex root of chi), `largest` the largest distance from it at
    the points looked at, `last` the distance at the last of them (NaN where the orbit has ended). A value that is no
    finite number counts as infinitely far.
    """

    name: str
    initial: NDArray[Any]
    largest: FloatArray
    last: FloatArray

    def of(self, orbit: int) -> Drift:
        """The same for one orbit, each entry a number."""
        return Drift(self.name, self.initial[orbit], self.largest[orbit], self.last[orbit])


class Stepping:
    """A map, eps and a method, with the kernel that advances lanes: what orbits and ensembles are made of.

    A system stands for its Kahan map.

    `kernel` is "numpy", "numba" or None: numba if it is installed.
    """

    def __init__(
        self,
        system: QuadraticSystem | BirationalMap,
        eps: fmpq,
        *,
        backward: bool,
        form: NormalForm | None,
        kernel: str | None,
        threads: int | None = 1,
    ) -> None:
        if to_float(eps) == 0.0:
            raise InputError("eps is 0 in machine numbers, and the Kahan map the identity: take a larger eps")
        compiled = choose_kernel(kernel, long=True) == "numba"
        if threads is not None and threads < 1:
            raise InputError(f"found {threads} threads, expected at least 1")
        map_ = as_map(system).rounded
        map_over = map_.at(eps)
        self._map = map_over.inverse if backward else map_over
        self.matrix_name = map_over.denominator_name(backward)
        self.dim = system.dim
        self.rows: PlanarRows | None = None
        if form is not None:
            require_same_system(form, map_)
            self.rows = PlanarRows(planar_blocks(form, -eps if backward else eps))
        self.compiled = compiled
        self.threads = (threads or processors()) if compiled else 1
        method = "generic" if form is None else "normal form"
        self.name = f"numba {method}, {counted(self.threads, 'thread')}" if compiled else f"numpy {method}"
        self._engine = self._made()

    def __getstate__(self) -> dict[str, Any]:
        """For `pickle`: compiled code and its working arrays are made anew."""
        return {name: value for name, value in vars(self).items() if name != "_engine"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._engine = self._made()

    def _made(self) -> Engine:
        planar: Callable[[PlanarRows], Engine]
        generic: Callable[[GenericEquation], Engine]
        if self.compiled:
            from kahanmaps.maps.floats.numba_kernel import generic_numba as generic
            from kahanmaps.maps.floats.numba_kernel import planar_numba as planar
        else:
            from kahanmaps.maps.floats.numpy_kernel import GenericNumpy as generic
            from kahanmaps.maps.floats.numpy_kernel import PlanarNumpy as planar
        if self.rows is not None:
            engine = planar(self.rows)
        else:
            engines = [generic(generic_equation(one)) for one in self._map.factors]
            engine = engines[0] if len(engines) == 1 else Word(engines)
        engine.threads = self.threads
        return engine

    def lanes(self, starts: FloatArray) -> Lanes:
        """Lanes at the starts, an array (n, dim) of finite numbers."""
        if self.rows is None:
            return Lanes.of(np.ascontiguousarray(starts.T))
        lanes = Lanes.of(_product(self.rows.into, starts.T), len(self.rows.blocks.kinds))
        lanes.base[:] = self.rows.integrals(lanes.z)
        return lanes

    def advance(
        self, lanes: Lanes, first: int, steps: int, every: int, sampled: int, record: FloatArray | None = None
    ) -> None:
        """Take all lanes `steps` steps from the index `first`, with states at multiples of `every` in `record`.

        The distances of the block integrals from the start are looked at every `sampled` steps.
        """
        kept = NOTHING if record is None else Kept(every, record, first // every)
        self._engine.advance(lanes, first, steps, kept, 0 if self.rows is None else sampled)

    def points(self, record: FloatArray) -> FloatArray:
        """The points x (count, n, dim) of recorded states (count, rows, n)."""
        count, _, n = record.shape
        if self.rows is None:
            return np.ascontiguousarray(record.transpose(0, 2, 1))
        if n == 1:  # numbers side by side are multiplied fastest
            record = np.ascontiguousarray(record[:, :, 0].T)[None]
        x = _product(self.rows.blocks.out, record, self.rows.places)
        return np.ascontiguousarray(x.transpose(0, 2, 1)).reshape(count, n, self.dim)

    def piece(self, n: int) -> int:
        """How many steps of n lanes take about a tenth of a second."""
        # row steps a second, roughly, of one core
        planar = self.rows is not None
        speed = 1e10 if self.compiled and planar else 8e8 if self.compiled else 1e8 if n > 64 else 1e6
        work = n * self.dim * (1 if planar else len(self._map.factors) * self.dim**2 / 8)
        return max(1, int(0.1 * speed * self.threads / work))


def starts_in_box(count: int, dim: int, size: float, seed: int) -> FloatArray:
    """Starts (count, dim) drawn uniformly from -size to size, the same ones for the same seed.

    >>> starts_in_box(2, 1, 1.0, seed=0).tolist()
    [[0.2739233746429086], [-0.4604265724722594]]
    """
    starts: FloatArray = (2 * np.random.default_rng(seed).random((count, dim)) - 1) * size
    return starts


class FloatEnsemble:
    """Orbits of many starts in double precision, advanced together.

    `starts` is an array of machine numbers, or a sequence of points with exact entries, one point a row. `eps` is
    exact, half the time step; `backward` steps by the inverse map. With `form`, the normal form of the system, a step
    costs a few operations for each pair of coordinates instead of an elimination, and loses fewer digits. `kernel` is
    "numpy" or "numba" (default: numba if installed), `threads` how many cores numba may use (default: all). `integrals`
    are functions of a point, watched at recorded points. The block integrals of the normal form are sampled at every
    multiple of `sampled` steps.

    >>> import numpy as np
    >>> top = QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"])
    >>> ensemble = FloatEnsemble(top, "1/10", np.array([[1.0, 0.5, 0.25], [1.0, 0.0, 0.0]]), kernel="numpy")
    >>> ensemble.advance(100)
    >>> ensemble.x[1], ensemble.status.tolist(), ensemble.kernel
    (array([1., 0., 0.]), ['completed', 'completed'], 'numpy generic')
    """

    def __init__(
        self,
        system: QuadraticSystem | BirationalMap,
        eps: Any,
        starts: Any,
        *,
        backward: bool = False,
        form: NormalForm | None = None,
        kernel: str | None = None,
        threads: int | None = None,
        integrals: Mapping[str, Function] | None = None,
        sampled: int = SAMPLED,
    ) -> None:
        epsilon = rational(eps)
        if sampled < 1:
            raise InputError(f"found a sample every {sampled} steps, expected at least 1")
        system = as_map(system)
        self._starts = _points(starts, system)
        self._stepping = Stepping(system, epsilon, backward=backward, form=form, kernel=kernel, threads=threads)
        self._lanes = self._stepping.lanes(self._starts)
        self._watched = [Watched(name, function, self._starts) for name, function in (integrals or {}).items()]
        self._sampled = sampled
        self._interrupted = False
        self.system = system
        self.backward = backward
        self.step = 0

    @property
    def kernel(self) -> str:
        """What computes: "numba normal form, 2 threads"."""
        return self._stepping.name

    @property
    def n(self) -> int:
        """The number of orbits."""
        return len(self._starts)

    @property
    def x(self) -> FloatArray:
        """The present points (n, dim), NaN for orbits that have ended."""
        if self.step == 0:
            return self._starts.copy()
        x: FloatArray = self._stepping.points(self._lanes.z[None])[0]
        x[self._lanes.status != RUNNING] = np.nan
        return x

    @property
    def status(self) -> NDArray[Any]:
        """One word an orbit: "completed" (all its steps so far), "overflow" or "singular"."""
        words: NDArray[Any] = np.array(STATUS)[self._lanes.status]
        return words

    @property
    def failed_at(self) -> NDArray[np.int64]:
        """The index of the first iterate that does not exist, -1 for orbits that have not ended."""
        return self._lanes.failed_at.copy()

    @property
    def near_singular(self) -> NDArray[np.int64]:
        """How many near-singular steps each orbit has taken (see steps.py), counted for each block."""
        return self._lanes.near.copy()

    @property
    def near_singular_at(self) -> NDArray[np.int64]:
        """The index of the point from which the first near-singular step was taken, -1 where there was none."""
        return self._lanes.near_at.copy()

    @property
    def drift(self) -> tuple[Drift, ...]:
        """Of the block integrals h/(1 + eps^2 D), by root of chi, and of the functions that are watched."""
        return (*block_drifts(self._stepping, self._lanes), *(watched.drift for watched in self._watched))

    def end(self, orbit: int) -> OrbitEnd:
        """How one orbit stands, in the words of single orbits."""
        return end_of(self._lanes, orbit, self.step, self._stepping.matrix_name)

    def interrupt(self) -> None:
        """Ask `advance` or `records` to return after the portion in hand (safe to call from a signal handler)."""
        self._interrupted = True

    def advance(self, steps: int, *, progress: Callable[[int], None] | None = None) -> None:
        """Take `steps` steps; `progress` is called with the number of steps taken so far, about ten times a second."""
        require_steps(steps)
        for _ in self._recorded(steps, 0, progress):
            pass

    def records(self, steps: int, every: int, *, progress: Callable[[int], None] | None = None) -> Iterator[FloatArray]:
        """The points at multiples of `every`, the start among them, in portions (count, n, dim); NaN after the end.

        They are computed as they are asked for, `steps` steps in all.
        """
        require_steps(steps)
        require_every(every)
        if self.step == 0:
            for watched in self._watched:
                watched.look(self._starts[None])
            yield self._starts[None].copy()
        else:
            yield np.empty((0, self.n, self.system.dim))
        for record in self._recorded(steps, every, progress):
            if record is not None:
                x = self._stepping.points(record)
                for watched in self._watched:
                    watched.look(x)
                yield x

    def _recorded(self, steps: int, every: int, progress: Callable[[int], None] | None) -> Iterator[FloatArray | None]:
        self._interrupted = False
        stepping, lanes, stop = self._stepping, self._lanes, self.step + steps
        for first, count, rows in portions(stepping, self.n, self.step, stop, every):
            record = np.empty((rows, len(lanes.z), self.n)) if rows else None
            stepping.advance(lanes, first, count, every, self._sampled, record)
            self.step = first + count
            yield record
            if progress is not None:
                progress(self.step)
            if self._interrupted:
                return


def portions(stepping: Stepping, n: int, step: int, stop: int, every: int) -> Iterator[tuple[int, int, int]]:
    """First index, steps and recorded rows of portions that take a tenth of a second and some megabytes."""
    piece = stepping.piece(n)
    if every:
        piece = min(piece, every * max(1, 1_000_000 // (n * stepping.dim)))
    while step < stop:
        count = min(piece, stop - step)
        yield step, count, (step + count) // every - step // every if every else 0
        step += count


class Watched:
    """A function of points, and how far it has moved from its value at the starts."""

    def __init__(self, name: str, function: Function, starts: FloatArray) -> None:
        self.name = name
        self._function = function
        self._initial = self._values(starts)
        self._largest = np.zeros(len(starts))
        self._last = np.zeros(len(starts))

    def look(self, x: FloatArray) -> None:
        """Take notice of points (count, n, dim); those with NaN are passed over."""
        for points in x:
            there = ~np.isnan(points).any(axis=1)
            self._last[~there] = np.nan
            distance = np.abs(self._values(points[there]) - self._initial[there])
            distance[np.isnan(distance)] = np.inf
            self._last[there] = distance
            self._largest[there] = np.maximum(self._largest[there], distance)

    @property
    def drift(self) -> Drift:
        """What was seen."""
        return Drift(self.name, self._initial.copy(), self._largest.copy(), self._last.copy())

    def _values(self, points: FloatArray) -> FloatArray:
        found = (self._function(point) for point in points.tolist())
        return np.array([np.nan if value is None else value for value in found], dtype=np.float64)


def ensemble(
    given: QuadraticSystem | BirationalMap, /, starts: Any, eps: Any, steps: int = 0, **options: Any
) -> FloatEnsemble:
    """The float orbits of many starts after `steps` steps; the arguments are those of `FloatEnsemble`.

    Raises InputError for a number of steps that is negative, and what `FloatEnsemble` refuses.

    >>> top = QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"])
    >>> ensemble(top, [[1, 0, 0], [0, "1/2", 0]], "1/10", 100, kernel="numpy").x.tolist()
    [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]
    """
    require_steps(steps)
    found = FloatEnsemble(given, eps, starts, **options)
    if steps:
        found.advance(steps)
    return found


def block_drifts(stepping: Stepping, lanes: Lanes) -> Iterator[Drift]:
    """The drift of every block integral h/(1 + eps^2 D), up to now."""
    if stepping.rows is None:
        return
    blocks = stepping.rows.blocks
    now = stepping.rows.distances(lanes.z, lanes.base)
    now[:, lanes.status != RUNNING] = np.nan
    largest = np.fmax(lanes.largest, now)
    for r, label in enumerate(blocks.labels):
        initial: NDArray[Any] = lanes.base[r, 0].copy()
        if r >= blocks.reals:
            initial = initial + 1j * lanes.base[r, 1]
        yield Drift(f"h/(1 + eps^2 D) at t = {label}", initial, largest[r], now[r])


def end_of(lanes: Lanes, orbit: int, step: int, matrix: str) -> OrbitEnd:
    """How an orbit that has been asked for `step` steps stands; `matrix` is the name of that of the equation."""
    code, last = int(lanes.status[orbit]), int(lanes.failed_at[orbit]) - 1
    if code == RUNNING:
        return OrbitEnd("completed", step, counted(step, "step"))
    if code == SINGULAR:
        return OrbitEnd("singular", last, f"{matrix} is singular in machine numbers at step {last}")
    return OrbitEnd("overflow", last, f"step {last + 1} leaves the range of machine floats")


def require_every(every: int) -> None:
    """Raises InputError unless every >= 1."""
    if every < 1:
        raise InputError(f"found a record every {every} steps, expected at least 1")


def _points(starts: Any, system: QuadraticSystem | BirationalMap) -> FloatArray:
    if isinstance(starts, np.ndarray) and starts.dtype.kind in "fiu":
        points = np.array(starts, dtype=np.float64, order="C")
    else:
        points = np.array([to_floats(start) for start in starts], dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != system.dim or not len(points):
        raise InputError(
            f"found starts of shape {points.shape}, expected (n, {system.dim}): one row for each start, with columns "
            f"{', '.join(system.variables)}"
        )
    if not np.isfinite(points).all():
        raise InputError("found a start that is no finite number")
    return points


def _product(matrix: FloatArray, columns: FloatArray, places: Sequence[int] | None = None) -> FloatArray:
    """matrix columns (..., rows, n), every sum from left to right: BLAS orders them by the shape of the arrays.

    `places` says which row stands where, if they are in another order.
    """
    first, *rest = range(matrix.shape[1]) if places is None else places
    with np.errstate(all="ignore"):  # what leaves the range of doubles is a status, not a warning
        total: FloatArray = matrix[:, :1] * columns[..., first : first + 1, :]
        for j, place in enumerate(rest, 1):
            total += matrix[:, j, None] * columns[..., place : place + 1, :]
    return total
