"""The fields of numbers: one protocol over QQ, GF(p), RR(bits) and CC(bits).

Specified here: what `convert` takes and what it refuses, that it respects sums and products, that text comes back,
which moduli and precisions are allowed, and what a ball may be said to be.
"""

from __future__ import annotations

import random
from fractions import Fraction

import flint
import numpy as np
import pytest
from flint import acb, arb, fmpq, fmpq_mat, fmpq_poly, fmpz, fmpz_mod, fmpz_mod_ctx, nmod
from helpers import (
    FIELDS,
    LARGEST_WORD_PRIME,
    SMALLEST_LARGE_PRIME,
    encloses,
    matrices,
    over_exact_fields,
    rationals,
    some,
)
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.bounds import BoundField
from kahanmaps.algebra.duals import DualField
from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import CC, GF, QQ, RR, PrimeField, rational
from kahanmaps.algebra.functions import FunctionField
from kahanmaps.algebra.matrices import nullspace, rank, solve
from kahanmaps.errors import BadPrime, ExpressionError, InexactNumber, InputError, PrecisionLost, SingularMatrix

over_all_fields = pytest.mark.parametrize("field", [*FIELDS, CC(128)], ids=repr)
over_balls = pytest.mark.parametrize("balls", [RR, CC], ids=["RR", "CC"])

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


MACHINE_NUMBERS = [0.1, -0.0, float("nan"), float("inf"), 1e300, 1j, np.float64(0.1), np.float32(0.5)]


@pytest.mark.parametrize("value", MACHINE_NUMBERS, ids=repr)
@over_all_fields
def test_a_machine_number_is_refused_by_every_field(field, value):
    with pytest.raises(InexactNumber, match="machine number"):
        field.convert(value)


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


@pytest.mark.parametrize("ball", [arb(1), acb(1)], ids=["arb", "acb"])
@over_exact_fields
def test_a_ball_is_refused_by_an_exact_field(field, ball):
    with pytest.raises(InputError, match=type(ball).__name__):
        field.convert(ball)


def test_a_complex_ball_is_refused_by_real_balls():
    with pytest.raises(InputError, match="acb"):
        RR(64).convert(acb(1))


def test_a_real_ball_is_a_complex_one_without_loss():
    with RR(500).working():
        third = arb(1) / 3
    assert CC(500).convert(third).real.rel_accuracy_bits() == third.rel_accuracy_bits()


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


COMPLEX = [  # text, real part, imaginary part
    ("1/2", "1/2", "0"),
    ("-3j", "0", "-3"),
    ("1 + 2j", "1", "2"),
    ("-1/2 - 3/4j", "-1/2", "-3/4"),
    (" [+/- 1] + [2 +/- 0.5]j ", "-1", "5/2"),
    ("[2 +/- 0.5] - [1 +/- 0.5]j", "3/2", "-3/2"),
    ("[2 +/- 0.5]j", "0", "3/2"),
]


@pytest.mark.parametrize(("text", "real", "imaginary"), COMPLEX)
def test_a_complex_ball_is_read_from_its_parts(text, real, imaginary):
    ball = CC(64).parse(text)
    assert encloses(ball.real, rational(real))
    assert encloses(ball.imag, rational(imaginary))
    assert not encloses(ball.imag, rational(imaginary) + 3)


@pytest.mark.parametrize("bits", [8, 53, 128, 1000])
@some
@given(real=rationals(10**20), imaginary=rationals(10**20))
def test_the_text_of_a_complex_ball_comes_back_as_a_ball_around_it(bits, real, imaginary):
    ball = acb(RR(bits).convert(real), RR(bits).convert(imaginary))
    assert CC(bits).parse(CC(bits).format(ball)).contains(ball)


@pytest.mark.parametrize(
    "text", ["j", "1 +j", "1 + j", "1j + 2", "(1 + 2j)", "[1 +/- x]j", "1 + 2i", "1 + 2 + 3j", "nanj"]
)
def test_a_complex_ball_that_is_not_spelled_out_is_refused(text):
    with pytest.raises(InputError):
        CC(64).parse(text)


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


