"""Dual numbers K[d]/(d^2): slopes are derivatives, over every kind of field, and matrices obey their algebra."""

import pytest
from flint import fmpq, fmpq_poly
from helpers import agree, leibniz, matrices, rationals, some
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.duals import DualField
from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.algebra.functions import FunctionField
from kahanmaps.algebra.matrices import solve

D = DualField(QQ)
FUNCTIONS = FunctionField(["x", "y"], budget=10**12)
BASES = [QQ, GF(2**61 - 1), RR(128), D, EtaleAlgebra(fmpq_poly([-1, 0, 1])), FUNCTIONS]

over_all_bases = pytest.mark.parametrize("base", BASES, ids=repr)
small = st.integers(-3, 3)
polynomials = st.lists(rationals(6), min_size=1, max_size=5).map(fmpq_poly)


def at(polynomial: fmpq_poly, x):
    """The value at an element of any field, by Horner's scheme."""
    total = x * 0
    for coefficient in reversed(polynomial.coeffs()):
        total = total * x + coefficient
    return total


@st.composite
def dual_matrices(draw, field, rows, columns):
    """Matrices with small integers in value and slope."""
    entries = [(draw(small), draw(small)) for _ in range(rows * columns)]
    return field.matrix(rows, columns, [field.dual(*entry) for entry in entries])


@over_all_bases
@some
@given(p=polynomials, q=polynomials, x=rationals(9))
def test_the_slope_of_a_rational_function_is_its_derivative(base, p, q, x):
    assume(q(x) != 0)
    field = DualField(base)
    with field.working():
        moving = field.dual(x, 1)
        expected = (p.derivative()(x) * q(x) - p(x) * q.derivative()(x)) / q(x) ** 2
        assert field.equal(at(p, moving) / at(q, moving), field.dual(p(x) / q(x), expected))


x = D.dual(2, 3)
MIXED = [  # result, value, slope
    (x + 1, 3, 3),
    (fmpq(1, 2) - x, fmpq(-3, 2), -3),
    (5 * x, 10, 15),
    (x / 2, 1, fmpq(3, 2)),
    (1 / x, fmpq(1, 2), fmpq(-3, 4)),
    (-x, -2, -3),
    (x**-2, fmpq(1, 4), fmpq(-3, 4)),
]


@pytest.mark.parametrize(("result", "value", "slope"), MIXED)
def test_numbers_on_either_side_are_constants(result, value, slope):
    assert (result.value, result.slope) == (value, slope)


@over_all_bases
@some
@given(data=st.data(), a=small, b=small)
def test_the_determinant_is_right_where_the_value_is_singular(base, data, a, b):
    field = DualField(base)
    with field.working():
        slope = data.draw(matrices(3, 3, small))
        singular = base.matrix(3, 3, [1, a, b, 2, 2 * a, 2 * b, a, 1, 1])
        matrix = field.lift_matrix(singular) + field.convert_matrix(slope) * field.dual(0, 1)
        assert field.equal(matrix.det(), leibniz(field, matrix))


@over_all_bases
@some
@given(data=st.data(), n=st.integers(1, 3))
def test_a_solution_solves_the_system_column_by_column(base, data, n):
    field = DualField(base)
    with field.working():
        matrix, right = data.draw(dual_matrices(field, n, n)), data.draw(dual_matrices(field, n, 2))
        assume(not base.equal(matrix.det().value, base.zero))
        assert agree(field, (matrix * solve(matrix, right)).entries(), right.entries())
