"""Bounds for degrees and coefficients, compared with the polynomial that they bound: never below the truth.

What is composed of these is bounded by composition; tests/checks and tests/paper look at whole claims.
"""

import math

import pytest
from check_helpers import F, covers, covers_polynomial, numerator, polynomials, true_size
from flint import fmpq
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.bounds import BoundField, CoefficientSize


def bounded(K, element):
    """A polynomial's own bound in K, as tight as can be."""
    return K.polynomial(*true_size(element.numerator))


@given(polynomials(), polynomials(), polynomials())
def test_sums_differences_and_products_of_polynomials_are_bounded(p, q, r):
    K = BoundField()
    a, b, c = (bounded(K, element) for element in (p, q, r))
    assert covers_polynomial((a + b).numerator, numerator(p + q))
    assert covers_polynomial((a - b).numerator, numerator(p - q))
    assert covers_polynomial((a * b).numerator, numerator(p * q))
    assert covers_polynomial((-a).numerator, numerator(-p))
    assert covers_polynomial(((a + b) * c - a * a * a).numerator, numerator((p + q) * r - p * p * p))


@given(st.lists(polynomials(), min_size=6, max_size=6))
def test_rational_functions_are_bounded(drawn):
    a, b, c, d, e, f = drawn
    assume(not any(element.numerator.is_zero() for element in (b, d, f)))
    K = BoundField()
    A, B, C, D, E, G = (bounded(K, element) for element in drawn)
    assert covers(A / B + C / D, a / b + c / d)
    assert covers(A / B - C / D * (E / G), a / b - c / d * (e / f))
    assert covers((A / B) * (C / B) + E / B, (a / b) * (c / b) + e / b)
    inner = b + c / d
    assume(not inner.numerator.is_zero())
    assert covers(A / (B + C / D), a / inner)


def test_entries_of_a_matrix_with_one_bound_are_different_denominators():
    # By hand: 1/p + 1/q is (q + p)/(p q), of degree 3 over 6; the bound of p and q is one object.
    K = BoundField()
    p, q = K.matrix(1, 2, [K.polynomial(3, 1.0), K.polynomial(2, 1.0)]).entries()
    total = K.one / p + K.one / q
    assert (total.numerator, total.pole_degree) == (CoefficientSize(3, 2.0), 6)
    assert not K.is_zero(p)
    assert not K.is_zero(q)
    assert K.pole_degree == 12
    entry = K.matrix(1, 1, [K.polynomial(3, 1.0)])
    assert (K.one / entry[0, 0] + K.one / entry[0, 0]).pole_degree == 3


@st.composite
def polynomial_matrices(draw, n, columns):
    return [[draw(polynomials()) for _ in range(columns)] for _ in range(n)]


def in_F(rows):
    return F.matrix(len(rows), len(rows[0]), [entry for row in rows for entry in row])


def in_K(K, rows):
    return K.matrix(len(rows), len(rows[0]), [bounded(K, entry) for row in rows for entry in row])


@given(st.integers(1, 3).flatmap(lambda n: polynomial_matrices(n, n)))
def test_determinants_are_bounded(rows):
    assert covers_polynomial(in_K(BoundField(), rows).det().numerator, numerator(in_F(rows).det()))


@given(st.integers(1, 3).flatmap(lambda n: st.tuples(polynomial_matrices(n, n), polynomial_matrices(n, 1))))
def test_solutions_are_bounded_by_cramers_rule(drawn):
    rows, right = drawn
    matrix = in_F(rows)
    determinant = matrix.det()
    assume(not determinant.numerator.is_zero())
    K = BoundField()
    bound = in_K(K, rows).solve(in_K(K, right)).entry
    assert true_size(numerator(determinant))[0] <= bound.pole_degree
    for entry in matrix.solve(in_F(right)).entries():
        product = determinant.numerator * entry.numerator  # over the denominator it is a polynomial
        assert product / entry.denominator * entry.denominator == product
        assert covers_polynomial(bound.numerator, product / entry.denominator)


def test_what_is_compared_with_zero_must_not_be_zero():
    K = BoundField()
    x = K.variable()
    assert not K.is_zero(x * x)
    assert K.pole_degree == 2
    assert not K.is_zero(K.one)
    assert K.pole_degree == 2
    assert (x / (x * x * x)).pole_degree == 3
    assert K.pole_degree == 5


def test_denominators_of_a_determinant_and_of_cramers_rule_are_those_of_all_rows():
    # By hand, entries x/(3 w): det = (x^2 - x^2)/(3 w)^2, and the solution of M y = b is 3 w adj(x) b / det(x).
    K = BoundField()
    x, w = K.variable(), K.polynomial(5, 0.0)
    matrix = K.matrix(2, 2, [x / w * K.convert(fmpq(1, 3))] * 4)
    det = matrix.det()
    assert (det.numerator.degree, det.pole_degree, det.scale) == (2, 10, 9)
    solution = matrix.solve(K.matrix(2, 1, [K.one] * 2)).entry
    assert (solution.numerator.degree, solution.pole_degree) == (5 + 1, 2)
    assert solution.numerator.bits == pytest.approx(math.log2(3 * 2), abs=1e-6)
