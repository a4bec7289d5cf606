"""Straight-line code: linear equations of every pattern of zeros, against exact ones, by each way of running it."""

import random

import numpy as np
import pytest
from flint import fmpq, fmpq_mat

from kahanmaps.maps.floats.straight_line_program import StepChecks, StraightLineProgram, solve

PATTERNS = {
    "one equation": ["*"],
    "diagonal": ["*..", ".*.", "..*"],
    "triangular": ["*..", "**.", "***"],
    "triangular from the right": ["***", ".**", "..*"],
    "exchanged": [".*.", "..*", "*.."],
    "two equations": ["**", "**"],
    "no diagonal": [".*", "*."],
    "blocks": ["**...", "**...", "..***", "..***", "..***"],
    "a block behind others": ["**..", "**..", "*.**", ".***"],
    "an arrow": ["****", "**..", "*.*.", "*..*"],
    "dense": ["****"] * 4,
    "no diagonal, dense": [".***", "*.**", "**.*", "***."],
    "a cycle": ["**...", ".**..", "..**.", "...**", "*...*"],
}


def to_float(x):
    return int(x.p) / int(x.q)


def code_of(pattern, careful):
    """The solution of M y = r as code of the entries of M that are not 0, row by row, and of r."""
    n = len(pattern)
    code, requested = StraightLineProgram(sum(row.count("*") for row in pattern) + n), StepChecks(careful)
    entries = iter(code.arguments)
    rows = [[next(entries) if mark == "*" else 0.0 for mark in row] for row in pattern]
    rows = [[*row, right] for row, right in zip(rows, entries, strict=True)]
    size = code.arguments[0]
    for x in code.arguments[1:]:
        size = size.code.emit("max", abs(size), abs(x))
    code.outputs = [*solve(rows, lambda: abs(size), requested), *requested.outputs()]
    return code


@pytest.mark.parametrize("pattern", PATTERNS.values(), ids=PATTERNS)
@pytest.mark.parametrize("small", [False, True], ids=["large diagonal", "any pivots"])
def test_equations_of_any_pattern_have_the_exact_solution(pattern, small):
    rng, n = random.Random(3), len(pattern)
    fast, careful = (code_of(pattern, kind) for kind in (False, True))
    contented = 0
    for _ in range(20):
        M = [[fmpq(rng.randint(1, 64), 64) if mark == "*" else fmpq(0) for mark in row] for row in pattern]
        for i in range(n):
            M[i][i] *= 1 if small else 8
        if fmpq_mat(M).det() == 0:
            continue
        right = [fmpq(rng.randint(-64, 64), 64) for _ in range(n)]
        expected = [to_float(x) for x in fmpq_mat(M).solve(fmpq_mat(n, 1, right)).entries()]
        given = [to_float(M[i][j]) for i in range(n) for j in range(n) if pattern[i][j] == "*"]
        given += [to_float(x) for x in right]
        *result, near, singular, overflow = careful.function(float)(*given)
        assert (bool(near), bool(singular), bool(overflow)) == (False, False, False)
        condition = np.linalg.cond([[to_float(x) for x in row] for row in M])
        # some dozen roundings, and rows subtracted up to 8 times from others
        assert result == pytest.approx(expected, rel=1e-13 * condition, abs=1e-13 * condition)
        *quick, good = fast.function(float)(*given)
        if good:
            contented += 1
            assert quick == result
        arrays = careful.function(np.ndarray)(*(np.array([x]) for x in given))
        assert [float(x[0]) for x in arrays[:n]] == result
    assert small or contented > 10


SINGULAR = [["..", "**"], [".*", ".*"], ["**.", "**.", "**."], ["***", "*..", "*.."]]


@pytest.mark.parametrize("pattern", SINGULAR, ids=str)
def test_a_matrix_that_its_zeros_make_singular_is_reported(pattern):
    assert code_of(pattern, careful=True).outputs[-2] is True
    assert code_of(pattern, careful=False).outputs[-1] is False
