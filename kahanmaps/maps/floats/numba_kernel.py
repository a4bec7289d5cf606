"""Compiled kernels; needs numba, and is imported only by those who have asked for it or have it (ensemble.py).

In normal form blocks know nothing of each other: all blocks of one kind are taken together, those of 256 lanes in
vector registers and the innermost cache, and those of a single orbit such that the steps of one hide the time that a
chain of operations takes in another. The generic elimination runs over 128 lanes, exchanging rows in those that want
it. Steps are only watched for anything unusual, and lanes that met it are taken again from a saved state, one by one
and with all tests: a Python call for each of them would cost a thousand times as much.

Operations and their order are those of steps.py, which are compiled here. Without fastmath nothing is contracted or
reordered. Kernels release the interpreter lock and are started by Python threads on ranges of lanes. So no threading
layer of numba is needed; the one that is always there aborts the program if two threads use it at once.
"""

from __future__ import annotations

import zlib
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np

from kahanmaps.maps.floats import steps as float_steps
from kahanmaps.maps.floats.advance import Engine, Kept
from kahanmaps.maps.floats.blocks import CUBES, GENERAL, LINES
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.steps import GenericEquation, Lanes, PlanarRows
from kahanmaps.maps.kept_code import compiled

_WIDTH = 256
_PIECE = 1024
_FEW = 16  # blocks of a kind
_LANES = 128
_ALL = 1 << 62
_ALONE = 8  # lanes, up to which the elimination takes them one by one

NEAR = float_steps.NEAR
NEAR_SQUARED = float_steps.NEAR_SQUARED
MUCH = float_steps.MUCH
LARGEST = float_steps.LARGEST
RUNNING = float_steps.RUNNING
OVERFLOW = float_steps.OVERFLOW
SINGULAR = float_steps.SINGULAR


class Numbers(NamedTuple):
    """Of a normal form what a step needs: its runs, and by block a, b, c, d and the factor of the integral."""

    runs: Any
    coefficients: FloatArray
    kappa: FloatArray


class PlanarRoom(NamedTuple):
    """What a kernel in normal form works in: the states of some lanes, those before a piece, and which lanes are fine.

    There is a 1 for each block of a run (0: unusual).
    """

    buffer: FloatArray
    saved: FloatArray
    usual: FloatArray


class GenericRoom(NamedTuple):
    """What the elimination works in: points and images, (M | r), and a number a lane three times."""

    x: FloatArray
    right: FloatArray
    M: FloatArray
    scale: FloatArray
    inverse: FloatArray
    fine: FloatArray


_inner = numba.njit(error_model="numpy", nogil=True)

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
def _careful(state: Any, width: int, i: int, numbers: Numbers, first: int, count: int, lanes: Lanes, lane: int) -> None:
    """Steps of one lane with all tests; an orbit ends as the first of its blocks does (advance.Planar.one)."""
    runs = numbers.runs
    for index in range(first, first + count):
        status, near = RUNNING, 0
        for r in range(len(runs)):
            real, far, k = runs[r, 1] == 2, runs[r, 3] * width, _eight(numbers.coefficients, runs[r, 4])
            for b in range(runs[r, 3]):
                at = (runs[r, 2] + b) * width + i
                if real:
                    state[at], state[at + far], w, g = real_general(state[at], state[at + far], k)
                    unusual = not abs(w) > NEAR + NEAR * abs(g)
                else:
                    U, V, W, T = state[at], state[at + far], state[at + 2 * far], state[at + 3 * far]
                    U, V, W, T, w, g = complex_general(U, V, W, T, k)
                    state[at], state[at + far], state[at + 2 * far], state[at + 3 * far] = U, V, W, T
                    unusual = not w > NEAR_SQUARED + NEAR_SQUARED * g
                if status == RUNNING:
                    if w == 0.0:
                        status = SINGULAR
                    elif not np.isfinite(w):
                        status = OVERFLOW
                    elif unusual:
                        near += 1
        if status == RUNNING:
            for j in range(len(lanes.z)):
                if not np.isfinite(state[j * width + i]):
                    status = OVERFLOW
        if status != RUNNING:
            for j in range(len(lanes.z)):
                state[j * width + i] = 0.0
        if status != RUNNING or near:
            _note(lanes, lane, index, status, near)
        if status != RUNNING:
            return


@numba.njit(error_model="numpy", nogil=True, inline="always")  # Lanes are long to hand over
def _note(lanes: Lanes, lane: int, index: int, status: int, near: int) -> None:
    """What a step from the index was."""
    if status != RUNNING:
        lanes.status[lane] = status
        lanes.failed_at[lane] = index + 1
    elif near:
        if lanes.near[lane] == 0:
            lanes.near_at[lane] = index
        lanes.near[lane] += near


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


