"""Orbits in floating point, one at a time.

This implementation is independent of the exact orbits and is tested against them. In this folder, `float_conversion`
rounds exact numbers, `steps` defines a step, `straight_line_program` its operations, `machine_code` compiles these,
`planar_blocks` is the normal form in doubles, `ensemble` advances many orbits, `npy_file` stores them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kahanmaps.errors import InputError, counted
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.floats.ensemble import (
    SAMPLE_INTERVAL,
    Drift,
    FloatEnsemble,
    Function,
    require_every,
)
from kahanmaps.maps.floats.float_conversion import FLOATS, FloatArray, float_function, to_float, to_floats
from kahanmaps.maps.floats.npy_file import NpyFile
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
    """The orbit of an initial point in double precision: iterate over (step, x), then read `end`.

    Args:
        system: a map, or a quadratic system, which stands for its Kahan map.
        eps: an exact number, half the time step.
        start: the initial point, exact numbers.
        steps: the number of steps; None for no limit.
        backward: whether steps are taken by the inverse map.
        form: the normal form of the system; with it, steps are much faster and lose fewer digits.
        kernel: "numpy" or "numba"; by default numba, if it is installed and more than 20,000 steps are requested.
        every: only the points whose step is a multiple of this number are yielded.
        integrals, sample_interval: see FloatEnsemble.

    Points are computed in portions, ahead of the point yielded. The number of near-singular steps and the drift refer
    to all points computed so far.

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
        sample_interval: int = SAMPLE_INTERVAL,
    ) -> None:
        require_steps(steps)
        require_every(every)
        if len(start) != system.dim:
            raise InputError(
                f"found a point with {counted(len(start), 'coordinate')}, "
                f"expected {system.dim}: {', '.join(system.variables)}"
            )
        self.start = to_floats(start)
        self.steps = steps
        self.every = every
        self.dim = system.dim
        self.end: OrbitEnd | None = None
        self._new_ensemble = partial(
            FloatEnsemble,
            system,
            eps,
            self.start[None],
            backward=backward,
            form=form,
            kernel=choose_kernel(kernel, is_long=steps is None or steps > _MIN_COMPILED_STEPS),
            threads=1,
            integrals=integrals,
            sample_interval=sample_interval,
        )
        self._ensemble = self._new_ensemble()
        self._interrupted = False

    @property
    def kernel(self) -> str:
        """Kernel and method as a phrase: "numpy generic", "numba normal form, 1 thread"."""
        return self._ensemble.kernel

    @property
    def near_singular(self) -> int:
        """The number of near-singular steps (see steps.py)."""
        return int(self._ensemble.near_singular[0])

    @property
    def near_singular_at(self) -> int | None:
        """The index of the point before the first near-singular step; None if there was no such step."""
        return int(self._ensemble.near_singular_at[0]) if self.near_singular else None

    @property
    def drift(self) -> tuple[Drift, ...]:
        """The drift of h/(1 + eps^2 D) for each planar block (planar_blocks.py), and of each of `integrals`."""
        return tuple(drift.of(0) for drift in self._ensemble.drift)

    def interrupt(self) -> None:
        """Stop a running iteration after the current point, or `portions` after the current portion."""
        self._interrupted = True

    def __iter__(self) -> Iterator[tuple[int, FloatArray]]:
        step = -self.every
        for _, points in self.portions():
            for x in points:
                step += self.every
                yield step, x
                if self._interrupted:
                    self.end = OrbitEnd("interrupted", step, f"interrupted after step {step}")
                    return

    def portions(self) -> Iterator[tuple[int, FloatArray]]:
        """Yield pairs (step reached, array (count, dim) of the points at multiples of `every` since the last pair)."""
        if (
            self.end is not None or self._ensemble.step
        ):  # create a new ensemble: the old one would continue the previous iteration
            self._ensemble = self._new_ensemble()
        ensemble = self._ensemble
        for x in ensemble.records(_NO_LIMIT if self.steps is None else self.steps, self.every):
            points = x[:, 0]
            yield ensemble.step, points[~np.isnan(points).any(axis=1)]
            if ensemble.failed_at[0] >= 0:
                break
            if self._interrupted and ensemble.step != self.steps:
                self.end = OrbitEnd("interrupted", ensemble.step, f"interrupted after step {ensemble.step}")
                return
        self.end = ensemble.end(0)


_MIN_COMPILED_STEPS = 20_000  # for fewer steps, compiling takes longer than it saves
_NO_LIMIT = 1 << 62  # the number of steps of an orbit without a limit


def stream_orbit(orbit: FloatOrbit, path: str | Path, *, progress: Callable[[int], None] | None = None) -> OrbitEnd:
    """Write an orbit to a .npy file of shape (points, dim): the initial point and every `orbit.every`-th iterate.

    Returns how the orbit ended. `progress` is called with the current step about ten times a second. The method
    `orbit.interrupt()` stops the orbit after the current portion.
    """
    with NpyFile(path, (orbit.dim,)) as file:
        for step, x in orbit.portions():
            file.append(x)
            if progress is not None:
                progress(step)
    if orbit.end is None:
        raise AssertionError("the portions of an orbit ended without a status")
    return orbit.end
