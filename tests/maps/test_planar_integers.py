"""A plane in homogeneous coordinates, and over Q in integers.

Specified here: the image is the Kahan map of u' = h_v, v' = -h_u for 2 eps (u, v) = (U/W, V/W), whatever eps is; the
level is conserved; over Q start and cubic are primitive.
"""

from math import gcd

from flint import fmpq
from helpers import points, rationals
from hypothesis import given
from hypothesis import strategies as st
from planar_helpers import by_gcds, integer_block, over_starts, planar_system

from kahanmaps.errors import SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form.planar_block import PlanarBlock
from kahanmaps.maps.normal_form.planar_integers import IntegerBlock


@given(cubic=points(4, rationals(6)), point=points(2, rationals(10**30)), eps=rationals(10**9).filter(bool))
def test_the_start_and_the_cubic_are_integers_without_a_common_factor(cubic, point, eps):
    block = IntegerBlock(cubic, eps, *point)
    U, V, W = block.start
    assert (fmpq(U, W), fmpq(V, W)) == tuple(block.scale * entry for entry in point)
    assert gcd(*map(int, block.start)) == 1
    h = block.block
    assert gcd(*map(int, (h.a, h.b, h.c, h.d))) == (0 if block.block.is_zero else 1)


@over_starts
def test_the_level_is_that_of_every_point(cubic, start):
    block = integer_block(cubic, start)
    for point in by_gcds(block, 5)[:-1]:
        above, below = block.block.level(point)
        assert below == 0 if block.level is None else fmpq(above, below) == block.level


# The plane itself, over any numbers.


small = st.integers(-4, 4)
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
def test_the_level_is_conserved(cubic, point):
    block = PlanarBlock(*cubic)
    (above, below), (h, denominator) = block.level(point), block.level(block.image(point))
    assert above * denominator == h * below


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
