"""Compiled kernels; needs numba, and is imported only by those who have asked for it or have it (float_ensemble.py).

In normal form blocks know nothing of each other, so each takes 256 steps with 256 lanes at a time, in vector registers
and the innermost cache; up to 4 lanes go one by one instead, four blocks together, which hides the time that a single
chain of operations takes. In both cases the steps are only watched for anything unusual, and what is unusual is taken
again from a saved state, lane by lane and with all tests. The generic elimination runs over 128 lanes, exchanging rows
in those that want it.

Operations and their order are those of float_steps.py, which are compiled here: results are the same to the last bit.
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
from typing import Any

import numba
import numpy as np

from kahanmaps.maps import float_steps
from kahanmaps.maps.float_blocks import CUBES, GENERAL, LINES, PlanarBlocks
from kahanmaps.maps.float_numbers import FloatArray
from kahanmaps.maps.float_steps import GenericEquation, Lanes
from kahanmaps.maps.kept_code import compiled

_WIDTH = 256
_PIECE = 256
_FEW = 4
_GENERIC_WIDTH = 128
_SHARES = 8

NEAR = float_steps.NEAR
NEAR_SQUARED = float_steps.NEAR_SQUARED
CLEAR = float_steps.CLEAR
MUCH = float_steps.MUCH
LARGEST = float_steps.LARGEST
RUNNING = float_steps.RUNNING
OVERFLOW = float_steps.OVERFLOW
SINGULAR = float_steps.SINGULAR

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


def _sweeps_canonical(formula: Any) -> tuple[Any, Any]:
    """Steps of one block in many lanes: whether none was unusual; and the same telling in which lanes."""

    @_inner
    def swept(U: Any, V: Any, k: Any, width: int, count: int) -> bool:
        good = True
        for _ in range(count):
            for i in range(width):
                U[i], V[i], w, _g = formula(U[i], V[i], k)
                good &= abs(w) > CLEAR
        return good

    @_inner
    def flagged(U: Any, V: Any, k: Any, width: int, count: int, fine: Any) -> None:
        for _ in range(count):
            for i in range(width):
                U[i], V[i], w, _g = formula(U[i], V[i], k)
                if not abs(w) > CLEAR:
                    fine[i] = 0.0

    return swept, flagged


def _sweeps_real(formula: Any) -> tuple[Any, Any]:
    @_inner
    def swept(U: Any, V: Any, k: Any, width: int, count: int) -> bool:
        good = True
        for _ in range(count):
            for i in range(width):
                U[i], V[i], w, g = formula(U[i], V[i], k)
                good &= abs(w) > NEAR + NEAR * abs(g)
        return good

    @_inner
    def flagged(U: Any, V: Any, k: Any, width: int, count: int, fine: Any) -> None:
        for _ in range(count):
            for i in range(width):
                U[i], V[i], w, g = formula(U[i], V[i], k)
                if not abs(w) > NEAR + NEAR * abs(g):
                    fine[i] = 0.0

    return swept, flagged


def _sweeps_complex(formula: Any) -> tuple[Any, Any]:
    @_inner
    def swept(Ur: Any, Ui: Any, Vr: Any, Vi: Any, k: Any, width: int, count: int) -> bool:
        good = True
        for _ in range(count):
            for i in range(width):
                Ur[i], Ui[i], Vr[i], Vi[i], w, g = formula(Ur[i], Ui[i], Vr[i], Vi[i], k)
                good &= w > NEAR_SQUARED + NEAR_SQUARED * g
        return good

    @_inner
    def flagged(Ur: Any, Ui: Any, Vr: Any, Vi: Any, k: Any, width: int, count: int, fine: Any) -> None:
        for _ in range(count):
            for i in range(width):
                Ur[i], Ui[i], Vr[i], Vi[i], w, g = formula(Ur[i], Ui[i], Vr[i], Vi[i], k)
                if not w > NEAR_SQUARED + NEAR_SQUARED * g:
                    fine[i] = 0.0

    return swept, flagged


# A formula handed to a compiled function as an argument would keep the machine code from being stored.
_sweep_real_lines, _flag_real_lines = _sweeps_canonical(real_lines)
_sweep_real_cubes, _flag_real_cubes = _sweeps_canonical(real_cubes)
_sweep_real_general, _flag_real_general = _sweeps_real(real_general)
_sweep_complex_lines, _flag_complex_lines = _sweeps_complex(complex_lines)
_sweep_complex_general, _flag_complex_general = _sweeps_complex(complex_general)


@_inner
def _many(z: Any, kinds: Any, coefficients: Any, reals: int, width: int, count: int) -> bool:
    good = True
    for r in range(len(kinds)):
        k = _eight(coefficients[r])
        if r < reals:
            U, V = z[2 * r], z[2 * r + 1]
            if kinds[r] == LINES:
                good &= _sweep_real_lines(U, V, k, width, count)
            elif kinds[r] == CUBES:
                good &= _sweep_real_cubes(U, V, k, width, count)
            else:
                good &= _sweep_real_general(U, V, k, width, count)
        else:
            at = 4 * r - 2 * reals
            if kinds[r] == LINES:
                good &= _sweep_complex_lines(z[at], z[at + 1], z[at + 2], z[at + 3], k, width, count)
            else:
                good &= _sweep_complex_general(z[at], z[at + 1], z[at + 2], z[at + 3], k, width, count)
    return good


@_inner
def _many_flagged(z: Any, kinds: Any, coefficients: Any, reals: int, width: int, count: int, fine: Any) -> None:
    for r in range(len(kinds)):
        k = _eight(coefficients[r])
        if r < reals:
            U, V = z[2 * r], z[2 * r + 1]
            if kinds[r] == LINES:
                _flag_real_lines(U, V, k, width, count, fine)
            elif kinds[r] == CUBES:
                _flag_real_cubes(U, V, k, width, count, fine)
            else:
                _flag_real_general(U, V, k, width, count, fine)
        else:
            at = 4 * r - 2 * reals
            if kinds[r] == LINES:
                _flag_complex_lines(z[at], z[at + 1], z[at + 2], z[at + 3], k, width, count, fine)
            else:
                _flag_complex_general(z[at], z[at + 1], z[at + 2], z[at + 3], k, width, count, fine)


@_inner
def _block(coefficients: Any, z: Any, lane: int, r: int, reals: int) -> Any:
    """a, b, c, d and the state of real block r, or of one that stands still where there are fewer."""
    if r < reals:
        return _eight(coefficients[r]), z[2 * r, lane], z[2 * r + 1, lane]
    return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0


def _fours(formula: Any) -> Any:
    """Real blocks r, ..., r + 3 of one lane together."""

    @_inner
    def four(z: Any, lane: int, coefficients: Any, reals: int, r: int, count: int) -> bool:
        k0, U0, V0 = _block(coefficients, z, lane, r, reals)
        k1, U1, V1 = _block(coefficients, z, lane, r + 1, reals)
        k2, U2, V2 = _block(coefficients, z, lane, r + 2, reals)
        k3, U3, V3 = _block(coefficients, z, lane, r + 3, reals)
        good = True
        for _ in range(count):
            U0, V0, w0, g0 = formula(U0, V0, k0)
            U1, V1, w1, g1 = formula(U1, V1, k1)
            U2, V2, w2, g2 = formula(U2, V2, k2)
            U3, V3, w3, g3 = formula(U3, V3, k3)
            good &= (abs(w0) > NEAR + NEAR * abs(g0)) & (abs(w1) > NEAR + NEAR * abs(g1))
            good &= (abs(w2) > NEAR + NEAR * abs(g2)) & (abs(w3) > NEAR + NEAR * abs(g3))
        z[2 * r, lane], z[2 * r + 1, lane] = U0, V0
        if r + 1 < reals:
            z[2 * r + 2, lane], z[2 * r + 3, lane] = U1, V1
        if r + 2 < reals:
            z[2 * r + 4, lane], z[2 * r + 5, lane] = U2, V2
        if r + 3 < reals:
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
def _single(z: Any, lane: int, kinds: Any, coefficients: Any, reals: int, count: int) -> bool:
    good = True
    for r in range(0, reals, 4):
        kind, last = kinds[r], min(r + 4, reals)
        for s in range(r + 1, last):
            kind = kind if kinds[s] == kind else GENERAL  # whose formula gives the numbers of the others
        if kind == LINES:
            good &= _four_lines(z, lane, coefficients, reals, r, count)
        elif kind == CUBES:
            good &= _four_cubes(z, lane, coefficients, reals, r, count)
        else:
            good &= _four_general(z, lane, coefficients, reals, r, count)
    r = reals
    while r < len(kinds):
        s = r + 1 if r + 1 < len(kinds) and kinds[r + 1] == kinds[r] else r
        k, l = _eight(coefficients[r]), _eight(coefficients[s])
        good &= _two(z, lane, kinds[r] == LINES, k, l, 4 * r - 2 * reals, 4 * s - 2 * reals, count)
        r = s + 1
    return good


@_inner
def _careful(
    z: Any,
    lane: int,
    kinds: Any,
    coefficients: Any,
    reals: int,
    index: int,
    count: int,
    status: Any,
    failed_at: Any,
    near: Any,
    near_at: Any,
    at_lane: int,
) -> None:
    """float_steps.walk for one lane in normal form."""
    rows = z.shape[0]
    for step in range(index, index + count):
        failed, close = RUNNING, 0
        for r in range(len(kinds)):
            k = _eight(coefficients[r])
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
            status[at_lane] = failed
            failed_at[at_lane] = step + 1
            for j in range(rows):
                z[j, lane] = 0.0
            return
        if close:
            if near[at_lane] == 0:
                near_at[at_lane] = step
            near[at_lane] += close


@_inner
def _sample(
    z: Any, width: int, at_lane: int, coefficients: Any, reals: int, kappa: Any, base: Any, largest: Any, alive: Any
) -> None:
    """float_steps.sample; lanes that have ended are not alive."""
    for r in range(len(coefficients)):
        k, kappa_r, kappa_i = _eight(coefficients[r]), kappa[r, 0], kappa[r, 1]
        base_r, base_i = base[r, 0, at_lane : at_lane + width], base[r, 1, at_lane : at_lane + width]
        top = largest[r, at_lane : at_lane + width]
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
def _sound(z: Any, before: Any, width: int) -> bool:
    """Whether all lanes are finite and none has fallen to 0; see float_numpy._sound."""
    good = True
    for j in range(len(z)):
        row, old = z[j], before[j]
        for i in range(width):
            good &= (abs(row[i]) <= LARGEST) & ((row[i] != 0.0) | (old[i] == 0.0))
    return good


def _stamp() -> int:
    """A checksum of the formulas' file: machine code kept on disk goes by the age of this file alone."""
    return zlib.crc32(Path(float_steps.__file__).read_bytes())


