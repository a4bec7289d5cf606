"""The fields of numbers: one protocol over QQ, GF(p) and RR(bits).

Specified here: what `convert` takes and what it refuses, that it respects sums and products, that text comes back,
which moduli and precisions are allowed, and what a ball may be said to be.
"""

from __future__ import annotations

import random
from fractions import Fraction

import flint
import numpy as np
import pytest
from flint import arb, fmpq, fmpq_mat, fmpz, fmpz_mod, fmpz_mod_ctx, nmod
from helpers import (
    LARGEST_WORD_PRIME,
    SMALLEST_LARGE_PRIME,
    encloses,
    over_all_fields,
    over_exact_fields,
    rationals,
    some,
)
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF, QQ, RR, PrimeField, rational
from kahanmaps.errors import BadPrime, ExpressionError, InexactNumber, InputError, PrecisionLost

integers = st.integers(-(10**30), 10**30)


# The door: what is an exact number, and what is not.

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


MACHINE_NUMBERS = [0.1, -0.0, float("nan"), float("inf"), 1e300, 1j, np.float64(0.1), np.float32(0.5), np.int64(3)]


@pytest.mark.parametrize("value", MACHINE_NUMBERS, ids=repr)
@over_all_fields
def test_a_machine_number_is_refused_by_every_field(field, value):
    with pytest.raises(InexactNumber, match="machine number"):
        field.convert(value)


@pytest.mark.parametrize("value", MACHINE_NUMBERS, ids=repr)
def test_the_example_in_the_refusal_of_a_machine_number_can_be_typed_in(value):
    with pytest.raises(InexactNumber) as refusal:
        rational(value)
    example = str(refusal.value).split("e.g. ")[1].strip('"')
    rational(example)


@pytest.mark.parametrize("kind", [ValueError, TypeError, InputError])
def test_the_refusal_of_a_machine_number_is_an_error_of_the_builtin_kinds(kind):
    with pytest.raises(kind):
        rational(0.1)


@pytest.mark.parametrize(
    "value", [True, False, None, [1], (1, 2), {}, b"1", pytest.param(object(), id="an object")], ids=repr
)
@over_all_fields
def test_what_is_no_number_is_refused_by_every_field(field, value):
    with pytest.raises(InputError, match="expected"):
        field.convert(value)


@pytest.mark.parametrize("text", ["", "x", "1/0", "0x10", "1_000", "nan", "inf"])
@over_all_fields
def test_text_that_spells_no_number_is_refused_by_every_field(field, text):
    with pytest.raises(ExpressionError):
        field.parse(text)


OF_OTHER_FIELDS = [nmod(1, 5), fmpz_mod_ctx(5)(1), fmpz_mod_ctx(2**89 - 1)(1)]


@pytest.mark.parametrize("element", OF_OTHER_FIELDS, ids=repr)
@over_all_fields
def test_an_element_of_another_field_is_refused(field, element):
    with pytest.raises(InputError, match="expected"):
        field.convert(element)


@over_exact_fields
def test_a_ball_is_refused_by_an_exact_field(field):
    with pytest.raises(InputError, match="arb"):
        field.convert(arb(1))


# convert is a homomorphism.


@over_all_fields
def test_zero_and_one_are_the_images_of_zero_and_one(field):
    assert (field.convert(0), field.convert("1")) == (field.zero, field.one)


@over_all_fields
@some
@given(a=integers, b=integers)
def test_converting_respects_sums_and_products(field, a, b):
    with field.working():
        assert field.equal(field.convert(a) + field.convert(b), field.convert(a + b))
        assert field.equal(field.convert(a) * field.convert(b), field.convert(a * b))


@over_all_fields
@some
@given(a=integers, b=st.integers(1, 10**30))
def test_a_fraction_becomes_the_quotient_of_its_parts(field, a, b):
    assume(field.convert(b) != 0)
    with field.working():
        assert field.equal(field.convert(fmpq(a, b)), field.convert(a) / field.convert(b))


@over_exact_fields
def test_one_added_as_often_as_the_characteristic_says_is_zero(field):
    assert field.convert(field.characteristic) == field.zero


@over_all_fields
def test_an_element_of_the_field_is_converted_to_itself(field):
    element = field.convert(11) + field.one
    assert field.convert(element) == element == 12


@pytest.mark.parametrize("prime", [2, 7, SMALLEST_LARGE_PRIME])
def test_a_denominator_that_the_prime_divides_is_refused_with_the_prime(prime):
    with pytest.raises(BadPrime, match="take another prime") as refusal:
        GF(prime).convert(fmpq(1, prime))
    assert refusal.value.prime == prime


def test_the_refusal_of_a_prime_shortens_a_number_of_many_digits():
    with pytest.raises(BadPrime) as refusal:
        GF(7).convert(fmpq(10**5000, 7))
    assert len(str(refusal.value)) < 200


