"""Compiled kernels for residues modulo an odd p < 2^61; `kernels` needs numba, and nothing else here does.

Numbers are in Montgomery form, a R modulo p with R = 2^64, below p. A sum of up to four products is at most 4 p^2 <
p R / 2; adding the multiple of p that makes it divisible by R and dividing leaves less than 3 p / 2. The products are
of 128 bits, which numba does not offer: they are written in the language of LLVM.

The functions are ordinary ones until `kernels` puts what numba makes of them in their place, so that this file
loads without numba, and the machine code can be kept on disk.
"""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from threading import Lock
from typing import Any

import numpy as np

_mul: Any = None  # a b / R
_dot2: Any = None  # (a b + c d) / R
_dot4: Any = None


_LOCK = Lock()


def kernels() -> tuple[Any, Any, Any]:
    """The compiled `walk_planes`, `walk_general` and `inner_product`. Raises ImportError without numba."""
    with _LOCK:
        return _compiled()


@lru_cache(maxsize=1)
def _compiled() -> tuple[Any, Any, Any]:
    import numba

    from kahanmaps.maps.kept_code import compiled

    module = globals()
    for name, factors in (("_mul", 2), ("_dot2", 4), ("_dot4", 8)):
        module[name] = _operation(factors)
    inner = numba.njit(nogil=True)
    for name in ("_walk_plane", "_inner_product", "_eliminate"):
        module[name] = inner(module[name])
    return compiled(walk_planes, nogil=True), compiled(walk_general, nogil=True), module["_inner_product"]


def _operation(factors: int) -> Any:
    """The sum of the products of neighbours among so many words, over R modulo p; p and -1/p modulo R come last."""
    from numba.core.types import uint64
    from numba.extending import intrinsic

    ir: Any = import_module("llvmlite.ir")
    word, double = ir.IntType(64), ir.IntType(128)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        *values, p, n = arguments
        wide = [builder.zext(value, double) for value in values]
        total = builder.mul(wide[0], wide[1])
        for k in range(2, factors, 2):
            total = builder.add(total, builder.mul(wide[k], wide[k + 1]))
        multiple = builder.zext(builder.mul(builder.trunc(total, word), n), double)
        total = builder.add(total, builder.mul(multiple, builder.zext(p, double)))
        result = builder.trunc(builder.lshr(total, ir.Constant(double, 64)), word)
        return builder.select(builder.icmp_unsigned(">=", result, p), builder.sub(result, p), result)

    signature = uint64(*([uint64] * (factors + 2)))

    def two(typing: Any, a: Any, b: Any, p: Any, n: Any) -> Any:
        return signature, code

    def four(typing: Any, a: Any, b: Any, c: Any, d: Any, p: Any, n: Any) -> Any:
        return signature, code

    def eight(typing: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any, p: Any, n: Any) -> Any:
        return signature, code

    return intrinsic({2: two, 4: four, 8: eight}[factors])


def _walk_plane(start: Any, end: Any, k: Any, p: Any, n: Any, steps: int) -> int:
    """Takes `start` = (U, V, W) to `end`, up to `steps` steps and not where W becomes 0; how many it were."""
    b, c2, d3, a3, b2, c1, q0, q1, q2 = k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8]
    U, V, W = start[0], start[1], start[2]
    taken = 0
    while taken < steps:
        UU, UV, VV = _mul(U, U, p, n), _mul(U, V, p, n), _mul(V, V, p, n)
        below = _dot4(W, W, q0, UU, q1, UV, q2, VV, p, n)
        if below == 0:
            break
        U, V = _dot4(U, W, b, UU, c2, UV, d3, VV, p, n), _dot4(V, W, a3, UU, b2, UV, c1, VV, p, n)
        W = below
        taken += 1
    end[0], end[1], end[2] = U, V, W
    return taken


def walk_planes(state: Any, coefficients: Any, p: Any, n: Any, steps: int, first: int, singular_at: Any) -> None:
    """`steps` steps of every lane that is still running; state[lane, plane] = (U, V, W).

    Each plane goes by itself; a lane ends where the first of its planes does.
    """
    lanes, planes = state.shape[0], state.shape[1]
    for lane in range(lanes):
        if singular_at[lane] >= 0:
            continue
        before, count = state[lane].copy(), steps
        for plane in range(planes):
            taken = _walk_plane(before[plane], state[lane, plane], coefficients[plane], p, n, count)
            if taken < count:
                count = taken
                for earlier in range(plane):
                    _walk_plane(before[earlier], state[lane, earlier], coefficients[earlier], p, n, count)
        if count < steps:
            singular_at[lane] = first + count


def _inner_product(row: Any, x: Any, p: Any, n: Any) -> Any:
    """The length is a multiple of 4."""
    total = _dot4(row[0], x[0], row[1], x[1], row[2], x[2], row[3], x[3], p, n)
    for k in range(4, x.shape[0], 4):
        total += _dot4(row[k], x[k], row[k + 1], x[k + 1], row[k + 2], x[k + 2], row[k + 3], x[k + 3], p, n)
        if total >= p:
            total -= p
    return total


def _eliminate(M: Any, size: int, p: Any, n: Any) -> bool:
    """Makes M = (matrix | right side) diagonal, rows multiplied as need be; False where the matrix is singular."""
    for column in range(size):
        row = column
        while row < size and M[row, column] == 0:
            row += 1
        if row == size:
            return False
        if row != column:
            for j in range(column, size + 1):
                M[row, j], M[column, j] = M[column, j], M[row, j]
        pivot = M[column, column]
        for i in range(size):
            if i != column and M[i, column] != 0:
                factor = p - M[i, column]
                if i < column:
                    M[i, i] = _mul(M[i, i], pivot, p, n)
                for j in range(column + 1, size + 1):
                    M[i, j] = _dot2(pivot, M[i, j], factor, M[column, j], p, n)
    return True


def walk_general(state: Any, forms: Any, one: Any, p: Any, n: Any, steps: int, first: int, singular_at: Any) -> None:
    """`steps` steps of every lane that is still running; state[lane] = (x_1 Z, ..., x_size Z, Z, 0, ...).

    forms[i, j] applied to the state is the entry (i, j) of the matrix of the step, j = size of its right side.
    """
    lanes, size = state.shape[0], forms.shape[0]
    M = np.empty((size, size + 1), dtype=np.uint64)
    for lane in range(lanes):
        if singular_at[lane] >= 0:
            continue
        x = state[lane]
        for step in range(steps):
            for i in range(size):
                for j in range(size + 1):
                    M[i, j] = _inner_product(forms[i, j], x, p, n)
            if not _eliminate(M, size, p, n):
                singular_at[lane] = first + step
                break
            # x_i = M[i, size] / M[i, i], over the product of all M[i, i].
            total = one
            for i in range(size):
                x[i] = _mul(M[i, size], total, p, n)
                total = _mul(total, M[i, i], p, n)
            x[size] = total
            total = M[size - 1, size - 1]
            for i in range(size - 2, -1, -1):
                x[i] = _mul(x[i], total, p, n)
                total = _mul(total, M[i, i], p, n)
