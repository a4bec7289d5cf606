"""The denominators that half of the Euclidean algorithm finds, against Euclid's divisions one by one."""

import random

import pytest
from flint import fmpz
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra import half_gcd
from kahanmaps.algebra.half_gcd import simple_denominator


def by_euclid(number: fmpz, power: int) -> fmpz | None:
    """The first convergent with a remainder below the square root of 2^power."""
    (a, v), (b, z) = (fmpz(1) << power, fmpz(0)), (number % (fmpz(1) << power), fmpz(1))
    while b >= fmpz(1) << (power // 2):
        (a, v), (b, z) = (b, z), (a % b, v - (a // b) * z)
    return abs(z) if abs(z).bit_length() <= power // 2 - 16 else None


@given(
    quotients=st.lists(st.integers(1, 2**40), min_size=1, max_size=40),
    power=st.integers(0, 1500),
    error=st.integers(-(2**20), 2**20),
    bits=st.sampled_from([(12, 1), (40, 1), (40, 8), (800, 8)]),
)
def test_a_number_near_a_continued_fraction_has_the_denominator_that_euclid_finds(quotients, power, error, bits):
    numerator, denominator = 0, 1
    for quotient in quotients:
        numerator, denominator = denominator, quotient * denominator + numerator
    number = (fmpz(numerator) << power) // denominator + error
    with pytest.MonkeyPatch.context() as patch:
        for name, value in zip(("_SHORT_BITS", "_GUARD_BITS"), bits, strict=True):  # few guard bits: wrong quotients
            patch.setattr(half_gcd, name, value)
        assert simple_denominator(number, power) == by_euclid(number, power)


@pytest.mark.parametrize("bits", [100, 1000, 10_000, 50_000])
def test_the_denominator_is_found_from_twice_its_length_and_not_from_less(bits):
    rng = random.Random(bits)
    V, X = fmpz(rng.getrandbits(bits) | 1), fmpz(rng.getrandbits(bits) | 1)
    denominator = V // V.gcd(X)
    power = 2 * denominator.bit_length() + 40
    assert simple_denominator((X << power) // V, power) == denominator
    assert simple_denominator(((X << power) // V) ^ (fmpz(1) << (power // 2 + 40)), power) is None
    assert simple_denominator((X << (power - 80)) // V, power - 80) in (None, 1)


@pytest.mark.parametrize("guard_bits", [1, 8])
def test_wrong_quotients_from_leading_digits_are_corrected(guard_bits, monkeypatch):
    monkeypatch.setattr(half_gcd, "_SHORT_BITS", 30)
    monkeypatch.setattr(half_gcd, "_GUARD_BITS", guard_bits)
    rng = random.Random(3)
    for _ in range(30):
        V, X = fmpz(rng.getrandbits(2000) | 1), fmpz(rng.getrandbits(2000) | 1)
        assert simple_denominator((X << 4040) // V, 4040) == V // V.gcd(X)


def test_random_numbers_have_no_simple_fraction():
    rng = random.Random(1)
    assert sum(simple_denominator(fmpz(rng.getrandbits(500)), 500) is not None for _ in range(2000)) <= 2
