"""Classical one-step methods in machine numbers, to compare the Kahan map with: explicit RK4 and implicit midpoint.

Both take the time step h = 2 eps. The midpoint equation y = x + (h/2) f(y), x~ = x + h f(y), is solved by Newton's
method from y = x until the corrections are round-off; an orbit ends where it does not get there.

A step goes through the terms c x_j x_k of the equation one after the other, in plain Python or compiled by numba: the
same function, so the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np
from flint import fmpq

from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError, counted
from kahanmaps.maps.float_ensemble import has_numba
from kahanmaps.maps.float_numbers import FloatArray, to_float, to_floats
from kahanmaps.maps.orbits import OrbitEnd, require_steps
from kahanmaps.systems.quadratic import QuadraticSystem

METHODS = {"rk4": "explicit RK4", "midpoint": "implicit midpoint"}
_LONG = 100_000  # steps, from which on loading compiled code pays
_PORTION = 20_000
_RUNNING, _OVERFLOW, _NO_SOLUTION = 0, 1, 2
_MOST_CORRECTIONS = 50
_ROUND_OFF = 4e-16  # corrections below it, relative to the point, are the last ones
_STALLED = 1e-10  # where corrections stop falling below it, they have become round-off


class ClassicalOrbit:
    """The orbit of `start` under RK4 or the implicit midpoint rule with the time step 2 eps, in double precision.

    `method` is "rk4" or "midpoint"; `start` and `eps` are exact. Iterate once over `portions`, then look at `end`.
    Raises InputError for wrong values.

    >>> orbit = ClassicalOrbit(QuadraticSystem.from_text(["x"], ["x"]), "1/20", [1], 10, "midpoint")
    >>> points = np.concatenate([x for _, x in orbit.portions()])
    >>> points.shape, round(float(points[-1, 0]), 10), round((1.05 / 0.95) ** 10, 10)
    ((11, 1), 2.7205514142, 2.7205514142)
    >>> orbit.end.status
    'completed'
    """

    def __init__(
        self, system: QuadraticSystem, eps: Any, start: Sequence[Any], steps: int, method: str, *, compiled: Any = None
    ) -> None:
        require_steps(steps)
        if method not in METHODS:
            raise InputError(f"found the method {str(method)[:40]!r}, expected {' or '.join(METHODS)}")
        if len(start) != system.dim:
            raise InputError(f"found a point with {len(start)} coordinates, expected {system.dim}")
        self.steps, self.method = steps, method
        self.end: OrbitEnd | None = None
        self._dim = system.dim
        self._h = to_float(2 * rational(eps))
        self._start = to_floats(start)
        self._terms = _terms(system)
        self._compiled = steps > _LONG and has_numba() if compiled is None else bool(compiled)

    def portions(self) -> Iterator[tuple[int, FloatArray]]:
        """The step reached, and the points (count, dim) on the way; the start first."""
        yield 0, self._start[None].copy()
        advance = _kernels(self._compiled)[self.method]
        tables: list[Any] = [np.array(column) for column in self._terms]
        if not self._compiled:  # lists are faster there, and the same numbers
            tables = [column.tolist() for column in tables]
        step, x = 0, self._start
        while step < self.steps:
            count = min(_PORTION, self.steps - step)
            out = np.empty((count, self._dim))
            if self._compiled:
                done, status = advance(*tables, self._h, x.copy(), out)
            else:
                rows: list[list[float]] = [[0.0] * self._dim for _ in range(count)]
                done, status = advance(*tables, self._h, x.tolist(), rows)
                out[:] = rows
            step += done
            if done:
                x = out[done - 1]
                yield step, out[:done]
            if status != _RUNNING:
                self.end = _end(status, step)
                return
        self.end = OrbitEnd("completed", step, counted(step, "step"))


def _end(status: int, step: int) -> OrbitEnd:
    if status == _OVERFLOW:
        return OrbitEnd("overflow", step, f"step {step + 1} leaves the range of machine floats")
    return OrbitEnd("singular", step, f"step {step + 1}: Newton's method finds no solution of the midpoint equation")


def _terms(system: QuadraticSystem) -> tuple[list[int], list[int], list[int], list[float]]:
    """The terms c x_j x_k of every f_i as columns i, j, k, c; the index dim stands for the number 1."""
    n = system.dim
    found: list[tuple[int, int, int, fmpq]] = []
    for i in range(n):
        for j in range(n):
            found += [(i, j, k, system.Q[i][j, k] * (1 if j == k else 2)) for k in range(j, n)]
            found.append((i, j, n, system.B[i, j]))
        found.append((i, n, n, system.c[i]))
    kept = [term for term in found if term[3] != 0]
    return (
        [term[0] for term in kept],
        [term[1] for term in kept],
        [term[2] for term in kept],
        [to_float(term[3]) for term in kept],
    )


# What follows is compiled as it stands, too: loops and indices only, for lists as for arrays.


def _field(rows: Any, js: Any, ks: Any, cs: Any, x: Any, f: Any) -> None:
    n = len(f)
    for i in range(n):
        f[i] = 0.0
    for t in range(len(cs)):
        j, k = js[t], ks[t]
        f[rows[t]] += cs[t] * (x[j] if j < n else 1.0) * (x[k] if k < n else 1.0)


def _jacobian(rows: Any, js: Any, ks: Any, cs: Any, half: float, x: Any, matrix: Any) -> None:
    """I - half f'(x), row after row."""
    n = len(x)
    for i in range(n * n):
        matrix[i] = 0.0
    for i in range(n):
        matrix[i * n + i] = 1.0
    for t in range(len(cs)):
        j, k = js[t], ks[t]
        c = half * cs[t]
        if j < n:
            matrix[rows[t] * n + j] -= c * (x[k] if k < n else 1.0)
        if k < n:
            matrix[rows[t] * n + k] -= c * (x[j] if j < n else 1.0)