# Text.


@over_exact_fields
@some
@given(number=rationals(10**20))
def test_an_exact_element_comes_back_from_its_text(field, number):
    assume(field.convert(number.q) != 0)
    element = field.convert(number)
    assert field.parse(field.format(element)) == element


def test_a_rational_number_of_any_length_is_printed():
    assert len(QQ.format(fmpq(10**6000, 3))) == 6003  # Python's own str stops at 4300 digits


@pytest.mark.parametrize("bits", [8, 53, 128, 1000])
@some
@given(number=rationals(10**20))
def test_the_text_of_a_ball_comes_back_as_a_ball_around_it(bits, number):
    ball = RR(bits).convert(number)
    assert RR(bits).parse(RR(bits).format(ball)).contains(ball)


@given(number=rationals(10**20))
def test_the_text_of_a_ball_loses_only_a_few_bits(number):
    assume(number != 0)
    again = RR(128).parse(RR(128).format(RR(128).convert(number)))
    assert again.is_exact() or again.rel_accuracy_bits() >= 128 - 8  # one decimal digit, and the printed radius


BALLS = [  # text, both ends, a number outside
    ("[1.5 +/- 0.5]", "1", "2", "2.01"),
    ("[+/- 1e-5]", "-0.00001", "0.00001", "0.0000101"),
    ("[-2.25e+3 +/- 1.5]", "-2251.5", "-2248.5", "2250"),
    (" [1 +/- .5] ", "0.5", "1.5", "0"),
]


@pytest.mark.parametrize(("text", "left", "right", "outside"), BALLS)
def test_a_ball_is_read_from_midpoint_and_radius(text, left, right, outside):
    ball = RR(64).parse(text)
    assert [encloses(ball, rational(number)) for number in (left, right, outside)] == [True, True, False]


@pytest.mark.parametrize("text", ["[1 +/- x]", "[. +/- .]", "[1 +/- ]", "[ +/- 1]", "[1e5 +/- e1]", "[nan +/- 1]"])
def test_a_ball_that_is_not_spelled_out_is_refused(text):
    with pytest.raises(InputError):
        RR(64).parse(text)


def test_a_ball_of_more_digits_than_the_precision_can_hold_is_refused():
    with pytest.raises(InputError, match="too long for 64 bits"):
        RR(64).parse(f"[1.{'0' * 1000} +/- 1e-5]")


# Prime fields.


PRIMES = [2, 3, 7, 2**31 - 1, 2**61 - 1, LARGEST_WORD_PRIME, SMALLEST_LARGE_PRIME, 2**64 + 13, 2**127 - 1]


@pytest.mark.parametrize("prime", PRIMES)
@some
@given(a=integers, b=integers)
def test_arithmetic_modulo_a_prime_is_that_of_pythons_integers(prime, a, b):
    K = GF(prime)
    assert int(K.convert(a) * K.convert(b) - K.convert(b)) == (a * b - b) % prime


@pytest.mark.parametrize(
    ("prime", "kind"), [(LARGEST_WORD_PRIME, nmod), (SMALLEST_LARGE_PRIME, fmpz_mod)], ids=["below", "above"]
)
def test_residues_are_machine_words_below_two_to_the_63_and_long_above(prime, kind):
    assert isinstance(GF(prime).convert("1/2"), kind)


COMPOSITE = [4, 91, 561, 2**61 + 1, 2**67 - 1, (2**31 - 1) * (2**61 - 1), 3215031751]


@pytest.mark.parametrize("modulus", COMPOSITE)  # 561 and 3215031751 pass weak tests of primality
def test_a_composite_modulus_is_refused(modulus):
    with pytest.raises(InputError, match="is composite"):
        GF(modulus)


@pytest.mark.parametrize("modulus", [1, 0, -7])
def test_a_modulus_below_two_is_refused(modulus):
    with pytest.raises(InputError, match="at least 2"):
        GF(modulus)


@pytest.mark.parametrize("modulus", [7.0, True, "7", None, fmpz(7), np.int64(7)], ids=repr)
def test_a_modulus_that_is_no_python_integer_is_refused_even_after_its_equal_was_accepted(modulus):
    GF(7)
    with pytest.raises(InputError, match="prime number as an integer"):
        GF(modulus)


def test_a_modulus_too_long_to_be_proved_prime_quickly_is_refused():
    with pytest.raises(InputError, match="expected at most 512"):
        GF(2**521 - 1)


def test_fields_of_the_same_prime_are_equal_and_hash_alike():
    assert (PrimeField(7), hash(PrimeField(7))) == (GF(7), hash(GF(7)))


