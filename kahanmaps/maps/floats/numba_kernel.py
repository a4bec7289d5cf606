"""Compiled kernels; needs numba, and is imported only by those who have asked for it or have it (ensemble.py).

In normal form blocks know nothing of each other: all blocks of one kind are taken together, those of 256 lanes in
vector registers and the innermost cache, and those of a single orbit such that the steps of one hide the time that a
chain of operations takes in another. The generic elimination runs over 128 lanes, exchanging rows in those that want
it; for single orbits the same code is compiled for one lane. Steps are only watched for anything unusual (advance.py).

Operations and their order are those of steps.py, which are compiled here. Without fastmath nothing is contracted or
reordered. Kernels release the interpreter lock and are started by Python threads on ranges of lanes. So no threading
layer of numba is needed; the one that is always there aborts the program if two threads use it at once.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np

from kahanmaps.maps.floats import steps as float_steps
from kahanmaps.maps.floats.advance import NOTHING, Generic, Kept, Planar
from kahanmaps.maps.floats.blocks import CUBES, GENERAL, LINES
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.steps import GenericEquation, PlanarRows
from kahanmaps.maps.kept_code import compiled

_WIDTH = 256
_FEW = 16  # blocks of a kind
_LANES = 128

NEAR = float_steps.NEAR
NEAR_SQUARED = float_steps.NEAR_SQUARED
MUCH = float_steps.MUCH
LARGEST = float_steps.LARGEST

_NONE = Kept(0, NOTHING)


class PlanarRoom(NamedTuple):
    """What a kernel in normal form works in: the states of some lanes, and for each block 1, or 0 (unusual)."""

    buffer: FloatArray
    usual: FloatArray


class GenericRoom(NamedTuple):
    """What the elimination works in: points and images, (M | r), sizes of rows, and a number a lane twice."""

    x: FloatArray
    right: FloatArray
    M: FloatArray
    sizes: FloatArray
    inverse: FloatArray
    fine: FloatArray


_inner = numba.njit(error_model="numpy", nogil=True)

real_lines = _inner(float_steps.real_lines)
real_cubes = _inner(float_steps.real_cubes)
real_general = _inner(float_steps.real_general)
complex_lines = _inner(float_steps.complex_lines)
complex_general = _inner(float_steps.complex_general)


@_inner
def _eight(k: Any) -> Any:
    return (k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7])


def _real_sweep(formula: Any) -> Any:
    """Steps of one real block in many lanes; `fine` becomes 0 in those where one is unusual."""

    @_inner
    def swept(U: Any, V: Any, k: Any, width: int, count: int, fine: Any) -> None:
        for _ in range(count):
            for i in range(width):
                U[i], V[i], w, g = formula(U[i], V[i], k)
                if not abs(w) > NEAR + NEAR * abs(g):
                    fine[i] = 0.0

    return swept


def _complex_sweep(formula: Any) -> Any:
    @_inner
    def swept(Ur: Any, Ui: Any, Vr: Any, Vi: Any, k: Any, width: int, count: int, fine: Any) -> None:
        for _ in range(count):
            for i in range(width):
                Ur[i], Ui[i], Vr[i], Vi[i], w, g = formula(Ur[i], Ui[i], Vr[i], Vi[i], k)
                if not w > NEAR_SQUARED + NEAR_SQUARED * g:
                    fine[i] = 0.0

    return swept


def _real_fours(formula: Any) -> Any:
    """The same in few lanes, four of them together in registers; the last one again where there are fewer."""

    @_inner
    def fours(U: Any, V: Any, k: Any, width: int, count: int, fine: Any) -> None:
        for a in range(0, width, 4):
            b, c, d = min(a + 1, width - 1), min(a + 2, width - 1), min(a + 3, width - 1)
            U0, V0, U1, V1, U2, V2, U3, V3 = U[a], V[a], U[b], V[b], U[c], V[c], U[d], V[d]
            good = True
            for _ in range(count):
                U0, V0, w0, g0 = formula(U0, V0, k)
                U1, V1, w1, g1 = formula(U1, V1, k)
                U2, V2, w2, g2 = formula(U2, V2, k)
                U3, V3, w3, g3 = formula(U3, V3, k)
                good &= (abs(w0) > NEAR + NEAR * abs(g0)) & (abs(w1) > NEAR + NEAR * abs(g1))
                good &= (abs(w2) > NEAR + NEAR * abs(g2)) & (abs(w3) > NEAR + NEAR * abs(g3))
            U[a], V[a], U[b], V[b], U[c], V[c], U[d], V[d] = U0, V0, U1, V1, U2, V2, U3, V3
            if not good:
                fine[a] = fine[b] = fine[c] = fine[d] = 0.0

    return fours


def _complex_twos(formula: Any) -> Any:
    @_inner
    def twos(U: Any, V: Any, W: Any, T: Any, k: Any, width: int, count: int, fine: Any) -> None:
        for i in range(0, width, 2):
            j = min(i + 1, width - 1)
            a, b, c, d, e, f, g, h = U[i], V[i], W[i], T[i], U[j], V[j], W[j], T[j]
            good = True
            for _ in range(count):
                a, b, c, d, n, s = formula(a, b, c, d, k)
                e, f, g, h, m, t = formula(e, f, g, h, k)
                good &= (n > NEAR_SQUARED + NEAR_SQUARED * s) & (m > NEAR_SQUARED + NEAR_SQUARED * t)
            U[i], V[i], W[i], T[i], U[j], V[j], W[j], T[j] = a, b, c, d, e, f, g, h
            if not good:
                fine[i] = fine[j] = 0.0

    return twos


# A formula handed to a compiled function as an argument would keep the machine code from being stored.
_sweep_real_lines, _sweep_real_cubes = _real_sweep(real_lines), _real_sweep(real_cubes)
_sweep_real_general = _real_sweep(real_general)
_four_lines, _four_cubes = _real_fours(real_lines), _real_fours(real_cubes)
_two_lines = _complex_twos(complex_lines)
_sweep_complex_lines, _sweep_complex_general = _complex_sweep(complex_lines), _complex_sweep(complex_general)


@_inner
def _sweep(state: Any, width: int, run: Any, coefficients: Any, count: int, usual: Any) -> None:
    """Steps of all blocks of a run: `state` has their rows, of `width` lanes each, one behind the other."""
    kind, parts, blocks, k = run[0], run[1], run[3], _eight(coefficients[run[4]])
    size, at = blocks * width, run[2] * width
    few, share = size <= _FEW, size if size <= _WIDTH else width
    for low in range(0, size, share):
        fine = usual[low : low + share]
        U, V = state[at + low : at + low + share], state[at + size + low : at + size + low + share]
        if parts == 2 and kind == LINES:
            if few:
                _four_lines(U, V, k, share, count, fine)
            else:
                _sweep_real_lines(U, V, k, share, count, fine)
        elif parts == 2 and kind == CUBES:
            if few:
                _four_cubes(U, V, k, share, count, fine)
            else:
                _sweep_real_cubes(U, V, k, share, count, fine)
        elif parts == 2:
            _sweep_real_general(U, V, k, share, count, fine)
        else:
            far = at + 2 * size + low
            W, T = state[far : far + share], state[far + size : far + size + share]
            if kind == GENERAL:
                _sweep_complex_general(U, V, W, T, k, share, count, fine)
            elif few:
                _two_lines(U, V, W, T, k, share, count, fine)
            else:
                _sweep_complex_lines(U, V, W, T, k, share, count, fine)


@_inner
def _next(index: int, last: int, one: Kept, other: Kept) -> int:
    """The next index at which something is kept, or the last one."""
    if one.every:
        last = min(last, index - index % one.every + one.every)
    if other.every:
        last = min(last, index - index % other.every + other.every)
    return last


@_inner
def _keep(state: Any, stride: int, at: int, width: int, index: int, row: int, kept: Kept) -> int:
    """Write the states of the lanes from `at` on to the table, if they are wanted; the next row."""
    if kept.every == 0 or index % kept.every:
        return row
    for j in range(kept.table.shape[1]):
        for i in range(width):
            kept.table[row, j, kept.lane + at + i] = state[j * stride + i]
    return row + 1


def _planar_kernel(stamp: int) -> Any:
    def planar_take(
        z: Any,
        runs: Any,
        coefficients: Any,
        first: int,
        count: int,
        kept: Kept,
        also: Kept,
        room: PlanarRoom,
        fine: Any,
    ) -> int:
        rows, lanes, last = z.shape[0], z.shape[1], first + count
        state, usual = room.buffer, room.usual
        for at in range(0, lanes, _WIDTH):
            width = min(_WIDTH, lanes - at)
            for j in range(rows):
                for i in range(width):
                    state[j * width + i] = z[j, at + i]
            usual[:] = 1.0
            index, row, other = first, kept.row, also.row
            while index < last:
                end = _next(index, last, kept, also)
                for r in range(len(runs)):
                    _sweep(state, width, runs[r], coefficients, end - index, usual)
                index = end
                row = _keep(state, width, at, width, index, row, kept)
                other = _keep(state, width, at, width, index, other, also)
            for j in range(rows):
                for i in range(width):
                    value = state[j * width + i]
                    # Where w overflows and the numerators do not, the image is 0, and stays there; see advance.sound.
                    if not ((abs(value) <= LARGEST) & ((value != 0.0) | (z[j, at + i] == 0.0))):
                        fine[at + i] = False
                    z[j, at + i] = value
            for r in range(len(runs)):
                for b in range(runs[r, 3]):
                    for i in range(width):
                        fine[at + i] &= usual[b * width + i] != 0.0
        return stamp

    return planar_take


@_inner
def _fill(x: Any, equation: GenericEquation, M: Any, sizes: Any) -> None:
    """The matrices at x, and for each row the largest of 1 and its entries."""
    first, columns, factors, products = equation.first, equation.columns, equation.factors, equation.products
    n = len(equation.constants)
    for t in range(len(products)):
        a, b = products[t, 0], products[t, 1]
        for l in range(_LANES):
            x[n + t, l] = x[a, l] * x[b, l]
    for i in range(n):
        for l in range(_LANES):
            sizes[i, l] = 1.0
        for j in range(n + 1):
            entry, constant = M[i * (n + 1) + j], equation.constants[i, j]
            t, end = first[i * (n + 1) + j], first[i * (n + 1) + j + 1]
            if end - t >= 3:
                a, b, c = factors[t], factors[t + 1], factors[t + 2]
                A, B, C = x[columns[t]], x[columns[t + 1]], x[columns[t + 2]]
                for l in range(_LANES):
                    entry[l] = ((constant + a * A[l]) + b * B[l]) + c * C[l]
                t += 3
            else:
                for l in range(_LANES):
                    entry[l] = constant
            while end - t >= 3:
                a, b, c = factors[t], factors[t + 1], factors[t + 2]
                A, B, C = x[columns[t]], x[columns[t + 1]], x[columns[t + 2]]
                for l in range(_LANES):
                    entry[l] = ((entry[l] + a * A[l]) + b * B[l]) + c * C[l]
                t += 3
            while t < end:
                a, A = factors[t], x[columns[t]]
                for l in range(_LANES):
                    entry[l] += a * A[l]
                t += 1
            if j < n:
                size = sizes[i]
                for l in range(_LANES):
                    size[l] = abs(entry[l]) if abs(entry[l]) > size[l] else size[l]


@_inner
def _exchange(M: Any, a: int, b: int, wanted: Any) -> None:
    """Two rows in the lanes that want it."""
    for l in range(_LANES):
        one, other = M[a, l], M[b, l]
        M[a, l] = other if wanted[l] != 0.0 else one
        M[b, l] = one if wanted[l] != 0.0 else other


@_inner
def _eliminate(M: Any, p: int, n: int, sizes: Any, inverse: Any, fine: Any) -> None:
    """Column p out of the rows below row p, which is exchanged with others in the lanes that want it."""
    top = p * (n + 1)
    for i in range(p + 1, n):
        below, wanted = i * (n + 1), False
        for l in range(_LANES):
            wanted |= abs(M[below + p, l]) > MUCH * abs(M[top + p, l])
        if wanted:
            for l in range(_LANES):
                inverse[l] = 1.0 if abs(M[below + p, l]) > MUCH * abs(M[top + p, l]) else 0.0
            for j in range(p, n + 1):
                _exchange(M, top + j, below + j, inverse)
            _exchange(sizes, p, i, inverse)
    for l in range(_LANES):
        size = abs(M[top + p, l])
        fine[l] = fine[l] if (size > NEAR * sizes[p, l]) & (size <= LARGEST) else 0.0
        inverse[l] = 1.0 / M[top + p, l]
    for i in range(p + 1, n):
        factor = M[i * (n + 1) + p]
        for l in range(_LANES):
            factor[l] = factor[l] * inverse[l]
        j = p + 1
        while j + 1 <= n:
            entry, upper = M[i * (n + 1) + j], M[top + j]
            other, above = M[i * (n + 1) + j + 1], M[top + j + 1]
            for l in range(_LANES):
                entry[l] -= factor[l] * upper[l]
                other[l] -= factor[l] * above[l]
            j += 2
        while j <= n:
            entry, upper = M[i * (n + 1) + j], M[top + j]
            for l in range(_LANES):
                entry[l] -= factor[l] * upper[l]
            j += 1


@_inner
def _step_many(x: Any, right: Any, equation: GenericEquation, room: GenericRoom) -> None:
    """One step of all lanes: images into `right`; `fine` becomes 0 where something is unusual.

    M has n rows of n + 1 entries, the last one the right-hand side. Loops over the lanes do several operations,
    which saves loads and stores, but not too many: a loop over more than a handful of rows is not vectorised,
    because the compiler would have to test too many pairs of them for overlap.
    """
    n = len(equation.constants)
    M, sizes, fine = room.M, room.sizes, room.fine
    _fill(x, equation, M, sizes)  # an infinite entry makes its row's size infinite, and its pivot small
    for p in range(n):
        _eliminate(M, p, n, sizes, room.inverse, fine)
    for j in range(n - 1, -1, -1):
        value, pivot = j * (n + 1) + n, j * (n + 1) + j
        for l in range(_LANES):
            right[j, l] = M[value, l] / M[pivot, l]
            fine[l] = fine[l] if abs(right[j, l]) <= LARGEST else 0.0
        for i in range(j):
            value, pivot = i * (n + 1) + n, i * (n + 1) + j
            for l in range(_LANES):
                M[value, l] -= M[pivot, l] * right[j, l]


@_inner
def _step_one(x: Any, right: Any, equation: GenericEquation, M: Any, sizes: Any) -> bool:
    """The same for one lane; whether nothing was unusual."""
    constants, first, columns = equation.constants, equation.first, equation.columns
    factors, products = equation.factors, equation.products
    n = len(constants)
    for t in range(len(products)):
        x[n + t] = x[products[t, 0]] * x[products[t, 1]]
    for i in range(n):
        sizes[i] = 1.0
        for j in range(n + 1):
            total = constants[i, j]
            for t in range(first[i * (n + 1) + j], first[i * (n + 1) + j + 1]):
                total += factors[t] * x[columns[t]]
            if j == n:
                right[i] = total
                continue
            M[i, j] = total
            if abs(total) > sizes[i]:
                sizes[i] = abs(total)
    for p in range(n):
        for i in range(p + 1, n):
            if abs(M[i, p]) > MUCH * abs(M[p, p]):
                for j in range(p, n):
                    M[p, j], M[i, j] = M[i, j], M[p, j]
                right[p], right[i] = right[i], right[p]
                sizes[p], sizes[i] = sizes[i], sizes[p]
        if not (abs(M[p, p]) > NEAR * sizes[p] and abs(M[p, p]) <= LARGEST):
            return False
        inverse = 1.0 / M[p, p]
        for i in range(p + 1, n):
            factor = M[i, p] * inverse
            for j in range(p + 1, n):
                M[i, j] -= factor * M[p, j]
            right[i] -= factor * right[p]
    usual = True
    for j in range(n - 1, -1, -1):
        right[j] /= M[j, j]
        usual &= abs(right[j]) <= LARGEST
        for i in range(j):
            right[i] -= M[i, j] * right[j]
    return usual


def _generic_kernel(stamp: int) -> Any:
    def generic_take(
        z: Any, equation: GenericEquation, first: int, count: int, kept: Kept, room: GenericRoom, usual: Any
    ) -> int:
        n, lanes, wide = z.shape[0], z.shape[1], len(room.fine)
        x, right = room.x, room.right
        M, alone, image, sizes = np.empty((n, n)), np.empty(len(x)), np.empty(n), np.empty(n)
        for at in range(0, lanes, wide):
            width = min(wide, lanes - at)
            for j in range(n):
                for i in range(wide):
                    x[j, i] = z[j, at + i] if i < width else z[j, at]  # lanes that nobody looks at
            room.fine[:] = 1.0
            row = kept.row
            for index in range(first, first + count):
                if wide > 1:
                    _step_many(x, right, equation, room)
                    x, right = right, x
                else:
                    for j in range(n):
                        alone[j] = x[j, 0]
                    if not _step_one(alone, image, equation, M, sizes):
                        room.fine[0] = 0.0
                        break
                    for j in range(n):
                        x[j, 0] = image[j]
                if kept.every and (index + 1) % kept.every == 0:
                    row = _keep(x.ravel(), wide, at, width, index + 1, row, kept)
            for i in range(width):
                usual[at + i] = room.fine[i] != 0.0
                for j in range(n):
                    z[j, at + i] = x[j, i]
        return stamp

    return generic_take


# A checksum of the formulas' file: machine code kept on disk goes by the age of this file alone.
_STAMP = zlib.crc32(Path(float_steps.__file__).read_bytes())
_kernel = partial(compiled, error_model="numpy", nogil=True)
planar_take = _kernel(_planar_kernel(_STAMP))
generic_take = _kernel(_generic_kernel(_STAMP))


class PlanarNumba(Planar):
    """Steps in normal form."""

    piece, long_piece, group = 4096, 1 << 16, 2048

    def __init__(self, rows: PlanarRows) -> None:
        super().__init__(rows)
        self._runs = np.array(rows.runs, dtype=np.int64)

    def take(self, z: FloatArray, first: int, count: int, kept: Sequence[Kept]) -> Any:
        blocks = self.rows.blocks
        most = int(self._runs[:, 3].max())
        one, other, *_ = [*kept, _NONE, _NONE]
        room = PlanarRoom(_aligned(len(z), _WIDTH).ravel(), _aligned(most, _WIDTH).ravel())
        fine = np.ones(z.shape[1], dtype=bool)
        planar_take(z, self._runs, blocks.coefficients, first, count, one, other, room, fine)
        return fine


class GenericNumba(Generic):
    """Steps of any map."""

    piece, long_piece, few, group = 128, 1 << 14, 8, 1024

    def take(self, z: FloatArray, first: int, count: int, kept: Sequence[Kept]) -> Any:
        n, more = self.equation.rows, len(self.equation.products)
        wide = 1 if z.shape[1] <= self.few else _LANES
        x, right, M, sizes = (_aligned(rows, wide) for rows in (n + more, n + more, n * (n + 1), n))
        room = GenericRoom(x, right, M, sizes, _aligned(1, wide)[0], _aligned(1, wide)[0])
        fine = np.ones(z.shape[1], dtype=bool)
        generic_take(z, self.equation, first, count, kept[0] if kept else _NONE, room, fine)
        return fine


def _aligned(rows: int, width: int) -> FloatArray:
    """Zeros (rows, width) from the beginning of a cache line on: vectors across two of them cost a third of the speed.

    Kernels are given such arrays, for those that they make themselves may begin anywhere.
    """
    memory = np.zeros(rows * width + 8)
    skipped = -(memory.ctypes.data // 8) % 8
    return memory[skipped : skipped + rows * width].reshape(rows, width)
