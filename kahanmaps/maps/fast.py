"""Float orbits: the Kahan map in machine numbers.

A second implementation, apart from the exact one and tested against it. The only road from exact numbers to machine
numbers is `to_floats`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from math import isfinite
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.errors import InputError
from kahanmaps.maps.orbits import OrbitEnd, counted, require_steps
from kahanmaps.systems.quadratic import QuadraticSystem

FloatArray = NDArray[np.float64]


def to_float(value: fmpq) -> float:
    """The double nearest to a rational number. Raises InputError where it lies outside the range of doubles."""
    try:
        nearest = int(value.p) / int(value.q)
    except OverflowError as error:
        raise InputError("found a number beyond the range of machine floats (1.8e308): use exact arithmetic") from error
    return nearest


def to_floats(values: Sequence[Any]) -> FloatArray:
    """Exact numbers rounded to doubles, each to the nearest.

    >>> to_floats(["1/3", "2"])
    array([0.33333333, 2.        ])
    """
    return np.array([to_float(rational(value)) for value in values], dtype=np.float64)


class FloatKahanMap:
    """Phi(., eps) in double precision, one linear solve by LAPACK a step; the time step is 2 eps."""

    def __init__(self, system: QuadraticSystem, eps: Any) -> None:
        n = system.dim
        self.system = system
        self.eps = to_float(rational(eps))
        if self.eps == 0.0:
            raise InputError("eps is 0 in machine numbers, and the Kahan map the identity: take a larger eps")
        forms = [2 * entry for form in system.Q for entry in form.entries()]
        with np.errstate(over="ignore"):
            self._tensor = to_floats(forms).reshape(n, n, n) * self.eps
            self._linear = to_floats(system.B.entries()).reshape(n, n) * self.eps
            self._constant = to_floats(system.c) * (2 * self.eps)
        if not all(np.isfinite(part).all() for part in (self._tensor, self._linear, self._constant)):
            raise InputError("eps times a coefficient leaves the range of machine floats: use exact arithmetic")
        self._identity = np.eye(n)

    @property
    def inverse(self) -> FloatKahanMap:
        """The inverse map, Phi(., -eps)."""
        return FloatKahanMap(self.system, rational(_exact(-self.eps)))

    def step(self, x: FloatArray) -> FloatArray | None:
        """The image, or None where the matrix I - eps f'(x) is singular in machine numbers."""
        matrix = self._identity - self._tensor @ x - self._linear
        right = x + self._linear @ x + self._constant
        try:
            image: FloatArray = np.linalg.solve(matrix, right).astype(np.float64, copy=False)
            return image
        except np.linalg.LinAlgError:
            return None


class FloatOrbit:
    """The orbit of `start` in double precision: iterate once over (step, x), then look at `end`."""

    def __init__(
        self, system: QuadraticSystem, eps: Any, start: Sequence[Any], steps: int | None, *, backward: bool = False
    ) -> None:
        require_steps(steps)
        if len(start) != system.dim:
            raise InputError(
                f"found a point with {len(start)} coordinates, expected {system.dim}: {', '.join(system.variables)}"
            )
        forward = FloatKahanMap(system, eps)
        self.map = forward.inverse if backward else forward
        self.start = to_floats(start)
        self.steps = steps
        self.backward = backward
        self.end: OrbitEnd | None = None
        self._interrupted = False

    def interrupt(self) -> None:
        """Ask a running orbit to end after the step in flight."""
        self._interrupted = True

    def __iter__(self) -> Iterator[tuple[int, FloatArray]]:
        x, step = self.start, 0
        yield 0, x
        # A product that leaves the range of doubles is a status of the orbit, not a warning on the terminal.
        while self.steps is None or step < self.steps:
            if self._interrupted:
                self.end = OrbitEnd("interrupted", step, f"interrupted after step {step}")
                return
            with np.errstate(all="ignore"):
                image = self.map.step(x)
            if image is None:
                sign = "+" if self.backward else "-"
                message = f"I {sign} eps f'(x) is singular in machine numbers at step {step}"
                self.end = OrbitEnd("singular", step, message)
                return
            if not np.isfinite(image).all():
                self.end = OrbitEnd("overflow", step, f"step {step + 1} leaves the range of machine floats")
                return
            x, step = image, step + 1
            yield step, x
        self.end = OrbitEnd("completed", step, counted(step, "step"))


class _Floats:
    """Machine numbers, as far as evaluating a rational function needs a field."""

    zero = 0.0
    one = 1.0
    exact = False

    @staticmethod
    def convert(value: Any) -> float:
        return to_float(rational(value))

    @staticmethod
    def is_zero(value: float) -> bool:
        return value == 0.0

    @staticmethod
    def working() -> AbstractContextManager[None]:
        return nullcontext()


def float_function(function: RationalFunction) -> Callable[[Sequence[float]], float | None]:
    """The rational function in double precision; None where the denominator is 0 or the value is no finite number."""

    def value(point: Sequence[float]) -> float | None:
        try:
            found: float | None = function.value(_Floats, point)
        except (OverflowError, ZeroDivisionError):
            return None
        return found if found is not None and isfinite(found) else None

    return value


def _exact(value: float) -> fmpq:
    """The rational number that a double is."""
    numerator, denominator = value.as_integer_ratio()
    return fmpq(numerator, denominator)
