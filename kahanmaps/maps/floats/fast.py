"""Float orbits: the Kahan map in machine numbers.

A second implementation, apart from the exact one and tested against it. The only road from exact numbers to machine
numbers is `to_floats`. What users need is gathered here. `steps` says what a step is, `straight_line` how it is written
out, `machine_code` compiles it, `blocks` is the normal form in doubles, `ensemble` advances many orbits, `stream`
writes them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kahanmaps.errors import InputError
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.floats.doubles import FLOATS, FloatArray, float_function, to_float, to_floats
from kahanmaps.maps.floats.ensemble import (
    SAMPLED,
    Drift,
    FloatEnsemble,
    Function,
    require_every,
)
from kahanmaps.maps.floats.stream import NpyFile
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kernels import choose_kernel
from kahanmaps.maps.orbits.iteration import OrbitEnd, require_steps
from kahanmaps.systems.quadratic import QuadraticSystem

__all__ = [
    "FLOATS",
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
    """The orbit of `start` in double precision: iterate over (step, x), then look at `end`.

    `start` holds exact numbers, `eps` is half the time step, `steps` how many steps to take (None: no limit), `every`
    says which of them are delivered, `backward` steps by the inverse map. With `form`, the normal form of the system,
    steps are much faster and lose fewer digits. `kernel` is "numpy" or "numba"; by default numba, if it is installed,
    for more than 20,000 steps. Points are computed some ahead of the one delivered; what the attributes say about
    near-singular steps and drift is about what was computed. See FloatEnsemble for many orbits, and for `integrals` and
    `sampled`.

    >>> orbit = FloatOrbit(QuadraticSystem.from_text(["x"], ["x"]), "1/2", [1], 4, every=2)
    >>> [(step, float(x[0])) for step, x in orbit]
    [(0, 1.0), (2, 9.0), (4, 81.0)]
    >>> orbit.end.status, orbit.kernel
    ('completed', 'numpy generic')
    """

    def __init__(
        self,
        system: QuadraticSystem | MapFamily,
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
        self.start = to_floats(start)
        self.steps = steps
        self.every = every
        self.dim = system.dim
        self.end: OrbitEnd | None = None
        self._fresh = partial(
            FloatEnsemble,
            system,
            eps,
            self.start[None],
            backward=backward,
            form=form,
            kernel=choose_kernel(kernel, is_long=steps is None or steps > _LONG),
            threads=1,
            integrals=integrals,
            sampled=sampled,
        )
        self._ensemble = self._fresh()
        self._interrupted = False

    @property
    def kernel(self) -> str:
        """What computes: "numpy generic", "numba normal form, 1 thread"."""
        return self._ensemble.kernel

    @property
    def near_singular(self) -> int:
        """How many near-singular steps were taken (see steps.py)."""
        return int(self._ensemble.near_singular[0])

    @property
    def near_singular_at(self) -> int | None:
        """The index of the point from which the first of them was taken."""
        return int(self._ensemble.near_singular_at[0]) if self.near_singular else None

    @property
    def drift(self) -> tuple[Drift, ...]:
        """Of the block integrals h/(1 + eps^2 D), by root of chi, and of the functions that are watched."""
        return tuple(drift.of(0) for drift in self._ensemble.drift)

    def interrupt(self) -> None:
        """Ask a running orbit to end after the step in flight."""
        self._interrupted = True

    def __iter__(self) -> Iterator[tuple[int, FloatArray]]:
        reached = -self.every
        for _, points in self.portions():
            for x in points:
                reached += self.every
                yield reached, x
                if self._interrupted:
                    self.end = OrbitEnd("interrupted", reached, f"interrupted after step {reached}")
                    return

    def portions(self) -> Iterator[tuple[int, FloatArray]]:
        """The same in portions: the step reached, and the points (count, dim) delivered on the way."""
        if self.end is not None or self._ensemble.step:  # an ensemble would go on from where the last walk was
            self._ensemble = self._fresh()
        ensemble = self._ensemble
        for x in ensemble.records(_FOR_EVER if self.steps is None else self.steps, self.every):
            points = x[:, 0]
            yield ensemble.step, points[~np.isnan(points).any(axis=1)]
            if ensemble.failed_at[0] >= 0:
                break
            if self._interrupted and ensemble.step != self.steps:
                self.end = OrbitEnd("interrupted", ensemble.step, f"interrupted after step {ensemble.step}")
                return
        self.end = ensemble.end(0)


_LONG = 20_000  # steps, from which on compiling pays
_FOR_EVER = 1 << 62


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
