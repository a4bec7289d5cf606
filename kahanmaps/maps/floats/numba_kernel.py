"""Compiled kernels; needs numba, and is imported only by those who have asked for it or have it (ensemble.py).

There is one loop, over lanes and steps. It takes many lanes together through steps that are only watched for anything
unusual; lanes that met it are taken again from where they were, one by one and with all tests, for a Python call for
each of them would cost a thousand times as much. Two kinds of steps are put into it:

In normal form blocks know nothing of each other: all blocks of one kind are taken together, those of 256 lanes in
vector registers and the innermost cache, and those of a single orbit such that the steps of one hide the time that a
chain of operations takes in another. The generic elimination runs over 128 lanes, exchanging rows in those that want
it; of few lanes it takes one after the other.

Operations and their order are those of steps.py, which are compiled here. Without fastmath nothing is contracted or
reordered. Kernels release the interpreter lock and are started by Python threads on ranges of lanes. So no threading
layer of numba is needed; the one that is always there aborts the program if two threads use it at once.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np

from kahanmaps.maps.floats import steps as float_steps
from kahanmaps.maps.floats.advance import Engine, Kept
from kahanmaps.maps.floats.blocks import CUBES, GENERAL, LINES
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.steps import (
    LARGEST,
    MUCH,
    NEAR,
    NEAR_SQUARED,
    OVERFLOW,
    RUNNING,
    SINGULAR,
    GenericEquation,
    Lanes,
    PlanarRows,
)
from kahanmaps.maps.kept_code import compiled

_WIDTH = 256
_PIECE, _LEAST = 1024, 16  # steps between looks at what was unusual; fewer after there was something
_FEW = 16  # blocks of a kind
_LANES = 128
_ALL = 1 << 62
_ALONE = 8  # lanes, up to which the elimination takes them one by one

_inner = numba.njit(error_model="numpy", nogil=True)


class Room(NamedTuple):
    """What the loop works in: how many lanes are taken together, in rows as long for fewer where they are `fixed`.

    A lane that is `alone` is taken with all tests at once. `x` and `image` hold the rows of states before and after
    `piece` steps, one behind the other, `z` and `M` the state and the matrix of one lane. `fine` is 0 in lanes where
    something is unusual; `work` is for steps of many.
    """

    lanes: int
    fixed: bool
    alone: bool
    piece: int
    x: FloatArray
    image: FloatArray
    z: FloatArray
    M: FloatArray
    fine: FloatArray
    work: Any


def _loop(many: Any, one: Any, sample: Any) -> Any:
    """The loop for a kind of steps, given by three compiled functions.

    `many(x, image, width, count, numbers, fine, work)` takes lanes through steps, says whether all were usual, and
    else has `fine` tell in which lanes. `one(z, first, end, numbers, M)` takes a lane through steps with all tests, as
    far as they exist, and returns the index reached, the status, how often it was near-singular and where first.
    `sample(x, width, at, numbers, lanes)` looks at the integrals.
    """

    @_inner
    def advance(
        lanes: Lanes, lo: int, hi: int, numbers: Any, first: int, steps: int, sampled: int, kept: Kept, room: Room
    ) -> None:
        x, image, fine, work, status = room.x, room.image, room.fine, room.work, lanes.status
        z, M, alone = room.z, room.M, room.alone
        rows, last, table, every = lanes.z.shape[0], first + steps, kept.table, kept.every
        most, least = room.piece, room.piece if alone else min(room.piece, _LEAST)
        for at in range(lo, hi, room.lanes):
            width = min(room.lanes, hi - at)
            wide = room.lanes if room.fixed else width
            for j in range(rows):
                for i in range(wide):
                    x[j * wide + i] = lanes.z[j, at + i] if i < width else lanes.z[j, at]  # lanes that nobody looks at
            index, row, piece = first, 0, least
            to_keep, to_sample = _multiple(first, every), _multiple(first, sampled)
            while index < last:
                end = min(last, index + piece, to_keep, to_sample)
                piece = min(2 * piece, most)
                if alone or not many(x, image, wide, end - index, numbers, fine, work):
                    piece = least
                    for i in range(width):
                        if fine[i] != 0.0:
                            continue
                        lane = at + i
                        for j in range(rows):
                            z[j] = x[j * wide + i]
                        if status[lane] == RUNNING:
                            stopped, failed, near, where = one(z, index, end, numbers, M)
                            if failed != RUNNING:
                                status[lane], lanes.failed_at[lane] = failed, stopped
                            if near:
                                lanes.near_at[lane] = where if lanes.near[lane] == 0 else lanes.near_at[lane]
                                lanes.near[lane] += near
                        for j in range(rows):
                            image[j * wide + i] = z[j] if status[lane] == RUNNING else 0.0
                index, x, image = end, image, x
                if index == to_keep:
                    for j in range(rows):
                        for i in range(width):
                            table[row, j, at + i] = x[j * wide + i]
                    row, to_keep = row + 1, to_keep + every
                if index == to_sample:
                    sample(x, width, at, numbers, lanes)
                    to_sample += sampled
            for j in range(rows):
                for i in range(width):
                    lanes.z[j, at + i] = x[j * wide + i] if status[at + i] == RUNNING else 0.0

    return advance


@_inner
def _multiple(index: int, every: int) -> int:
    """The next multiple (0: none)."""
    return index - index % every + every if every else _ALL


# Steps in normal form.


class Numbers(NamedTuple):
    """Of a normal form what a step needs: its runs, and by block a, b, c, d and the factor of the integral.

    There are `rows` rows in a state, and `most` blocks in a run.
    """

    runs: Any
    coefficients: FloatArray
    kappa: FloatArray
    rows: int
    most: int


real_lines = _inner(float_steps.real_lines)
real_cubes = _inner(float_steps.real_cubes)
real_general = _inner(float_steps.real_general)
complex_lines = _inner(float_steps.complex_lines)
complex_general = _inner(float_steps.complex_general)
real_integral = _inner(float_steps.real_integral)
complex_integral = _inner(float_steps.complex_integral)


@_inner
def _eight(k: Any, r: int) -> Any:
    return (k[r, 0], k[r, 1], k[r, 2], k[r, 3], k[r, 4], k[r, 5], k[r, 6], k[r, 7])


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
    kind, parts, blocks, k = run[0], run[1], run[3], _eight(coefficients, run[4])
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
def _planar_many(x: Any, image: Any, width: int, count: int, numbers: Numbers, fine: Any, work: None) -> bool:
    """Steps of all blocks, watched: `fine` has `width` lanes for each block of a run."""
    runs, rows, size, good = numbers.runs, numbers.rows * width, numbers.most * width, True
    for i in range(rows):
        image[i] = x[i]
    for i in range(size):
        fine[i] = 1.0
    for r in range(len(runs)):
        _sweep(image, width, runs[r], numbers.coefficients, count, fine)
    for i in range(size):
        good &= fine[i] != 0.0
    # Where w overflows and the numerators do not, the image is 0, and stays there; see numpy_kernel.py.
    for i in range(rows):
        good &= (abs(image[i]) <= LARGEST) & ((image[i] != 0.0) | (x[i] == 0.0))
    if not good:
        for i in range(width, size):
            fine[i % width] *= fine[i]
        for i in range(rows):
            if not ((abs(image[i]) <= LARGEST) & ((image[i] != 0.0) | (x[i] == 0.0))):
                fine[i % width] = 0.0
    return good


@_inner
def _planar_one(z: Any, first: int, end: int, numbers: Numbers, M: Any) -> Any:
    """Steps of one lane with all tests; an orbit ends as the first of its blocks does."""
    runs, coefficients = numbers.runs, numbers.coefficients
    total, where = 0, -1
    for index in range(first, end):
        status, near = RUNNING, 0
        for r in range(len(runs)):
            kind, real, far, k = runs[r, 0], runs[r, 1] == 2, runs[r, 3], _eight(coefficients, runs[r, 4])
            for at in range(runs[r, 2], runs[r, 2] + far):
                if real:
                    z[at], z[at + far], w, g = real_general(z[at], z[at + far], k)
                    usual = abs(w) > NEAR + NEAR * abs(g)
                else:
                    U, V, W, T = z[at], z[at + far], z[at + 2 * far], z[at + 3 * far]
                    if kind == LINES:
                        U, V, W, T, w, g = complex_lines(U, V, W, T, k)
                    else:
                        U, V, W, T, w, g = complex_general(U, V, W, T, k)
                    z[at], z[at + far], z[at + 2 * far], z[at + 3 * far] = U, V, W, T
                    usual = w > NEAR_SQUARED + NEAR_SQUARED * g
                if status == RUNNING:
                    if w == 0.0:
                        status = SINGULAR
                    elif not np.isfinite(w):
                        status = OVERFLOW
                    elif not usual:
                        near += 1
        if status == RUNNING:
            for j in range(len(z)):
                if not np.isfinite(z[j]):
                    status = OVERFLOW
        if status != RUNNING:
            return index + 1, status, total, where
        if near and total == 0:
            where = index
        total += near
    return end, RUNNING, total, where


@_inner
def _sample(state: Any, width: int, at: int, numbers: Numbers, lanes: Lanes) -> None:
    """PlanarRows.distances of the lanes from `at` on, the largest of which are kept for orbits that go on."""
    runs, alive = numbers.runs, lanes.status[at : at + width]
    for r in range(len(runs)):
        far = runs[r, 3] * width
        for b in range(runs[r, 3]):
            block, low = runs[r, 4] + b, (runs[r, 2] + b) * width
            k, kappa = _eight(numbers.coefficients, block), numbers.kappa[block]
            real, imaginary = lanes.base[block, 0, at : at + width], lanes.base[block, 1, at : at + width]
            top, U, V = lanes.largest[block, at : at + width], state[low:], state[low + far :]
            if runs[r, 1] == 2:
                for i in range(width):
                    x = abs(real_integral(U[i], V[i], k, kappa[0]) - real[i])
                    x = x if x <= np.inf else np.inf
                    top[i] = x if (x > top[i]) & (alive[i] == RUNNING) else top[i]
            else:
                W, T = state[low + 2 * far :], state[low + 3 * far :]
                for i in range(width):
                    x, y = complex_integral(U[i], V[i], W[i], T[i], k, kappa[0], kappa[1])
                    x, y = x - real[i], y - imaginary[i]
                    x = np.sqrt(x * x + y * y)
                    x = x if x <= np.inf else np.inf
                    top[i] = x if (x > top[i]) & (alive[i] == RUNNING) else top[i]


# Steps by elimination.


class Matrices(NamedTuple):
    """What the elimination of many lanes works in: (M | r), and a number a lane twice."""

    M: FloatArray
    scale: FloatArray
    inverse: FloatArray


@_inner
def _generic_one(x: Any, first: int, end: int, equation: GenericEquation, M: Any) -> Any:
    """Steps of one lane with all tests; x has room for the products, M for the rows of (M | r) and their sizes."""
    constants, starts, columns = equation.constants, equation.first, equation.columns
    factors, products, n, count, where = equation.factors, equation.products, len(equation.constants), 0, -1
    for index in range(first, end):
        near, scale = 0, 1.0
        for t in range(len(products)):
            x[n + t] = x[products[t, 0]] * x[products[t, 1]]
        for i in range(n):
            size = 1.0
            for j in range(n + 1):
                total = constants[i, j]
                for t in range(starts[i * (n + 1) + j], starts[i * (n + 1) + j + 1]):
                    total += factors[t] * x[columns[t]]
                M[i, j] = total
                if j < n and abs(total) > size:
                    size = abs(total)
            M[i, n + 1] = size
            if size > scale:
                scale = size
        if not scale <= LARGEST:
            return index + 1, OVERFLOW, count, where
        for p in range(n):
            for i in range(p + 1, n):
                if abs(M[i, p]) > MUCH * abs(M[p, p]):
                    for j in range(p, n + 2):
                        M[p, j], M[i, j] = M[i, j], M[p, j]
            if M[p, p] == 0.0:
                return index + 1, SINGULAR, count, where
            if not abs(M[p, p]) <= LARGEST:
                return index + 1, OVERFLOW, count, where
            if abs(M[p, p]) <= NEAR * M[p, n + 1]:
                near = 1
            inverse = 1.0 / M[p, p]
            for i in range(p + 1, n):
                factor = M[i, p] * inverse
                for j in range(p + 1, n + 1):
                    M[i, j] -= factor * M[p, j]
        for j in range(n - 1, -1, -1):
            x[j] = value = M[j, n] / M[j, j]
            if not np.isfinite(value):
                return index + 1, OVERFLOW, count, where
            for i in range(j):
                M[i, n] -= M[i, j] * value
        if near and count == 0:
            where = index
        count += near
    return end, RUNNING, count, where


@_inner
def _generic_many(
    x: Any, image: Any, width: int, count: int, equation: GenericEquation, fine: Any, work: Matrices
) -> bool:
    """One step of _LANES lanes, watched.

    M has n rows of n + 1 entries, the last one the right-hand side. Loops over the lanes do several operations, which
    saves loads and stores, but not too many: a loop over more than a handful of arrays is not vectorised, because the
    compiler would have to test too many pairs of them for overlap. For the same reason the number of lanes is a
    constant.
    """
    n, M, good = len(equation.constants), work.M, True
    _fill(x.reshape(-1, _LANES), equation, M, work.scale)
    for l in range(_LANES):
        fine[l] = 1.0
    for p in range(n):
        _eliminate(M, p, n, work.scale, work.inverse, fine)
    for j in range(n - 1, -1, -1):
        value, target, pivot = M[j * (n + 1) + n], image[j * _LANES : (j + 1) * _LANES], M[j * (n + 1) + j]
        for l in range(_LANES):
            target[l] = value[l] / pivot[l]
            fine[l] = fine[l] if abs(target[l]) <= LARGEST else 0.0
        for i in range(j):
            entry, upper = M[i * (n + 1) + n], M[i * (n + 1) + j]
            for l in range(_LANES):
                entry[l] -= upper[l] * target[l]
    for l in range(_LANES):
        good &= fine[l] != 0.0
    return good


@_inner
def _fill(x: Any, equation: GenericEquation, M: Any, scale: Any) -> None:
    """The matrices at x, and for each lane the largest of 1 and their entries."""
    first, columns, factors, products = equation.first, equation.columns, equation.factors, equation.products
    n = len(equation.constants)
    for l in range(_LANES):
        scale[l] = 1.0
    for t in range(len(products)):
        target, A, B = x[n + t], x[products[t, 0]], x[products[t, 1]]
        for l in range(_LANES):
            target[l] = A[l] * B[l]
    for i in range(n):
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
                for l in range(_LANES):
                    scale[l] = abs(entry[l]) if abs(entry[l]) > scale[l] else scale[l]


@_inner
def _eliminate(M: Any, p: int, n: int, scale: Any, inverse: Any, fine: Any) -> None:
    """Column p out of the rows below row p, which is exchanged with others in the lanes that want it."""
    pivot = M[p * (n + 1) + p]
    for i in range(p + 1, n):
        below = M[i * (n + 1) + p]
        wanted = False
        for l in range(_LANES):
            wanted |= abs(below[l]) > MUCH * abs(pivot[l])
        if wanted:
            for l in range(_LANES):
                inverse[l] = 1.0 if abs(below[l]) > MUCH * abs(pivot[l]) else 0.0
            for j in range(p, n + 1):
                upper, entry = M[p * (n + 1) + j], M[i * (n + 1) + j]
                for l in range(_LANES):
                    one, other = upper[l], entry[l]
                    upper[l] = other if inverse[l] != 0.0 else one
                    entry[l] = one if inverse[l] != 0.0 else other
    for l in range(_LANES):
        size = abs(pivot[l])
        fine[l] = fine[l] if (size > NEAR * scale[l]) & (size <= LARGEST) else 0.0
        inverse[l] = 1.0 / pivot[l]
    for i in range(p + 1, n):
        factor = M[i * (n + 1) + p]
        for l in range(_LANES):
            factor[l] = factor[l] * inverse[l]
        j = p + 1
        while j + 1 <= n:
            entry, upper = M[i * (n + 1) + j], M[p * (n + 1) + j]
            other, above = M[i * (n + 1) + j + 1], M[p * (n + 1) + j + 1]
            for l in range(_LANES):
                entry[l] -= factor[l] * upper[l]
                other[l] -= factor[l] * above[l]
            j += 2
        while j <= n:
            entry, upper = M[i * (n + 1) + j], M[p * (n + 1) + j]
            for l in range(_LANES):
                entry[l] -= factor[l] * upper[l]
            j += 1


@_inner
def _no_integrals(x: Any, width: int, at: int, numbers: GenericEquation, lanes: Lanes) -> None:
    """There are none."""


# What is kept on disk is a function without parts that are compiled functions: they have another name in each process.
_advance_planar = _loop(_planar_many, _planar_one, _sample)
_advance_generic = _loop(_generic_many, _generic_one, _no_integrals)


def _planar_kernel(stamp: int) -> Any:
    def planar_advance(*given: Any) -> int:
        _advance_planar(*given)
        return stamp

    return planar_advance


def _generic_kernel(stamp: int) -> Any:
    def generic_advance(*given: Any) -> int:
        _advance_generic(*given)
        return stamp

    return generic_advance


# A checksum of the formulas' file: machine code kept on disk goes by the age of this file alone.
_STAMP = zlib.crc32(Path(float_steps.__file__).read_bytes())
_kernel = partial(compiled, error_model="numpy", nogil=True)
planar_advance = _kernel(_planar_kernel(_STAMP))
generic_advance = _kernel(_generic_kernel(_STAMP))


class Numba(Engine):
    """Advances lanes by a compiled loop, in a room that is made for a number of lanes."""

    group = _ALL

    def __init__(self, advance: Any, numbers: Any, room: Callable[[int], Room]) -> None:
        self._advance, self._numbers, self._room = advance, numbers, room

    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        self._advance(lanes, lo, hi, self._numbers, first, steps, sampled, kept, self._room(hi - lo))


def planar_numba(rows: PlanarRows) -> Engine:
    """Advances lanes in normal form."""
    runs = np.array(rows.runs, dtype=np.int64)
    most, count = int(runs[:, 3].max()), rows.blocks.rows

    def room(_: int) -> Room:
        x, image, fine = (_aligned(number * _WIDTH) for number in (count, count, most))
        return Room(_WIDTH, False, False, _PIECE, x, image, np.zeros(count), np.zeros((0, 0)), fine, None)

    return Numba(planar_advance, Numbers(runs, rows.blocks.coefficients, rows.blocks.kappa, count, most), room)


def generic_numba(equation: GenericEquation) -> Engine:
    """Advances lanes of any map."""
    n, size = equation.rows, equation.rows + len(equation.products)

    def room(lanes: int) -> Room:
        wide, piece = (1, _PIECE) if lanes <= _ALONE else (_LANES, 1)
        x, image, M, scale, inverse, fine = (_aligned(rows * wide) for rows in (size, size, n * (n + 1), 1, 1, 1))
        work = Matrices(M.reshape(-1, wide), scale, inverse)
        return Room(wide, True, wide == 1, piece, x, image, np.zeros(size), np.zeros((n, n + 2)), fine, work)

    return Numba(generic_advance, equation, room)


def _aligned(size: int) -> FloatArray:
    """Zeros from the beginning of a cache line on: vectors across two of them cost a third of the speed.

    Kernels are given such arrays, for those that they make themselves may begin anywhere.
    """
    memory = np.zeros(size + 8)
    skipped = -(memory.ctypes.data // 8) % 8
    return memory[skipped : skipped + size]
