"""Linear algebra under one name over each field: solve, determinant, rank, null space, minors, primitive vectors.

Over balls a question is left open (`PrecisionLost`) instead of answered wrongly.
"""

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly, fmpz_mat
from helpers import leibniz, matrices, over_all_fields, over_exact_fields, some
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import QQ, RR
from kahanmaps.algebra.matrices import det, nullspace, rank, solve
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.errors import PrecisionLost, SingularMatrix

small = st.integers(-5, 5)


@over_all_fields
@some
@given(matrix=st.integers(1, 4).flatmap(lambda n: matrices(n, n, small)))
def test_the_determinant_is_leibniz_sum_over_permutations(field, matrix):
    with field.working():
        here = field.convert_matrix(matrix)
        assert field.equal(det(here), leibniz(field, here))


@over_all_fields
@some
@given(data=st.data(), n=st.integers(1, 4))
def test_a_solution_solves_the_system(field, data, n):
    matrix, right = data.draw(matrices(n, n, small)), data.draw(matrices(n, 2, small))
    with field.working():
        matrix, right = field.convert_matrix(matrix), field.convert_matrix(right)
        assume(not field.equal(det(matrix), field.zero))
        product = matrix * solve(matrix, right)
        assert all(field.equal(a, b) for a, b in zip(product.entries(), right.entries(), strict=True))


@over_all_fields
def test_a_singular_matrix_is_refused_also_where_a_solution_exists(field):
    matrix, image = field.matrix(2, 2, [1, 2, 2, 4]), field.column([1, 2])
    with field.working(), pytest.raises(SingularMatrix):
        solve(matrix, image)


def test_balls_that_cannot_tell_a_determinant_from_zero_say_so():
    matrix = RR(64).matrix(2, 2, ["1/3", "1/7", "1/3", "1/7"])
    with RR(64).working(), pytest.raises(PrecisionLost, match="more bits"):
        solve(matrix, RR(64).column([1, 1]))


RANKS = [
    (fmpq_mat([[1, 2], [3, 4]]), 2),
    (fmpq_mat([[1, 2], [2, 4]]), 1),
    (fmpq_mat([[0, 0], [0, 0]]), 0),
    (fmpq_mat([[1, 2, 3], [4, 5, 6], [7, 8, 9]]), 2),
    (fmpq_mat(2, 3, [fmpq(1, 2), fmpq(1, 3), fmpq(1, 5), fmpq(1, 2), fmpq(1, 3), fmpq(1, 5)]), 1),
    (fmpq_mat(0, 3), 0),
]


@pytest.mark.parametrize(("matrix", "expected"), RANKS, ids=str)
def test_the_rank_of_a_small_matrix_is_the_one_found_by_hand(matrix, expected):
    assert rank(QQ, matrix) == expected


@over_exact_fields
@some
@given(left=matrices(3, 2, small), right=matrices(2, 4, small))
def test_the_matrix_kills_a_null_space_of_the_right_dimension(field, left, right):
    here = field.convert_matrix(left * right)
    kernel = nullspace(field, here)
    images = [here * field.column(vector) for vector in kernel]
    assert all(field.equal(entry, field.zero) for image in images for entry in image.entries())
    assert rank(field, here) + len(kernel) == 4


@given(matrices(3, 4, st.integers(-1, 1)))
def test_rank_and_null_space_over_a_number_field_are_those_over_q(matrix):
    K = EtaleAlgebra(fmpq_poly([-2, 0, 1]))
    scale = [K.one, K.generator, K.generator - 1]  # a row times a unit has the same null space
    rows = [[K.convert(entry) * c for entry in row] for row, c in zip(matrix.tolist(), scale, strict=True)]
    rows.append([a + b for a, b in zip(rows[0], rows[1], strict=True)])
    over = K.matrix(4, 4, [entry for row in rows for entry in row])
    assert rank(K, over) == rank(QQ, matrix)
    assert nullspace(K, over) == [tuple(map(K.convert, vector)) for vector in nullspace(QQ, matrix)]


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
@given(data=st.data())
def test_the_minors_are_those_of_flint(n, data):
    entry = st.integers(-20, 20)
    rows = data.draw(st.lists(st.lists(entry, min_size=n + 1, max_size=n + 1), min_size=n, max_size=n))
    result = kernel_minors(rows)
    for k in range(n + 1):
        assert result[k] == (-1) ** k * fmpz_mat([[row[j] for j in range(n + 1) if j != k] for row in rows]).det()
    assert all(sum(a * b for a, b in zip(row, result, strict=True)) == 0 for row in rows)
