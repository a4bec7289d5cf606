"""What integers have in common with the primes of another one, against products that are known."""

from math import gcd

import pytest
from flint import fmpz
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.integers import common_part, divide_exactly, split_by_primes, without

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
    product = 1
    for prime in shared:
        product *= prime
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
    assert without(fmpz(value), fmpz(primes)) == left
    assert taken > 0
    assert fmpz(primes).gcd(left) == 1
    assert (fmpz(primes) ** 30) % taken == 0
