"""Classical one-step methods in floating point, for comparison: explicit RK4 and implicit midpoint.

Both use the time step h = 2 eps. The midpoint equation y = x + (h/2) f(y), x~ = x + h f(y), is solved by Newton's
method from y = x until the corrections are round-off; the orbit ends if Newton's method does not converge.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError, counted
from kahanmaps.maps.floats.float_conversion import FloatArray, to_float, to_floats
from kahanmaps.maps.orbits.iteration import OrbitEnd, require_steps
from kahanmaps.systems.quadratic import QuadraticSystem

METHODS = {"rk4": "explicit RK4", "midpoint": "implicit midpoint"}
_PORTION = 20_000
_MAX_CORRECTIONS = 50
_ROUND_OFF = 4e-16  # relative size of a correction after which the iteration stops
_STALLED = 1e-10  # relative size below which a correction that does not decrease is round-off


class ClassicalOrbit:
    """The orbit of an initial point under RK4 or the implicit midpoint rule, with time step 2 eps, in double precision.

    `method` is "rk4" or "midpoint"; `start` and `eps` are exact. Iterate once over `portions`, then read `end`.
    Raises InputError for invalid values.

    >>> orbit = ClassicalOrbit(QuadraticSystem.from_text(["x"], ["x"]), "1/20", [1], 10, "midpoint")
    >>> points = np.concatenate([x for _, x in orbit.portions()])
    >>> points.shape, round(float(points[-1, 0]), 10), round((1.05 / 0.95) ** 10, 10)
    ((11, 1), 2.7205514142, 2.7205514142)
    >>> orbit.end.status
    'completed'
    """

    def __init__(self, system: QuadraticSystem, eps: Any, start: Sequence[Any], steps: int, method: str) -> None:
        require_steps(steps)
        if method not in METHODS:
            raise InputError(f"found the method {str(method)[:40]!r}, expected {' or '.join(METHODS)}")
        if len(start) != system.dim:
            raise InputError(f"found a point with {counted(len(start), 'coordinate')}, expected {system.dim}")
        self.steps, self.method = steps, method
        self.end: OrbitEnd | None = None
        self._dim = system.dim
        self._h = to_float(2 * rational(eps))
        self._start = to_floats(start)
        self._field = VectorField(system)

    def portions(self) -> Iterator[tuple[int, FloatArray]]:
        """Yield the step reached and the points (count, dim) since the previous portion; first the initial point."""
        yield 0, self._start[None].copy()
        take = self._rk4 if self.method == "rk4" else self._midpoint
        step, x = 0, self._start
        while step < self.steps:
            out = np.empty((min(_PORTION, self.steps - step), self._dim))
            done = 0
            with np.errstate(all="ignore"):  # an overflow is a status, not a warning
                while done < len(out):
                    image = take(x)
                    if image is None or not np.isfinite(image).all():
                        break
                    x = out[done] = image
                    done += 1
            step += done
            if done:
                yield step, out[:done]
            if done < len(out):
                self.end = OrbitEnd("overflow", step, f"step {step + 1} leaves the range of floating-point numbers")
                if image is None:
                    sentence = f"step {step + 1}: Newton's method finds no solution of the midpoint equation"
                    self.end = OrbitEnd("singular", step, sentence)
                return
        self.end = OrbitEnd("completed", step, counted(step, "step"))

    def _rk4(self, x: FloatArray) -> FloatArray | None:
        f, h = self._field, self._h
        a = f(x)
        b = f(x + 0.5 * h * a)
        c = f(x + 0.5 * h * b)
        d = f(x + h * c)
        image: FloatArray = x + h / 6.0 * (a + 2.0 * (b + c) + d)
        return image

    def _midpoint(self, x: FloatArray) -> FloatArray | None:
        f, h = self._field, self._h
        identity = np.eye(self._dim)
        y, last = x, np.inf
        for _ in range(_MAX_CORRECTIONS):
            try:
                change = np.linalg.solve(identity - 0.5 * h * f.jacobian(y), x - y + 0.5 * h * f(y))
            except np.linalg.LinAlgError:
                return None
            y = y + change
            # Corrections stop decreasing at the rounding error, which may exceed the tolerance. A correction that no
            # longer decreases is accepted if it is small enough.
            size, scale = np.abs(change).max(), np.abs(y).max()
            if size <= _ROUND_OFF * scale or (size >= last and size <= _STALLED * scale):
                image: FloatArray = x + h * f(y)
                return image
            last = size
        return None


class VectorField:
    """A quadratic vector field f and f' in doubles: f_i(x) = z^T S_i z with z = (x, 1) and S_i symmetric.

    >>> f = VectorField(QuadraticSystem.from_text(["x", "y"], ["x*y + 1", "3*x"]))
    >>> f(np.array([2.0, 5.0])).tolist(), f.jacobian(np.array([2.0, 5.0])).tolist()
    ([11.0, 6.0], [[5.0, 2.0], [3.0, 0.0]])
    """

    def __init__(self, system: QuadraticSystem) -> None:
        n = system.dim
        self._S = np.zeros((n, n + 1, n + 1))
        for i in range(n):
            self._S[i, :n, :n] = to_floats(system.Q[i].entries()).reshape(n, n)
            self._S[i, :n, n] = self._S[i, n, :n] = to_floats([system.B[i, j] / 2 for j in range(n)])
        self._S[:, n, n] = to_floats(system.c)

    def __call__(self, x: FloatArray) -> FloatArray:
        """Return the values at points (..., dim)."""
        with np.errstate(all="ignore"):
            z, half = self._half(x)
            value: FloatArray = (half @ z[..., None])[..., 0]
        return value

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return f'(x) at one point."""
        with np.errstate(all="ignore"):
            return 2.0 * self._half(x)[1][:, :-1]

    def _half(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        z = np.concatenate([x, np.ones_like(x[..., :1])], axis=-1)
        return z, np.moveaxis(self._S @ z.T, -1, 0) if z.ndim > 1 else self._S @ z
