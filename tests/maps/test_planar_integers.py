"""A plane in homogeneous coordinates, and over Q in integers.

Specified here: the image is the Kahan map of u' = h_v, v' = -h_u for 2 eps (u, v) = (U/W, V/W), whatever eps is; the
level is conserved; over Q start and cubic are primitive.
"""

import pytest
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


@pytest.mark.parametrize(("ours", "theirs"), [("image", "step"), ("preimage", "inverse_step")])
@given(cubic=points(4, rationals(6)), point=points(2), eps=rationals().filter(bool))
def test_image_and_preimage_are_those_of_the_kahan_map_of_the_plane(ours, theirs, cubic, point, eps):
    U, V, W = getattr(PlanarBlock(*cubic), ours)((2 * eps * point[0], 2 * eps * point[1], fmpq(1)))
    try:
        expected = getattr(KahanMap(planar_system(cubic), eps), theirs)(point)
    except SingularStep:
        expected = None
    assert (None if W == 0 else (U / W / (2 * eps), V / W / (2 * eps))) == expected


@given(cubic=cubics, point=triples)
def test_the_level_is_conserved(cubic, point):
    block = PlanarBlock(*cubic)
    (above, below), (h, denominator) = block.level(point), block.level(block.image(point))
    assert above * denominator == h * below
