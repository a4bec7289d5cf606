"""Many orbits at once in whole numpy arrays, and few in plain Python: what runs where numba is not installed.

Lanes are taken in groups whose arrays stay in the processor's cache. In normal form they are only looked at for
anything unusual: one minimum over all of them in a step. If there is something, the steps are taken once more to find
the lanes concerned, and by these with all tests.
"""

from __future__ import annotations

from abc import abstractmethod
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.maps.floats.advance import Engine, Kept, segments
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
    PlanarRows,
    Run,
)

_PIECE, _LONG_PIECE = 64, 4096  # steps between looks at what was unusual, in many lanes and at most in few
Outcome = tuple[FloatArray, NDArray[np.int8], NDArray[np.int64]]


class Numpy(Engine):
    """Advances lanes in whole arrays, and up to `few` of them in Python's own floats."""

    few = 16

    @abstractmethod
    def one(self, z: FloatArray) -> Outcome:
        """One step: the images, the status of each lane, and how many blocks or pivots were near-singular."""

    @abstractmethod
    def step(self, x: list[float]) -> tuple[list[float], int, int]:
        """The same for one lane. It may be RUNNING where the image is not finite."""

    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        with np.errstate(all="ignore"):
            for index, count in segments(first, steps, sampled):
                if hi - lo <= self.few:
                    for lane in range(lo, hi):
                        self.walk(lanes, lane, index, count, kept)
                else:
                    self.take(lanes, slice(lo, hi), index, count, kept)
                if sampled and (index + count) % sampled == 0:
                    self.sample(lanes, slice(lo, hi))

    def sample(self, lanes: Lanes, which: slice) -> None:
        """Look at the integrals, if there are any."""

    def take(self, lanes: Lanes, which: Any, first: int, count: int, kept: Kept) -> None:
        """Take some lanes, a slice of them or an array of numbers, through steps with all tests."""
        z, numbers = lanes.z[:, which].copy(), np.arange(len(lanes.status))[which]
        for index in range(first, first + count):
            z, status, near = self.one(z)
            if status.any() or near.any() or lanes.status[which].any():
                _note(lanes, numbers, index, z, status, near)
            kept.keep(index + 1, which, z)
        lanes.z[:, which] = z

    def walk(self, lanes: Lanes, lane: int, first: int, count: int, kept: Kept) -> None:
        """Take one lane through steps with all tests."""
        if lanes.status[lane] != RUNNING:
            return
        x = lanes.z[:, lane].tolist()
        for index in range(first, first + count):
            x, status, near = self.step(x)
            if status != RUNNING or not all(map(isfinite, x)):
                lanes.status[lane], lanes.failed_at[lane] = status or OVERFLOW, index + 1
                lanes.z[:, lane] = 0.0
                return
            if near:
                if not lanes.near[lane]:
                    lanes.near_at[lane] = index
                lanes.near[lane] += near
            kept.keep(index + 1, lane, x)
        lanes.z[:, lane] = x


def _note(lanes: Lanes, which: Any, index: int, image: FloatArray, status: Any, near: Any) -> None:
    """What a step of some lanes from the index was; the images of those that have ended become 0."""
    running = lanes.status[which] == RUNNING
    ends, close = running & (status != RUNNING), running & (status == RUNNING) & (near > 0)
    image[:, ~running | ends] = 0.0
    lanes.status[which[ends]] = status[ends]
    lanes.failed_at[which[ends]] = index + 1
    seen = which[close]
    lanes.near_at[seen] = np.where(lanes.near[seen] == 0, index, lanes.near_at[seen])
    lanes.near[seen] += near[close]


