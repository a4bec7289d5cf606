"""What a step in machine numbers is, operation by operation; every kernel does these operations in this order.

So it makes no difference, to the last bit, which kernel ran: plain Python (this file), whole numpy arrays
(numpy_kernel.py) or compiled loops (numba_kernel.py); one orbit or many; one thread or two; in one piece or in
portions. The formulas are written so that they can be given floats or arrays. No product is contracted with a sum, and
no sum reordered.

In normal form a state holds the rows of blocks.py. A step is *near-singular* in a block if

    |w| <= 2^-40 (1 + |A C|),     w = (1 + B)(1 - B) + A C = 1 + eps^2 D,

at a complex root |w|^2 <= 2^-80 (1 + |A C|^2): then at most 13 of the 53 bits of w are left. Near-singular steps are
counted, one for each block, and the orbit goes on. It ends *singular* where w is 0, and as an *overflow* where w or a
coordinate of the image is no finite number.

The generic step, for any map, eliminates in the matrix M(x), which is I - eps f'(x) for Kahan maps. Going down a
column, a row whose entry is more than 8 times the pivot found so far becomes the pivot row; so no row is subtracted
more than 8 times from another, and where eps f'(x) is small no rows are exchanged. Such a step is near-singular if a
pivot is at most 2^-40 of the largest of 1 and the entries of its row, as it was in the beginning. The orbit ends
*singular* where a pivot is 0, and as an *overflow* where an entry, a pivot or a coordinate of the image is no finite
number.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import isfinite
from typing import Any, NamedTuple, Protocol

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.errors import InputError
from kahanmaps.maps.floats.blocks import LINES, PlanarBlocks
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.implicit import StepOver
from kahanmaps.maps.kahan import KahanMapOver

IntArray = NDArray[np.int64]

NEAR = 2.0**-40
NEAR_SQUARED = NEAR * NEAR
# In real canonical blocks |A C| <= |w - 1|: w is 1 + U V, or 1 - (U^2 + U V + V^2). So a step with |w| above this is
# not near-singular, whatever A C is.
CLEAR = 4 * NEAR
MUCH = 8.0
LARGEST = float(np.finfo(np.float64).max)

RUNNING, OVERFLOW, SINGULAR = 0, 1, 2
STATUS = ("completed", "overflow", "singular")  # by code; the words of OrbitEnd

# Formulas. k holds the coefficients Re a, Im a, Re b, ... of a block; the last two results are w and A C, and for
# complex blocks their squared absolute values. 1/w may be infinite, and what follows then no number: the caller looks
# at w.


def real_lines(U: Any, V: Any, k: Any) -> Any:
    """(a, b, c, d) = (0, 1, 1, 0): A = V, B = U + V, C = U."""
    B = U + V
    p = 1.0 + B
    q = 1.0 - B
    g = V * U
    w = p * q + g
    i = 1.0 / w
    return (p * U + g) * i, (q * V - g) * i, w, g


def real_cubes(U: Any, V: Any, k: Any) -> Any:
    """(a, b, c, d) = (1, 0, 0, 1): A = U, B = 0, C = V."""
    g = U * V
    w = 1.0 + g
    i = 1.0 / w
    return (U + V * V) * i, (V - U * U) * i, w, g


def real_general(U: Any, V: Any, k: Any) -> Any:
    """Any real a, b, c, d."""
    A = k[0] * U + k[2] * V
    B = k[2] * U + k[4] * V
    C = k[4] * U + k[6] * V
    p = 1.0 + B
    q = 1.0 - B
    g = A * C
    w = p * q + g
    i = 1.0 / w
    return (p * U + C * V) * i, (q * V - A * U) * i, w, g


def complex_lines(Ur: Any, Ui: Any, Vr: Any, Vi: Any, k: Any) -> Any:
    """(a, b, c, d) = (0, 1, 1, 0): A = V, B = U + V, C = U."""
    Br = Ur + Vr
    Bi = Ui + Vi
    pr = 1.0 + Br
    qr = 1.0 - Br
    gr = Vr * Ur - Vi * Ui
    gi = Vr * Ui + Vi * Ur
    wr = (pr * qr + Bi * Bi) + gr
    wi = (Bi * qr - pr * Bi) + gi
    n = wr * wr + wi * wi
    i = 1.0 / n
    xr = (pr * Ur - Bi * Ui) + gr
    xi = (pr * Ui + Bi * Ur) + gi
    yr = (qr * Vr + Bi * Vi) - gr
    yi = (qr * Vi - Bi * Vr) - gi
    cr = wr * i
    ci = wi * i
    return xr * cr + xi * ci, xi * cr - xr * ci, yr * cr + yi * ci, yi * cr - yr * ci, n, gr * gr + gi * gi


def complex_general(Ur: Any, Ui: Any, Vr: Any, Vi: Any, k: Any) -> Any:
    """Any complex a, b, c, d."""
    Ar = (k[0] * Ur - k[1] * Ui) + (k[2] * Vr - k[3] * Vi)
    Ai = (k[0] * Ui + k[1] * Ur) + (k[2] * Vi + k[3] * Vr)
    Br = (k[2] * Ur - k[3] * Ui) + (k[4] * Vr - k[5] * Vi)
    Bi = (k[2] * Ui + k[3] * Ur) + (k[4] * Vi + k[5] * Vr)
    Cr = (k[4] * Ur - k[5] * Ui) + (k[6] * Vr - k[7] * Vi)
    Ci = (k[4] * Ui + k[5] * Ur) + (k[6] * Vi + k[7] * Vr)
    pr = 1.0 + Br
    qr = 1.0 - Br
    gr = Ar * Cr - Ai * Ci
    gi = Ar * Ci + Ai * Cr
    wr = (pr * qr + Bi * Bi) + gr
    wi = (Bi * qr - pr * Bi) + gi
    n = wr * wr + wi * wi
    i = 1.0 / n
    xr = (pr * Ur - Bi * Ui) + (Cr * Vr - Ci * Vi)
    xi = (pr * Ui + Bi * Ur) + (Cr * Vi + Ci * Vr)
    yr = (qr * Vr + Bi * Vi) - (Ar * Ur - Ai * Ui)
    yi = (qr * Vi - Bi * Vr) - (Ar * Ui + Ai * Ur)
    cr = wr * i
    ci = wi * i
    return xr * cr + xi * ci, xi * cr - xr * ci, yr * cr + yi * ci, yi * cr - yr * ci, n, gr * gr + gi * gi


def real_integral(U: Any, V: Any, k: Any, kappa: Any) -> Any:
    """The block integral h/(1 + eps^2 D)."""
    A = k[0] * U + k[2] * V
    B = k[2] * U + k[4] * V
    C = k[4] * U + k[6] * V
    w = (1.0 + B) * (1.0 - B) + A * C
    return kappa * ((((A * U) + (2.0 * B) * V) * U + (C * V) * V) / w)


def complex_integral(Ur: Any, Ui: Any, Vr: Any, Vi: Any, k: Any, kappa_r: Any, kappa_i: Any) -> Any:
    """The block integral h/(1 + eps^2 D), real and imaginary part."""
    Ar = (k[0] * Ur - k[1] * Ui) + (k[2] * Vr - k[3] * Vi)
    Ai = (k[0] * Ui + k[1] * Ur) + (k[2] * Vi + k[3] * Vr)
    Br = (k[2] * Ur - k[3] * Ui) + (k[4] * Vr - k[5] * Vi)
    Bi = (k[2] * Ui + k[3] * Ur) + (k[4] * Vi + k[5] * Vr)
    Cr = (k[4] * Ur - k[5] * Ui) + (k[6] * Vr - k[7] * Vi)
    Ci = (k[4] * Ui + k[5] * Ur) + (k[6] * Vi + k[7] * Vr)
    wr = ((1.0 + Br) * (1.0 - Br) + Bi * Bi) + (Ar * Cr - Ai * Ci)
    wi = (-2.0 * Br) * Bi + (Ar * Ci + Ai * Cr)
    er = (Ar * Ur - Ai * Ui) + 2.0 * (Br * Vr - Bi * Vi)
    ei = (Ar * Ui + Ai * Ur) + 2.0 * (Br * Vi + Bi * Vr)
    fr = Cr * Vr - Ci * Vi
    fi = Cr * Vi + Ci * Vr
    hr = (er * Ur - ei * Ui) + (fr * Vr - fi * Vi)
    hi = (er * Ui + ei * Ur) + (fr * Vi + fi * Vr)
    n = wr * wr + wi * wi
    sr = (hr * wr + hi * wi) / n
    si = (hi * wr - hr * wi) / n
    return kappa_r * sr - kappa_i * si, kappa_r * si + kappa_i * sr


# What the kernels are given, and what they keep.


class GenericEquation(NamedTuple):
    """The equation M(x) x~ = r(x) in doubles, with the terms that are there; r is the last column of (M | r).

    Entry (i, j) is `constants[i, j]` plus the sum of `factors[t] y[columns[t]]` over
    `first[i (n + 1) + j] <= t < first[i (n + 1) + j + 1]`, where y is x and behind it y[a] y[b] for every pair (a, b)
    of `products`.
    """

    constants: FloatArray
    first: IntArray
    columns: IntArray
    factors: FloatArray
    products: IntArray

    @property
    def rows(self) -> int:
        """The dimension."""
        return len(self.constants)


def generic_equation(map_over: StepOver) -> GenericEquation:
    """The equation of a step of a map over QQ, each number rounded once. Raises InputError where one is out of range.

    A row of a Kahan map is of the size of 1 where eps is small, that of another map is divided by its largest
    coefficient in M: near-singular steps are told by the size of pivots.
    """
    equation = map_over.equation
    n = equation.dim
    index: dict[tuple[int, ...], int] = {tuple(int(i == k) for i in range(n)): k for k in range(n)}
    products: list[tuple[int, int]] = []

    def place(exponent: tuple[int, ...]) -> int:
        """Where the value of a monomial stands in y."""
        if exponent not in index:
            last = max(k for k, e in enumerate(exponent) if e)
            smaller = place((*exponent[:last], exponent[last] - 1, *exponent[last + 1 :]))
            index[exponent] = n + len(products)
            products.append((smaller, last))
        return index[exponent]

    constants = np.zeros((n, n + 1))
    first, columns, factors = [0], [], []
    for i, row in enumerate(equation.terms):
        largest = max((abs(c) for entry in row[:n] for _, c in entry), default=fmpq(1))
        scale = fmpq(1) if isinstance(map_over, KahanMapOver) else 1 / largest
        for j, entry in enumerate(row):
            found = []
            for k, coefficient in entry:
                value = _nearest(coefficient * scale if j < n else -coefficient * scale)
                exponent = equation.exponents[k][:n]
                if any(exponent):
                    found.append((place(exponent), value))
                else:
                    constants[i, j] = value
            for column, value in sorted(found):  # the order in which whole arrays are added
                columns.append(column)
                factors.append(value)
            first.append(len(columns))
    return GenericEquation(
        constants,
        np.array(first, dtype=np.int64),
        np.array(columns, dtype=np.int64),
        np.array(factors, dtype=np.float64),
        np.array(products, dtype=np.int64).reshape(-1, 2),
    )


def _nearest(number: fmpq) -> float:
    try:
        return int(number.p) / int(number.q)
    except OverflowError as error:
        raise InputError("eps times a coefficient leaves the range of machine floats: use exact arithmetic") from error


class Lanes(NamedTuple):
    """The states of n orbits side by side, one a column, and what happened to each.

    `z` has the shape (rows, n). `failed_at` is the index of the first iterate that does not exist, `near` the number of
    near-singular steps, `near_at` the index of the point at the first one (-1: none). `base` (blocks, 2, n) has the
    block integrals at the start, `largest` (blocks, n) the largest distance from it in a sample. The column of an orbit
    that has ended is 0.
    """

    z: FloatArray
    status: NDArray[np.int8]
    failed_at: IntArray
    near: IntArray
    near_at: IntArray
    base: FloatArray
    largest: FloatArray

    @classmethod
    def of(cls, z: FloatArray, blocks: int = 0) -> Lanes:
        """Lanes that are about to start."""
        n = z.shape[1]
        return cls(
            z,
            np.zeros(n, dtype=np.int8),
            np.full(n, -1, dtype=np.int64),
            np.zeros(n, dtype=np.int64),
            np.full(n, -1, dtype=np.int64),
            np.zeros((blocks, 2, n)),
            np.zeros((blocks, n)),
        )


def block_integrals(blocks: PlanarBlocks, z: FloatArray) -> FloatArray:
    """The integrals h/(1 + eps^2 D) of every block at the points `z` (rows, n): an array (blocks, 2, n), Re and Im."""
    found = np.zeros((len(blocks.kinds), 2, z.shape[1]))
    with np.errstate(all="ignore"):
        for r, (k, kappa) in enumerate(zip(blocks.coefficients.tolist(), blocks.kappa.tolist(), strict=True)):
            at = 2 * r if r < blocks.reals else 4 * r - 2 * blocks.reals
            if r < blocks.reals:
                found[r, 0] = real_integral(z[at], z[at + 1], k, kappa[0])
            else:
                found[r] = complex_integral(z[at], z[at + 1], z[at + 2], z[at + 3], k, kappa[0], kappa[1])
    return found


def distances(blocks: PlanarBlocks, lanes: Lanes, lo: int, hi: int) -> FloatArray:
    """How far the block integrals of the lanes lo, ..., hi - 1 are from their start: an array (blocks, hi - lo)."""
    with np.errstate(all="ignore"):
        moved = block_integrals(blocks, lanes.z[:, lo:hi]) - lanes.base[:, :, lo:hi]
        found: FloatArray = np.sqrt(moved[:, 0] * moved[:, 0] + moved[:, 1] * moved[:, 1])
    found[np.isnan(found)] = np.inf
    return found


def sample(blocks: PlanarBlocks, lanes: Lanes, lo: int, hi: int) -> None:
    """Keep the largest distance of the block integrals from their start, for the lanes lo, ..., hi - 1 that run."""
    alive = lanes.status[lo:hi] == RUNNING
    largest = lanes.largest[:, lo:hi]
    largest[:, alive] = np.maximum(largest[:, alive], distances(blocks, lanes, lo, hi)[:, alive])


def segments(first: int, steps: int, longest: int, every: int, sampled: int) -> Iterator[tuple[int, int]]:
    """Cuts `steps` steps from the index `first` on at the multiples of `every` and `sampled` (0: none).

    Yields the index at which a piece begins and the number of its steps, at most `longest`.
    """
    stop = first + steps
    while first < stop:
        end = min(stop, first + longest)
        for interval in (every, sampled):
            if interval:
                end = min(end, first - first % interval + interval)
        yield first, end - first
        first = end


def walk(
    stepper: Stepper,
    lanes: Lanes,
    lane: int,
    z: list[float],
    first: int,
    steps: int,
    every: int = 0,
    record: FloatArray | None = None,
) -> None:
    """Take one lane through `steps` steps from its state z at the index `first`, and note what happens to it.

    Writes the states at multiples of `every` to the rows of `record` (count, rows), NaN where there is none.
    """
    row = 0
    for index in range(first, first + steps):
        image, status, near = stepper.step(z)
        if status != RUNNING:
            lanes.status[lane] = status
            lanes.failed_at[lane] = index + 1
            z = [0.0] * len(z)
            if record is not None:
                record[row:] = np.nan
            break
        if near:
            if not lanes.near[lane]:
                lanes.near_at[lane] = index
            lanes.near[lane] += near
        z = image
        if record is not None and (index + 1) % every == 0:
            record[row] = z
            row += 1
    lanes.z[:, lane] = z


# One orbit in plain Python. 2 to 5 microseconds a planar block, and no waiting for a compiler.


class Stepper(Protocol):
    """Takes the state of a lane to its image."""

    def step(self, z: list[float]) -> tuple[list[float], int, int]:
        """The image, its status code, and how many blocks were near-singular."""


class PythonPlanar:
    """Steps of single lanes in normal form, in Python's own floats."""

    def __init__(self, blocks: PlanarBlocks) -> None:
        formulas = (real_lines, real_cubes, real_general)
        self._real = [
            (2 * r, formulas[blocks.kinds[r]], tuple(blocks.coefficients[r].tolist())) for r in range(blocks.reals)
        ]
        self._complex = [
            (
                2 * blocks.reals + 4 * s,
                complex_lines if blocks.kinds[blocks.reals + s] == LINES else complex_general,
                tuple(blocks.coefficients[blocks.reals + s].tolist()),
            )
            for s in range(len(blocks.kinds) - blocks.reals)
        ]

    def step(self, z: list[float]) -> tuple[list[float], int, int]:
        """The image, the status code and the number of near-singular blocks."""
        image: list[float] = []
        near = 0
        try:
            for at, formula, k in self._real:
                U, V, w, g = formula(z[at], z[at + 1], k)
                image += (U, V)
                if not abs(w) > NEAR + NEAR * abs(g):
                    if not isfinite(w):
                        return image, OVERFLOW, near
                    near += 1
                elif w in (_INFINITY, -_INFINITY):
                    return image, OVERFLOW, near
            for at, planar, k in self._complex:
                *parts, w, g = planar(z[at], z[at + 1], z[at + 2], z[at + 3], k)
                image += parts
                if not w > NEAR_SQUARED + NEAR_SQUARED * g:
                    if not isfinite(w):
                        return image, OVERFLOW, near
                    near += 1
                elif w == _INFINITY:
                    return image, OVERFLOW, near
        except ZeroDivisionError:  # where numpy and compiled code get an infinity
            return image, SINGULAR, near
        return image, RUNNING if all(map(isfinite, image)) else OVERFLOW, near


