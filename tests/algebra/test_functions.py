"""The field Q(x, y, eps) in which identities are expanded: its laws, its matrices, its budget.

A quotient is never reduced; what has to hold is that its value at rational points is right.
"""

import random

import pytest
from flint import fmpq, fmpq_mat
from hypothesis import given
from hypothesis import strategies as st

import kahanmaps.algebra.functions as module
from kahanmaps.algebra.functions import BudgetExceeded, Function, FunctionField
from kahanmaps.algebra.polynomials import evaluate, ring
from kahanmaps.algebra.work import counted

NAMES = ["x", "y"]
small = st.integers(-4, 4)


def value(function: Function, point: tuple[fmpq, ...]) -> fmpq | None:
    denominator = evaluate(function.denominator, None, point)
    return None if denominator == 0 else evaluate(function.numerator, None, point) / denominator


def linear(field: FunctionField, a: int, b: int, c: int) -> Function:
    x, y = field.variables
    return x * field.convert(a) + y * field.convert(b) + field.convert(c)


@st.composite
def functions(draw, field: FunctionField) -> Function:
    first, second = (linear(field, draw(small), draw(small), draw(small)) for _ in range(2))
    return first * second / linear(field, draw(small), draw(small), draw(st.integers(1, 4)))


FIELD = FunctionField(NAMES, budget=10**12)
POINT = (fmpq(17, 5), fmpq(-23, 7))


@given(functions(FIELD), functions(FIELD), st.dictionaries(st.tuples(*[st.integers(0, 3)] * 3), small, max_size=5))
def test_the_value_of_a_polynomial_is_that_of_numbers(f, g, terms):
    P = ring(["a", "b", "c"]).from_dict(terms)
    point = (f, g, f * FIELD.variables[0] + FIELD.one)  # the denominator of f twice
    numbers = [value(entry, POINT) for entry in point]
    assert value(evaluate(P, FIELD, point), POINT) == evaluate(P, None, numbers)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 9])  # more than 7 by elimination
def test_determinant_and_solution_agree_with_numbers(n):
    x, y = FIELD.variables
    entries = [
        linear(FIELD, (3 * i + j) % 5 - 2, (i * j) % 3 - 1, 1 + i + 2 * j) / (x + FIELD.convert(1 + (i + j) % 2))
        for i in range(n)
        for j in range(n)
    ]
    matrix, right = FIELD.matrix(n, n, entries), FIELD.column([y + FIELD.convert(i) for i in range(n)])
    numbers = fmpq_mat(n, n, [value(entry, POINT) for entry in entries])
    assert numbers.det() != 0
    assert value(matrix.det(), POINT) == numbers.det()
    expected = numbers.solve(fmpq_mat(n, 1, [POINT[1] + i for i in range(n)])).entries()
    assert [value(entry, POINT) for entry in matrix.solve(right).entries()] == expected


@pytest.mark.parametrize(
    "pattern",
    [
        ["x1", "01"],  # upper triangular: the second index does not lead back to the first
        ["1x0", "010", "0y1"],
        ["0x00", "y000", "00x1", "000y"],
        ["x001", "0y00", "1010", "000x"],
    ],
)
def test_matrices_with_zeros_agree_with_numbers(pattern):
    x, y = FIELD.variables
    entry = {"0": FIELD.zero, "1": FIELD.one, "x": x, "y": y}
    number = {"0": fmpq(0), "1": fmpq(1), "x": POINT[0], "y": POINT[1]}
    n = len(pattern)
    letters = "".join(pattern)
    matrix, numbers = FIELD.matrix(n, n, [entry[c] for c in letters]), fmpq_mat(n, n, [number[c] for c in letters])
    assert value(matrix.det(), POINT) == numbers.det()
    solution = matrix.solve(FIELD.column([x + FIELD.convert(i) for i in range(n)]))
    expected = numbers.solve(fmpq_mat(n, 1, [POINT[0] + i for i in range(n)]))
    assert [value(entry, POINT) for entry in solution.entries()] == expected.entries()


