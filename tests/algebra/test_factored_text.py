"""Products as text: what is printed in factors parses back to the same function."""

from __future__ import annotations

import random

import pytest
from flint import fmpq

from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.algebra.written.text import format_factored, format_product, parse_rational_function

NAMES = ["x", "y", "eps"]
CONTEXT = ring(NAMES)


def drawn(rng):
    """A product of a fraction and of powers of few short polynomials."""
    P = CONTEXT.constant(fmpq(rng.choice([-6, -1, 1, 2, 4]), rng.choice([1, 3, 10])))
    for _ in range(rng.randint(0, 3)):
        terms = {
            tuple(rng.randint(0, 2) for _ in NAMES): rng.choice([-4, -2, -1, 1, 3]) for _ in range(rng.randint(1, 3))
        }
        P *= CONTEXT.from_dict(terms) ** rng.randint(1, 3)
    return P


@pytest.mark.parametrize("seed", range(60))
def test_what_is_printed_in_factors_is_read_back(seed):
    rng = random.Random(seed)
    above, below = drawn(rng), drawn(rng)
    back = parse_rational_function(format_factored(RationalFunction(above, below)), NAMES)
    assert back.numerator * below == above * back.denominator


def test_zero_and_numbers_have_no_factors():
    zero, half = CONTEXT.constant(0), CONTEXT.constant(fmpq(-1, 2))
    assert format_factored(RationalFunction(zero, CONTEXT.gen(0) ** 2)) == "0"
    assert format_factored(RationalFunction(half, CONTEXT.constant(1))) == "-1/2"
    assert format_product([], fmpq(-2, 3)) == "-2/3"