_INFINITY = float("inf")


class PythonGeneric:
    """Steps of single lanes of any map, in Python's own floats."""

    def __init__(self, equation: GenericEquation) -> None:
        n = equation.rows
        first: list[int] = equation.first.tolist()
        columns: list[int] = equation.columns.tolist()
        factors: list[float] = equation.factors.tolist()
        constants: list[list[float]] = equation.constants.tolist()
        terms = [list(zip(columns[s:e], factors[s:e], strict=True)) for s, e in pairwise(first)]
        rows = [[(constants[i][j], terms[i * (n + 1) + j]) for j in range(n + 1)] for i in range(n)]
        self._entries = [(row[:n], *row[n]) for row in rows]
        self._products: list[list[int]] = equation.products.tolist()

    def step(self, x: list[float]) -> tuple[list[float], int, int]:
        """The image, the status code and whether the step is near-singular."""
        y = x if not self._products else [*x]
        for a, b in self._products:
            y.append(y[a] * y[b])
        matrix, right, sizes = [], [], []
        for row, side, side_terms in self._entries:
            entries, size = [], 1.0
            for total, terms in row:
                for k, factor in terms:
                    total += factor * y[k]
                entries.append(total)
                if abs(total) > size:
                    size = abs(total)
            for k, factor in side_terms:
                side += factor * y[k]
            matrix.append(entries)
            right.append(side)
            sizes.append(size)
        return _solved(matrix, right, sizes)


