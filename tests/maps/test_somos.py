"""Somos sequences without the primes of a set, against their recurrence over Q.

Specified here: terms near n come from those near n/2; what is left out of them is known up to what cancels.
"""

import pytest
from flint import fmpq, fmpz
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.integers import split_by_primes
from kahanmaps.maps.somos import Integers, Terms, around, first_terms

rational = st.fractions(min_value=-9, max_value=9, max_denominator=9).filter(bool)
rational = rational.map(lambda x: fmpq(x.numerator, x.denominator))


def primes_of(*terms):
    product = fmpz(1)
    for term in terms:
        product = product.lcm(term.p).lcm(term.q)
    return product


def sequences(H, y, z, most):
    try:
        first, others = first_terms(H, y, z)
        return first, others, around(first, most), around(others, most, first)
    except ZeroDivisionError:
        assume(False)


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


@given(rational, rational, rational)
def test_terms_and_what_is_left_out_of_them(H, y, z):
    first, others, W, U = sequences(H, y, z, 40)
    assume(all(W[n] and U[n] for n in range(1, 41)))
    primes = primes_of(*first, *others)
    numbers = Integers(primes)
    multiples = Terms(first, numbers)
    sequence = Terms(others, numbers, multiples)
    scales = []
    for terms, exact in ((multiples, W), (sequence, U)):
        scale = {n: exact[n] / terms.integer(n) for n in range(1, 41)}
        assert all(
            split_by_primes(x.p, primes)[0] in (1, -1) and split_by_primes(x.q, primes)[0] == 1 for x in scale.values()
        )
        assert all(primes.gcd(terms.integer(n)) == 1 for n in range(1, 41))
        assert all(terms.own_quotient(n) == scale[n + 1] * scale[n - 1] / scale[n] ** 2 for n in range(2, 39))
        scales.append(scale)
    S, s = scales
    assert all(sequence.mixed_quotient(n) == S[n - 1] * s[n + 1] / (S[n] * s[n]) for n in range(2, 39))
    assert all(multiples.mixed_quotient(n) == multiples.own_quotient(n) for n in range(2, 39))


@given(rational, rational, rational)
def test_sequences_satisfy_their_recurrence_in_both_directions_and_the_addition_formula(H, y, z):
    _, _, W, U = sequences(H, y, z, 12)
    assert (W[0], W[1], W[2], W[3], U[1], U[2]) == (0, 1, H, H**3, 1, 1)
    assert (H * U[2] ** 2, H * U[3] ** 2) == (y * U[3] * U[1], z * U[4] * U[2])
    for terms in (W, U):
        for n in range(-10, 11):
            assert terms[n + 2] * terms[n - 2] == H**2 * terms[n + 1] * terms[n - 1] - H**3 * terms[n] ** 2
        for i in range(-4, 5):
            for j in range(-4, 5):
                right = terms[i + 1] * terms[i - 1] * W[j] ** 2 - terms[i] ** 2 * W[j + 1] * W[j - 1]
                assert terms[i + j] * terms[i - j] == right
