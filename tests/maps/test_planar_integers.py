"""A plane in homogeneous coordinates, and over Q in integers.

Specified here: the image is the Kahan map of u' = h_v, v' = -h_u for 2 eps (u, v) = (U/W, V/W), whatever eps is; the
level is conserved; over Q start and cubic are primitive.
"""

from flint import fmpq
from helpers import points, rationals
from hypothesis import given
from hypothesis import strategies as st
from planar_helpers import planar_system

from kahanmaps.errors import SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form.planar_block import PlanarBlock

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