def _planar_kernel(stamp: int) -> Any:
    def planar_advance(
        z: Any,
        lo: int,
        hi: int,
        kinds: Any,
        coefficients: Any,
        reals: int,
        kappa: Any,
        first: int,
        steps: int,
        every: int,
        sampled: int,
        record: Any,
        status: Any,
        failed_at: Any,
        near: Any,
        near_at: Any,
        base: Any,
        largest: Any,
        buffer: Any,
        saved: Any,
        fine: Any,
    ) -> int:
        rows = z.shape[0]
        for at in range(lo, hi, _WIDTH):
            width = min(_WIDTH, hi - at)
            for j in range(rows):
                for i in range(width):
                    buffer[j, i] = z[j, at + i]
            index, row = first, 0
            while index < first + steps:
                end = min(first + steps, index + _PIECE)
                if every:
                    end = min(end, index - index % every + every)
                if sampled:
                    end = min(end, index - index % sampled + sampled)
                count = end - index
                _copied(buffer, saved, width)
                if width <= _FEW:
                    good = True
                    for i in range(width):
                        good &= _single(buffer, i, kinds, coefficients, reals, count)
                else:
                    good = _many(buffer, kinds, coefficients, reals, width, count)
                good &= _sound(buffer, saved, width)
                if not good:
                    for i in range(width):
                        fine[i] = 1.0
                    _copied(saved, buffer, width)
                    _many_flagged(buffer, kinds, coefficients, reals, width, count, fine)
                    for i in range(width):
                        for j in range(rows):
                            x = buffer[j, i]
                            if not ((abs(x) <= LARGEST) & ((x != 0.0) | (saved[j, i] == 0.0))):
                                fine[i] = 0.0
                        if fine[i] == 0.0:
                            for j in range(rows):
                                buffer[j, i] = saved[j, i]
                            _careful(
                                buffer,
                                i,
                                kinds,
                                coefficients,
                                reals,
                                index,
                                count,
                                status,
                                failed_at,
                                near,
                                near_at,
                                at + i,
                            )
                index = end
                if every and index % every == 0:
                    for i in range(width):
                        running = status[at + i] == RUNNING
                        for j in range(rows):
                            record[row, j, at + i] = buffer[j, i] if running else np.nan
                    row += 1
                if sampled and index % sampled == 0:
                    for i in range(width):
                        fine[i] = 1.0 if status[at + i] == RUNNING else 0.0
                    _sample(buffer, width, at, coefficients, reals, kappa, base, largest, fine)
            for j in range(rows):
                for i in range(width):
                    z[j, at + i] = buffer[j, i]
        return stamp

    return planar_advance


