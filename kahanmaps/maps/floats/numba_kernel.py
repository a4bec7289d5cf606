"""Compiled kernels; needs numba, and is imported only by those who have asked for it or have it (ensemble.py).

In normal form blocks know nothing of each other, so each takes 256 steps with 256 lanes at a time, in vector registers
and the innermost cache; up to 4 lanes go one by one instead, four blocks together, which hides the time that a single
chain of operations takes. In both cases the steps are only watched for anything unusual, and lanes that met it are
taken again from a saved state, one by one and with all tests. The generic elimination runs over 128 lanes, exchanging
rows in those that want it.

Operations and their order are those of steps.py, which are compiled here: results are the same to the last bit.
Without fastmath nothing is contracted or reordered. Kernels release the interpreter lock and are started by Python
threads on ranges of lanes. So no threading layer of numba is needed; the one that is always there aborts the program if
two threads use it at once.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np

from kahanmaps.maps.floats import steps as float_steps
from kahanmaps.maps.floats.blocks import CUBES, GENERAL, LINES, PlanarBlocks
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.steps import GenericEquation, Lanes
from kahanmaps.maps.kept_code import compiled

_WIDTH = 256
_PIECE = 256
_FEW = 4
_GENERIC_WIDTH = 128
_SHARES = 8

NEAR = float_steps.NEAR
NEAR_SQUARED = float_steps.NEAR_SQUARED
MUCH = float_steps.MUCH
LARGEST = float_steps.LARGEST
RUNNING = float_steps.RUNNING
OVERFLOW = float_steps.OVERFLOW
SINGULAR = float_steps.SINGULAR


class Blocks(NamedTuple):
    """Of PlanarBlocks what a step needs."""

    kinds: Any
    coefficients: Any
    reals: int
    kappa: Any


class Span(NamedTuple):
    """Steps from the index `first`: recorded are multiples of `every`, at those of `sampled` integrals are sampled."""

    first: int
    steps: int
    every: int
    sampled: int


class PlanarRoom(NamedTuple):
    """What a kernel in normal form works in: states, those before a piece, and which lanes are fine (1) or not (0)."""

    buffer: FloatArray
    saved: FloatArray
    fine: FloatArray


class GenericRoom(NamedTuple):
    """What the elimination works in: points and images, matrices, and a number a lane three times."""

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


# A formula handed to a compiled function as an argument would keep the machine code from being stored.
_sweep_real_lines, _sweep_real_cubes = _real_sweep(real_lines), _real_sweep(real_cubes)
_sweep_real_general = _real_sweep(real_general)
_sweep_complex_lines, _sweep_complex_general = _complex_sweep(complex_lines), _complex_sweep(complex_general)


@_inner
def _many(z: Any, blocks: Blocks, width: int, count: int, fine: Any) -> None:
    for r in range(len(blocks.kinds)):
        kind, k = blocks.kinds[r], _eight(blocks.coefficients[r])
        if r < blocks.reals:
            U, V = z[2 * r], z[2 * r + 1]
            if kind == LINES:
                _sweep_real_lines(U, V, k, width, count, fine)
            elif kind == CUBES:
                _sweep_real_cubes(U, V, k, width, count, fine)
            else:
                _sweep_real_general(U, V, k, width, count, fine)
        else:
            at = 4 * r - 2 * blocks.reals
            if kind == LINES:
                _sweep_complex_lines(z[at], z[at + 1], z[at + 2], z[at + 3], k, width, count, fine)
            else:
                _sweep_complex_general(z[at], z[at + 1], z[at + 2], z[at + 3], k, width, count, fine)


@_inner
def _block(z: Any, lane: int, blocks: Blocks, r: int) -> Any:
    """a, b, c, d and the state of real block r, or of one that stands still where there are fewer."""
    if r < blocks.reals:
        return _eight(blocks.coefficients[r]), z[2 * r, lane], z[2 * r + 1, lane]
    return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0


def _fours(formula: Any) -> Any:
    """Real blocks r, ..., r + 3 of one lane together."""

    @_inner
    def four(z: Any, lane: int, blocks: Blocks, r: int, count: int) -> bool:
        k0, U0, V0 = _block(z, lane, blocks, r)
        k1, U1, V1 = _block(z, lane, blocks, r + 1)
        k2, U2, V2 = _block(z, lane, blocks, r + 2)
        k3, U3, V3 = _block(z, lane, blocks, r + 3)
        good = True
        for _ in range(count):
            U0, V0, w0, g0 = formula(U0, V0, k0)
            U1, V1, w1, g1 = formula(U1, V1, k1)
            U2, V2, w2, g2 = formula(U2, V2, k2)
            U3, V3, w3, g3 = formula(U3, V3, k3)
            good &= (abs(w0) > NEAR + NEAR * abs(g0)) & (abs(w1) > NEAR + NEAR * abs(g1))
            good &= (abs(w2) > NEAR + NEAR * abs(g2)) & (abs(w3) > NEAR + NEAR * abs(g3))
        z[2 * r, lane], z[2 * r + 1, lane] = U0, V0
        if r + 1 < blocks.reals:
            z[2 * r + 2, lane], z[2 * r + 3, lane] = U1, V1
        if r + 2 < blocks.reals:
            z[2 * r + 4, lane], z[2 * r + 5, lane] = U2, V2
        if r + 3 < blocks.reals:
            z[2 * r + 6, lane], z[2 * r + 7, lane] = U3, V3
        return good

    return four


_four_lines, _four_cubes, _four_general = _fours(real_lines), _fours(real_cubes), _fours(real_general)


@_inner
def _two(z: Any, lane: int, special: bool, k: Any, l: Any, at: int, also: int, count: int) -> bool:
    """Two complex blocks of one lane together, in rows `at` and `also` on (or one, twice)."""
    a, b, c, d = z[at, lane], z[at + 1, lane], z[at + 2, lane], z[at + 3, lane]
    e, f, g, h = z[also, lane], z[also + 1, lane], z[also + 2, lane], z[also + 3, lane]
    good = True
    for _ in range(count):
        if special:
            a, b, c, d, n, s = complex_lines(a, b, c, d, k)
            e, f, g, h, m, t = complex_lines(e, f, g, h, l)
        else:
            a, b, c, d, n, s = complex_general(a, b, c, d, k)
            e, f, g, h, m, t = complex_general(e, f, g, h, l)
        good &= (n > NEAR_SQUARED + NEAR_SQUARED * s) & (m > NEAR_SQUARED + NEAR_SQUARED * t)
    z[at, lane], z[at + 1, lane], z[at + 2, lane], z[at + 3, lane] = a, b, c, d
    z[also, lane], z[also + 1, lane], z[also + 2, lane], z[also + 3, lane] = e, f, g, h
    return good


@_inner
def _single(z: Any, lane: int, blocks: Blocks, count: int) -> bool:
    kinds, reals = blocks.kinds, blocks.reals
    good = True
    for r in range(0, reals, 4):
        kind, last = kinds[r], min(r + 4, reals)
        for s in range(r + 1, last):
            kind = kind if kinds[s] == kind else GENERAL  # whose formula gives the numbers of the others
        if kind == LINES:
            good &= _four_lines(z, lane, blocks, r, count)
        elif kind == CUBES:
            good &= _four_cubes(z, lane, blocks, r, count)
        else:
            good &= _four_general(z, lane, blocks, r, count)
    r = reals
    while r < len(kinds):
        s = r + 1 if r + 1 < len(kinds) and kinds[r + 1] == kinds[r] else r
        k, l = _eight(blocks.coefficients[r]), _eight(blocks.coefficients[s])
        good &= _two(z, lane, kinds[r] == LINES, k, l, 4 * r - 2 * reals, 4 * s - 2 * reals, count)
        r = s + 1
    return good


@_inner
def _careful(z: Any, lane: int, blocks: Blocks, index: int, count: int, lanes: Lanes, at_lane: int) -> None:
    """float_steps.walk for one lane in normal form: column `lane` of z is that of `at_lane` in `lanes`."""
    kinds, reals = blocks.kinds, blocks.reals
    rows = z.shape[0]
    for step in range(index, index + count):
        failed, close = RUNNING, 0
        for r in range(len(kinds)):
            k = _eight(blocks.coefficients[r])
            if r < reals:
                U, V, w, g = real_general(z[2 * r, lane], z[2 * r + 1, lane], k)
                z[2 * r, lane], z[2 * r + 1, lane] = U, V
                unusual = not abs(w) > NEAR + NEAR * abs(g)
            else:
                at = 4 * r - 2 * reals
                if kinds[r] == LINES:
                    a, b, c, d, w, g = complex_lines(z[at, lane], z[at + 1, lane], z[at + 2, lane], z[at + 3, lane], k)
                else:
                    a, b, c, d, w, g = complex_general(
                        z[at, lane], z[at + 1, lane], z[at + 2, lane], z[at + 3, lane], k
                    )
                z[at, lane], z[at + 1, lane], z[at + 2, lane], z[at + 3, lane] = a, b, c, d
                unusual = not w > NEAR_SQUARED + NEAR_SQUARED * g
            if failed == RUNNING:
                if w == 0.0:
                    failed = SINGULAR
                elif not np.isfinite(w):
                    failed = OVERFLOW
                elif unusual:
                    close += 1
        if failed == RUNNING:
            for j in range(rows):
                if not np.isfinite(z[j, lane]):
                    failed = OVERFLOW
        if failed != RUNNING:
            lanes.status[at_lane] = failed
            lanes.failed_at[at_lane] = step + 1
            for j in range(rows):
                z[j, lane] = 0.0
            return
        if close:
            if lanes.near[at_lane] == 0:
                lanes.near_at[at_lane] = step
            lanes.near[at_lane] += close


@_inner
def _sample(z: Any, width: int, at_lane: int, blocks: Blocks, lanes: Lanes, alive: Any) -> None:
    """float_steps.sample; lanes that have ended are not alive."""
    reals = blocks.reals
    for r in range(len(blocks.kinds)):
        k, kappa_r, kappa_i = _eight(blocks.coefficients[r]), blocks.kappa[r, 0], blocks.kappa[r, 1]
        base_r, base_i = lanes.base[r, 0, at_lane : at_lane + width], lanes.base[r, 1, at_lane : at_lane + width]
        top = lanes.largest[r, at_lane : at_lane + width]
        if r < reals:
            U, V = z[2 * r], z[2 * r + 1]
            for i in range(width):
                x = real_integral(U[i], V[i], k, kappa_r) - base_r[i]
                distance = np.sqrt(x * x)
                distance = distance if distance <= np.inf else np.inf
                top[i] = distance if (distance > top[i]) & (alive[i] != 0.0) else top[i]
        else:
            at = 4 * r - 2 * reals
            Ur, Ui, Vr, Vi = z[at], z[at + 1], z[at + 2], z[at + 3]
            for i in range(width):
                x, y = complex_integral(Ur[i], Ui[i], Vr[i], Vi[i], k, kappa_r, kappa_i)
                x, y = x - base_r[i], y - base_i[i]
                distance = np.sqrt(x * x + y * y)
                distance = distance if distance <= np.inf else np.inf
                top[i] = distance if (distance > top[i]) & (alive[i] != 0.0) else top[i]


@_inner
def _copied(source: Any, target: Any, width: int) -> None:
    for j in range(len(source)):
        from_row, to_row = source[j], target[j]
        for i in range(width):
            to_row[i] = from_row[i]


@_inner
def _sound(z: Any, before: Any, width: int, fine: Any) -> None:
    """`fine` becomes 0 in lanes that are not finite or have fallen to 0; see float_numpy._sound."""
    for j in range(len(z)):
        row, old = z[j], before[j]
        for i in range(width):
            if not ((abs(row[i]) <= LARGEST) & ((row[i] != 0.0) | (old[i] == 0.0))):
                fine[i] = 0.0


def _planar_kernel(stamp: int) -> Any:
    def planar_advance(
        lanes: Lanes, lo: int, hi: int, blocks: Blocks, span: Span, record: Any, room: PlanarRoom
    ) -> int:
        z, buffer, saved, fine = lanes.z, room.buffer, room.saved, room.fine
        rows, every, sampled, last = z.shape[0], span.every, span.sampled, span.first + span.steps
        for at in range(lo, hi, _WIDTH):
            width = min(_WIDTH, hi - at)
            for j in range(rows):
                for i in range(width):
                    buffer[j, i] = z[j, at + i]
            index, row = span.first, 0
            while index < last:
                end = min(last, index + _PIECE)
                if every:
                    end = min(end, index - index % every + every)
                if sampled:
                    end = min(end, index - index % sampled + sampled)
                count = end - index
                _copied(buffer, saved, width)
                for i in range(width):
                    fine[i] = 1.0
                    if width <= _FEW and not _single(buffer, i, blocks, count):
                        fine[i] = 0.0
                if width > _FEW:
                    _many(buffer, blocks, width, count, fine)
                _sound(buffer, saved, width, fine)
                for i in range(width):
                    if fine[i] == 0.0:
                        for j in range(rows):
                            buffer[j, i] = saved[j, i]
                        _careful(buffer, i, blocks, index, count, lanes, at + i)
                index = end
                if every and index % every == 0:
                    for i in range(width):
                        running = lanes.status[at + i] == RUNNING
                        for j in range(rows):
                            record[row, j, at + i] = buffer[j, i] if running else np.nan
                    row += 1
                if sampled and index % sampled == 0:
                    for i in range(width):
                        fine[i] = 1.0 if lanes.status[at + i] == RUNNING else 0.0
                    _sample(buffer, width, at, blocks, lanes, fine)
            for j in range(rows):
                for i in range(width):
                    z[j, at + i] = buffer[j, i]
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
    for l in range(_GENERIC_WIDTH):
        room.fine[l] = 1.0
    for p in range(n):
        _eliminate(room.M, p, n, room.scale, room.inverse, room.fine)
    M, fine, good = room.M, room.fine, True
    for j in range(n - 1, -1, -1):
        value, target, pivot = M[j * (n + 1) + n], right[j], M[j * (n + 1) + j]
        for l in range(_GENERIC_WIDTH):
            target[l] = value[l] / pivot[l]
            fine[l] = fine[l] if abs(target[l]) <= LARGEST else 0.0
        for i in range(j):
            entry, upper = M[i * (n + 1) + n], M[i * (n + 1) + j]
            for l in range(_GENERIC_WIDTH):
                entry[l] -= upper[l] * target[l]
    for l in range(_GENERIC_WIDTH):
        good &= fine[l] != 0.0
    return good


@_inner
def _fill(x: Any, equation: GenericEquation, M: Any, scale: Any) -> None:
    """The matrices at x, and for each lane the largest of 1 and their entries."""
    first, columns, factors, products = equation.first, equation.columns, equation.factors, equation.products
    n = len(equation.constants)
    for l in range(_GENERIC_WIDTH):
        scale[l] = 1.0
    for t in range(len(products)):
        target, A, B = x[n + t], x[products[t, 0]], x[products[t, 1]]
        for l in range(_GENERIC_WIDTH):
            target[l] = A[l] * B[l]
    for i in range(n):
        for j in range(n + 1):
            entry, constant = M[i * (n + 1) + j], equation.constants[i, j]
            t, end = first[i * (n + 1) + j], first[i * (n + 1) + j + 1]
            if end - t >= 3:
                a, b, c = factors[t], factors[t + 1], factors[t + 2]
                A, B, C = x[columns[t]], x[columns[t + 1]], x[columns[t + 2]]
                for l in range(_GENERIC_WIDTH):
                    entry[l] = ((constant + a * A[l]) + b * B[l]) + c * C[l]
                t += 3
            else:
                for l in range(_GENERIC_WIDTH):
                    entry[l] = constant
            while end - t >= 3:
                a, b, c = factors[t], factors[t + 1], factors[t + 2]
                A, B, C = x[columns[t]], x[columns[t + 1]], x[columns[t + 2]]
                for l in range(_GENERIC_WIDTH):
                    entry[l] = ((entry[l] + a * A[l]) + b * B[l]) + c * C[l]
                t += 3
            while t < end:
                a, A = factors[t], x[columns[t]]
                for l in range(_GENERIC_WIDTH):
                    entry[l] += a * A[l]
                t += 1
            if j < n:
                for l in range(_GENERIC_WIDTH):
                    scale[l] = abs(entry[l]) if abs(entry[l]) > scale[l] else scale[l]


@_inner
def _eliminate(M: Any, p: int, n: int, scale: Any, inverse: Any, fine: Any) -> None:
    """Column p out of the rows below row p, which is exchanged with others in the lanes that want it."""
    pivot = M[p * (n + 1) + p]
    for i in range(p + 1, n):
        below = M[i * (n + 1) + p]
        wanted = False
        for l in range(_GENERIC_WIDTH):
            wanted |= abs(below[l]) > MUCH * abs(pivot[l])
        if wanted:
            for l in range(_GENERIC_WIDTH):
                inverse[l] = 1.0 if abs(below[l]) > MUCH * abs(pivot[l]) else 0.0
            for j in range(p, n + 1):
                upper, entry = M[p * (n + 1) + j], M[i * (n + 1) + j]
                for l in range(_GENERIC_WIDTH):
                    one, other = upper[l], entry[l]
                    upper[l] = other if inverse[l] != 0.0 else one
                    entry[l] = one if inverse[l] != 0.0 else other
    for l in range(_GENERIC_WIDTH):
        size = abs(pivot[l])
        fine[l] = fine[l] if (size > NEAR * scale[l]) & (size <= LARGEST) else 0.0
        inverse[l] = 1.0 / pivot[l]
    for i in range(p + 1, n):
        factor = M[i * (n + 1) + p]
        for l in range(_GENERIC_WIDTH):
            factor[l] = factor[l] * inverse[l]
        j = p + 1
        while j + 1 <= n:
            entry, upper = M[i * (n + 1) + j], M[p * (n + 1) + j]
            other, above = M[i * (n + 1) + j + 1], M[p * (n + 1) + j + 1]
            for l in range(_GENERIC_WIDTH):
                entry[l] -= factor[l] * upper[l]
                other[l] -= factor[l] * above[l]
            j += 2
        while j <= n:
            entry, upper = M[i * (n + 1) + j], M[p * (n + 1) + j]
            for l in range(_GENERIC_WIDTH):
                entry[l] -= factor[l] * upper[l]
            j += 1


def _generic_kernel(stamp: int) -> Any:
    def generic_advance(
        lanes: Lanes, lo: int, hi: int, equation: GenericEquation, span: Span, record: Any, room: GenericRoom
    ) -> int:
        z, x, right, fine = lanes.z, room.x, room.right, room.fine
        status, every = lanes.status, span.every
        n = z.shape[0]
        wide = len(fine)
        few = wide == 1
        x_alone = np.zeros(n + len(equation.products))
        M_alone = np.zeros((n, n))
        right_alone = np.zeros(n)
        sizes = np.ones(n)
        for at in range(lo, hi, wide):
            width = min(wide, hi - at)
            for j in range(n):
                for i in range(wide):
                    x[j, i] = z[j, at + i] if i < width else z[j, at]  # lanes that nobody looks at
            row = 0
            for index in range(span.first, span.first + span.steps):
                good = False
                if few:
                    fine[0] = 0.0
                else:
                    good = _together(x, right, equation, room)
                if not good:
                    for i in range(width):
                        if fine[i] != 0.0:
                            continue
                        failed, close = RUNNING, 0
                        if status[at + i] == RUNNING:
                            for j in range(n):
                                x_alone[j] = x[j, i]
                            failed, close = _alone(x_alone, equation, M_alone, right_alone, sizes)
                            if failed != RUNNING:
                                status[at + i] = failed
                                lanes.failed_at[at + i] = index + 1
                            elif close:
                                if lanes.near[at + i] == 0:
                                    lanes.near_at[at + i] = index
                                lanes.near[at + i] += close
                        for j in range(n):
                            right[j, i] = right_alone[j] if status[at + i] == RUNNING else 0.0
                x, right = right, x
                if every and (index + 1) % every == 0:
                    for i in range(width):
                        running = status[at + i] == RUNNING
                        for j in range(n):
                            record[row, j, at + i] = x[j, i] if running else np.nan
                    row += 1
            for i in range(width):
                running = status[at + i] == RUNNING
                for j in range(n):
                    z[j, at + i] = x[j, i] if running else 0.0
        return stamp

    return generic_advance


# A checksum of the formulas' file: machine code kept on disk goes by the age of this file alone.
_STAMP = zlib.crc32(Path(float_steps.__file__).read_bytes())
_kernel = partial(compiled, error_model="numpy", nogil=True)
planar_advance = _kernel(_planar_kernel(_STAMP))
generic_advance = _kernel(_generic_kernel(_STAMP))

_NOTHING = np.empty((0, 0, 0))


class PlanarNumba:
    """Advances lanes in normal form."""

    def __init__(self, blocks: PlanarBlocks, threads: int) -> None:
        self.blocks = blocks
        self.threads = threads

    def advance(
        self, lanes: Lanes, first: int, steps: int, every: int, sampled: int, record: FloatArray | None
    ) -> None:
        """Take all lanes `steps` steps from the index `first`; see float_numpy.PlanarNumpy."""
        given = self.blocks
        blocks = Blocks(given.kinds, given.coefficients, given.reals, given.kappa)
        span = Span(first, steps, every if record is not None else 0, sampled)

        def run(lo: int, hi: int) -> None:
            rows = len(lanes.z)
            room = PlanarRoom(_aligned(rows, _WIDTH), _aligned(rows, _WIDTH), _aligned(1, _WIDTH)[0])
            planar_advance(lanes, lo, hi, blocks, span, _NOTHING if record is None else record, room)

        _spread(run, lanes.z.shape[1], self.threads, _WIDTH)


class GenericNumba:
    """Advances lanes of any map."""

    def __init__(self, equation: GenericEquation, threads: int) -> None:
        self.equation = equation
        self.threads = threads

    def advance(
        self, lanes: Lanes, first: int, steps: int, every: int, sampled: int, record: FloatArray | None
    ) -> None:
        """Take all lanes `steps` steps from the index `first`; see float_numpy.GenericNumpy."""
        equation = self.equation
        n, more = equation.rows, len(equation.products)
        span = Span(first, steps, every if record is not None else 0, sampled)

        def run(lo: int, hi: int) -> None:
            wide = 1 if hi - lo <= 2 * _FEW else _GENERIC_WIDTH
            room = GenericRoom(
                _aligned(n + more, wide),
                _aligned(n + more, wide),
                _aligned(n * (n + 1), wide),
                _aligned(1, wide)[0],
                _aligned(1, wide)[0],
                _aligned(1, wide)[0],
            )
            generic_advance(lanes, lo, hi, equation, span, _NOTHING if record is None else record, room)

        _spread(run, lanes.z.shape[1], self.threads, _GENERIC_WIDTH)


def _aligned(rows: int, width: int) -> FloatArray:
    """Zeros (rows, width) from the beginning of a cache line on: vectors across two of them cost a third of the speed.

    Kernels are given such arrays, for those that they make themselves may begin anywhere.
    """
    memory = np.zeros(rows * width + 8)
    skipped = -(memory.ctypes.data // 8) % 8
    return memory[skipped : skipped + rows * width].reshape(rows, width)


def _spread(run: Callable[[int, int], None], lanes: int, threads: int, width: int) -> None:
    """Run on ranges of lanes that are multiples of `width` long, several for each thread: other programs run too."""
    share = -(-lanes // (threads * _SHARES * width)) * width if threads > 1 else lanes
    ranges = [(lo, min(lanes, lo + share)) for lo in range(0, lanes, share)]
    if len(ranges) == 1:
        run(*ranges[0])
        return
    with ThreadPoolExecutor(min(threads, len(ranges))) as pool:
        for done in [pool.submit(run, lo, hi) for lo, hi in ranges]:
            done.result()
