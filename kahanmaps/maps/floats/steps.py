"""Steps of maps in floating point: as straight-line programs, or for large maps with numpy arrays.

A step maps the rows of a state to the rows of its image. For a map the rows are the coordinates, and the step solves
M(x) x~ = r(x), where M(x) = I - eps f'(x) for Kahan maps. For a normal form the rows are the coordinates of its planar
blocks (planar_blocks.py), and the same equation splits into blocks of two rows. A step is *near-singular* if a pivot is
small (straight_line_program.py); such steps are counted, and the orbit continues. An orbit ends as *singular* if a
pivot is 0, and as *overflow* if an intermediate number or a coordinate of the image is not finite.

With one kernel, results agree to the last bit for any number of orbits and threads, and for any portions of steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache, partial
from math import log2
from typing import Any, NamedTuple

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import QQ
from kahanmaps.errors import InputError
from kahanmaps.maps.floats.float_conversion import FloatArray
from kahanmaps.maps.floats.planar_blocks import PlanarBlocks
from kahanmaps.maps.floats.straight_line_program import (
    LARGE,
    LARGEST_DOUBLE,
    MAX_ENTRY,
    MAX_OPERATIONS,
    MIN_PIVOT_RATIO,
    ComplexPair,
    EntryBound,
    StepChecks,
    StraightLineProgram,
    TooManyOperations,
    solve,
    solve_two,
)
from kahanmaps.maps.implicit import ElementaryMap, Map
from kahanmaps.maps.kahan import KahanMap

IntArray = NDArray[np.int64]

RUNNING, OVERFLOW, SINGULAR = 0, 1, 2
STATUS = ("completed", "overflow", "singular")  # indexed by these three codes; the values of OrbitEnd.status


Write = Callable[[Sequence[Any], StepChecks], Sequence[Any]]


class FloatStep:
    """A step of states with `rows` rows; `write` writes the operations for the image of a state and the checks.

    `careful` maps the rows of a state (arrays) to the rows of its image and three more rows, which say in which orbits
    the step is near-singular, singular, or an overflow. `fast` returns the image and one more row, which says in which
    orbits the fast step is valid. A fast program with too many operations is omitted. `in_arrays` replaces a careful
    program with too many operations (row exchanges fill in zeros). Machine code needs both programs.
    """

    def __init__(self, rows: int, write: Write, in_arrays: Callable[..., tuple[Any, ...]] | None = None) -> None:
        self.rows, self._write, self._in_arrays = rows, write, in_arrays
        self.fast_code = self._build_program(careful=False)
        self.operations = rows**3
        if self.fast_code is not None:
            self.operations = len(self.fast_code.operations)
            self.fast_on_floats, self.fast = self.fast_code.function(float), self.fast_code.function(np.ndarray)

    @cached_property
    def careful_code(self) -> StraightLineProgram | None:
        """The program of the careful step, written when it is first needed, since this is rare."""
        return None if self.fast_code is None else self._build_program(careful=True)

    @cached_property
    def careful(self) -> Callable[..., tuple[Any, ...]]:
        """The step on arrays with all checks."""
        function = self._in_arrays if self.careful_code is None else self.careful_code.function(np.ndarray)
        if function is None:
            raise AssertionError("a step has no careful version")
        return function

    @cached_property
    def careful_on_floats(self) -> Callable[..., tuple[Any, ...]]:
        """The step on floats with all checks, if the careful program exists."""
        return self.careful if self.careful_code is None else self.careful_code.function(float)

    def _build_program(self, careful: bool) -> StraightLineProgram | None:
        max_operations = None if self._in_arrays is None else 2 * MAX_OPERATIONS if careful else MAX_OPERATIONS
        code, checks = StraightLineProgram(self.rows, max_operations), StepChecks(careful)
        try:
            image = self._write(code.arguments, checks)
            if careful or not checks.is_bounded:
                for x in image:
                    checks.number(x)
            code.outputs = [*image, *checks.outputs()]
        except TooManyOperations:
            return None
        return code


def planar_step(blocks: PlanarBlocks) -> FloatStep:
    """Return the step of a normal form, block by block."""

    def write(z: Sequence[Any], checks: StepChecks) -> list[Any]:
        image: list[Any] = []
        for r, coefficients in enumerate(blocks.coefficients):
            row, is_real = len(image), r < blocks.real_count
            if is_real:
                U, V = z[row : row + 2]
                a, b, c, d = coefficients.real.tolist()
            else:
                U, V = ComplexPair(z[row], z[row + 1]), ComplexPair(z[row + 2], z[row + 3])
                a, b, c, d = (ComplexPair(x.real, x.imag) for x in coefficients.tolist())
            A, B, C = a * U + b * V, b * U + c * V, c * U + d * V
            for x in solve_two([[1.0 - B, -C, U], [A, 1.0 + B, V]], checks):
                image += [x] if is_real else [x.x, x.y]
        return image

    return FloatStep(blocks.rows, write)


def map_step(factors: Sequence[ElementaryMap]) -> FloatStep:
    """Return the step of a composition of maps. Raises InputError if a coefficient is out of the range of doubles."""
    equations = [float_equation(factor) for factor in factors]

    def write(x: Sequence[Any], checks: StepChecks) -> Sequence[Any]:
        checks.is_bounded = True  # until an equation is not
        for equation in equations:
            x = equation.image(x, checks)
        return x

    return FloatStep(factors[0].dim, write, partial(_step_in_arrays, equations))


class FloatEquation(NamedTuple):
    """The equation M(x) x~ = r(x) in doubles, as the matrix (M | r) in sparse form.

    Entry (i, j) of (M | r) is `constants[i][j]` plus the sum of c y[k] over the pairs (k, c) of `terms[i][j]`. Here y
    is x followed by y[a] y[b] for every pair (a, b) in `products`.
    """

    constants: list[list[float]]
    terms: list[list[list[tuple[int, float]]]]
    products: list[tuple[int, int]]

    def monomials(self, x: Sequence[Any]) -> list[Any]:
        """Return the vector y at x."""
        y = list(x)
        for a, b in self.products:
            y.append(y[a] * y[b])
        return y

    def image(self, x: Sequence[Any], checks: StepChecks) -> list[Any]:
        """Write the operations that compute the image of x."""
        y, n = self.monomials(x), len(self.constants)
        rows = []
        for constants, entries in zip(self.constants, self.terms, strict=True):
            rows.append([sum((c * y[k] for k, c in terms), c0) for c0, terms in zip(constants, entries, strict=True)])

        in_matrix, in_rhs = (
            {k for entries in self.terms for terms in entries[part] for k, _ in terms}
            for part in (slice(n), slice(n, None))
        )
        largest_sum, rhs_sum = (
            max(sum(abs(c) for _, c in terms) for entries in self.terms for terms in entries[part])
            for part in (slice(n), slice(n, None))
        )
        constant, rhs_constant = (
            max(abs(x) for constants in self.constants for x in constants[part]) for part in (slice(n), slice(n, None))
        )
        bound = max(MAX_ENTRY, min(4 * constant, LARGE))
        largest = min((bound - constant) / largest_sum, LARGE) if largest_sum and constant < bound else 0.0

        def holds() -> Any:
            # A sum, not the maximum: if a product of coordinates is NaN, so is the sum.
            size: Any = sum((abs(y[k]) for k in sorted(in_matrix)), 0.0)
            return (size <= largest) if constant < bound else False

        # No number can overflow: each unknown exceeds those solved before it, or the right side, at most by the factor
        # n 9^n 2^40, the first two of them by its square.
        exponent = n * (40 + log2(n * 9**n)) + log2(rhs_sum * largest + rhs_constant + 1)
        checks.is_bounded &= in_rhs <= in_matrix and bound == MAX_ENTRY and exponent < 1000
        return solve(rows, EntryBound(bound, holds), checks)


def float_equation(map_over: ElementaryMap) -> FloatEquation:
    """Return the equation of a map over QQ in doubles; each number is rounded only once.

    Near-singular steps are recognized by the size of pivots. Hence each row is divided by its largest coefficient in M,
    except for Kahan maps, where M has rows of size 1 for small eps. Raises InputError if a number is too large.
    """
    equation = map_over.equation
    n = equation.dim
    index: dict[tuple[int, ...], int] = {tuple(int(i == k) for i in range(n)): k for k in range(n)}
    products: list[tuple[int, int]] = []

    def monomial_index(exponent: tuple[int, ...]) -> int:
        """Return the index of a monomial in the vector y."""
        if exponent not in index:
            j = max(k for k, e in enumerate(exponent) if e)
            divisor_index = monomial_index((*exponent[:j], exponent[j] - 1, *exponent[j + 1 :]))
            index[exponent] = n + len(products)
            products.append((divisor_index, j))
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
                        "eps times a coefficient leaves the range of floating-point numbers: use exact arithmetic"
                    ) from error
                exponent = equation.exponents[k][:n]
                if any(exponent):
                    entries.append((monomial_index(exponent), value))
                else:
                    constants[j] = value
            terms.append(sorted(entries))
        all_constants.append(constants)
        all_terms.append(terms)
    return FloatEquation(all_constants, all_terms, products)


def _step_in_arrays(equations: Sequence[FloatEquation], *x: FloatArray) -> tuple[Any, ...]:
    """Take a careful step with partial pivoting in numpy arrays, for maps of many variables."""
    is_near_singular, is_singular, is_finite = (np.full(x[0].shape, value) for value in (False, False, True))
    image: Any = np.array(x)
    for equation in equations:
        n, y = len(x), equation.monomials(image)
        M = np.zeros((n, n + 2, len(is_near_singular)))
        M[:, :-1] = np.array(equation.constants)[:, :, None]
        for i, entries in enumerate(equation.terms):
            for j, terms in enumerate(entries):
                for k, c in terms:
                    M[i, j] += c * y[k]
        M[:, n + 1] = np.fmax(np.abs(M[:, :n]).max(axis=1), 1.0)  # the sizes of the rows
        pivots = eliminate(M, n, 1)
        is_near_singular |= ~(pivots > MIN_PIVOT_RATIO * M[:, n + 1]).all(axis=0)
        is_singular |= is_finite & (pivots == 0.0).any(axis=0)
        image = M[:, n]
        is_finite &= (pivots <= LARGEST_DOUBLE).all(axis=0) & (np.abs(image) <= LARGEST_DOUBLE).all(axis=0)
    return *image, is_near_singular & is_finite & ~is_singular, is_singular, ~is_finite & ~is_singular


def eliminate(M: FloatArray, n: int, count: int) -> FloatArray:
    """Solve a batch of linear systems by Gaussian elimination with partial pivoting; overwrite M with the result.

    M has the shape (n, n + count + ..., batch). The `count` columns after the first n are right-hand sides, which the
    solutions replace; in all later columns rows are only permuted. Returns the |pivots|, an array (n, batch).
    """
    columns, last_column = np.arange(M.shape[2]), n + count
    pivots = np.empty((n, len(columns)))
    for p in range(n):
        pivot_rows = p + np.abs(M[p:, p]).argmax(axis=0)
        if (pivot_rows != p).any():
            rows = M.transpose(0, 2, 1)
            rows[p], rows[pivot_rows, columns] = rows[pivot_rows, columns], rows[p].copy()
        pivots[p] = np.abs(M[p, p])
        M[p + 1 :, p:last_column] -= (M[p + 1 :, p] / M[p, p])[:, None] * M[p, p:last_column]
    for p in range(n - 1, -1, -1):
        M[p, n:last_column] /= M[p, p]
        M[:p, n:last_column] -= M[:p, p, None] * M[p, n:last_column]
    return pivots


def images_of(map_: Map, points: FloatArray) -> FloatArray:
    """Return the images of points (dim,) or (points, dim) under a map over Q; NaN if the map is not defined there.

    Raises InputError for an array of another shape, and for a map over another field.
    """
    rows = np.atleast_2d(np.asarray(points, dtype=np.float64))
    if map_.field is not QQ or rows.ndim != 2 or rows.shape[1] != map_.dim:
        raise InputError(
            f"found floating-point numbers of shape {points.shape} for {map_!r}, expected rows of {map_.dim} numbers, "
            "and a map over QQ"
        )
    batch = BatchState.of(np.array(rows.T, order="C"))  # a copy, since steps overwrite the states
    advance_by_numpy(_cached_step(map_), batch, 0, 1, [])
    images = batch.z.T.copy()
    images[batch.status != RUNNING] = np.nan
    return images.reshape(points.shape)


@lru_cache(maxsize=16)
def _cached_step(map_: Map) -> FloatStep:
    return map_step(map_.factors)


class BatchState(NamedTuple):
    """The states of a batch of n orbits, one per column, and the status of each orbit.

    `z` has the shape (rows, n); its columns are 0 for orbits that have ended. `failed_at` is the index of the first
    iterate that does not exist, `near_singular` the number of near-singular steps, `near_singular_at` the index of the
    point before the first near-singular step; -1 means none.
    """

    z: FloatArray
    status: IntArray
    failed_at: IntArray
    near_singular: IntArray
    near_singular_at: IntArray

    @classmethod
    def of(cls, z: FloatArray) -> BatchState:
        """Return a batch of running orbits with these initial states."""
        n = z.shape[1]
        columns = [np.full(n, value, dtype=np.int64) for value in (RUNNING, -1, 0, -1)]
        return cls(np.ascontiguousarray(z), *columns)

    def note(self, orbits: IntArray, index: int, near: Any, singular: Any, overflow: Any) -> Any:
        """Record the results of a careful step from index `index` for `orbits`; return which of these have ended."""
        near, singular, overflow = (np.broadcast_to(x, orbits.shape) for x in (near, singular, overflow))
        has_ended = singular | overflow
        self.status[orbits[has_ended]] = np.where(singular[has_ended], SINGULAR, OVERFLOW)
        self.failed_at[orbits[has_ended]] = index + 1
        near_orbits = orbits[near & ~has_ended]
        self.near_singular_at[near_orbits[self.near_singular[near_orbits] == 0]] = index
        self.near_singular[near_orbits] += 1
        return has_ended


class RecordTable(NamedTuple):
    """An array (records, rows, n) in which the states at multiples of `every` are stored."""

    every: int
    states: FloatArray


_MAX_SINGLE_ORBITS = 16  # up to this number of orbits, Python floats are faster than arrays
_GROUP_SIZE = 8192  # number of orbits processed together, so that the arrays fit into the processor's cache


def advance_by_numpy(step: FloatStep, batch: BatchState, first: int, steps: int, tables: Sequence[RecordTable]) -> None:
    """Advance all orbits by `steps` steps from the index `first`: in arrays, or in Python floats for a few orbits."""
    n = batch.z.shape[1]
    is_single = n <= _MAX_SINGLE_ORBITS and step.fast_code is not None
    group_size = 1 if is_single else _GROUP_SIZE
    with np.errstate(all="ignore"):
        for start in range(0, n, group_size):
            group = slice(start, min(n, start + group_size))
            has_ended = batch.status[group] != RUNNING
            buffers: list[list[Any]] = [[] for _ in tables]
            x: Any = batch.z[:, start].tolist() if is_single else list(batch.z[:, group])
            for index in range(first, first + steps):
                try:
                    if step.fast_code is None:
                        image, is_good = x, False
                    elif is_single:
                        *image, is_good = step.fast_on_floats(*x)
                        if not is_good and step.careful_code is not None:
                            *image, is_near_singular, is_singular, is_overflow = step.careful_on_floats(*x)
                            is_good = not (is_near_singular or is_singular or is_overflow)
                    else:
                        *image, is_good = step.fast(*x)
                except ZeroDivisionError:  # a quotient of arrays would be infinite
                    image, is_good = x, False
                # Orbits in which the fast step is not valid repeat it as a careful step.
                if is_good is not True and not np.all(is_good | has_ended):
                    repeated_orbits = np.flatnonzero(~(is_good | has_ended))
                    points_before, points_after = (
                        np.array([np.broadcast_to(row, has_ended.shape) for row in state]) for state in (x, image)
                    )
                    *careful_image, is_near_singular, is_singular, is_overflow = step.careful(
                        *points_before[:, repeated_orbits]
                    )
                    ends_now = batch.note(start + repeated_orbits, index, is_near_singular, is_singular, is_overflow)
                    for row, values in zip(points_after, careful_image, strict=True):
                        row[repeated_orbits] = np.where(ends_now, 0.0, values)
                    has_ended[repeated_orbits] |= ends_now
                    image = points_after[:, 0].tolist() if is_single else list(points_after)
                x = image
                for buffer, (interval, states) in zip(buffers, tables, strict=True):
                    if (index + 1) % interval == 0 and is_single:
                        buffer.append(x)
                    elif (index + 1) % interval == 0:
                        for row, values in zip(states[(index + 1) // interval - first // interval - 1], x, strict=True):
                            row[group] = values
                if is_single and has_ended[0]:
                    break
            for buffer, (_, states) in zip(buffers, tables, strict=True):
                if buffer:
                    states[: len(buffer), :, start] = buffer
            for row, values in zip(batch.z, x, strict=True):
                row[group] = np.where(has_ended, 0.0, values)