@_inner
def _alone(
    x: Any,
    constants: Any,
    first: Any,
    columns: Any,
    factors: Any,
    products: Any,
    M: Any,
    right: Any,
    sizes: Any,
) -> Any:
    """float_steps.PythonGeneric.step: the image of x into `right`; its status, and whether it was near-singular."""
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
def _together(
    x: Any,
    constants: Any,
    first: Any,
    columns: Any,
    factors: Any,
    products: Any,
    M: Any,
    right: Any,
    scale: Any,
    inverse: Any,
    fine: Any,
) -> bool:
    """One step of all lanes: images into `right`; `fine` is 0 where something is unusual.

    M has n rows of n + 1 entries, the last one the right-hand side. Loops over the lanes do several operations, which
    saves loads and stores, but not too many: a loop over more than a handful of arrays is not vectorised, because the
    compiler would have to test too many pairs of them for overlap. For the same reason the number of lanes is a
    constant.
    """
    n = len(constants)
    for l in range(_GENERIC_WIDTH):
        scale[l] = 1.0
        fine[l] = 1.0
    for t in range(len(products)):
        target, A, B = x[n + t], x[products[t, 0]], x[products[t, 1]]
        for l in range(_GENERIC_WIDTH):
            target[l] = A[l] * B[l]
    for i in range(n):
        for j in range(n + 1):
            entry = M[i * (n + 1) + j]
            t, end = first[i * (n + 1) + j], first[i * (n + 1) + j + 1]
            constant = constants[i, j]
            if end - t >= 3:
                a, b, c = factors[t], factors[t + 1], factors[t + 2]
                A, B, C = x[columns[t]], x[columns[t + 1]], x[columns[t + 2]]
                for l in range(_GENERIC_WIDTH):
                    entry[l] = ((constant + a * A[l]) + b * B[l]) + c * C[l]
                t += 3
            else:
                for l in range(_GENERIC_WIDTH):
                    entry[l] = constant
            while end - t > 3:
                a, b, c = factors[t], factors[t + 1], factors[t + 2]
                A, B, C = x[columns[t]], x[columns[t + 1]], x[columns[t + 2]]
                for l in range(_GENERIC_WIDTH):
                    entry[l] = ((entry[l] + a * A[l]) + b * B[l]) + c * C[l]
                t += 3
            if end - t == 3 and j < n:
                a, b, c = factors[t], factors[t + 1], factors[t + 2]
                A, B, C = x[columns[t]], x[columns[t + 1]], x[columns[t + 2]]
                for l in range(_GENERIC_WIDTH):
                    total = ((entry[l] + a * A[l]) + b * B[l]) + c * C[l]
                    entry[l] = total
                    scale[l] = abs(total) if abs(total) > scale[l] else scale[l]
                continue
            while t < end:
                a = factors[t]
                A = x[columns[t]]
                for l in range(_GENERIC_WIDTH):
                    entry[l] += a * A[l]
                t += 1
            if j < n:
                for l in range(_GENERIC_WIDTH):
                    scale[l] = abs(entry[l]) if abs(entry[l]) > scale[l] else scale[l]
    for p in range(n):
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
    for j in range(n - 1, -1, -1):
        value, target, pivot = M[j * (n + 1) + n], right[j], M[j * (n + 1) + j]
        for l in range(_GENERIC_WIDTH):
            target[l] = value[l] / pivot[l]
            fine[l] = fine[l] if abs(target[l]) <= LARGEST else 0.0
        for i in range(j):
            entry, upper = M[i * (n + 1) + n], M[i * (n + 1) + j]
            for l in range(_GENERIC_WIDTH):
                entry[l] -= upper[l] * target[l]
    good = True
    for l in range(_GENERIC_WIDTH):
        good &= fine[l] != 0.0
    return good


