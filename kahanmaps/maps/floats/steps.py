"""What a step in machine numbers is, operation by operation, and what is kept of many orbits side by side.

The formulas are written so that they can be given floats or arrays; plain Python and whole numpy arrays
(numpy_kernel.py) and compiled loops (numba_kernel.py) run them as they stand. A result names its kernel; with the same
one it comes out the same, to the last bit: one orbit or many, one thread or two, in one piece or in portions.

In normal form a state holds the rows of blocks.py, those of one kind together (`PlanarRows`). A step is
*near-singular* in a block if

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

from typing import Any, NamedTuple

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.errors import InputError
from kahanmaps.maps.floats.blocks import CUBES, GENERAL, LINES, PlanarBlocks
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
_CACHED = 512  # lanes whose integrals are computed together
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

FORMULAS: dict[tuple[int, int], Any] = {
    (LINES, 2): real_lines,
    (CUBES, 2): real_cubes,
    (GENERAL, 2): real_general,
    (LINES, 4): complex_lines,
    (GENERAL, 4): complex_general,
}  # by kind and the number of rows of a block


class Run(NamedTuple):
    """Neighbouring blocks of one kind that take their steps together; a general one is alone, for its coefficients.

    Its rows are those from `row` on: of all `blocks` of them the first coordinate, of all the second, ... (`parts`).
    """

    kind: int
    parts: int
    row: int
    blocks: int
    first: int

    def of(self, z: FloatArray) -> list[FloatArray]:
        """The coordinates, each an array (blocks, n), views of the state z (rows, n)."""
        return [z[self.row + k * self.blocks : self.row + (k + 1) * self.blocks] for k in range(self.parts)]

    @property
    def near(self) -> float:
        """What w, or |w|^2, is compared with."""
        return NEAR if self.parts == 2 else NEAR_SQUARED


class PlanarRows:
    """The blocks of a normal form in runs; `places` says where in a state each row of the blocks is."""

    def __init__(self, blocks: PlanarBlocks) -> None:
        self.blocks = blocks
        self.runs: list[Run] = []
        order: list[int] = []
        first = 0
        while first < len(blocks.kinds):
            kind, real, end = int(blocks.kinds[first]), first < blocks.reals, first + 1
            last = blocks.reals if real else len(blocks.kinds)
            while end < last and kind != GENERAL and blocks.kinds[end] == kind:
                end += 1
            parts, count = 2 if real else 4, end - first
            start = 2 * first if real else 4 * first - 2 * blocks.reals  # of the rows in the order of the blocks
            self.runs.append(Run(kind, parts, len(order), count, first))
            order += [start + parts * b + k for k in range(parts) for b in range(count)]
            first = end
        self.places = np.argsort(order).tolist()
        self.into = blocks.into[order]

    def coefficients(self, run: Run) -> tuple[FloatArray, ...]:
        """Re a, Im a, Re b, ... of the blocks of a run, columns."""
        return tuple(self.blocks.coefficients[run.first : run.first + run.blocks].T[:, :, None])

    def integrals(self, z: FloatArray) -> FloatArray:
        """The integrals h/(1 + eps^2 D) at the states z (rows, n): an array (blocks, 2, n), Re and Im."""
        found = np.zeros((len(self.blocks.kinds), 2, z.shape[1]))
        numbers = [(run, self.coefficients(run), slice(run.first, run.first + run.blocks)) for run in self.runs]
        with np.errstate(all="ignore"):
            for low in range(0, z.shape[1], _CACHED):
                lanes = slice(low, low + _CACHED)
                for run, k, here in numbers:
                    kappa = self.blocks.kappa[here].T[:, :, None]
                    integral: Any = real_integral if run.parts == 2 else complex_integral
                    value = integral(*run.of(z[:, lanes]), k, *kappa[: run.parts // 2])
                    if run.parts == 2:
                        found[here, 0, lanes] = value
                    else:
                        found[here, 0, lanes], found[here, 1, lanes] = value
        return found

    def distances(self, z: FloatArray, base: FloatArray) -> FloatArray:
        """How far the block integrals at the states z (rows, n) are from `base`: an array (blocks, n)."""
        moved, reals = self.integrals(z), self.blocks.reals
        with np.errstate(all="ignore"):
            moved -= base
            distance: FloatArray = np.abs(moved[:, 0])
            distance[reals:] = np.sqrt((moved[reals:] * moved[reals:]).sum(axis=1))
        distance[np.isnan(distance)] = np.inf
        return distance


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
