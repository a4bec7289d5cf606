"""Somos sequences: a known one, and what is none. Points of orbits by them: test_elliptic_steps.py."""

import pytest
from flint import fmpq, fmpz

from kahanmaps.maps.somos import Integers, Terms


def test_the_elliptic_divisibility_sequence_of_ward():
    # 0, 1, 1, -1, 1, 2, -1, -3, -5, 7, -4, -23, 29, 59, 129, ...: y^2 + y = x^3 - x with (0, 0), OEIS A006769.
    expected = [1, 1, -1, 1, 2, -1, -3, -5, 7, -4, -23, 29, 59, 129, -314]
    terms = Terms([fmpq(x) for x in expected[:4]], Integers(fmpz(1)))
    with pytest.raises(ArithmeticError):
        Terms([fmpq(x) for x in (1, 0, -1, 1)], Integers(fmpz(1)))
    with pytest.raises(ArithmeticError):
        Terms([fmpq(1), fmpq(1, 3), fmpq(1), fmpq(1)], Integers(fmpz(2)))
    assert [terms.integer(n) for n in range(1, 16)] == expected
    assert terms.pair(9) == (expected[8] ** 2, expected[7] * expected[9])
