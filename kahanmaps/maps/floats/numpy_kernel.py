"""Many orbits at once in whole numpy arrays, and single ones in plain Python: what runs where numba is not installed.

Lanes are taken in groups whose arrays stay in the processor's cache. A group first takes up to 64 steps in
which it is only looked for anything unusual: one minimum over all lanes. If there is something, the steps are taken
once more to find the lanes concerned, and these are walked alone (steps.py), so the others cost nothing more.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from kahanmaps.maps.floats.blocks import GENERAL, LINES, PlanarBlocks
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.steps import (
    CLEAR,
    LARGEST,
    MUCH,
    NEAR,
    NEAR_SQUARED,
    RUNNING,
    GenericEquation,
    Lanes,
    PythonGeneric,
    PythonPlanar,
    Stepper,
    complex_general,
    complex_lines,
    real_general,
    sample,
    segments,
    walk,
)

_GROUP = 4096
_PIECE = 64
_FEW = 16  # lanes, up to which plain Python is faster
_FEW_GENERIC = 4


class PlanarNumpy:
    """Advances lanes in normal form. The two common kinds of block have their formulas here with buffers reused."""

    def __init__(self, blocks: PlanarBlocks) -> None:
        self.blocks = blocks
        self.single = PythonPlanar(blocks)
        self._runs = list(_runs(blocks))

    def advance(
        self, lanes: Lanes, first: int, steps: int, every: int, sampled: int, record: FloatArray | None
    ) -> None:
        """Take all lanes `steps` steps from the index `first`.

        Writes the states at multiples of `every` to `record` (count, rows, n), and samples the integrals at multiples
        of `sampled`.
        """
        for lo, hi in _groups(lanes, _GROUP):
            few = hi - lo <= _FEW
            row = 0
            for index, count in segments(first, steps, steps if few else _PIECE, 0 if few else every, sampled):
                if few:
                    row += _walk_all(self.single, lanes, lo, hi, index, count, every, record, row)
                else:
                    self._piece(lanes, lo, hi, index, count)
                    row += _write(lanes, lo, hi, index + count, every, record, row)
                if sampled and (index + count) % sampled == 0:
                    sample(self.blocks, lanes, lo, hi)

    def _piece(self, lanes: Lanes, lo: int, hi: int, index: int, count: int) -> None:
        saved = lanes.z[:, lo:hi].copy()
        with np.errstate(all="ignore"):
            z, fine = self._taken(saved, count, None)
            if not (fine and _sound(z, saved).all()):
                good = np.ones(hi - lo, dtype=bool)
                z, _ = self._taken(saved, count, good)
                good &= _sound(z, saved)
                lanes.z[:, lo:hi] = z
                _redo(self.single, lanes, lo, saved, np.flatnonzero(~good), index, count)
                return
        lanes.z[:, lo:hi] = z

    def _taken(self, start: FloatArray, count: int, good: Any) -> tuple[FloatArray, bool]:
        """The state after `count` steps, and whether no lane met anything unusual; `good` tells which, if given."""
        z, reals = start.copy(), self.blocks.reals
        for kind, r, end in self._runs:
            k = self.blocks.coefficients[r].tolist()
            if r < reals and kind != GENERAL:
                fine = _canonical(kind, z[2 * r : 2 * end : 2], z[2 * r + 1 : 2 * end : 2], count, good)
            elif r < reals:
                fine = _alone(real_general, NEAR, z[2 * r : 2 * r + 2], k, count, good)
            else:
                at, formula = 4 * r - 2 * reals, complex_lines if kind == LINES else complex_general
                fine = _alone(formula, NEAR_SQUARED, z[at : at + 4], k, count, good)
            if not fine:
                return z, False
        return z, True


def _canonical(kind: int, U: FloatArray, V: FloatArray, count: int, good: Any) -> bool:
    """Steps of several blocks of one kind, in place: U and V have a row for each of them."""
    take = _lines if kind == LINES else _cubes
    buffers = np.empty((5, *U.shape))
    w = buffers[3]
    for _ in range(count):
        take(U, V, *buffers)
        np.abs(w, out=w)
        if good is not None:
            good &= (w > CLEAR).all(axis=0)
        elif not np.minimum.reduce(w, axis=None) > CLEAR:
            return False
    return True


def _alone(formula: Any, near: float, z: FloatArray, k: list[float], count: int, good: Any) -> bool:
    """Steps of one block, in place; of a complex one the formula gives the squares of |w| and |g|."""
    for _ in range(count):
        *image, w, g = formula(*z, k)
        z[:] = image
        usual = np.abs(w) > near + near * np.abs(g)
        if good is not None:
            good &= usual
        elif not usual.all():
            return False
    return True


def _lines(U: Any, V: Any, p: Any, q: Any, g: Any, w: Any, i: Any) -> None:
    """float_steps.real_lines in place; leaves w."""
    np.add(U, V, out=q)
    np.add(q, 1.0, out=p)
    np.subtract(1.0, q, out=q)
    np.multiply(V, U, out=g)
    np.multiply(p, q, out=w)
    np.add(w, g, out=w)
    np.divide(1.0, w, out=i)
    np.multiply(p, U, out=p)
    np.add(p, g, out=p)
    np.multiply(p, i, out=U)
    np.multiply(q, V, out=q)
    np.subtract(q, g, out=q)
    np.multiply(q, i, out=V)


def _cubes(U: Any, V: Any, p: Any, q: Any, g: Any, w: Any, i: Any) -> None:
    """float_steps.real_cubes in place; leaves w."""
    np.multiply(U, V, out=g)
    np.add(g, 1.0, out=w)
    np.divide(1.0, w, out=i)
    np.multiply(V, V, out=p)
    np.add(p, U, out=p)
    np.multiply(U, U, out=q)
    np.subtract(V, q, out=q)
    np.multiply(p, i, out=U)
    np.multiply(q, i, out=V)


class GenericNumpy:
    """Advances lanes of any map."""

    def __init__(self, equation: GenericEquation) -> None:
        self.equation = equation
        self.single = PythonGeneric(equation)
        # Beyond some hundred terms even one lane is faster in arrays, which are then matrices.
        self.few = _FEW_GENERIC if len(equation.factors) + equation.rows**3 // 3 < 1000 else 0
        n = equation.rows
        # By row and column, and then either one by one or, where there are many, in whole matrices.
        self._places = [
            (*divmod(entry, n + 1), int(equation.columns[t]), float(equation.factors[t]))
            for entry in range(n * (n + 1))
            for t in range(equation.first[entry], equation.first[entry + 1])
        ]
        self._terms: FloatArray | None = None
        if 3 * len(self._places) > n * n * (n + 1):
            self._terms = np.zeros((n + len(equation.products), n, n + 1, 1))
            for i, j, k, factor in self._places:
                self._terms[k, i, j] = factor

    def advance(
        self, lanes: Lanes, first: int, steps: int, every: int, sampled: int, record: FloatArray | None
    ) -> None:
        """Take all lanes `steps` steps from the index `first`, recording the states at multiples of `every`."""
        group = max(64, 32768 // self.equation.rows**2)
        for lo, hi in _groups(lanes, group):
            if hi - lo <= self.few:
                _walk_all(self.single, lanes, lo, hi, first, steps, every, record, 0)
                continue
            row = 0
            for index in range(first, first + steps):
                with np.errstate(all="ignore"):
                    self._step(lanes, lo, hi, index)
                row += _write(lanes, lo, hi, index + 1, every, record, row)

    def _step(self, lanes: Lanes, lo: int, hi: int, index: int) -> None:
        equation, x = self.equation, lanes.z[:, lo:hi].copy()
        n = equation.rows
        y = list(x)
        for a, b in equation.products:
            y.append(y[a] * y[b])
        full = np.repeat(equation.constants[:, :, None], x.shape[1], axis=2)
        if self._terms is None:
            for i, j, k, factor in self._places:
                full[i, j] += factor * y[k]
        else:
            product = np.empty_like(full)
            for terms, value in zip(self._terms, y, strict=True):
                full += np.multiply(terms, value, out=product)
        matrix, right = full[:, :n], full[:, n].copy()
        # At least the row of the pivot, by which the single step judges: what may be near-singular is done again there.
        scale = np.fmax(np.fmax.reduce(np.abs(matrix).reshape(n * n, -1), axis=0), 1.0)
        good = np.ones(x.shape[1], dtype=bool)
        for p in range(n):
            for i in range(p + 1, n):
                wanted = np.abs(matrix[i, p]) > MUCH * np.abs(matrix[p, p])
                if wanted.any():
                    matrix[p, p:, wanted], matrix[i, p:, wanted] = matrix[i, p:, wanted], matrix[p, p:, wanted]
                    right[p, wanted], right[i, wanted] = right[i, wanted], right[p, wanted]
            size = np.abs(matrix[p, p])
            good &= (size > NEAR * scale) & (size <= LARGEST)
            if p + 1 < n:
                factors = matrix[p + 1 :, p] * (1.0 / matrix[p, p])
                matrix[p + 1 :, p + 1 :] -= factors[:, None] * matrix[p, None, p + 1 :]
                right[p + 1 :] -= factors * right[p]
        for j in range(n - 1, -1, -1):
            right[j] /= matrix[j, j]
            right[:j] -= matrix[:j, j] * right[j]
        good &= np.isfinite(right).all(axis=0)
        lanes.z[:, lo:hi] = right
        _redo(self.single, lanes, lo, x, np.flatnonzero(~good), index, 1)
        lanes.z[:, lo:hi][:, lanes.status[lo:hi] != RUNNING] = 0.0


def _runs(blocks: PlanarBlocks) -> Iterator[tuple[int, int, int]]:
    """Kind, first block and end of runs of real blocks of one canonical kind; other blocks alone."""
    r = 0
    while r < len(blocks.kinds):
        kind, end = int(blocks.kinds[r]), r + 1
        while end < blocks.reals and kind != GENERAL and blocks.kinds[end] == kind:
            end += 1
        yield kind, r, end
        r = end


def _walk_all(
    stepper: Stepper,
    lanes: Lanes,
    lo: int,
    hi: int,
    first: int,
    steps: int,
    every: int,
    record: FloatArray | None,
    row: int,
) -> int:
    """Walk the lanes lo, ..., hi - 1 alone, and return how many rows of `record` each has written."""
    rows = (first + steps) // every - first // every if every else 0
    for lane in range(lo, hi):
        mine = record[row : row + rows, :, lane] if record is not None and every else None
        if lanes.status[lane] == RUNNING:
            walk(stepper, lanes, lane, lanes.z[:, lane].tolist(), first, steps, every, mine)
        elif mine is not None:
            mine[:] = np.nan
    return rows


def _write(lanes: Lanes, lo: int, hi: int, index: int, every: int, record: FloatArray | None, row: int) -> int:
    """Write the states at `index` to `record` if they are wanted, and return how many rows were written."""
    if record is None or not every or index % every:
        return 0
    record[row, :, lo:hi] = lanes.z[:, lo:hi]
    record[row, :, lo:hi][:, lanes.status[lo:hi] != RUNNING] = np.nan
    return 1


def _sound(z: FloatArray, before: FloatArray) -> Any:
    """Which lanes are finite and have not fallen to 0.

    Where w overflows and the numerators do not, the image is 0, and stays there: a point that all planar maps keep.
    """
    sound = np.isfinite(z).all(axis=0)
    return sound & ~(((z == 0.0) & (before != 0.0)).any(axis=0))


def _redo(stepper: Stepper, lanes: Lanes, lo: int, saved: FloatArray, which: Any, index: int, count: int) -> None:
    """Walk the lanes lo + which alone, from the states in `saved`."""
    for i in which.tolist():
        if lanes.status[lo + i] == RUNNING:
            walk(stepper, lanes, lo + i, saved[:, i].tolist(), index, count)
        else:
            lanes.z[:, lo + i] = 0.0


def _groups(lanes: Lanes, size: int) -> list[tuple[int, int]]:
    """Ranges of lanes, none of them empty."""
    n = lanes.z.shape[1]
    return [(lo, min(n, lo + size)) for lo in range(0, n, size)]