def _solve(matrix: Any, right: Any) -> bool:
    """Put the solution into `right`; False where a pivot is 0 or no number."""
    n = len(right)
    for i in range(n):
        best = i
        for r in range(i + 1, n):
            if abs(matrix[r * n + i]) > abs(matrix[best * n + i]):
                best = r
        pivot = matrix[best * n + i]
        if not abs(pivot) > 0.0:
            return False
        if best != i:
            for k in range(n):
                matrix[i * n + k], matrix[best * n + k] = matrix[best * n + k], matrix[i * n + k]
            right[i], right[best] = right[best], right[i]
        for r in range(i + 1, n):
            factor = matrix[r * n + i] / pivot
            if factor != 0.0:
                for k in range(i + 1, n):
                    matrix[r * n + k] -= factor * matrix[i * n + k]
                right[r] -= factor * right[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[i * n + k] * right[k]
        right[i] /= matrix[i * n + i]
    return True


@cache
def _kernels(compiled: bool) -> dict[str, Callable[..., tuple[int, int]]]:
    """The functions that take steps: of lists in plain Python, of arrays where they are compiled."""
    if compiled:
        import numba

        compile_it: Callable[[Any], Any] = numba.njit(error_model="numpy", nogil=True)
        makes: Callable[[int], Any] = compile_it(_empty_array)
    else:
        compile_it, makes = _as_it_is, _empty_list
    field, jacobian, solve = compile_it(_field), compile_it(_jacobian), compile_it(_solve)

    def rk4(rows: Any, js: Any, ks: Any, cs: Any, h: float, x: Any, out: Any) -> tuple[int, int]:
        n = len(x)
        y, a, b, c, d = makes(n), makes(n), makes(n), makes(n), makes(n)
        for step in range(len(out)):
            field(rows, js, ks, cs, x, a)
            for i in range(n):
                y[i] = x[i] + 0.5 * h * a[i]
            field(rows, js, ks, cs, y, b)
            for i in range(n):
                y[i] = x[i] + 0.5 * h * b[i]
            field(rows, js, ks, cs, y, c)
            for i in range(n):
                y[i] = x[i] + h * c[i]
            field(rows, js, ks, cs, y, d)
            for i in range(n):
                x[i] += h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i])
                if not abs(x[i]) <= _LARGEST:
                    return step, _OVERFLOW
            for i in range(n):
                out[step][i] = x[i]
        return len(out), _RUNNING

    def midpoint(rows: Any, js: Any, ks: Any, cs: Any, h: float, x: Any, out: Any) -> tuple[int, int]:
        n = len(x)
        y, f, g, matrix = makes(n), makes(n), makes(n), makes(n * n)
        for step in range(len(out)):
            for i in range(n):
                y[i] = x[i]
            last = _LARGEST
            solved = False
            for _ in range(_MOST_CORRECTIONS):
                field(rows, js, ks, cs, y, f)
                jacobian(rows, js, ks, cs, 0.5 * h, y, matrix)
                for i in range(n):
                    g[i] = x[i] - y[i] + 0.5 * h * f[i]
                if not solve(matrix, g):
                    break
                size, scale = 0.0, 0.0
                for i in range(n):
                    y[i] += g[i]
                    size = max(size, abs(g[i]))
                    scale = max(scale, abs(y[i]))
                if size <= _ROUND_OFF * scale or (size >= last and size <= _STALLED * scale):
                    solved = True
                    break
                last = size
            if not solved:
                return step, _NO_SOLUTION
            field(rows, js, ks, cs, y, f)
            for i in range(n):
                x[i] += h * f[i]
                if not abs(x[i]) <= _LARGEST:
                    return step, _OVERFLOW
            for i in range(n):
                out[step][i] = x[i]
        return len(out), _RUNNING

    return {"rk4": compile_it(rk4), "midpoint": compile_it(midpoint)}


_LARGEST = float(np.finfo(np.float64).max)


def _as_it_is(function: Any) -> Any:
    return function


def _empty_list(n: int) -> Any:
    return [0.0] * n


def _empty_array(n: int) -> Any:
    return np.zeros(n)
