"""Straight-line programs for steps of maps in floating point.

`StraightLineProgram` records the operations on its values. Operations on constants are carried out at once: there are
no multiplications by 0 or 1, and no common subexpression is computed twice. A program runs in two ways, with equal
results to the last bit: as a Python function of floats or of numpy arrays (`StraightLineProgram.function`), and as
machine code for vectors of orbits (machine_code.py).

`solve` writes a program for the solution of M y = r, where the positions of zeros in M are known. Rows and columns with
one nonzero entry are solved by substitution, blocks of two rows by Cramer's rule with one division (the planes of a
normal form are such blocks, with complex entries for a complex eigenvalue), larger blocks by Gaussian elimination down
to two rows.

Pivots. A step is *near-singular* if a pivot, or the determinant of two rows, is at most 2^-40 times the numbers from
which it was computed: then at most 13 of its 53 bits are correct. An elimination takes pivots on the diagonal, in an
order with little fill-in. It is stable as long as no pivot row is multiplied by more than 8 before it is subtracted.
Each step has two versions. The *fast* one reports in which orbits all pivots are far from 0, all entries are far from
infinity, no rows need to be exchanged and all numbers are finite. The *careful* one, for all other orbits, exchanges
rows and reports the status. If the fast version is valid, both versions give the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

MIN_PIVOT_RATIO = 2.0**-40  # a step is near-singular if a pivot is at most this fraction of the numbers it comes from
# A fast elimination is valid only for entries up to this bound, or four times the largest constant. Its pivots are then
# compared with constants, which takes less time than with the entries of each orbit.
MAX_ENTRY = 1024.0
LARGE = (
    2.0**300
)  # no fast elimination with larger numbers is valid: the determinant of its last two rows might overflow
MAX_FACTOR = 8.0  # maximal factor by which a pivot row is multiplied when it is subtracted from another row
LARGEST_DOUBLE = float(np.finfo(np.float64).max)
MAX_OPERATIONS = 4000  # maximal number of operations of a fast step; longer programs take too long to compile

_SYMBOLS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "gt": ">", "le": "<=", "eq": "==", "and": "&", "or": "|"}


class TooManyOperations(Exception):
    """A step has too many operations for a straight-line program."""


class StraightLineProgram:
    """A list of operations in the order of execution; operation number k has the value number `inputs + k`.

    >>> code = StraightLineProgram(2)
    >>> x, y = code.arguments
    >>> code.outputs = [(x + 0.0) * y, y * x - 1.0]
    >>> code.function(float)(3.0, 5.0)
    (15.0, 14.0)
    >>> len(code.operations)
    2
    """

    def __init__(self, inputs: int, limit: int | None = None) -> None:
        self.inputs = inputs
        self.operations: list[tuple[str, tuple[Any, ...]]] = []
        self.outputs: Sequence[Any] = ()
        self._limit = limit
        self._value_of_operation: dict[tuple[str, tuple[Any, ...]], Value] = {}
        self.arguments = [Value(self, k) for k in range(inputs)]

    def emit(self, name: str, *operands: Any) -> Value:
        """Return the value of an operation, and record the operation unless it is already recorded."""
        keys = tuple(x.number if isinstance(x, Value) else ("constant", float(x)) for x in operands)
        key = (name, tuple(sorted(keys, key=repr)) if name in ("add", "mul", "and", "or") else keys)
        if key not in self._value_of_operation:
            if self._limit is not None and len(self.operations) >= self._limit:
                raise TooManyOperations
            self._value_of_operation[key] = Value(self, self.inputs + len(self.operations))
            self.operations.append((name, operands))
        return self._value_of_operation[key]

    def function(self, kind: type) -> Callable[..., tuple[Any, ...]]:
        """Compile the program to a Python function of floats, or of arrays if `kind` is np.ndarray."""
        last_use = {
            x.number: k for k, (_, operands) in enumerate(self.operations) for x in operands if isinstance(x, Value)
        }
        last_use |= {x.number: len(self.operations) for x in self.outputs if isinstance(x, Value)}
        names = {k: f"v{k}" for k in range(self.inputs)}
        free_names: list[str] = []  # names to be reused, so that fewer arrays have to fit into the processor's cache

        def operand_text(x: Any) -> str:
            return names[x.number] if isinstance(x, Value) else repr(x) if isinstance(x, bool) else f"({float(x)!r})"

        lines = [f"def step({', '.join(names.values())}):"]
        for k, (name, operands) in enumerate(self.operations):
            if self.inputs + k not in last_use:
                continue
            x = [operand_text(operand) for operand in operands]
            if name in _SYMBOLS:
                expression = f"{x[0]} {_SYMBOLS[name]} {x[1]}"
            elif name in ("neg", "not"):
                expression = f"-{x[0]}" if name == "neg" else f"{x[0]} ^ True"
            elif name == "select" and kind is float:
                expression = f"{x[1]} if {x[0]} else {x[2]}"
            else:
                expression = f"{name}({', '.join(x)})"
            released_values = {
                v.number
                for v in operands
                if isinstance(v, Value) and last_use[v.number] == k and v.number >= self.inputs
            }
            released_names = [names[number] for number in sorted(released_values)]
            if kind is not float and name in ("add", "sub", "mul", "div") and isinstance(operands[0], Value):
                if name in ("add", "mul") and operands[0].number not in released_values:
                    x.reverse()
                if x[0] in released_names:  # overwrite this array
                    released_names.remove(x[0])
                    names[self.inputs + k] = x[0]
                    lines.append(f"    {x[0]} {_SYMBOLS[name]}= {x[1]}")
                    free_names += released_names
                    continue
            free_names += released_names
            names[self.inputs + k] = free_names.pop() if free_names else f"v{self.inputs + k}"
            lines.append(f"    {names[self.inputs + k]} = {expression}")
        lines.append(f"    return ({''.join(f'{operand_text(x)}, ' for x in self.outputs)})")
        functions: dict[str, Any] = {"select": np.where, "max": np.maximum, "min": np.minimum}
        if kind is float:
            functions = {"max": max, "min": min}
        exec("\n".join(lines), functions)
        function: Callable[..., tuple[Any, ...]] = functions["step"]
        return function


class Value:
    """A number or a truth value in a program; constants are represented by floats and bools of Python."""

    def __init__(self, code: StraightLineProgram, number: int) -> None:
        self.code, self.number = code, number

    def __neg__(self) -> Any:
        operand = _operand_of_negation(self)
        return self.code.emit("neg", self) if operand is None else operand

    def __add__(self, other: Any) -> Any:
        if is_zero(other):
            return self
        for x, y in ((self, other), (other, self)):
            if _operand_of_negation(y) is not None:
                return x - _operand_of_negation(y)
        return self.code.emit("add", self, other)

    def __sub__(self, other: Any) -> Any:
        if is_zero(other):
            return self
        return (
            self.code.emit("sub", self, other)
            if _operand_of_negation(other) is None
            else self + _operand_of_negation(other)
        )

    def __rsub__(self, other: Any) -> Any:
        if is_zero(other):
            return -self
        return (
            self.code.emit("sub", other, self)
            if _operand_of_negation(self) is None
            else other + _operand_of_negation(self)
        )

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, Value) and other in (0.0, 1.0, -1.0):
            return 0.0 if other == 0.0 else self if other == 1.0 else -self
        for x, y in ((self, other), (other, self)):
            if _operand_of_negation(y) is not None:
                return -(x * _operand_of_negation(y))
        return self.code.emit("mul", self, other)

    def __truediv__(self, other: Any) -> Any:
        return self if not isinstance(other, Value) and other == 1.0 else self.code.emit("div", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return 0.0 if is_zero(other) else self.code.emit("div", other, self)

    def __abs__(self) -> Any:
        operand = _operand_of_negation(self)
        return self.code.emit("abs", self if operand is None else operand)

    def __gt__(self, other: Any) -> Any:
        return self.code.emit("gt", self, other)

    def __lt__(self, other: Any) -> Any:
        return self.code.emit("gt", other, self)

    def __le__(self, other: Any) -> Any:
        return self.code.emit("le", self, other)

    def __and__(self, other: Any) -> Any:
        return (self if other else False) if isinstance(other, bool) else self.code.emit("and", self, other)

    def __or__(self, other: Any) -> Any:
        return (True if other else self) if isinstance(other, bool) else self.code.emit("or", self, other)

    def __invert__(self) -> Any:
        return self.code.emit("not", self)

    __radd__, __rmul__, __rand__, __ror__ = __add__, __mul__, __and__, __or__


def _operand_of_negation(x: Any) -> Any:
    """Return y if x was computed as -y, otherwise None."""
    if not isinstance(x, Value) or x.number < x.code.inputs:
        return None
    name, operands = x.code.operations[x.number - x.code.inputs]
    return operands[0] if name == "neg" else None


class ComplexPair:
    """A complex number x + i y, with values or floats as x and y."""

    def __init__(self, x: Any, y: Any = 0.0) -> None:
        self.x, self.y = x, y

    def __neg__(self) -> ComplexPair:
        return ComplexPair(-self.x, -self.y)

    def __add__(self, other: Any) -> ComplexPair:
        other = other if isinstance(other, ComplexPair) else ComplexPair(other)
        return ComplexPair(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Any) -> ComplexPair:
        other = other if isinstance(other, ComplexPair) else ComplexPair(other)
        return ComplexPair(self.x - other.x, self.y - other.y)

    def __rsub__(self, other: float) -> ComplexPair:
        return ComplexPair(other) - self

    def __mul__(self, other: ComplexPair) -> ComplexPair:
        return ComplexPair(self.x * other.x - self.y * other.y, self.x * other.y + self.y * other.x)

    __radd__ = __add__

    def norm(self) -> Any:
        """Return x^2 + y^2."""
        return self.x * self.x + self.y * self.y


def is_zero(x: Any) -> bool:
    """Return whether x is the constant 0."""
    return isinstance(x, float | int) and x == 0.0


def select(condition: Any, if_true: Any, if_false: Any) -> Any:
    """Return `if_true` if the condition holds, otherwise `if_false` (for each orbit)."""
    if isinstance(condition, bool):
        return if_true if condition else if_false
    is_same = if_true is if_false or (
        isinstance(if_true, float) and isinstance(if_false, float) and if_true == if_false
    )
    return if_true if is_same else condition.code.emit("select", condition, if_true, if_false)


def extreme(name: str, x: Any, y: Any) -> Any:
    """Return the larger ("max") or smaller ("min") of two numbers >= 0; if one is NaN, the first, or NaN in arrays.

    In a fast elimination every NaN comes after a pivot 0 or a factor that is too large, which are then kept.
    """
    values = [v for v in (x, y) if isinstance(v, Value)]
    if len(values) == 1 and (0.0 if name == "max" else np.inf) in (x, y):
        return values[0]
    return values[0].code.emit(name, x, y) if values else max(x, y) if name == "max" else min(x, y)


class StepChecks:
    """The checks on the intermediate numbers of a step.

    For a fast step, `is_valid` is true if the result is valid. For a careful step, `is_near_singular` is true if a
    pivot was small, `is_singular` if a pivot was 0, and `is_finite` if all numbers were finite.
    """

    def __init__(self, careful: bool) -> None:
        self.careful = careful
        self.is_valid: Any = True
        self.is_near_singular: Any = False
        self.is_singular: Any = False
        self.is_finite: Any = True
        self.is_bounded = False  # whether all numbers of a valid fast step are certainly finite
        self._sum: Any = 0.0

    def pivot(self, pivot: Any, threshold: Any) -> None:
        """Check a divisor, which counts as small if its absolute value is at most `threshold`."""
        self.is_bounded = False  # the threshold may depend on numbers of any size
        if isinstance(pivot, float):  # a constant, which is 0 if the matrix is singular at all points
            self.is_singular, self.is_valid = self.is_singular | (pivot == 0.0), self.is_valid & (pivot != 0.0)
            return
        is_large = abs(pivot) > threshold
        if self.careful:
            self.is_near_singular |= ~is_large
            self.is_singular |= pivot.code.emit("eq", pivot, 0.0)
        else:
            self.is_valid = self.is_valid & is_large
        self.number(pivot)

    def number(self, x: Any) -> None:
        """Check that a number is finite. A fast step checks the sum of all numbers, a careful step each number."""
        if isinstance(x, Value) and self.careful:
            self.is_finite = self.is_finite & (abs(x) <= LARGEST_DOUBLE)
        elif isinstance(x, Value):
            self._sum = x + self._sum

    def outputs(self) -> list[Any]:
        """Return [valid] for a fast step, and [near-singular, singular, overflow] for a careful step."""
        if not self.careful:
            has_sum = isinstance(self._sum, Value)
            return [self.is_valid & (abs(self._sum) <= LARGEST_DOUBLE) if has_sum else self.is_valid]
        is_singular = self.is_singular
        has_failed = is_singular | _negation(self.is_finite)
        return [self.is_near_singular & _negation(has_failed), is_singular, has_failed & _negation(is_singular)]


def _negation(x: Any) -> Any:
    return not x if isinstance(x, bool) else ~x


class EntryBound(NamedTuple):
    """A bound of the |entries| of a matrix, and a function that writes the test whether they are below it."""

    bound: float
    holds: Callable[[], Any]


def solve(rows: Sequence[Sequence[Any]], entry_bound: EntryBound, checks: StepChecks) -> list[Any]:
    """Write the operations that solve M y = r, given the rows of (M | r); y is meaningless if M is singular.

    Only fast eliminations need a bound of the entries of M.
    """
    n = len(rows)
    matrix = [{j: x for j, x in enumerate(row[:n]) if not is_zero(x)} for row in rows]
    rhs, remaining, solution = [row[n] for row in rows], set(range(n)), [0.0] * n
    # A row with one entry is solved first. A column with one entry is solved last: its unknown is only in one row.
    solved_last: list[tuple[int, int]] = []
    while remaining:
        single_row = next((i for i in sorted(remaining) if len(matrix[i]) == 1), None)
        if single_row is not None:
            remaining.remove(single_row)
            ((j, pivot),) = matrix[single_row].items()
            checks.pivot(pivot, MIN_PIVOT_RATIO)
            solution[j] = rhs[single_row] / pivot
            for k in remaining:
                if j in matrix[k]:
                    rhs[k] = rhs[k] - matrix[k].pop(j) * solution[j]
            continue
        columns: dict[int, list[int]] = {}
        for i in sorted(remaining):
            for j in matrix[i]:
                columns.setdefault(j, []).append(i)
        lone_column = next((j for j in sorted(columns) if len(columns[j]) == 1), None)
        if lone_column is None:
            break
        solved_last.append((columns[lone_column][0], lone_column))
        remaining.remove(columns[lone_column][0])
    while remaining:  # split into connected blocks, i.e. rows that are linked by common unknowns
        block: set[int] = set()
        component = {min(remaining)}
        while component != block:
            block, unknowns = component, {j for i in component for j in matrix[i]}
            component = {i for i in remaining if unknowns & matrix[i].keys()} | block
        remaining -= block
        unknown_list = sorted(unknowns)
        if len(unknown_list) != len(block):  # the matrix is singular at all points
            checks.pivot(0.0, MIN_PIVOT_RATIO)
            continue
        block_rows = [[*(matrix[i].get(j, 0.0) for j in unknown_list), rhs[i]] for i in sorted(block)]
        values = solve_two(block_rows, checks) if len(block_rows) == 2 else _eliminate(block_rows, entry_bound, checks)
        for j, value in zip(unknown_list, values, strict=True):
            solution[j] = value
    for i, j in reversed(solved_last):
        checks.pivot(matrix[i][j], MIN_PIVOT_RATIO)
        total = rhs[i]
        for k, entry in matrix[i].items():
            total = total if k == j else total - entry * solution[k]
        solution[j] = total / matrix[i][j]
    return solution


def solve_two(rows: Sequence[Sequence[Any]], checks: StepChecks) -> list[Any]:
    """Write the operations that solve two equations by Cramer's rule; entries may be complex (`ComplexPair`)."""
    # The bound for the pivot a d - b c grows with b c: digits are lost if a d and b c cancel, however large they are.
    (a, b, r), (c, d, s) = rows
    bc = b * c
    det = a * d - bc
    if isinstance(det, ComplexPair):
        norm = det.norm()
        checks.pivot(norm, MIN_PIVOT_RATIO**2 + MIN_PIVOT_RATIO**2 * bc.norm())
        inverse_norm = _inverse(norm)
        inverse: Any = ComplexPair(det.x * inverse_norm, -(det.y * inverse_norm))
    else:
        checks.pivot(det, MIN_PIVOT_RATIO + MIN_PIVOT_RATIO * abs(bc))
        inverse = _inverse(det)
    return [(d * r - b * s) * inverse, (a * s - c * r) * inverse]