def _generic_kernel(stamp: int) -> Any:
    def generic_advance(
        z: Any,
        lo: int,
        hi: int,
        constants: Any,
        terms: Any,
        columns: Any,
        factors: Any,
        products: Any,
        first: int,
        steps: int,
        every: int,
        record: Any,
        status: Any,
        failed_at: Any,
        near: Any,
        near_at: Any,
        x: Any,
        M: Any,
        right: Any,
        scale: Any,
        inverse: Any,
        fine: Any,
    ) -> int:
        n = z.shape[0]
        wide = len(fine)
        few = wide == 1
        x_alone = np.zeros(n + len(products))
        M_alone = np.zeros((n, n))
        right_alone = np.zeros(n)
        sizes = np.ones(n)
        for at in range(lo, hi, wide):
            width = min(wide, hi - at)
            for j in range(n):
                for i in range(wide):
                    x[j, i] = z[j, at + i] if i < width else z[j, at]  # lanes that nobody looks at
            row = 0
            for index in range(first, first + steps):
                good = False
                if few:
                    fine[0] = 0.0
                else:
                    good = _together(x, constants, terms, columns, factors, products, M, right, scale, inverse, fine)
                if not good:
                    for i in range(width):
                        if fine[i] != 0.0:
                            continue
                        failed, close = RUNNING, 0
                        if status[at + i] == RUNNING:
                            for j in range(n):
                                x_alone[j] = x[j, i]
                            failed, close = _alone(
                                x_alone, constants, terms, columns, factors, products, M_alone, right_alone, sizes
                            )
                            if failed != RUNNING:
                                status[at + i] = failed
                                failed_at[at + i] = index + 1
                            elif close:
                                if near[at + i] == 0:
                                    near_at[at + i] = index
                                near[at + i] += close
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


