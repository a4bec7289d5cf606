"""A plane over Q in integers, with the common factor known beforehand.

Specified here: the points are those that plain gcds give, for every kind of cubic and of start, each primitive, and the
orbit ends before a pole; away from the bad primes the content of an image is the W of the point before the last; with a
wrong W, or with the bad primes forgotten, this fails; a division with a remainder raises.
"""

from __future__ import annotations

import random
from itertools import islice, pairwise
from math import gcd, prod

import pytest
from flint import fmpq, fmpz
from helpers import points, quick, rationals
from hypothesis import assume, given
from hypothesis import strategies as st
from planar_helpers import (
    STARTS,
    as_integers,
    before,
    by_gcds,
    integer_block,
    over_starts,
    planar_system,
    random_blocks,
    reduced,
)

from kahanmaps.errors import SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form import planar_integers
from kahanmaps.maps.normal_form.planar_integers import (
    IntegerBlock,
    bad_part,
    content,
    divide_exactly,
    primitive,
    radical,
    strip,
    without,
)

GENERAL = integer_block(*STARTS["three real roots, irrational"])


def walked(block: IntegerBlock, steps: int) -> list[tuple[int, int, int]]:
    """The block's own points, up to the sign of a triple."""
    return [reduced(triple) for triple in islice(block.triples(), steps + 1)]


# Scaling.


@given(cubic=points(4, rationals(6)), point=points(2), eps=rationals().filter(bool))
def test_the_scaled_plane_steps_like_the_kahan_map(cubic, point, eps):
    block = IntegerBlock(cubic, eps, *point)
    U, V, W = block.block.image(block.start)
    try:
        expected = KahanMap(planar_system(cubic), eps).step(point)
    except SingularStep:
        expected = None
    assert (None if W == 0 else (fmpq(U, W) / block.scale, fmpq(V, W) / block.scale)) == expected


@given(cubic=points(4, rationals(6)), point=points(2, rationals(10**30)), eps=rationals(10**9).filter(bool))
def test_the_start_and_the_cubic_are_integers_without_a_common_factor(cubic, point, eps):
    block = IntegerBlock(cubic, eps, *point)
    U, V, W = block.start
    assert (fmpq(U, W), fmpq(V, W)) == tuple(block.scale * entry for entry in point)
    assert gcd(*map(int, block.start)) == 1
    h = block.block
    assert gcd(*map(int, (h.a, h.b, h.c, h.d))) == (0 if block.block.is_zero else 1)


@pytest.mark.parametrize(("cubic", "start"), [STARTS["h = 0"], STARTS["the origin"]], ids=["h = 0", "the origin"])
def test_a_constant_orbit_never_ends(cubic, start):
    block = integer_block(cubic, start)
    assert block.is_constant
    assert set(walked(block, 20)) == {reduced(start)}


@pytest.mark.parametrize(
    ("name", "degenerate"),
    [("one real root, irrational", False), ("a double root", True), ("level 0", True), ("delta = 1", True)],
)
def test_a_plane_is_degenerate_where_its_level_cubic_is_singular(name, degenerate):
    assert integer_block(*STARTS[name]).is_degenerate == degenerate


@over_starts
def test_the_level_is_that_of_every_point(cubic, start):
    block = integer_block(cubic, start)
    for point in by_gcds(block, 5)[:-1]:
        above, below = block.block.level(point)
        assert below == 0 if block.level is None else fmpq(above, below) == block.level


# Points.


@over_starts
def test_the_points_are_those_of_plain_gcds(cubic, start):
    block = integer_block(cubic, start)
    assert walked(block, 14) == by_gcds(block, 14)


@pytest.mark.parametrize("seed", quick(range(3), [0]))
def test_the_points_of_random_planes_are_those_of_plain_gcds(seed):
    for block in random_blocks(seed, 440):
        assert walked(block, 8) == by_gcds(block, 8)


small = st.integers(-4, 4)


@given(
    cubic=st.tuples(small, small, small, small),
    start=st.tuples(small, small, st.integers(1, 9)),
)
def test_the_points_of_any_small_plane_are_those_of_plain_gcds(cubic, start):
    block = integer_block(cubic, start)
    assert walked(block, 7) == by_gcds(block, 7)


@given(cubic=points(4, rationals(10**6)), point=points(2, rationals(10**50)), eps=rationals(10**12).filter(bool))
def test_the_points_of_planes_with_long_numbers_are_those_of_plain_gcds(cubic, point, eps):
    block = IntegerBlock(cubic, eps, *point)
    assert walked(block, 5) == by_gcds(block, 5)


@over_starts
def test_every_triple_is_primitive(cubic, start):
    assert all(gcd(*map(int, triple)) == 1 for triple in islice(integer_block(cubic, start).triples(), 15))


@pytest.mark.parametrize("steps", [0, 1, 5, 12])
@pytest.mark.parametrize(
    ("name", "last"), [("a pole at step 2", 1), ("a pole at step 5", 4), ("delta = 1, a pole at step 3", 2)]
)
def test_an_orbit_ends_before_its_pole(name, last, steps):
    cubic, start = STARTS[name]
    assert len(walked(integer_block(cubic, before(cubic, start, steps)), 30)) == last + steps + 1


def test_an_orbit_goes_on_from_any_point_of_it_and_the_one_before():
    first, second, *rest = islice(GENERAL.triples(), 8)
    assert [reduced(P) for P in islice(GENERAL.triples_from(second, first), 7)] == [*map(reduced, (second, *rest))]


# The rule.