def _eliminate(rows: list[list[Any]], entry_bound: EntryBound, checks: StepChecks) -> list[Any]:
    """Write a Gaussian elimination; the careful version exchanges rows if a pivot is small."""
    n, M = len(rows), [[*row, 1.0] for row in rows]  # the last column contains the size of each row of the matrix
    pivots = _choose_pivots([{j for j in range(n) if not is_zero(row[j])} for row in rows])
    if len(pivots) < n:  # the matrix is singular at all points
        checks.pivot(0.0, MIN_PIVOT_RATIO)
        return [0.0] * n
    for row in M if checks.careful else ():
        for x in row[:n]:
            row[-1] = extreme("max", row[-1], abs(x))
    inverses: list[Any] = []
    smallest_pivot, largest_factor = np.inf, 0.0
    *first_pivots, (i1, j1), (i2, j2) = pivots
    for step, (i, j) in enumerate(first_pivots):
        columns = [*(c for _, c in pivots[step + 1 :]), n]
        later_rows = [k for k, _ in pivots[step + 1 :]]
        for k in later_rows if checks.careful else ():
            is_swapped = abs(M[k][j]) > MAX_FACTOR * abs(M[i][j])
            for c in (j, *columns, n + 1):
                entry, entry_below = M[i][c], M[k][c]
                M[i][c], M[k][c] = select(is_swapped, entry_below, entry), select(is_swapped, entry, entry_below)
        inverses.append(_inverse(M[i][j]))
        if checks.careful:
            checks.pivot(M[i][j], MIN_PIVOT_RATIO * M[i][n + 1])
        else:
            smallest_pivot = extreme("min", smallest_pivot, abs(M[i][j]))
        for k in later_rows:
            if not is_zero(M[k][j]):
                factor = M[k][j] * inverses[-1]
                largest_factor = extreme("max", largest_factor, abs(factor))
                for c in columns:
                    M[k][c] = M[k][c] - factor * M[i][c]
    (a, b, r), (c, d, s) = ([M[i][j1], M[i][j2], M[i][n]] for i in (i1, i2))
    det = a * d - b * c
    if checks.careful:
        checks.pivot(det, MIN_PIVOT_RATIO * (M[i1][n + 1] * M[i2][n + 1]))
    else:
        checks.is_valid &= smallest_pivot > MIN_PIVOT_RATIO * entry_bound.bound
        checks.is_valid &= abs(det) > MIN_PIVOT_RATIO * entry_bound.bound**2
        checks.is_valid &= largest_factor <= MAX_FACTOR
        checks.is_valid &= entry_bound.holds()
    inverse, solution = _inverse(det), [0.0] * n
    solution[j1], solution[j2] = (d * r - b * s) * inverse, (a * s - c * r) * inverse
    for step, (i, j) in reversed(list(enumerate(first_pivots))):
        total = M[i][n]
        for _, k in pivots[step + 1 :]:
            total = total - M[i][k] * solution[k]
        solution[j] = total * inverses[step]
    return solution


def _choose_pivots(nonzero_columns: list[set[int]]) -> list[tuple[int, int]]:
    """Return the pairs (row, column) of the pivots, diagonal if possible, with little fill-in (Markowitz's rule).

    The result has fewer pivots than rows if the positions of the zeros make the matrix singular.
    """
    rows, pivots = {i: set(row) for i, row in enumerate(nonzero_columns)}, []
    while rows:
        column_counts: dict[int, int] = {}
        for row in rows.values():
            for j in row:
                column_counts[j] = column_counts.get(j, 0) + 1
        candidates = [(i, j) for i, row in rows.items() for j in row]
        candidates = [(i, j) for i, j in candidates if i == j] or candidates
        if not candidates:
            break
        i, j = min(candidates, key=lambda entry: ((len(rows[entry[0]]) - 1) * (column_counts[entry[1]] - 1), entry))
        pivot_row = rows.pop(i)
        pivots.append((i, j))
        for row in rows.values():
            if j in row:
                row |= pivot_row
                row.discard(j)
    return pivots


def _inverse(x: Any) -> Any:
    return 1.0 / x if isinstance(x, Value) or x else np.inf
