"""The fields of numbers: one protocol over QQ, GF(p), RR(bits) and CC(bits).

What integers have in common with the primes of another one.
"""

from fractions import Fraction
from itertools import product
from math import gcd, prod

import numpy as np
import pytest
from flint import arb, fmpq, fmpz, fmpz_mod_ctx, nmod
from helpers import FIELDS, SMALLEST_LARGE_PRIME, over_exact_fields, rationals, refuses, some, together
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import CC, GF, RR, rational
from kahanmaps.algebra.integers import common_part, coprime_part, divide_exactly, split_by_primes
from kahanmaps.algebra.polynomials import evaluate, ring
from kahanmaps.errors import BadPrime, InexactNumber, PrecisionLost
from kahanmaps.systems.quadratic import QuadraticSystem

ALL_FIELDS = [*FIELDS, CC(128)]
over_all_fields = pytest.mark.parametrize("field", ALL_FIELDS, ids=repr)
over_balls = pytest.mark.parametrize("balls", [RR, CC], ids=["RR", "CC"])

integers = st.integers(-(10**30), 10**30)


EXACT = [
    (3, fmpq(3)),
    (10**40, fmpq(10**40)),
    (Fraction(-2, 6), fmpq(-1, 3)),
    ("0.1", fmpq(1, 10)),
    ("1e-3", fmpq(1, 1000)),
    (" -6/4 ", fmpq(-3, 2)),
    (fmpz(5), fmpq(5)),
    (fmpq(2, 3), fmpq(2, 3)),
]


@pytest.mark.parametrize(("value", "expected"), EXACT, ids=repr)
def test_integers_fractions_and_text_stand_for_exact_numbers(value, expected):
    assert rational(value) == expected


MACHINE_NUMBERS = [0.1, -0.0, float("nan"), float("inf"), 1e300, 1j, np.float64(0.1), np.float32(0.5)]


@together("field, value", product(ALL_FIELDS, MACHINE_NUMBERS))
def test_a_machine_number_is_refused_by_every_field(field, value):
    refuses("floating-point number", field.convert, value, error=InexactNumber)


OF_OTHER_FIELDS = [nmod(1, 5), fmpz_mod_ctx(5)(1), fmpz_mod_ctx(2**89 - 1)(1)]


@pytest.mark.parametrize("element", OF_OTHER_FIELDS, ids=repr)
@over_all_fields
def test_an_element_of_another_field_is_refused(field, element):
    refuses("expected", field.convert, element)


@over_all_fields
@some
@given(a=integers, b=integers)
def test_converting_respects_sums_products_and_quotients(field, a, b):
    with field.working():
        assume(field.convert(b) != 0)
        assert field.equal(field.convert(fmpq(a, b)), field.convert(a) / field.convert(b))
        assert field.equal(field.convert(a) + field.convert(b), field.convert(a + b))
        assert field.equal(field.convert(a) * field.convert(b), field.convert(a * b))


@pytest.mark.parametrize("prime", [2, 7, SMALLEST_LARGE_PRIME])
def test_a_denominator_that_the_prime_divides_is_refused_with_the_prime(prime):
    with pytest.raises(BadPrime, match="use another prime") as error:
        GF(prime).convert(fmpq(1, prime))
    assert error.value.prime == prime


@over_exact_fields
@some
@given(number=rationals(10**20))
def test_a_printed_exact_element_parses_back(field, number):
    assume(field.convert(number.q) != 0)
    element = field.convert(number)
    assert field.convert(field.format(element)) == element


@pytest.mark.parametrize("modulus", [4, 561, 2**67 - 1, 3215031751])  # 561 and the last pass weak tests of primality
def test_a_composite_modulus_is_refused(modulus):
    refuses("is composite", GF, modulus)


@over_balls
def test_a_ball_that_contains_zero_and_more_cannot_be_told_from_zero(balls):
    refuses("64 bits", balls(64).is_zero, balls(64).convert("1/3") * 3 - 1, error=PrecisionLost)


@over_balls
def test_nothing_is_equal_to_a_ball_of_which_nothing_is_known(balls):
    """nan overlaps every ball: an identity would hold wherever the digits have been lost."""
    K = balls(64)
    with K.working():
        around_zero = K.convert("1/3") * 3 - 1
        for unknown in (K.one / around_zero, K.convert(arb("nan"))):
            for pair in ((unknown, K.one), (K.one, unknown)):
                refuses("more bits", K.equal, *pair, error=PrecisionLost)
        assert K.equal(around_zero, K.zero)


@over_balls
def test_powers_of_balls_around_zero_are_known(balls):
    """python-flint 0.9.0 has nan for x**2 and x**1 where the midpoint of an arb is 0: here they are products."""
    K = balls(64)
    x, y = ring(["x", "y"]).gens()
    system = QuadraticSystem((x * y**2 + y**3,), ("y",))
    with K.working():
        around_zero = K.convert("1/3") * 3 - 1
        assert around_zero.contains(0)
        assert not around_zero.is_zero()
        value = evaluate(x**2 + x * y**3, K, (around_zero, K.one))
        over = system.over(K, (around_zero,))
        for entry in (value, over.B.entries()[0], over.c.entries()[0]):
            assert entry.is_finite()
            assert entry.contains(0)
            assert abs(entry) < 1e-15


longs = st.integers(-(10**40), 10**40)


@given(quotient=longs, divisor=st.integers(2, 2**60), remainder=st.integers(1, 2**60), sign=st.sampled_from([1, -1]))
def test_a_division_that_is_not_exact_raises(quotient, divisor, remainder, sign):
    assume(remainder % divisor != 0)
    with pytest.raises(ArithmeticError, match="please report"):
        divide_exactly([fmpz(divisor), fmpz(quotient * divisor + remainder)], fmpz(sign * divisor))


@given(
    numbers=st.lists(st.integers(-(10**6), 10**6), min_size=1, max_size=3),
    shared=st.lists(st.sampled_from([2, 3, 5, 7]), max_size=12),
    power=st.sampled_from([2, 6, 30, 9 * 125]),
)
def test_what_numbers_have_in_common_in_some_primes(numbers, shared, power):
    assume(any(numbers))
    product = prod(shared)
    common = gcd(*(product * number for number in numbers))
    expected = 1
    for prime in (2, 3, 5):
        while power % prime == 0 and common % (expected * prime) == 0:
            expected *= prime
    assert common_part([fmpz(product * number) for number in numbers], fmpz(power)) == expected


@given(st.integers(-(10**9), 10**9).filter(bool), st.integers(1, 10**6))
def test_primes_are_taken_away_with_all_their_powers(value, primes):
    left, taken = split_by_primes(fmpz(value), fmpz(primes))
    assert left * taken == value
    assert coprime_part(fmpz(value), fmpz(primes)) == left
    assert taken > 0
    assert fmpz(primes).gcd(left) == 1
    assert (fmpz(primes) ** 30) % taken == 0