@over_balls
@given(number=rationals(10**10))
def test_a_ball_contains_the_number_it_was_made_from(balls, number):
    assert encloses(acb(balls(64).convert(number)).real, number)


@over_balls
def test_a_ball_around_a_third_is_not_a_third_but_overlaps_it(balls):
    third = balls(64).convert("1/3")
    assert (third * 3 == 1) is False  # balls: `!=` means certainly different, which is not the opposite
    assert balls(64).equal(third * 3, balls(64).one)


@over_balls
def test_disjoint_balls_are_not_equal(balls):
    assert not balls(64).equal(balls(64).convert("1/3"), balls(64).convert("1/3") + arb(2) ** -50)


def test_complex_balls_are_disjoint_if_their_imaginary_parts_are():
    assert not CC(64).equal(CC(64).parse("1/3 + 1/3j"), CC(64).parse("1/3 - 1/3j"))


@over_balls
def test_the_ball_zero_is_zero_and_a_ball_around_one_is_not(balls):
    assert balls(64).is_zero(balls(64).zero)
    assert not balls(64).is_zero(balls(64).convert("1/3"))


def test_a_complex_ball_is_not_zero_if_one_part_is_not():
    assert not CC(64).is_zero(acb(0, arb(1) / 3))
    assert not CC(64).is_zero(acb(arb(0, 1), 1))


@over_balls
def test_a_ball_that_contains_zero_and_more_cannot_be_told_from_zero(balls):
    with pytest.raises(PrecisionLost, match="64 bits"):
        balls(64).is_zero(balls(64).convert("1/3") * 3 - 1)


@given(a=rationals(), b=rationals(), c=rationals(), d=rationals())
def test_products_and_quotients_of_complex_balls_enclose_those_of_the_numbers(a, b, c, d):
    assume((c, d) != (0, 0))
    with CC(64).working():
        z, w = acb(RR(64).convert(a), RR(64).convert(b)), acb(RR(64).convert(c), RR(64).convert(d))
        product, quotient = z * w, z / w
    size = c * c + d * d
    assert encloses(product.real, a * c - b * d)
    assert encloses(product.imag, a * d + b * c)
    assert encloses(quotient.real, (a * c + b * d) / size)
    assert encloses(quotient.imag, (b * c - a * d) / size)


def test_the_square_root_of_minus_two_encloses_i_times_that_of_two():
    with CC(64).working():
        root = CC(64).convert(-2).sqrt()
        assert CC(64).equal(root * root, CC(64).convert(-2))
    assert root.imag.rel_accuracy_bits() >= 60
    approximation = fmpq(1)
    for _ in range(6):  # Newton's iteration 1, 3/2, 17/12, 577/408, ...: within 1e-48 of the square root of 2
        approximation = (approximation + 2 / approximation) / 2
    assert encloses(root.real, fmpq(0))
    assert encloses(root.imag, approximation)
    assert not encloses(root.imag, fmpq(577, 408))


def test_complex_roots_of_a_polynomial_are_zeros_of_it():
    chi = fmpq_poly([1, -3, 0, 2, 1])
    with CC(200).working():
        for root, _ in chi.complex_roots():
            value = sum((CC(200).convert(c) * root**k for k, c in enumerate(chi.coeffs())), CC(200).zero)
            assert CC(200).equal(value, CC(200).zero)


@some
@given(matrix=matrices(3, 3), right=matrices(3, 2))
def test_a_complex_system_is_solved_as_the_rational_one_it_encloses(matrix, right):
    assume(matrix.det() != 0)
    field, unit = CC(256), CC(256).parse("1j")
    with field.working():
        solution = solve(field.convert_matrix(matrix) * unit, field.convert_matrix(right))  # the solution times 1/i
    for ball, number in zip(solution.entries(), matrix.solve(right).entries(), strict=True):
        assert encloses(ball.imag, -number)


@over_balls
def test_a_system_that_may_be_singular_asks_for_more_bits(balls):
    with balls(64).working(), pytest.raises(PrecisionLost, match="more bits"):
        solve(balls(64).matrix(2, 2, ["1/3", "1/7", "1/3", "1/7"]), balls(64).column([1, 1]))


