"""Where the tau functions of an orbit in a plane start.

Specified here: the base point is the first of three around which no value is zero that is divided by; near a pole there
is none. What psi and chi are is tested with the table that continues them.
"""

from __future__ import annotations

import pytest
from flint import fmpq, fmpz
from planar_helpers import STARTS, integer_block

from kahanmaps.maps.normal_form import tau


@pytest.mark.parametrize(
    ("name", "base"),
    [
        ("one real root, irrational", 0),
        ("P_{-1}, P_0, P_1 on a line", 1),
        ("chi_1 = 0", 2),
        ("chi_2 = 0", 2),
        ("chi_{-2} = 0", 1),
        ("chi_3 = 0, P_1 a flex", 0),
    ],
)
def test_the_base_point_is_the_first_around_which_no_value_is_zero(name, base):
    # From base b the zero of chi at n is at n - 3b.
    assert tau.start_near(integer_block(*STARTS[name])).base == base


@pytest.mark.parametrize("name", ["a pole at step 2", "a pole at step 3", "period 5 but for a pole"])
def test_near_a_pole_there_is_no_base_point(name):
    assert tau.start_near(integer_block(*STARTS[name])) is None


def test_a_window_knows_its_indices():
    window = tau.Window(-1, [fmpz(n) for n in (5, 6, 7, 8)], [fmpq(1), fmpq(2), fmpq(3), fmpq(5)])
    assert (window[-1], window[2], window.scale(1), window.t(0), window.t(1)) == (5, 8, 3, fmpq(3, 4), fmpq(10, 9))
