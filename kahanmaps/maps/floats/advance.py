"""How orbits side by side are advanced: all together, and those that meet something unusual again with all tests.

Compiled kernels do both (numba_kernel.py). A kernel in whole arrays takes many lanes through many steps and says in
which of them every step was usual. The others are taken again from where they were, in halves, until a single step is
left, which `Halved.one` looks at: it may be near-singular, or the last one. So such a kernel needs no test that ends an
orbit, and what is unusual costs as much as it is rare.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.steps import (
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
)

_SHARES = 8  # of the lanes for each thread: other programs run too
_MULTIPLE = 256  # lanes that compiled kernels take together
Outcome = tuple[FloatArray, NDArray[np.int8], NDArray[np.int64]]


class Kept(NamedTuple):
    """The states at multiples of `every` (0: none) go to `table[row:, :, lane:]`."""

    every: int
    table: FloatArray
    row: int = 0
    lane: int = 0

    def rows(self, first: int, count: int) -> int:
        """How many come in `count` steps from the index `first`."""
        return (first + count) // self.every - first // self.every if self.every else 0

    def of(self, lanes: int, first: int, count: int) -> Kept:
        """The same for lanes that are taken apart, to a table of their own."""
        return Kept(self.every, np.empty((self.rows(first, count), self.table.shape[1], lanes)))

    def after(self, first: int, count: int) -> Kept:
        """The same for the steps behind these."""
        return self._replace(row=self.row + self.rows(first, count))

    def keep(self, z: FloatArray, index: int) -> Kept:
        """Write the states at an index, if they are wanted; the same for the steps behind."""
        if self.every == 0 or index % self.every:
            return self
        self.table[self.row, :, self.lane : self.lane + z.shape[1]] = z
        return self._replace(row=self.row + 1)


NOTHING = Kept(0, np.empty((0, 0, 0)))


class Engine(ABC):
    """Takes states (rows, n) to their images."""

    group = 4096  # lanes that are taken together by a single thread
    threads = 1

    @abstractmethod
    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        """Take the lanes lo, ..., hi - 1 through the steps; what is kept of an orbit that has ended does not count."""

    def advance(self, lanes: Lanes, first: int, steps: int, kept: Kept, sampled: int) -> None:
        """Take all lanes `steps` steps from the index `first`; states after the end of an orbit become NaN.

        In normal form the integrals are looked at at multiples of `sampled`.
        """
        in_ranges(
            lambda lo, hi: self.run(lanes, lo, hi, first, steps, kept, sampled),
            lanes.z.shape[1],
            self.threads,
            self.group,
        )
        if len(kept.table) and (lanes.status != RUNNING).any():
            at = (first // kept.every + 1 + np.arange(len(kept.table))) * kept.every
            gone = (lanes.failed_at >= 0) & (at[:, None] >= lanes.failed_at)
            kept.table.transpose(0, 2, 1)[gone] = np.nan


class Halved(Engine):
    """Engines that only say which lanes were usual."""

    piece = 64  # steps that are taken together in many lanes,
    long_piece = 4096  # and in few
    few = 16

    @abstractmethod
    def take(self, z: FloatArray, first: int, count: int, kept: Kept) -> Any:
        """Take the states `count` steps from the index `first`, in place; for each lane whether all were usual.

        Where one was not, what stands in z and in the tables afterwards does not count.
        """

    @abstractmethod
    def one(self, z: FloatArray) -> Outcome:
        """One step: the images, the status of each lane, and how many blocks or pivots were near-singular."""

    def sample(self, lanes: Lanes, which: slice) -> None:
        """Look at the integrals, if there are any."""

    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        piece = self.long_piece if hi - lo <= self.few else self.piece
        kept, which = kept._replace(lane=lo), slice(lo, hi)
        for index, count in segments(first, steps, piece, sampled):
            self._take(lanes, which, index, count, kept)
            kept = kept.after(index, count)
            if sampled and (index + count) % sampled == 0:
                self.sample(lanes, which)

    def _take(self, lanes: Lanes, which: Any, index: int, count: int, kept: Kept) -> None:
        """Take some lanes, a slice of them or an array of numbers, through a piece."""
        before = np.array(lanes.z[:, which], order="C")
        z = before.copy()
        fine = self.take(z, index, count, kept)
        lanes.z[:, which] = z
        if fine.all():
            return
        bad = np.flatnonzero(~fine)
        lost = bad + which.start if isinstance(which, slice) else which[bad]
        if count == 1:
            self._look(lanes, lost, index, before[:, bad], kept, bad)
            return
        lanes.z[:, lost] = before[:, bad]
        for start, part in ((index, count // 2), (index + count // 2, count - count // 2)):
            apart = kept.of(len(bad), start, part)
            self._take(lanes, lost, start, part, apart)
            if len(apart.table):
                kept.table[kept.row : kept.row + len(apart.table), :, kept.lane + bad] = apart.table
            kept = kept.after(start, part)

    def _look(self, lanes: Lanes, lost: Any, index: int, before: FloatArray, kept: Kept, places: Any) -> None:
        """One step of lanes in which it is unusual."""
        with np.errstate(all="ignore"):
            image, status, near = self.one(before)
        note(lanes, lost, index, image, status, near)
        lanes.z[:, lost] = image
        if kept.rows(index, 1):
            kept.table[kept.row, :, kept.lane + places] = image.T


def note(lanes: Lanes, which: Any, index: int, image: FloatArray, status: Any, near: Any) -> None:
    """What a step of some lanes from the index was; the images of those that have ended become 0."""
    running = lanes.status[which] == RUNNING
    ends, close = running & (status != RUNNING), running & (status == RUNNING) & (near > 0)
    image[:, ~running | ends] = 0.0
    lanes.status[which[ends]] = status[ends]
    lanes.failed_at[which[ends]] = index + 1
    seen = which[close]
    lanes.near_at[seen] = np.where(lanes.near[seen] == 0, index, lanes.near_at[seen])
    lanes.near[seen] += near[close]


class Planar(Halved):
    """Engines in normal form."""

    def __init__(self, rows: PlanarRows) -> None:
        self.rows = rows

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


def sound(z: FloatArray, before: FloatArray) -> Any:
    """Which lanes are finite and have not fallen to 0.

    Where w overflows and the numerators do not, the image is 0, and stays there: a point that all planar maps keep.
    """
    return np.isfinite(z).all(axis=0) & ~(((z == 0.0) & (before != 0.0)).any(axis=0))


class Generic(Engine):
    """Engines for any map with an equation."""

    def __init__(self, equation: GenericEquation) -> None:
        self.equation = equation
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


class Word(Engine):
    """Several engines one after the other, each for a step."""

    def __init__(self, engines: Sequence[Engine]) -> None:
        self.engines = engines

    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        kept = kept._replace(lane=lo)
        for index in range(first, first + steps):
            for engine in self.engines:
                engine.run(lanes, lo, hi, index, 1, NOTHING, 0)
            kept = kept.keep(lanes.z[:, lo:hi], index + 1)


def segments(first: int, count: int, *intervals: int) -> Iterator[tuple[int, int]]:
    """Index and number of steps of segments that end at every multiple of the intervals (0: none)."""
    index = first
    while index < first + count:
        end = min([first + count, *(index - index % interval + interval for interval in intervals if interval)])
        yield index, end - index
        index = end


def in_ranges(run: Callable[[int, int], None], lanes: int, threads: int, width: int) -> None:
    """Run on ranges of at most `width` lanes, or on several threads on several for each."""
    share = -(-lanes // (threads * _SHARES * _MULTIPLE)) * _MULTIPLE if threads > 1 else width
    ranges = [(lo, min(lanes, lo + share)) for lo in range(0, lanes, share)]
    if threads == 1 or len(ranges) == 1:
        for lo, hi in ranges:
            run(lo, hi)
        return
    with ThreadPoolExecutor(min(threads, len(ranges))) as pool:
        for done in [pool.submit(run, lo, hi) for lo, hi in ranges]:
            done.result()
