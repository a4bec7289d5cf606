"""Many orbits at once in whole numpy arrays, and few in plain Python: what runs where numba is not installed.

Lanes are taken in groups whose arrays stay in the processor's cache, and are only looked at for anything unusual: one
minimum over all of them in a step. If there is something, the steps are taken once more to find the lanes concerned.
"""

from __future__ import annotations

from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np

from kahanmaps.maps.floats.advance import Generic, Kept, Planar, note, segments, sound
from kahanmaps.maps.floats.blocks import CUBES, LINES
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.steps import (
    CLEAR,
    FORMULAS,
    LARGEST,
    MUCH,
    NEAR,
    OVERFLOW,
    RUNNING,
    SINGULAR,
    GenericEquation,
    Lanes,
    Run,
)


class PlanarNumpy(Planar):
    """Steps in normal form. The two common kinds of block have their formulas here with buffers reused."""

    def take(self, z: FloatArray, first: int, count: int, kept: Kept) -> Any:
        if z.shape[1] <= self.few:
            return np.array([self._alone(z, lane, first, count, kept) for lane in range(z.shape[1])])
        before, good = z.copy(), np.ones(z.shape[1], dtype=bool)
        with np.errstate(all="ignore"):
            if not (self._together(z, first, count, kept, None) and sound(z, before).all()):
                z[:] = before
                self._together(z, first, count, kept, good)
                good &= sound(z, before)
        return good

    def _together(self, z: FloatArray, first: int, count: int, kept: Kept, good: Any) -> bool:
        """Whether no lane met anything unusual; `good` tells which did, if given."""
        for index, steps in segments(first, count, kept.every):
            for run in self.rows.runs:
                sweep = _canonical if run.parts == 2 and run.kind in (LINES, CUBES) else self._any
                if not sweep(run, run.of(z), steps, good):
                    return False
            kept = kept.keep(z, index + steps)
        return True

    def _any(self, run: Run, parts: list[FloatArray], count: int, good: Any) -> bool:
        formula, k = FORMULAS[run.kind, run.parts], self.rows.coefficients(run)
        for _ in range(count):
            *image, w, g = formula(*parts, k)
            for row, after in zip(parts, image, strict=True):
                row[:] = after
            if not _noted(np.abs(w) > run.near + run.near * np.abs(g), good):
                return False
        return True

    def _alone(self, z: FloatArray, lane: int, first: int, count: int, kept: Kept) -> bool:
        """One lane in Python's own floats, block by block."""
        before = z[:, lane].copy()
        wanted = kept.rows(first, count)
        for run in self.rows.runs:
            formula, near = FORMULAS[run.kind, run.parts], run.near
            for b in range(run.blocks):
                rows = slice(run.row + b, run.row + b + run.parts * run.blocks, run.blocks)
                k = self.rows.blocks.coefficients[run.first + b].tolist()
                state: list[float] = z[rows, lane].tolist()
                path = []
                try:
                    for _ in range(count):
                        *state, w, g = formula(*state, k)
                        if not abs(w) > near + near * abs(g):
                            return False
                        if wanted:
                            path.append(state)
                except ZeroDivisionError:  # where numpy and compiled code get an infinity
                    return False
                z[rows, lane] = state
                if wanted:
                    states = path[kept.every - first % kept.every - 1 :: kept.every]
                    kept.table[kept.row : kept.row + wanted, rows, kept.lane + lane] = states
        return bool(sound(z[:, lane : lane + 1], before[:, None])[0])


def _noted(usual: Any, good: Any) -> bool:
    """Whether to go on: all lanes are usual, or it is kept in mind which are."""
    if good is None:
        return bool(usual.all())
    good &= usual.all(axis=0)
    return True


def _canonical(run: Run, parts: list[FloatArray], count: int, good: Any) -> bool:
    """Steps of several real blocks of one kind, in place."""
    U, V = parts
    take = _lines if run.kind == LINES else _cubes
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


