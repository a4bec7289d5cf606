"""Float orbits: the Kahan map in machine numbers.

A second implementation, apart from the exact one and tested against it. The only road from exact numbers to machine
numbers is `to_floats`. What users need is gathered here; the parts are the modules float_*.py: `float_steps` says what
a step is, `float_blocks` what the normal form is in doubles, `float_numpy` and `float_numba` are the kernels,
`float_ensemble` advances many orbits, `float_stream` writes them to disk.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.errors import InputError
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.floats.doubles import FloatArray, to_float, to_floats
from kahanmaps.maps.floats.ensemble import (
    SAMPLED,
    Drift,
    FloatEnsemble,
    Function,
    Stepping,
    Watched,
    block_drifts,
    end_of,
    require_every,
)
from kahanmaps.maps.floats.steps import RUNNING
from kahanmaps.maps.floats.stream import NpyFile
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.orbits import OrbitEnd, require_steps
from kahanmaps.systems.quadratic import QuadraticSystem

__all__ = [
    "Drift",
    "FloatArray",
    "FloatEnsemble",
    "FloatOrbit",
    "float_function",
    "stream_orbit",
    "to_float",
    "to_floats",
]


class FloatOrbit:
    """The orbit of `start` in double precision: iterate once over (step, x), then look at `end`.

    `start` holds exact numbers, `eps` is half the time step, `steps` how many steps to take (None: no limit), `every`
    says which of them are delivered, `backward` steps by the inverse map. With `form`, the normal form of the system,
    steps are much faster and lose fewer digits. `kernel` is "numpy" or "numba"; by default numba, if it is installed,
    for more than 100,000 steps: it makes no difference to the numbers. Points are computed some ahead of the one
    delivered; what the attributes say about near-singular steps and drift is about what was computed. See FloatEnsemble
    for many orbits and for `integrals` and `sampled`.

    >>> orbit = FloatOrbit(QuadraticSystem.from_text(["x"], ["x"]), "1/2", [1], 4, every=2)
    >>> [(step, float(x[0])) for step, x in orbit]
    [(0, 1.0), (2, 9.0), (4, 81.0)]
    >>> orbit.end.status, orbit.kernel
    ('completed', 'numpy generic')
    """

    def __init__(
        self,
        system: QuadraticSystem | BirationalMap,
        eps: Any,
        start: Sequence[Any],
        steps: int | None,
        *,
        backward: bool = False,
        form: NormalForm | None = None,
        kernel: str | None = None,
        every: int = 1,
        integrals: Mapping[str, Function] | None = None,
        sampled: int = SAMPLED,
    ) -> None:
        require_steps(steps)
        require_every(every)
        if len(start) != system.dim:
            raise InputError(
                f"found a point with {len(start)} coordinates, expected {system.dim}: {', '.join(system.variables)}"
            )
        epsilon = rational(eps)
        self.start = to_floats(start)
        self.steps = steps
        self.every = every
        self.backward = backward
        self.dim = system.dim
        self.end: OrbitEnd | None = None
        self._stepping = Stepping(
            system,
            epsilon,
            backward=backward,
            form=form,
            kernel=kernel,
            long=steps is None or steps > _LONG,
        )
        self._lanes = self._stepping.lanes(self.start[None])
        self._watched = [Watched(name, function, self.start[None]) for name, function in (integrals or {}).items()]
        self._sampled = sampled
        self._interrupted = False

    @property
    def kernel(self) -> str:
        """What computes: "numpy generic", "numba normal form, 1 thread"."""
        return self._stepping.name

    @property
    def near_singular(self) -> int:
        """How many near-singular steps were taken (see steps.py), counted for each block."""
        return int(self._lanes.near[0])

    @property
    def near_singular_at(self) -> int | None:
        """The index of the point from which the first of them was taken."""
        return int(self._lanes.near_at[0]) if self._lanes.near[0] else None

    @property
    def drift(self) -> tuple[Drift, ...]:
        """Of the block integrals h/(1 + eps^2 D), by root of chi, and of the functions that are watched."""
        drifts = (*block_drifts(self._stepping, self._lanes), *(watched.drift for watched in self._watched))
        return tuple(drift.of(0) for drift in drifts)

    def interrupt(self) -> None:
        """Ask a running orbit to end after the step in flight."""
        self._interrupted = True

    def __iter__(self) -> Iterator[tuple[int, FloatArray]]:
        reached = 0
        for step, points in self._portions(_AHEAD):
            first = reached // self.every * self.every + self.every if step else 0
            for row, x in enumerate(points):
                reached = first + row * self.every
                yield reached, x
                if self._interrupted:
                    self.end = OrbitEnd("interrupted", reached, f"interrupted after step {reached}")
                    return
            reached = step

    def portions(self) -> Iterator[tuple[int, FloatArray]]:
        """The same in portions: the step reached, and the points (count, dim) delivered on the way."""
        return self._portions(None)

    def _portions(self, ahead: int | None) -> Iterator[tuple[int, FloatArray]]:
        """With `ahead`, the first portions are short: as many points as have been asked for already, up to `ahead`."""
        stepping, lanes, every = self._stepping, self._lanes, self.every
        for watched in self._watched:
            watched.look(self.start[None, None])
        yield 0, self.start[None].copy()
        step, rows = 0, 1
        while (self.steps is None or step < self.steps) and lanes.status[0] == RUNNING:
            if self._interrupted:
                self.end = OrbitEnd("interrupted", step, f"interrupted after step {step}")
                return
            piece = stepping.piece(1)
            stop = step + min(piece, every * rows if ahead else max(1, 200_000 // self.dim) * every)
            stop = stop if self.steps is None else min(stop, self.steps)
            record = np.empty((stop // every - step // every, len(lanes.z), 1))
            stepping.advance(lanes, step, stop - step, every, self._sampled, record)
            x = stepping.points(record)
            if lanes.status[0] != RUNNING:
                x = x[: (int(lanes.failed_at[0]) - 1) // every - step // every]
            for watched in self._watched:
                watched.look(x)
            step = stop
            yield step, x[:, 0]
            if ahead:
                rows = min(2 * rows, ahead)
        self.end = end_of(lanes, 0, step, stepping.matrix_name)


_LONG = 100_000  # steps, from which on loading compiled code pays
_AHEAD = 4096  # points


class _Floats:
    """Machine numbers, as far as evaluating a rational function, and printing a point, need a field."""

    zero = 0.0
    one = 1.0

    @staticmethod
    def convert(value: Any) -> float:
        return to_float(rational(value))

    @staticmethod
    def is_zero(value: float) -> bool:
        return value == 0.0

    @staticmethod
    def format(value: float) -> str:
        return repr(value)

    @staticmethod
    def working() -> AbstractContextManager[None]:
        return nullcontext()


FLOATS: Any = _Floats()


def float_function(function: RationalFunction) -> Callable[[Sequence[float]], float | None]:
    """The rational function in double precision; None where the denominator is 0 or the value is no finite number."""

    def value(point: Sequence[float]) -> float | None:
        try:
            found: float | None = function.value(_Floats, point)
        except (OverflowError, ZeroDivisionError):
            return None
        return found if found is not None and isfinite(found) else None

    return value


def stream_orbit(orbit: FloatOrbit, path: str | Path, *, progress: Callable[[int], None] | None = None) -> OrbitEnd:
    """Walk an orbit into a .npy file of shape (points, dim): the start and every `orbit.every`-th iterate.

    `progress` is called with the index of the step reached, about ten times a second; `orbit.interrupt()` ends the walk
    after the portion in hand.
    """
    with NpyFile(path, (orbit.dim,)) as file:
        for step, x in orbit.portions():
            file.append(x)
            if progress is not None:
                progress(step)
    if orbit.end is None:
        raise AssertionError("an orbit has run out of portions without an end")
    return orbit.end