def _points_kernel(stamp: int) -> Any:
    def points(out: Any, record: Any, x: Any, lo: int, hi: int) -> int:
        """x = out z for every record (rows, n); x has the shape (count, n, dim)."""
        rows = record.shape[1]
        total = np.zeros((out.shape[0], _WIDTH))
        for row in range(record.shape[0]):
            for at in range(lo, hi, _WIDTH):
                width = min(_WIDTH, hi - at)
                for i in range(out.shape[0]):
                    for l in range(width):
                        total[i, l] = out[i, 0] * record[row, 0, at + l]
                    for j in range(1, rows):
                        for l in range(width):
                            total[i, l] += out[i, j] * record[row, j, at + l]
                for l in range(width):
                    for i in range(out.shape[0]):
                        x[row, at + l, i] = total[i, l]
        return stamp

    return points


_STAMP = _stamp()
_kernel = partial(compiled, error_model="numpy", nogil=True)
planar_advance = _kernel(_planar_kernel(_STAMP))
generic_advance = _kernel(_generic_kernel(_STAMP))
points = _kernel(_points_kernel(_STAMP))

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
        blocks = self.blocks

        def run(lo: int, hi: int) -> None:
            planar_advance(
                lanes.z,
                lo,
                hi,
                blocks.kinds,
                blocks.coefficients,
                blocks.reals,
                blocks.kappa,
                first,
                steps,
                every if record is not None else 0,
                sampled,
                _NOTHING if record is None else record,
                lanes.status,
                lanes.failed_at,
                lanes.near,
                lanes.near_at,
                lanes.base,
                lanes.largest,
                _aligned(len(lanes.z), _WIDTH),
                _aligned(len(lanes.z), _WIDTH),
                _aligned(1, _WIDTH)[0],
            )

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

        n = equation.rows

        def run(lo: int, hi: int) -> None:
            wide = 1 if hi - lo <= 2 * _FEW else _GENERIC_WIDTH
            generic_advance(
                lanes.z,
                lo,
                hi,
                equation.constants,
                equation.first,
                equation.columns,
                equation.factors,
                equation.products,
                first,
                steps,
                every if record is not None else 0,
                _NOTHING if record is None else record,
                lanes.status,
                lanes.failed_at,
                lanes.near,
                lanes.near_at,
                _aligned(n + len(equation.products), wide),
                _aligned(n * (n + 1), wide),
                _aligned(n + len(equation.products), wide),
                _aligned(1, wide)[0],
                _aligned(1, wide)[0],
                _aligned(1, wide)[0],
            )

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