@pytest.mark.parametrize("n", [1, 2, 3, 8])
def test_the_denominator_of_a_solution_is_the_determinant(n):
    # With its sign: quotients by D and by -D would have no simple common denominator in what follows.
    x, y = FIELD.variables
    matrix = FIELD.matrix(n, n, [x if i == j else y * FIELD.convert(i - j) for i in range(n) for j in range(n)])
    solution = matrix.solve(FIELD.column([y] * n)).entries()
    assert {str(entry.denominator) for entry in solution} == {str(matrix.det().numerator)}


def test_a_singular_matrix_is_refused():
    x, y = FIELD.variables
    with pytest.raises(ZeroDivisionError):
        FIELD.matrix(2, 2, [x, y, x * x, x * y]).solve(FIELD.column([x, y]))
    assert FIELD.is_zero(FIELD.matrix(2, 2, [x, y, x * x, x * y]).det())


def test_the_budget_is_spent_before_the_work_is_done():
    field = FunctionField(NAMES, budget=1000)
    x, y = field.variables
    power = x + y + field.one
    while len(power.numerator) ** 2 + 100 < field.budget:
        power = power * power
    with pytest.raises(BudgetExceeded):
        _ = power * power * power * power


@pytest.mark.parametrize("is_second_row_short", [False, True])
def test_a_solution_that_exceeds_the_budget_is_refused_before_the_longest_minors(is_second_row_short, monkeypatch):
    """The exact number of products suffices, and 60 percent are refused early, also if the rows differ in length."""
    monkeypatch.setattr(module, "_MIN_FORECAST", 0)
    rng = random.Random(20261129)
    coefficients = [[[rng.randrange(1, 99) for _ in range(6)] for _ in range(6)] for _ in range(5)]

    def solve(budget: int, scale: int) -> tuple[int, float]:
        """Return the remaining budget (negative after a refusal) and the units of work; results are cached by scale."""
        K = FunctionField(["x", "y", "z", "u", "v"], budget=budget)
        gens, units = [K.one, *K.variables], counted()
        lengths = [2 if is_second_row_short and i == 1 else 6 for i in range(5)]
        rows = [
            [sum((gens[k] * K.convert(scale * entry[k]) for k in range(length)), K.zero) for entry in row]
            for row, length in zip(coefficients, lengths, strict=True)
        ]
        try:
            K.matrix(5, 5, [entry for row in rows for entry in row[:5]]).solve(K.column([row[5] for row in rows]))
        except BudgetExceeded:
            return -1, counted() - units
        return K.budget, counted() - units

    remaining, units = solve(10**6, 1)
    needed = 10**6 - remaining
    assert solve(needed, 2) == (0, units)
    remaining, units_before_refusal = solve(needed * 6 // 10, 3)
    assert remaining < 0
    assert units_before_refusal < 0.65 * units
    monkeypatch.setattr(module, "_MIN_FORECAST", 10**9)
    assert solve(needed * 6 // 10, 4)[1] > 0.8 * units  # without a forecast


def test_the_digits_of_the_iterates_of_an_affine_map_grow_linearly():
    field = FunctionField(NAMES, budget=10**6, reduces=True)
    x, matrix = field.column(field.variables), field.matrix(2, 2, [1, fmpq(-1, 10), fmpq(1, 10), 1])
    right = field.matrix(2, 2, [1, fmpq(1, 10), fmpq(-1, 10), 1])
    for _ in range(40):
        x = matrix.solve(right * x)
    step = fmpq_mat([[1, fmpq(-1, 10)], [fmpq(1, 10), 1]]).inv() * fmpq_mat([[1, fmpq(1, 10)], [fmpq(-1, 10), 1]])
    exact = step**40
    for entry, row in zip(x.entries(), exact.tolist(), strict=True):
        assert value(entry, (fmpq(2), fmpq(3))) == 2 * row[0] + 3 * row[1]
        assert len(str(entry.numerator)) + len(str(entry.denominator)) < 800


@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_constant_determinant_leaves_the_denominator_1(n):
    # One sign for all: the sum of 1/1 and 1/(-1) would have no denominator.
    x, y = FIELD.variables
    matrix = FIELD.matrix(n, n, [FIELD.convert(-3 if i == j else int(j > i)) for i in range(n) for j in range(n)])
    solution = matrix.solve(FIELD.column([x * y] * n)).entries()
    assert [str(entry.denominator) for entry in solution] == ["1"] * n
    assert value(solution[-1], POINT) == POINT[0] * POINT[1] / -3
