"""Polynomials and rational functions: what FLINT leaves out."""

from math import gcd

import pytest
from flint import fmpq
from helpers import over_all_fields, rationals, some
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import (
    RationalFunction,
    evaluate,
    gradient,
    names_of,
    primitive_part,
    ring,
    substitute,
)

XYZ = ring(["x", "y", "z"])
x, y, z = XYZ.gens()
integers = st.integers(-9, 9)


def polynomials(coefficients=None, exponent: int = 3):
    """Polynomials in x, y, z with up to five terms."""
    exponents = st.tuples(*[st.integers(0, exponent)] * 3)
    terms = st.dictionaries(exponents, rationals() if coefficients is None else coefficients, max_size=5)
    return terms.map(lambda d: XYZ.from_dict({m: fmpq(c) for m, c in d.items() if c != 0}))


def integral_functions():
    """Quotients with integer coefficients only, so that every field can have them."""
    return st.builds(lambda p, q: RationalFunction(p, 1 + x * q), polynomials(integers), polynomials(integers))


def rational_functions():
    return st.builds(RationalFunction, polynomials(), polynomials().filter(lambda p: not p.is_zero()))


@given(p=polynomials(), q=polynomials())
def test_the_gradient_obeys_leibniz(p, q):
    assert gradient(p * q) == tuple(a * q + p * b for a, b in zip(gradient(p), gradient(q), strict=True))


@given(p=polynomials().filter(lambda p: not p.is_zero()))
def test_a_polynomial_is_a_factor_times_coprime_integers_with_a_positive_leading_one(p):
    factor, primitive = primitive_part(p)
    assert factor * primitive == p
    assert {c.q for c in primitive.coeffs()} == {1}
    assert gcd(*[int(c.p) for c in primitive.coeffs()]) == 1
    assert primitive.leading_coefficient() > 0


@pytest.mark.parametrize("prime", [31, 2**61 - 1])
@some
@given(p=polynomials(), point=st.tuples(rationals(), rationals(), rationals()))
def test_the_value_modulo_a_prime_is_the_value_reduced(prime, p, point):
    # denominators are at most 20
    K = GF(prime)
    assert evaluate(p, K, [K.convert(entry) for entry in point]) == K.convert(p(*point))


@given(p=polynomials(), point=st.tuples(rationals(), rationals(), rationals()))
def test_variables_can_be_given_values_one_after_the_other(p, point):
    reduced = substitute(p, {"y": point[1]})
    assert names_of(reduced) == ("x", "z")
    assert reduced(point[0], point[2]) == p(*point)


@given(f=rational_functions(), factor=polynomials().filter(lambda p: not p.is_zero()))
def test_a_common_factor_does_not_change_a_quotient(f, factor):
    assert RationalFunction(f.numerator * factor, f.denominator * factor) == f


@over_all_fields
@some
@given(f=integral_functions(), point=st.tuples(integers, integers, integers))
def test_the_value_of_a_quotient_times_the_denominator_is_the_numerator(field, f, point):
    at = [field.convert(entry) for entry in point]
    value = f.value(field, at)
    assume(value is not None)
    with field.working():
        product = value * evaluate(f.denominator, field, at)
    assert field.equal(product, evaluate(f.numerator, field, at))


@over_all_fields
def test_a_quotient_has_no_value_where_its_denominator_vanishes(field):
    assert RationalFunction(x, x - y).value(field, [field.one] * 3) is None