class GenericNumpy(Generic):
    """Steps of any map."""

    def __init__(self, equation: GenericEquation) -> None:
        super().__init__(equation)
        self.group = max(64, 32768 // equation.rows**2)
        # Beyond some hundred terms even one lane is faster in arrays, which are then matrices.
        self.few = 4 if len(equation.factors) + equation.rows**3 // 3 < 1000 else 0
        n = equation.rows
        first: list[int] = equation.first.tolist()
        columns: list[int] = equation.columns.tolist()
        factors: list[float] = equation.factors.tolist()
        constants: list[list[float]] = equation.constants.tolist()
        terms = [list(zip(columns[s:e], factors[s:e], strict=True)) for s, e in pairwise(first)]
        rows = [[(constants[i][j], terms[i * (n + 1) + j]) for j in range(n + 1)] for i in range(n)]
        self._entries = [(row[:n], *row[n]) for row in rows]
        self._products: list[list[int]] = equation.products.tolist()

    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        if hi - lo <= self.few:
            for lane in range(lo, hi):
                self._walk(lanes, lane, first, steps, kept)
            return
        z, which, kept = lanes.z[:, lo:hi].copy(), np.arange(lo, hi), kept._replace(lane=lo)
        with np.errstate(all="ignore"):
            for index in range(first, first + steps):
                z[:], status, near = self.one(z)
                if status.any() or near.any() or lanes.status[lo:hi].any():
                    note(lanes, which, index, z, status, near)
                kept = kept.keep(z, index + 1)
        lanes.z[:, lo:hi] = z

    def _walk(self, lanes: Lanes, lane: int, first: int, steps: int, kept: Kept) -> None:
        """One lane in Python's own floats, with all tests."""
        if lanes.status[lane] != RUNNING:
            return
        x, place = lanes.z[:, lane].tolist(), kept.row
        for index in range(first, first + steps):
            for a, b in self._products:
                x.append(x[a] * x[b])
            rows, sizes = [], []
            for row, side, side_terms in self._entries:
                entries, size = [], 1.0
                for total, terms in row:
                    for k, factor in terms:
                        total += factor * x[k]
                    entries.append(total)
                    if abs(total) > size:
                        size = abs(total)
                for k, factor in side_terms:
                    side += factor * x[k]
                entries.append(side)
                rows.append(entries)
                sizes.append(size)
            status, near = _solved(rows, sizes)
            x = [row[-1] for row in rows]
            if status != RUNNING or not all(map(isfinite, x)):
                lanes.status[lane], lanes.failed_at[lane] = status or OVERFLOW, index + 1
                lanes.z[:, lane] = 0.0
                return
            if near:
                if not lanes.near[lane]:
                    lanes.near_at[lane] = index
                lanes.near[lane] += 1
            if kept.every and (index + 1) % kept.every == 0:
                kept.table[place, :, lane] = x
                place += 1
        lanes.z[:, lane] = x


def _solved(rows: list[list[float]], sizes: list[float]) -> tuple[int, bool]:
    """Eliminate in (M | r), whose last column becomes the solution; the status, and whether a pivot was small."""
    n, near = len(rows), False
    if not max(sizes) <= LARGEST:
        return OVERFLOW, near
    for p in range(n):
        for i in range(p + 1, n):
            if abs(rows[i][p]) > MUCH * abs(rows[p][p]):
                rows[p], rows[i] = rows[i], rows[p]
                sizes[p], sizes[i] = sizes[i], sizes[p]
        upper = rows[p]
        pivot = upper[p]
        if not NEAR * sizes[p] < abs(pivot) <= LARGEST:
            if pivot == 0.0:
                return SINGULAR, near
            if not abs(pivot) <= LARGEST:
                return OVERFLOW, near
            near = True
        inverse = 1.0 / pivot
        for row in rows[p + 1 :]:
            factor = row[p] * inverse
            for j in range(p + 1, n + 1):
                row[j] -= factor * upper[j]
    for j in range(n - 1, -1, -1):
        rows[j][n] = value = rows[j][n] / rows[j][j]
        for row in rows[:j]:
            row[n] -= row[j] * value
    return RUNNING, near