class PlanarNumpy(Numpy):
    """Steps in normal form. The two common kinds of block have their formulas here with buffers reused."""

    def __init__(self, rows: PlanarRows) -> None:
        self.rows = rows
        self._blocks = [  # formula, coefficients, what w is compared with, and where the coordinates stand
            (
                FORMULAS[run.kind, run.parts],
                rows.blocks.coefficients[run.first + b].tolist(),
                run.near,
                slice(run.row + b, run.row + b + run.parts * run.blocks, run.blocks),
            )
            for run in rows.runs
            for b in range(run.blocks)
        ]

    def sample(self, lanes: Lanes, which: slice) -> None:
        seen = self.rows.distances(lanes.z[:, which], lanes.base[:, :, which])
        seen[:, lanes.status[which] != RUNNING] = 0.0
        np.maximum(lanes.largest[:, which], seen, out=lanes.largest[:, which])

    def one(self, z: FloatArray) -> Outcome:
        """One step of all blocks; an orbit ends as the first of its blocks does."""
        status, near = np.zeros(z.shape[1], dtype=np.int8), np.zeros(z.shape[1], dtype=np.int64)
        image = np.empty_like(z)
        for run in self.rows.runs:
            *parts, w, g = FORMULAS[run.kind, run.parts](*run.of(z), self.rows.coefficients(run))
            for row, part in zip(run.of(image), parts, strict=True):
                row[:] = part
            near += (~(np.abs(w) > run.near + run.near * np.abs(g))).sum(axis=0)
            for of_block in np.atleast_2d(w):
                ends = np.where(of_block == 0.0, SINGULAR, np.where(np.isfinite(of_block), RUNNING, OVERFLOW))
                status = np.where(status == RUNNING, ends, status).astype(np.int8)
        status[(status == RUNNING) & ~np.isfinite(image).all(axis=0)] = OVERFLOW
        return image, status, near

    def step(self, x: list[float]) -> tuple[list[float], int, int]:
        image, status, near = x.copy(), RUNNING, 0
        for formula, k, limit, rows in self._blocks:
            try:
                *image[rows], w, g = formula(*x[rows], k)
            except ZeroDivisionError:  # where numpy and compiled code get an infinity
                w = g = 0.0
            if status == RUNNING:
                if w == 0.0 or not isfinite(w):
                    status = SINGULAR if w == 0.0 else OVERFLOW
                elif not abs(w) > limit + limit * abs(g):
                    near += 1
        return image, status, near

    def take(self, lanes: Lanes, which: Any, first: int, count: int, kept: Kept) -> None:
        for index, steps in segments(first, count, _PIECE):
            before = lanes.z[:, which].copy()
            z = before.copy()
            if self._together(z, which, index, steps, kept, None) and _sound(z, before).all():
                lanes.z[:, which] = z
                continue
            z[:], good = before, np.ones(z.shape[1], dtype=bool)
            self._together(z, which, index, steps, kept, good)
            good &= _sound(z, before)
            lanes.z[:, which] = np.where(good, z, before)
            lost = which.start + np.flatnonzero(~good)
            if len(lost) > self.few:
                super().take(lanes, lost, index, steps, kept)
            else:
                for lane in lost:
                    super().walk(lanes, lane, index, steps, kept)

    def walk(self, lanes: Lanes, lane: int, first: int, count: int, kept: Kept) -> None:
        index, last, piece = first, first + count, _PIECE
        while index < last and lanes.status[lane] == RUNNING:
            steps = min(piece, last - index)
            if self._alone(lanes, lane, index, steps, kept):
                piece = min(2 * piece, _LONG_PIECE)
            else:
                super().walk(lanes, lane, index, steps, kept)
                piece = _PIECE
            index += steps

    def _together(self, z: FloatArray, which: slice, first: int, count: int, kept: Kept, good: Any) -> bool:
        """Whether no lane met anything unusual; `good` tells which did, if given."""
        for index, steps in segments(first, count, kept.every):
            for run in self.rows.runs:
                sweep = _canonical if run.parts == 2 and run.kind in (LINES, CUBES) else self._any
                if not sweep(run, run.of(z), steps, good):
                    return False
            kept.keep(index + steps, which, z)
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

    def _alone(self, lanes: Lanes, lane: int, first: int, count: int, kept: Kept) -> bool:
        """Steps of one lane block by block, if all are usual."""
        before = lanes.z[:, lane].tolist()
        z, every = before.copy(), kept.every
        for formula, k, near, rows in self._blocks:
            state, path = z[rows], []
            try:
                for _ in range(count):
                    *state, w, g = formula(*state, k)
                    if not abs(w) > near + near * abs(g):
                        return False
                    if every:
                        path.append(state)
            except ZeroDivisionError:
                return False
            z[rows] = state
            states = path[every - first % every - 1 :: every] if every else []
            if states:
                row = first // every - kept.before
                kept.table[row : row + len(states), rows, lane] = states
        if not all(isfinite(x) and (x != 0.0 or old == 0.0) for x, old in zip(z, before, strict=True)):  # see _sound
            return False
        lanes.z[:, lane] = z
        return True