@pytest.mark.parametrize("other", [GF(5), QQ, RR(7), 7], ids=repr)
def test_fields_of_different_kind_or_prime_are_different(other):
    assert GF(7) != other


# Balls.


@given(number=rationals(10**10))
def test_a_ball_contains_the_number_it_was_made_from(number):
    assert encloses(RR(64).convert(number), number)


def test_a_ball_around_a_third_is_not_a_third_but_overlaps_it():
    third = RR(64).convert("1/3")
    assert (third * 3 == 1) is False  # balls: `!=` means certainly different, which is not the opposite
    assert RR(64).equal(third * 3, RR(64).one)


def test_disjoint_balls_are_not_equal():
    assert not RR(64).equal(RR(64).convert("1/3"), RR(64).convert("1/3") + arb(2) ** -50)


def test_the_ball_zero_is_zero_and_a_ball_around_one_is_not():
    assert RR(64).is_zero(RR(64).zero)
    assert not RR(64).is_zero(RR(64).convert("1/3"))


def test_a_ball_that_contains_zero_and_more_cannot_be_told_from_zero():
    with pytest.raises(PrecisionLost, match="64 bits"):
        RR(64).is_zero(RR(64).convert("1/3") * 3 - 1)


@over_exact_fields
def test_over_an_exact_field_zero_is_told_from_one(field):
    assert (field.is_zero(field.zero), field.is_zero(field.one)) == (True, False)


def test_working_sets_the_precision_of_balls_for_the_block_only():
    before = flint.ctx.prec
    with RR(777).working():
        assert flint.ctx.prec == 777
    assert flint.ctx.prec == before


def test_working_restores_the_precision_after_an_error():
    before = flint.ctx.prec
    with pytest.raises(ZeroDivisionError), RR(777).working():
        raise ZeroDivisionError
    assert flint.ctx.prec == before


def test_converting_uses_the_precision_of_the_field_whatever_the_ambient_one():
    assert RR(500).convert("1/3").rel_accuracy_bits() >= 498


@pytest.mark.parametrize("bits", [1, 0, -5, 1_000_001, 64.0, True, "64", None], ids=repr)
def test_a_precision_out_of_range_is_refused_even_after_its_equal_was_accepted(bits):
    RR(64)
    with pytest.raises(InputError, match="precision"):
        RR(bits)


def test_balls_of_the_same_precision_are_the_same_field_and_of_another_precision_are_not():
    assert (RR(64) == type(RR(64))(64), RR(64) == RR(65)) == (True, False)


# Random elements and matrices.


@over_all_fields
def test_random_elements_are_determined_by_the_seed(field):
    def draws(seed):
        rng = random.Random(seed)
        return [field.format(field.random(rng)) for _ in range(64)]

    assert draws(1) == draws(1)
    assert draws(1) != draws(2)


def test_random_rationals_stay_below_the_height():
    rng = random.Random(0)
    drawn = [QQ.random(rng, 5) for _ in range(200)]
    assert max(abs(number.p) for number in drawn) <= 5
    assert max(number.q for number in drawn) <= 5


@pytest.mark.parametrize("prime", [2, 7])
def test_random_residues_reach_every_element(prime):
    rng = random.Random(0)
    assert {int(GF(prime).random(rng)) for _ in range(200)} == set(range(prime))


@over_all_fields
def test_a_matrix_has_its_entries_row_by_row(field):
    matrix = field.matrix(2, 3, [1, 2, 3, 4, 5, 6])
    assert [[entry == i * 3 + j + 1 for j, entry in enumerate(row)] for i, row in enumerate(matrix.tolist())] == [
        [True] * 3
    ] * 2


@over_all_fields
def test_the_identity_changes_no_column(field):
    column = field.column([1, 2, 3])
    assert (field.identity(3) * column).entries() == column.entries()


@over_exact_fields
def test_a_matrix_of_rationals_is_carried_over_entry_by_entry(field):
    matrix = fmpq_mat(2, 2, [fmpq(1, 3), fmpq(-5), fmpq(0), fmpq(2, 5)])
    expected = [field.convert(entry) for entry in matrix.entries()]
    assert list(field.convert_matrix(matrix).entries()) == expected


def test_a_matrix_of_balls_keeps_the_precision_of_the_field():
    entry = RR(300).convert_matrix(fmpq_mat(1, 1, [fmpq(1, 3)]))[0, 0]
    assert entry.rel_accuracy_bits() >= 298


@over_all_fields
def test_a_matrix_refuses_a_machine_number(field):
    with pytest.raises(InexactNumber):
        field.matrix(1, 1, [0.5])


@pytest.mark.parametrize(("field", "name"), [(QQ, "QQ"), (GF(7), "GF(7)"), (RR(128), "RR(128)")], ids=repr)
def test_a_field_prints_as_it_is_written(field, name):
    assert repr(field) == name