def _solved(matrix: list[list[float]], right: list[float], sizes: list[float]) -> tuple[list[float], int, int]:
    """The solution, its status code and whether a pivot was small; `sizes` has the largest of 1 and each row."""
    n, near = len(right), 0
    if not max(sizes) <= LARGEST:
        return right, OVERFLOW, near
    for p in range(n):
        for i in range(p + 1, n):
            if abs(matrix[i][p]) > MUCH * abs(matrix[p][p]):
                matrix[p], matrix[i] = matrix[i], matrix[p]
                right[p], right[i] = right[i], right[p]
                sizes[p], sizes[i] = sizes[i], sizes[p]
        upper = matrix[p]
        pivot = upper[p]
        if pivot == 0.0:
            return right, SINGULAR, near
        if not abs(pivot) <= LARGEST:
            return right, OVERFLOW, near
        if abs(pivot) <= NEAR * sizes[p]:
            near = 1
        inverse = 1.0 / pivot
        for i in range(p + 1, n):
            row = matrix[i]
            factor = row[p] * inverse
            for j in range(p + 1, n):
                row[j] -= factor * upper[j]
            right[i] -= factor * right[p]
    for j in range(n - 1, -1, -1):
        right[j] /= matrix[j][j]
        for i in range(j):
            right[i] -= matrix[i][j] * right[j]
    return right, RUNNING if all(map(isfinite, right)) else OVERFLOW, near
