"""One plane of the normal form in homogeneous coordinates.

Specified here: the image is the Kahan map of u' = h_v, v' = -h_u for 2 eps (u, v) = (U/W, V/W), whatever eps is; the
preimage is its inverse; the level is conserved, and D and disc(h) are what they are called; three points of an orbit
are on a line or not according to the sum of their indices alone.
"""

from __future__ import annotations

import random

import pytest
from flint import fmpq, fmpz
from helpers import over_exact_fields, points, rationals
from hypothesis import assume, given
from hypothesis import strategies as st
from planar_helpers import STARTS, by_gcds, image, integer_block, over_starts, planar_system, preimage, reduced

from kahanmaps.errors import SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, determinant, same_point

small = st.integers(-6, 6)
cubics = st.tuples(small, small, small, small)
triples = st.tuples(small, small, small)


def scaled_to(eps: fmpq, u: fmpq, v: fmpq) -> tuple[fmpq, fmpq, fmpq]:
    return 2 * eps * u, 2 * eps * v, fmpq(1)


@given(cubic=points(4, rationals(6)), point=points(2), eps=rationals().filter(bool))
def test_the_image_is_the_kahan_map_of_the_plane(cubic, point, eps):
    U, V, W = PlanarBlock(*cubic).image(scaled_to(eps, *point))
    try:
        expected = KahanMap(planar_system(cubic), eps).step(point)
    except SingularStep:
        expected = None
    assert (None if W == 0 else (U / W / (2 * eps), V / W / (2 * eps))) == expected


@given(cubic=points(4, rationals(6)), point=points(2), eps=rationals().filter(bool))
def test_the_preimage_is_the_inverse_of_the_kahan_map(cubic, point, eps):
    U, V, W = PlanarBlock(*cubic).preimage(scaled_to(eps, *point))
    try:
        expected = KahanMap(planar_system(cubic), eps).inverse_step(point)
    except SingularStep:
        expected = None
    assert (None if W == 0 else (U / W / (2 * eps), V / W / (2 * eps))) == expected


@given(cubic=cubics, point=triples)
def test_on_integers_the_formulas_are_those_spelled_out(cubic, point):
    block = PlanarBlock(*cubic)
    assert block.image(point) == image(cubic, point)
    assert block.preimage(point) == preimage(cubic, point)


@given(cubic=cubics, point=triples)
def test_the_preimage_of_the_image_is_the_point(cubic, point):
    block = PlanarBlock(*cubic)
    back = block.preimage(block.image(point))
    assume(any(back))
    assert same_point(back, point)


@given(cubic=cubics, point=triples)
def test_another_lift_has_the_same_image_with_the_square_of_the_factor(cubic, point):
    block = PlanarBlock(*cubic)
    assert block.image([-3 * entry for entry in point]) == tuple(9 * entry for entry in block.image(point))


@given(cubic=cubics, point=triples)
def test_the_level_is_conserved(cubic, point):
    block = PlanarBlock(*cubic)
    (above, below), (h, denominator) = block.level(point), block.level(block.image(point))
    assert above * denominator == h * below


@over_exact_fields
def test_over_every_field_the_image_is_that_of_the_integers(field):
    rng = random.Random(3)
    for _ in range(50):
        cubic, point = [rng.randint(-9, 9) for _ in range(4)], [rng.randint(-9, 9) for _ in range(3)]
        block = PlanarBlock(*(field.convert(entry) for entry in cubic))
        assert block.image([field.convert(entry) for entry in point]) == tuple(
            field.convert(entry) for entry in image(cubic, point)
        )


@given(cubic=cubics, U=small, V=small)
def test_h_is_the_cubic(cubic, U, V):
    a, b, c, d = cubic
    assert PlanarBlock(*cubic).h(U, V) == a * U**3 + b * U**2 * V + c * U * V**2 + d * V**3