def _sound(z: FloatArray, before: FloatArray) -> Any:
    """Which lanes are finite and have not fallen to 0.

    Where w overflows and the numerators do not, the image is 0, and stays there: a point that all planar maps keep.
    """
    return np.isfinite(z).all(axis=0) & ~(((z == 0.0) & (before != 0.0)).any(axis=0))


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


class GenericNumpy(Numpy):
    """Steps of any map."""

    def __init__(self, equation: GenericEquation) -> None:
        self.equation = equation
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
        # By row and column, and then either one by one or, where there are many, in whole matrices.
        self._places = [
            (*divmod(entry, n + 1), k, factor) for entry in range(n * (n + 1)) for k, factor in terms[entry]
        ]
        self._terms: FloatArray | None = None
        if 3 * len(self._places) > n * n * (n + 1):
            self._terms = np.zeros((n + len(equation.products), n, n + 1, 1))
            for i, j, k, factor in self._places:
                self._terms[k, i, j] = factor

    def step(self, x: list[float]) -> tuple[list[float], int, int]:
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
        return [row[-1] for row in rows], status, near

    def one(self, z: FloatArray) -> Outcome:
        """One elimination."""
        n = self.equation.rows
        full = self._matrices(z)
        matrix, right = full[:, :n], full[:, n]
        sizes = np.fmax(np.fmax.reduce(np.abs(matrix), axis=1), 1.0)  # of the rows
        for p in range(n):
            much = MUCH * np.abs(full[p, p])
            for i in range(p + 1, n):
                wanted = np.abs(full[i, p]) > much
                if wanted.any():
                    _exchange(full[p, p:], full[i, p:], wanted)
                    _exchange(sizes[p], sizes[i], wanted)
                    much = MUCH * np.abs(full[p, p])
            factors = full[p + 1 :, p] * (1.0 / full[p, p])
            full[p + 1 :, p + 1 :] -= factors[:, None] * full[p, None, p + 1 :]
        for j in range(n - 1, -1, -1):
            right[j] /= matrix[j, j]
            right[:j] -= matrix[:j, j] * right[j]
        pivots = np.abs(matrix[range(n), range(n)])
        near = (pivots <= NEAR * sizes).any(axis=0).astype(np.int64)
        status = np.zeros(z.shape[1], dtype=np.int8)
        if not (0.0 < pivots.min() <= pivots.max() <= LARGEST >= sizes.max() and np.isfinite(right).all()):
            status[~(sizes <= LARGEST).all(axis=0)] = OVERFLOW
            for size in pivots:
                ends = np.where(size == 0.0, SINGULAR, np.where(size <= LARGEST, RUNNING, OVERFLOW))
                status = np.where(status == RUNNING, ends, status).astype(np.int8)
            status[(status == RUNNING) & ~np.isfinite(right).all(axis=0)] = OVERFLOW
        return right, status, near

    def _matrices(self, z: FloatArray) -> FloatArray:
        """(M | r) at the states."""
        y = list(z)
        for a, b in self.equation.products:
            y.append(y[a] * y[b])
        full: FloatArray = np.repeat(self.equation.constants[:, :, None], z.shape[1], axis=2)
        if self._terms is None:
            for i, j, k, factor in self._places:
                full[i, j] += factor * y[k]
        else:
            product = np.empty_like(full)
            for terms, value in zip(self._terms, y, strict=True):
                full += np.multiply(terms, value, out=product)
        return full


def _exchange(one: FloatArray, other: FloatArray, wanted: Any) -> None:
    """Two rows in the lanes that want it."""
    kept = one.copy()
    np.copyto(one, other, where=wanted)
    np.copyto(other, kept, where=wanted)


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