@pytest.mark.parametrize("seed", range(3))
def test_the_content_of_an_image_is_the_w_of_the_point_before_but_for_bad_primes(seed):
    seen = 0
    for block in random_blocks(f"rule {seed}", 220):
        if block.is_constant or block.level is None or block.block.discriminant == 0:
            continue
        orbit = by_gcds(block, 6)
        for P, Q in pairwise(orbit):
            common = fmpz(gcd(*map(int, block.block.image(as_integers(Q)))))
            if common != 0:
                assert without(common, block.bad) == without(fmpz(P[2]), block.bad)
                seen += 1
    assert seen > 300


def test_that_content_is_not_the_w_of_any_other_point():
    # Negative control: W_k of the point itself, or W_{k-2}, is coprime to the content and does not divide.
    orbit = list(islice(GENERAL.triples(), 10))
    raw = GENERAL.block.image(orbit[8])
    assert divide_exactly(raw, without(orbit[7][2], GENERAL.bad))
    for k in (5, 6, 8):
        with pytest.raises(ArithmeticError):
            divide_exactly(raw, without(orbit[k][2], GENERAL.bad))


def test_a_wrong_point_before_is_noticed():
    orbit = list(islice(GENERAL.triples(), 6))
    with pytest.raises(ArithmeticError, match="left a remainder"):
        list(islice(GENERAL.triples_from(orbit[4], orbit[2]), 3))


@pytest.mark.parametrize("name", ["three real roots, irrational", "one real root, irrational", "large coefficients"])
def test_without_the_bad_primes_triples_are_not_primitive(name, monkeypatch):
    monkeypatch.setattr(planar_integers, "strip", lambda triple, bad: tuple(triple))
    block = integer_block(*STARTS[name])
    assert any(gcd(*map(int, triple)) > 1 for triple in islice(block.triples(), 12))


def test_the_bad_primes_are_those_of_6_disc_and_the_denominator_of_the_level():
    for block in random_blocks("bad", 200):
        if block.is_constant or block.level is None or block.block.discriminant == 0:
            continue
        number = 6 * block.block.discriminant * block.level.q
        assert without(number, block.bad) in (1, -1)
        assert without(block.bad, number) == 1


# The parts.

factors = st.lists(st.sampled_from([2, 3, 5, 7, 97, 101, 2**61 - 1]), max_size=8)
long_integers = st.integers(-(10**40), 10**40)


@given(quotients=st.lists(long_integers, min_size=1, max_size=3), divisor=long_integers.filter(bool))
def test_exact_division_undoes_multiplication(quotients, divisor):
    products = [fmpz(quotient * divisor) for quotient in quotients]
    assert divide_exactly(products, fmpz(divisor)) == quotients


@given(
    quotient=long_integers,
    divisor=st.integers(2, 2**60),
    remainder=st.integers(1, 2**60),
    sign=st.sampled_from([1, -1]),
)
def test_a_division_that_is_not_exact_raises(quotient, divisor, remainder, sign):
    assume(remainder % divisor != 0)
    with pytest.raises(ArithmeticError, match="please report"):
        divide_exactly([fmpz(divisor), fmpz(quotient * divisor + remainder)], fmpz(sign * divisor))


@given(triple=st.tuples(long_integers, long_integers, long_integers).filter(any), factor=st.integers(1, 10**20))
def test_a_primitive_triple_is_the_triple_over_its_gcd(triple, factor):
    scaled = as_integers([factor * entry for entry in triple])
    common = gcd(*map(int, scaled))
    assert content(scaled) == common
    assert primitive(scaled) == tuple(int(entry) // common for entry in scaled)


@given(good=factors, bad=factors.filter(bool))
def test_without_bad_primes_the_coprime_part_is_left(good, bad):
    number, product = fmpz(prod(good)), fmpz(prod(bad))
    assert without(number, product) == prod(p for p in good if p not in bad)
    assert bad_part(number, product) == (prod(p for p in good if p not in bad), prod(p for p in good if p in bad))


def test_zero_has_no_bad_part():
    assert bad_part(fmpz(0), fmpz(6)) == (0, 1)


@given(common=factors, bad=factors.filter(bool), triple=st.tuples(small, small, small).filter(any))
def test_stripping_removes_common_factors_of_bad_primes_alone(common, bad, triple):
    product = fmpz(prod(set(bad)))
    found = strip(as_integers([prod(common) * entry for entry in triple]), product)
    assert gcd(gcd(*map(int, found)), int(product)) == 1
    left = prod(p for p in common if p not in bad)
    assert reduced(found) == reduced(triple)
    assert without(content(found), product) == without(fmpz(left * gcd(*triple)), product)


@given(numbers=st.lists(factors.map(prod), min_size=1, max_size=3), sign=st.sampled_from([1, -1]))
def test_a_radical_has_the_primes_of_its_numbers_and_no_others(numbers, sign):
    found, product = radical(*(fmpz(sign * number) for number in numbers)), fmpz(prod(numbers))
    assert found > 0
    assert without(product, found) == 1
    assert without(found, product) == 1


@pytest.mark.parametrize(("number", "expected"), [(1, 1), (2**50, 2), (2**9 * 3, 6), ((2**61 - 1) ** 3, 2**61 - 1)])
def test_a_radical_is_short(number, expected):
    assert radical(fmpz(number)) == expected


def test_a_start_after_its_pole_is_stepped_like_any_other():
    # The root (1, 0) of h: P_{-2} is the pole (1 : 0 : 0) and P_{-1} = (-1 : 0 : b), both on every level.
    _, b, c, d = STARTS["a pole at step 2"][0]
    rng = random.Random(1)
    for _ in range(20):
        U, V = rng.randint(1, 9), rng.randint(1, 9)
        block = integer_block((0, b, c, d), (U, V, -(2 * b * U + c * V)))
        assert reduced(block.block.preimage(block.start)) in [(1, 0, -b), (-1, 0, b)]
        assert walked(block, 8) == by_gcds(block, 8)