@given(r=st.tuples(small, small), s=st.tuples(small, small), t=st.tuples(small, small))
def test_the_discriminant_is_the_product_of_the_squared_differences_of_roots(r, s, t):
    # h = (r1 U + r2 V)(s1 U + s2 V)(t1 U + t2 V)
    cubic = (
        r[0] * s[0] * t[0],
        r[0] * s[0] * t[1] + r[0] * s[1] * t[0] + r[1] * s[0] * t[0],
        r[0] * s[1] * t[1] + r[1] * s[0] * t[1] + r[1] * s[1] * t[0],
        r[1] * s[1] * t[1],
    )
    differences = [p[0] * q[1] - p[1] * q[0] for p, q in ((r, s), (s, t), (t, r))]
    assert PlanarBlock(*cubic).discriminant == (differences[0] * differences[1] * differences[2]) ** 2


def test_only_the_cubic_zero_is_zero():
    assert PlanarBlock(0, 0, 0, 0).is_zero
    assert not any(PlanarBlock(*(int(i == k) for i in range(4))).is_zero for k in range(4))


def test_the_origin_is_fixed_and_h_zero_gives_the_identity():
    assert PlanarBlock(1, 2, 3, 4).image((0, 0, 5)) == (0, 0, 25)
    assert same_point(PlanarBlock(0, 0, 0, 0).image((1, 2, 3)), (1, 2, 3))


@given(b=small.filter(bool), c=small, d=small, U=small, V=small)
def test_a_line_is_contracted_to_the_point_before_a_pole(b, c, d, U, V):
    # The root (1, 0) of h: the line W = 2 b U + c V goes to (1 : 0 : b), that to the pole (1 : 0 : 0).
    block = PlanarBlock(0, b, c, d)
    found = block.image((U, V, 2 * b * U + c * V))
    assert same_point(found, (1, 0, b))
    assert same_point(block.image((1, 0, b)), (1, 0, 0))
    assert block.image(block.image((1, 0, 0))) == (0, 0, 0)


GENERAL = [name for name, (cubic, start) in STARTS.items() if not integer_block(cubic, start).is_constant][:16]


@pytest.mark.parametrize("name", GENERAL)
def test_three_points_are_on_a_line_according_to_the_sum_of_their_indices(name):
    orbit = [fmpz_triple(P) for P in by_gcds(integer_block(*STARTS[name]), 9)]
    on_a_line: dict[int, set[bool]] = {}
    for i in range(10):
        for j in range(i):
            for k in range(j):
                on_a_line.setdefault(i + j + k, set()).add(determinant(orbit[i], orbit[j], orbit[k]) == 0)
    assert all(len(answers) == 1 for answers in on_a_line.values())
    n = {"chi_3": 3, "chi_4": 4, "chi_5": 5, "chi_6": 6, "chi_7": 7, "chi_9": 9}.get(name.split(" ")[0])
    assert [k for k, answers in on_a_line.items() if True in answers] == ([] if n is None else [n])


def fmpz_triple(triple):
    return tuple(fmpz(entry) for entry in triple)


@over_starts
def test_the_start_of_a_named_case_is_reduced(cubic, start):
    assert reduced(integer_block(cubic, start).start) == reduced(start)


@given(P=triples.filter(any), factor=small.filter(bool))
def test_proportional_triples_are_the_same_point(P, factor):
    assert same_point(P, [factor * entry for entry in P])


@pytest.mark.parametrize("Q", [(1, 2, 4), (1, 1, 3), (2, 2, 3), (0, 0, 1)])
def test_other_triples_are_another_point(Q):
    assert not same_point((1, 2, 3), Q)


def test_points_are_compared_modulo_a_number_if_it_is_given():
    assert same_point((1, 2, 3), (8, 9, 10), 7)
    assert not same_point((1, 2, 3), (8, 9, 10))
    assert not same_point((1, 2, 3), (8, 9, 11), 7)


@given(P=triples, Q=triples, R=triples)
def test_the_determinant_is_alternating_and_zero_for_dependent_points(P, Q, R):
    assert determinant(P, Q, R) == -determinant(Q, P, R) == -determinant(P, R, Q)
    assert determinant(P, Q, [2 * a - 3 * b for a, b in zip(P, Q, strict=True)]) == 0


def test_the_determinant_of_the_unit_points_is_one():
    assert determinant((1, 0, 0), (0, 1, 0), (0, 0, 1)) == 1