@_inner
def _keep(state: Any, stride: int, at: int, width: int, row: int, table: Any) -> None:
    """Write the states of the lanes from `at` on to a row of the table."""
    for j in range(table.shape[1]):
        for i in range(width):
            table[row, j, at + i] = state[j * stride + i]


@_inner
def _multiple(index: int, every: int) -> int:
    """The next multiple (0: none)."""
    return index - index % every + every if every else 1 << 62


@_inner
def _usual(state: Any, before: Any, size: int, usual: Any, blocks: int) -> bool:
    """Whether nothing unusual was met in any lane."""
    good = True
    for i in range(blocks):
        good &= usual[i] != 0.0
    # Where w overflows and the numerators do not, the image is 0, and stays there; see advance.sound.
    for i in range(size):
        good &= (abs(state[i]) <= LARGEST) & ((state[i] != 0.0) | (before[i] == 0.0))
    return good


@_inner
def _again(
    state: Any, before: Any, usual: Any, width: int, at: int, numbers: Numbers, first: int, count: int, lanes: Lanes
) -> None:
    """Take the lanes that met anything unusual again: `before` has their states before these steps."""
    rows, blocks = len(lanes.z), len(usual) // _WIDTH
    for i in range(width):
        good = True
        for b in range(blocks):
            good &= usual[b * width + i] != 0.0
        for j in range(rows):
            value, old = state[j * width + i], before[j * width + i]
            good &= (abs(value) <= LARGEST) & ((value != 0.0) | (old == 0.0))
        if not good:
            for j in range(rows):
                state[j * width + i] = before[j * width + i]
            _careful(state, width, i, numbers, first, count, lanes, at + i)


def _planar_kernel(stamp: int) -> Any:
    def planar_advance(
        lanes: Lanes,
        lo: int,
        hi: int,
        numbers: Numbers,
        first: int,
        steps: int,
        sampled: int,
        kept: Kept,
        room: PlanarRoom,
    ) -> int:
        rows, last, runs = lanes.z.shape[0], first + steps, numbers.runs
        state, before, usual = room.buffer, room.saved, room.usual
        for at in range(lo, hi, _WIDTH):
            width = min(_WIDTH, hi - at)
            most = len(usual) // _WIDTH * width
            for j in range(rows):
                for i in range(width):
                    state[j * width + i] = lanes.z[j, at + i]
            index, row = first, 0
            to_keep, to_sample = _multiple(first, kept.every), _multiple(first, sampled)
            while index < last:
                end = min(last, index + _PIECE, to_keep, to_sample)
                for i in range(rows * width):
                    before[i] = state[i]
                for i in range(most):
                    usual[i] = 1.0
                for r in range(len(runs)):
                    _sweep(state, width, runs[r], numbers.coefficients, end - index, usual)
                if not _usual(state, before, rows * width, usual, most):
                    _again(state, before, usual, width, at, numbers, index, end - index, lanes)
                index = end
                if index == to_keep:
                    _keep(state, width, at, width, row, kept.table)
                    row, to_keep = row + 1, to_keep + kept.every
                if index == to_sample:
                    _sample(state, width, at, numbers, lanes)
                    to_sample += sampled
            for j in range(rows):
                for i in range(width):
                    lanes.z[j, at + i] = state[j * width + i]
        return stamp

    return planar_advance


@_inner
def _alone(x: Any, equation: GenericEquation, M: Any, right: Any, sizes: Any) -> Any:
    """float_steps.PythonGeneric.step: the image of x into `right`; its status, and whether it was near-singular."""
    constants, first, columns = equation.constants, equation.first, equation.columns
    factors, products = equation.factors, equation.products
    n = len(constants)
    near = 0
    scale = 1.0
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
        if sizes[i] > scale:
            scale = sizes[i]
    if not scale <= LARGEST:
        return OVERFLOW, near
    for p in range(n):
        for i in range(p + 1, n):
            if abs(M[i, p]) > MUCH * abs(M[p, p]):
                for j in range(p, n):
                    M[p, j], M[i, j] = M[i, j], M[p, j]
                right[p], right[i] = right[i], right[p]
                sizes[p], sizes[i] = sizes[i], sizes[p]
        if M[p, p] == 0.0:
            return SINGULAR, near
        if not abs(M[p, p]) <= LARGEST:
            return OVERFLOW, near
        if abs(M[p, p]) <= NEAR * sizes[p]:
            near = 1
        inverse = 1.0 / M[p, p]
        for i in range(p + 1, n):
            factor = M[i, p] * inverse
            for j in range(p + 1, n):
                M[i, j] -= factor * M[p, j]
            right[i] -= factor * right[p]
    for j in range(n - 1, -1, -1):
        right[j] /= M[j, j]
        for i in range(j):
            right[i] -= M[i, j] * right[j]
    for j in range(n):
        if not np.isfinite(right[j]):
            return OVERFLOW, near
    return RUNNING, near


