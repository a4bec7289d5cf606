"""The algebra Q[t]/chi of a squarefree chi: what holds for the class of t holds at every root of chi.

Where all roots are rational, evaluation is an isomorphism onto copies of Q, and FLINT computes there.
"""

import math
import random

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly
from helpers import rationals, refuses, some
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra import etale
from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import det, solve
from kahanmaps.errors import SingularMatrix

polynomials = st.lists(rationals(6), max_size=5).map(fmpq_poly)
root_sets = st.lists(rationals(6), min_size=1, max_size=4, unique_by=str)

GOLDEN = EtaleAlgebra(fmpq_poly([-1, -1, 1]))
CUBIC = EtaleAlgebra(fmpq_poly([-1, -1, 0, 1]))  # t^3 - t - 1: one real root, two complex ones
SPLIT = EtaleAlgebra(fmpq_poly([-1, 0, 1]))  # roots 1 and -1


def with_roots(roots) -> EtaleAlgebra:
    chi = fmpq_poly([1])
    for root in roots:
        chi *= fmpq_poly([-root, 1])
    return EtaleAlgebra(chi)


def values(roots, element) -> list[fmpq]:
    return [element.polynomial(root) for root in roots]


def at_roots(roots, matrix) -> list[fmpq_mat]:
    size = matrix.nrows(), matrix.ncols()
    return [fmpq_mat(*size, [entry.polynomial(root) for entry in matrix.entries()]) for root in roots]


@st.composite
def square_matrices(draw, K):
    n = draw(st.integers(1, 4))
    coefficient = st.lists(st.integers(-2, 2), min_size=1, max_size=2).map(fmpq_poly)
    return K.matrix(n, n, [draw(coefficient) for _ in range(n * n)])


@given(roots=root_sets, p=polynomials, q=polynomials)
def test_sums_products_and_quotients_are_taken_at_every_root_and_quotients_by_zero_divisors_refused(roots, p, q):
    K = with_roots(roots)
    a, b = K.convert(p), K.convert(q)
    assert values(roots, a + b) == [p(root) + q(root) for root in roots]
    assert values(roots, a - b) == [p(root) - q(root) for root in roots]
    assert values(roots, a * b) == [p(root) * q(root) for root in roots]
    if 0 in values(roots, b):
        with pytest.raises(ZeroDivisionError):
            a / b
    else:
        assert values(roots, a / b) == [p(root) / q(root) for root in roots]


@given(roots=root_sets, p=polynomials)
def test_trace_and_norm_are_sum_and_product_over_the_roots(roots, p):
    K = with_roots(roots)
    a = K.convert(p)
    assert K.trace(a) == sum(values(roots, a), fmpq(0))
    assert K.norm(a) == math.prod(values(roots, a), start=fmpq(1))


def test_a_zero_divisor_is_not_zero_and_divides_nothing():
    left, right = SPLIT.generator - 1, SPLIT.generator + 1
    assert (left == 0, right == 0, left * right == 0) == (False, False, True)
    with pytest.raises(ZeroDivisionError, match=r"t - 1, a zero divisor in QQ\[t\]/\(t\^2 - 1\)"):
        left / left


WRONG = [
    (fmpq_poly([1, 2, 1]), "repeated roots"),
    (fmpq_poly([-1, 2]), "monic"),
    (fmpq_poly([1]), "monic"),
    (fmpq_poly([]), "monic"),
    ("t^2 - 2", "fmpq_poly"),
]


@pytest.mark.parametrize(("chi", "sentence"), WRONG, ids=str)
def test_a_chi_that_is_not_monic_and_squarefree_is_refused(chi, sentence):
    refuses(sentence, EtaleAlgebra, chi)


@some
@given(roots=root_sets, data=st.data())
def test_determinants_and_solutions_are_taken_at_every_root_and_refused_where_one_is_singular(roots, data):
    K = with_roots(roots)
    matrix = data.draw(square_matrices(K))
    assert values(roots, det(matrix)) == [here.det() for here in at_roots(roots, matrix)]
    right = K.matrix(matrix.nrows(), 2, [fmpq_poly([k, 1 - k]) for k in range(2 * matrix.nrows())])
    if any(here.det() == 0 for here in at_roots(roots, matrix)):
        with pytest.raises(SingularMatrix):
            solve(matrix, right)
    else:
        solution = solve(matrix, right)
        pairs = zip(at_roots(roots, matrix), at_roots(roots, right), strict=True)
        assert at_roots(roots, solution) == [here.solve(side) for here, side in pairs]


def long_elements(field: EtaleAlgebra, count: int) -> list:
    rng = random.Random(f"{field}")
    return [field.convert(fmpq_poly([QQ.random(rng, 10**700) for _ in range(field.degree)])) for _ in range(count)]


@pytest.mark.parametrize("field", [GOLDEN, CUBIC, SPLIT], ids=repr)
def test_both_ways_to_a_quotient_lead_to_the_same(field, monkeypatch):
    elements = long_elements(field, 4)
    quotients = [a / b for a in elements for b in elements]
    monkeypatch.setattr("kahanmaps.algebra.etale._LONG_BITS", 10**9)
    assert [a / b for a in elements for b in elements] == quotients


@pytest.mark.parametrize("field", [GOLDEN, CUBIC, SPLIT], ids=repr)
def test_both_ways_to_a_product_lead_to_the_same(field, monkeypatch):
    elements = [*long_elements(field, 3), field.convert(7**900)]
    products = [a * b for a in elements for b in elements]
    requested = []
    product = etale._karatsuba_product
    monkeypatch.setattr(etale, "_MIN_KARATSUBA_BITS", 100)
    monkeypatch.setattr(etale, "_karatsuba_product", lambda *both: requested.append(both) or product(*both))
    assert [a * b for a in elements for b in elements] == products
    assert len(requested) == len(products)
    monkeypatch.setattr(etale, "_MAX_KARATSUBA_TERMS", field.degree - 1)  # with more coefficients FLINT is faster
    assert elements[0] * elements[1] == products[1]
    assert len(requested) == len(products)
