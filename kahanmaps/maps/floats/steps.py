"""What a step in floating-point numbers is: written out for a map or for a normal form, or, of large maps, in arrays.

A step takes the rows of a state to those of its image. For a map they are its coordinates, and the step solves
M(x) x~ = r(x), M(x) being I - eps f'(x) for Kahan maps; for a normal form they are the coordinates of its planar blocks
(blocks.py), where the same equation falls apart into blocks of two rows. A step is *near-singular* if a pivot is small
(straight_line.py); such steps are counted, and the orbit goes on. It ends *singular* where a pivot is 0, and as an
*overflow* where a number on the way or a coordinate of the image is not finite.

A result names its kernel; with the same one it comes out the same, to the last bit: one orbit or many, one thread or
two, in one piece or in portions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.errors import InputError
from kahanmaps.maps.floats.blocks import PlanarBlocks
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.maps.floats.straight_line import (
    LARGEST,
    MAX_OPERATIONS,
    NEAR,
    Code,
    ComplexPair,
    StepFindings,
    TooManyOperations,
    extreme,
    solve,
    solve_two,
)
from kahanmaps.maps.implicit import ElementaryMap
from kahanmaps.maps.kahan import KahanMap

IntArray = NDArray[np.int64]

RUNNING, OVERFLOW, SINGULAR = 0, 1, 2
STATUS = ("completed", "overflow", "singular")  # by code; the words of OrbitEnd


Write = Callable[[Sequence[Any], StepFindings], Sequence[Any]]


class FloatStep:
    """A step of states with so many rows: `write` gives the image of a state, and asks `Findings` about the numbers.

    `careful` takes the rows of a state, arrays, to those of its image and three more, which tell in which orbits the
    step is near-singular, singular, or an overflow. `fast` has one more, which tells in which orbits it is right. Where
    the fast step has too many operations to be written out it is left out, where the careful one has too many
    (eliminations with exchanges keep few zeros), `in_arrays` takes its place; without both there is no machine code.
    """

    def __init__(self, rows: int, write: Write, in_arrays: Callable[..., tuple[Any, ...]] | None = None) -> None:
        self.rows, self._write, self._in_arrays = rows, write, in_arrays
        self.fast_code = self._code(careful=False)
        self.operations = rows**3
        if self.fast_code is not None:
            self.operations = len(self.fast_code.operations)
            self.fast_on_floats, self.fast = self.fast_code.function(float), self.fast_code.function(np.ndarray)

    @cached_property
    def careful_code(self) -> Code | None:
        """Written when it is needed, which is seldom."""
        return None if self.fast_code is None else self._code(careful=True)

    @cached_property
    def careful(self) -> Callable[..., tuple[Any, ...]]:
        """The image, and what happened."""
        function = self._in_arrays if self.careful_code is None else self.careful_code.function(np.ndarray)
        if function is None:
            raise AssertionError("a step has no careful version")
        return function

    @cached_property
    def careful_on_floats(self) -> Callable[..., tuple[Any, ...]]:
        """The same of a single state, if it is written out."""
        return self.careful if self.careful_code is None else self.careful_code.function(float)

    def _code(self, careful: bool) -> Code | None:
        limit = None if self._in_arrays is None else 2 * MAX_OPERATIONS if careful else MAX_OPERATIONS
        code, findings = Code(self.rows, limit), StepFindings(careful)
        try:
            image = self._write(code.arguments, findings)
            for x in image:
                findings.number(x)
            code.outputs = [*image, *findings.outputs()]
        except TooManyOperations:
            return None
        return code


def planar_step(blocks: PlanarBlocks) -> FloatStep:
    """A step of a normal form."""

    def write(z: Sequence[Any], findings: StepFindings) -> list[Any]:
        image: list[Any] = []
        for r, coefficients in enumerate(blocks.coefficients):
            at, real = len(image), r < blocks.reals
            if real:
                U, V = z[at : at + 2]
                a, b, c, d = coefficients.real.tolist()
            else:
                U, V = ComplexPair(z[at], z[at + 1]), ComplexPair(z[at + 2], z[at + 3])
                a, b, c, d = (ComplexPair(x.real, x.imag) for x in coefficients.tolist())
            A, B, C = a * U + b * V, b * U + c * V, c * U + d * V
            for x in solve_two([[1.0 - B, -C, U], [A, 1.0 + B, V]], findings):
                image += [x] if real else [x.x, x.y]
        return image

    return FloatStep(blocks.rows, write)


def map_step(factors: Sequence[ElementaryMap]) -> FloatStep:
    """A step of each of the maps, one after the other. Raises InputError where a number is out of range."""
    equations = [float_equation(one) for one in factors]

    def write(x: Sequence[Any], findings: StepFindings) -> Sequence[Any]:
        for equation in equations:
            x = equation.image(x, findings)
        return x

    return FloatStep(factors[0].dim, write, partial(_step_in_arrays, equations))


class FloatEquation(NamedTuple):
    """The equation M(x) x~ = r(x) in doubles, with the terms that are there; r is the last column of (M | r).

    Entry (i, j) is the sum of c y[k] over the pairs (k, c) of `terms[i][j]`, and `constants[i][j]`; y is x and behind
    it y[a] y[b] for every pair (a, b) of `products`.
    """

    constants: list[list[float]]
    terms: list[list[list[tuple[int, float]]]]
    products: list[tuple[int, int]]

    def monomials(self, x: Sequence[Any]) -> list[Any]:
        """The values y at x."""
        y = list(x)
        for a, b in self.products:
            y.append(y[a] * y[b])
        return y

    def image(self, x: Sequence[Any], findings: StepFindings) -> list[Any]:
        """The image of x."""
        y, n = self.monomials(x), len(self.constants)
        rows = []
        for constants, entries in zip(self.constants, self.terms, strict=True):
            rows.append(
                [sum((c * y[k] for k, c in terms), start) for start, terms in zip(constants, entries, strict=True)]
            )

        def bound() -> Any:
            size: Any = 0.0
            for k in sorted({k for entries in self.terms for terms in entries[:n] for k, _ in terms}):
                size = extreme("max", size, abs(y[k]))
            largest_sum = max(sum(abs(c) for _, c in terms) for entries in self.terms for terms in entries[:n])
            return size * largest_sum + max(1.0, max(abs(x) for constants in self.constants for x in constants[:n]))

        return solve(rows, bound, findings)


def float_equation(map_over: ElementaryMap) -> FloatEquation:
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

    all_constants, all_terms = [], []
    for row in equation.terms:
        largest = max((abs(c) for entry in row[:n] for _, c in entry), default=fmpq(1))
        scale = fmpq(1) if isinstance(map_over, KahanMap) else 1 / largest
        constants, terms = [0.0] * (n + 1), []
        for j, entry in enumerate(row):
            entries = []
            for k, coefficient in entry:
                number = coefficient * scale if j < n else -coefficient * scale
                try:
                    value = int(number.p) / int(number.q)
                except OverflowError as error:
                    raise InputError(
                        "eps times a coefficient leaves the range of machine floats: use exact arithmetic"
                    ) from error
                exponent = equation.exponents[k][:n]
                if any(exponent):
                    entries.append((place(exponent), value))
                else:
                    constants[j] = value
            terms.append(sorted(entries))
        all_constants.append(constants)
        all_terms.append(terms)
    return FloatEquation(all_constants, all_terms, products)


def _step_in_arrays(equations: Sequence[FloatEquation], *x: FloatArray) -> tuple[Any, ...]:
    """A careful step with partial pivoting in whole arrays, for maps of many variables."""
    near, singular, finite = (np.full(x[0].shape, truth) for truth in (False, False, True))
    image: Any = np.array(x)
    for equation in equations:
        n, y = len(x), equation.monomials(image)
        M = np.zeros((n, n + 2, len(near)))
        M[:, :-1] = np.array(equation.constants)[:, :, None]
        for i, entries in enumerate(equation.terms):
            for j, terms in enumerate(entries):
                for k, c in terms:
                    M[i, j] += c * y[k]
        M[:, n + 1] = np.fmax(np.abs(M[:, :n]).max(axis=1), 1.0)  # sizes of the rows
        pivots = eliminate(M, n, 1)
        near |= ~(pivots > NEAR * M[:, n + 1]).all(axis=0)
        singular |= finite & (pivots == 0.0).any(axis=0)
        image = M[:, n]
        finite &= (pivots <= LARGEST).all(axis=0) & (np.abs(image) <= LARGEST).all(axis=0)
    return *image, near & finite & ~singular, singular, ~finite & ~singular


def eliminate(M: FloatArray, n: int, count: int) -> FloatArray:
    """Gaussian elimination with partial pivoting in many matrices (n, n + count + ..., lanes) at once, in place.

    The solutions stand in the `count` columns of the right-hand sides then; columns behind them are exchanged with
    their rows. Returns the absolute values (n, lanes) of the pivots.
    """
    lanes, end = np.arange(M.shape[2]), n + count
    pivots = np.empty((n, len(lanes)))
    for p in range(n):
        best = p + np.abs(M[p:, p]).argmax(axis=0)
        if (best != p).any():
            rows = M.transpose(0, 2, 1)
            rows[p], rows[best, lanes] = rows[best, lanes], rows[p].copy()
        pivots[p] = np.abs(M[p, p])
        M[p + 1 :, p:end] -= (M[p + 1 :, p] / M[p, p])[:, None] * M[p, p:end]
    for p in range(n - 1, -1, -1):
        M[p, n:end] /= M[p, p]
        M[:p, n:end] -= M[:p, p, None] * M[p, n:end]
    return pivots


class BatchState(NamedTuple):
    """The states of n orbits side by side, one a column, and what happened to each.

    `z` has the shape (rows, n). `failed_at` is the index of the first iterate that does not exist, `near` the number of
    near-singular steps, `near_at` the index of the point at the first one (-1: none). The column of an orbit that has
    ended is 0.
    """

    z: FloatArray
    status: IntArray
    failed_at: IntArray
    near: IntArray
    near_at: IntArray

    @classmethod
    def of(cls, z: FloatArray) -> BatchState:
        """Lanes that are about to start."""
        n = z.shape[1]
        counts = [np.full(n, start, dtype=np.int64) for start in (RUNNING, -1, 0, -1)]
        return cls(np.ascontiguousarray(z), *counts)

    def note(self, which: IntArray, index: int, near: Any, singular: Any, overflow: Any) -> Any:
        """Take down what a careful step of some running orbits from the index met; which of them have ended."""
        near, singular, overflow = (np.broadcast_to(x, which.shape) for x in (near, singular, overflow))
        ended = singular | overflow
        self.status[which[ended]] = np.where(singular[ended], SINGULAR, OVERFLOW)
        self.failed_at[which[ended]] = index + 1
        close = which[near & ~ended]
        self.near_at[close] = np.where(self.near[close] == 0, index, self.near_at[close])
        self.near[close] += 1
        return ended


class RecordTable(NamedTuple):
    """Where states go: those at multiples of `every` to the rows of an array (records, rows, n), from the first on."""

    every: int
    states: FloatArray


_FEW = 16  # orbits, up to which Python's own floats are faster than arrays
_GROUP = 4096  # orbits that are taken together, so that arrays stay in the processor's cache


def advance_by_numpy(step: FloatStep, lanes: BatchState, first: int, steps: int, tables: Sequence[RecordTable]) -> None:
    """Take all orbits `steps` steps from the index `first`: in arrays, or a few one by one in Python's own floats."""
    n = lanes.z.shape[1]
    single = n <= _FEW and step.fast_code is not None
    width = 1 if single else _GROUP
    with np.errstate(all="ignore"):
        for low in range(0, n, width):
            part = slice(low, min(n, low + width))
            dead = lanes.status[part] != RUNNING
            path: list[list[Any]] = [[] for _ in tables]
            x: Any = lanes.z[:, low].tolist() if single else list(lanes.z[:, part])
            for index in range(first, first + steps):
                try:
                    if step.fast_code is None:
                        image, good = x, False
                    elif single:
                        *image, good = step.fast_on_floats(*x)
                        if not good and step.careful_code is not None:
                            *image, near, singular, overflow = step.careful_on_floats(*x)
                            good = not (near or singular or overflow)
                    else:
                        *image, good = step.fast(*x)
                except ZeroDivisionError:  # where arrays get an infinity
                    image, good = x, False
                if good is not True and not np.all(good | dead):
                    repeat = np.flatnonzero(~(good | dead))
                    points_before, points_after = (
                        np.array([np.broadcast_to(row, dead.shape) for row in state]) for state in (x, image)
                    )
                    *careful, near, singular, overflow = step.careful(*points_before[:, repeat])
                    ended = lanes.note(low + repeat, index, near, singular, overflow)
                    for row, values in zip(points_after, careful, strict=True):
                        row[repeat] = np.where(ended, 0.0, values)
                    dead[repeat] |= ended
                    image = points_after[:, 0].tolist() if single else list(points_after)
                x = image
                for buffer, (interval, states) in zip(path, tables, strict=True):
                    if (index + 1) % interval == 0 and single:
                        buffer.append(x)
                    elif (index + 1) % interval == 0:
                        for row, values in zip(states[(index + 1) // interval - first // interval - 1], x, strict=True):
                            row[part] = values
                if single and dead[0]:
                    break
            for buffer, (_, states) in zip(path, tables, strict=True):
                if buffer:
                    states[: len(buffer), :, low] = buffer
            for row, values in zip(lanes.z, x, strict=True):
                row[part] = np.where(dead, 0.0, values)