@_inner
def _together(x: Any, right: Any, equation: GenericEquation, room: GenericRoom) -> bool:
    """One step of all lanes: images into `right`; `fine` is 0 where something is unusual.

    M has n rows of n + 1 entries, the last one the right-hand side. Loops over the lanes do several operations, which
    saves loads and stores, but not too many: a loop over more than a handful of arrays is not vectorised, because the
    compiler would have to test too many pairs of them for overlap. For the same reason the number of lanes is a
    constant.
    """
    n = len(equation.constants)
    _fill(x, equation, room.M, room.scale)
    for l in range(_LANES):
        room.fine[l] = 1.0
    for p in range(n):
        _eliminate(room.M, p, n, room.scale, room.inverse, room.fine)
    M, fine, good = room.M, room.fine, True
    for j in range(n - 1, -1, -1):
        value, target, pivot = M[j * (n + 1) + n], right[j], M[j * (n + 1) + j]
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


def _generic_kernel(stamp: int) -> Any:
    def generic_advance(
        lanes: Lanes, lo: int, hi: int, equation: GenericEquation, first: int, steps: int, kept: Kept, room: GenericRoom
    ) -> int:
        x, right, fine, status = room.x, room.right, room.fine, lanes.status
        n, wide = lanes.z.shape[0], len(room.fine)
        alone, M, image, sizes = np.zeros(len(x)), np.zeros((n, n)), np.zeros(n), np.ones(n)
        for at in range(lo, hi, wide):
            width = min(wide, hi - at)
            for j in range(n):
                for i in range(wide):
                    x[j, i] = lanes.z[j, at + i] if i < width else lanes.z[j, at]  # lanes that nobody looks at
            row, to_keep = 0, _multiple(first, kept.every)
            for index in range(first, first + steps):
                fine[0] = 0.0
                if wide == 1 or not _together(x, right, equation, room):
                    for i in range(width):
                        if fine[i] != 0.0:
                            continue
                        if status[at + i] == RUNNING:
                            for j in range(n):
                                alone[j] = x[j, i]
                            failed, near = _alone(alone, equation, M, image, sizes)
                            if failed != RUNNING or near:
                                _note(lanes, at + i, index, failed, near)
                        for j in range(n):
                            right[j, i] = image[j] if status[at + i] == RUNNING else 0.0
                x, right = right, x
                if index + 1 == to_keep:
                    _keep(x.ravel(), wide, at, width, row, kept.table)
                    row, to_keep = row + 1, to_keep + kept.every
            for i in range(width):
                for j in range(n):
                    lanes.z[j, at + i] = x[j, i] if status[at + i] == RUNNING else 0.0
        return stamp

    return generic_advance


# A checksum of the formulas' file: machine code kept on disk goes by the age of this file alone.
_STAMP = zlib.crc32(Path(float_steps.__file__).read_bytes())
_kernel = partial(compiled, error_model="numpy", nogil=True)
planar_advance = _kernel(_planar_kernel(_STAMP))
generic_advance = _kernel(_generic_kernel(_STAMP))


class PlanarNumba(Engine):
    """Advances lanes in normal form."""

    group = _ALL

    def __init__(self, rows: PlanarRows) -> None:
        runs = np.array(rows.runs, dtype=np.int64)
        self._numbers = Numbers(runs, rows.blocks.coefficients, rows.blocks.kappa)
        self._most = int(runs[:, 3].max())

    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        rows = len(lanes.z)
        room = PlanarRoom(*(_aligned(count, _WIDTH).ravel() for count in (rows, rows, self._most)))
        planar_advance(lanes, lo, hi, self._numbers, first, steps, sampled, kept, room)


class GenericNumba(Engine):
    """Advances lanes of any map."""

    group = _ALL

    def __init__(self, equation: GenericEquation) -> None:
        self.equation = equation

    def run(self, lanes: Lanes, lo: int, hi: int, first: int, steps: int, kept: Kept, sampled: int) -> None:
        n, more = self.equation.rows, len(self.equation.products)
        wide = 1 if hi - lo <= _ALONE else _LANES
        x, right, M = (_aligned(rows, wide) for rows in (n + more, n + more, n * (n + 1)))
        room = GenericRoom(x, right, M, *(_aligned(1, wide)[0] for _ in range(3)))
        generic_advance(lanes, lo, hi, self.equation, first, steps, kept, room)


def _aligned(rows: int, width: int) -> FloatArray:
    """Zeros (rows, width) from the beginning of a cache line on: vectors across two of them cost a third of the speed.

    Kernels are given such arrays, for those that they make themselves may begin anywhere.
    """
    memory = np.zeros(rows * width + 8)
    skipped = -(memory.ctypes.data // 8) % 8
    return memory[skipped : skipped + rows * width].reshape(rows, width)