@over_balls
def test_a_system_that_is_singular_for_certain_is_called_so(balls):
    with balls(64).working(), pytest.raises(SingularMatrix):
        solve(balls(64).matrix(2, 2, [1, 2, 2, 4]), balls(64).column([1, 2]))


def test_rank_and_null_space_of_a_complex_matrix_are_those_found_by_hand():
    i = CC(64).parse("1j")
    matrix = CC(64).matrix(2, 2, [1, i, 2 * i, -2])  # the second row is 2i times the first
    assert nullspace(CC(64), CC(64).matrix(1, 2, [1, i])) == [(-i, 1)]
    assert rank(CC(64), CC(64).matrix(2, 2, [1, i, i, 1])) == 2
    assert rank(CC(64), matrix) == 1


def test_balls_do_not_guess_the_rank_of_a_complex_matrix():
    with pytest.raises(PrecisionLost, match="rank"):
        rank(CC(64), CC(64).matrix(2, 2, ["1/3", "1/7", "1/3", "1/7"]))


@over_exact_fields
def test_over_an_exact_field_zero_is_told_from_one(field):
    assert (field.is_zero(field.zero), field.is_zero(field.one)) == (True, False)


@over_balls
def test_working_sets_the_precision_of_balls_for_the_block_only(balls):
    before = flint.ctx.prec
    with balls(777).working():
        assert flint.ctx.prec == 777
    assert flint.ctx.prec == before


def test_working_restores_the_precision_after_an_error():
    before = flint.ctx.prec
    with pytest.raises(ZeroDivisionError), RR(777).working():
        raise ZeroDivisionError
    assert flint.ctx.prec == before


@over_balls
def test_converting_uses_the_precision_of_the_field_whatever_the_ambient_one(balls):
    assert balls(500).convert("1/3").rel_accuracy_bits() >= 498


@pytest.mark.parametrize("bits", [1, 0, -5, 1_000_001, 64.0, True, "64", None], ids=repr)
@over_balls
def test_a_precision_out_of_range_is_refused_even_after_its_equal_was_accepted(balls, bits):
    balls(64)
    with pytest.raises(InputError, match="precision"):
        balls(bits)


@over_balls
def test_balls_of_the_same_precision_are_the_same_field_and_of_another_precision_are_not(balls):
    field, again = balls(64), type(balls(64))(64)
    assert (field == again, hash(field) == hash(again), field == balls(65)) == (True, True, False)


def test_real_and_complex_balls_of_the_same_precision_are_different_fields():
    assert RR(64) != CC(64)


# Random elements and matrices.


@over_all_fields
def test_random_elements_are_determined_by_the_seed(field):
    def draws(seed):
        rng = random.Random(seed)
        return [field.format(field.random(rng)) for _ in range(64)]

    assert draws(1) == draws(1)
    assert draws(1) != draws(2)


ALGEBRA = EtaleAlgebra(fmpq_poly([-2, 0, 1]))
FUNCTIONS = FunctionField(["x"])


@pytest.mark.parametrize("field", [QQ, RR(64), CC(64), ALGEBRA, FUNCTIONS, BoundField(), DualField(QQ)], ids=repr)
def test_only_fields_of_residues_have_a_characteristic(field):
    assert (field.characteristic, GF(7).characteristic, DualField(GF(7)).characteristic) == (0, 7, 7)


def test_random_rationals_reach_the_height_and_no_more():
    rng = random.Random(0)
    drawn = [QQ.random(rng, 5) for _ in range(200)]
    assert (min(x.p for x in drawn), max(x.p for x in drawn), max(x.q for x in drawn)) == (-5, 5, 5)


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


@over_balls
def test_a_matrix_of_balls_keeps_the_precision_of_the_field(balls):
    entry = balls(300).convert_matrix(fmpq_mat(1, 1, [fmpq(1, 3)]))[0, 0]
    assert entry.rel_accuracy_bits() >= 298


@over_all_fields
def test_a_matrix_refuses_a_machine_number(field):
    with pytest.raises(InexactNumber):
        field.matrix(1, 1, [0.5])
