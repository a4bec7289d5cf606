"""Levels with a period: division polynomials against orders of points, walked orbits, and Mazur's theorem."""

from __future__ import annotations

import pytest
from flint import fmpq, nmod

from kahanmaps.errors import InputError
from kahanmaps.maps.normal_form.division import PeriodicLevels, division_polynomials
from kahanmaps.maps.normal_form.level_curves import translation_order
from kahanmaps.maps.normal_form.periods import plane_period_over_rationals, torsion_order
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, same_point

RATIONAL = {5: fmpq(32, 27), 6: fmpq(28, 27), 9: fmpq(8, 9), 12: fmpq(80, 81)}


@pytest.mark.parametrize("period", range(1, 31))
def test_the_rational_levels_are_those_of_periods_5_6_9_and_12(period):
    assert PeriodicLevels(period).gammas == ((RATIONAL[period],) if period in RATIONAL else ())


@pytest.mark.parametrize("period", RATIONAL)
def test_the_order_of_the_translation_there_is_the_period(period):
    assert torsion_order(RATIONAL[period])[0] == period


def test_psi_vanishes_modulo_a_prime_where_the_order_divides_the_index_and_only_there():
    prime = 61
    table = division_polynomials(20)
    for value in range(2, prime):
        gamma = nmod(value, prime)
        order = translation_order(gamma, prime)
        for n in range(1, 21):
            found = sum((int(c) * gamma**k for k, c in enumerate(table[n].coeffs())), nmod(0, prime))
            assert (found == 0) is (n % order == 0)


def test_an_orbit_on_a_level_of_period_5_comes_back_and_one_beside_it_does_not():
    block, eps = PlanarBlock(*(fmpq(c) for c in (0, 2, -1, 2))), fmpq(1, 2)
    point = (fmpq(-1, 3), fmpq(-1, 3), fmpq(1))  # with 2 eps = 1
    above, below = block.level(point)
    assert PeriodicLevels(5).squares(block.discriminant, eps) == ((above / below) ** 2,)
    image = point
    for _ in range(5):
        image = block.image(image)
    assert same_point(image, point)
    assert plane_period_over_rationals(block, (fmpq(-1, 3), fmpq(1, 3), fmpq(1))).status == "aperiodic"


@pytest.mark.parametrize("period", [0, -1, 61])
def test_periods_out_of_range_are_refused(period):
    with pytest.raises(InputError, match="expected 1 to 60"):
        PeriodicLevels(period)


def test_a_plane_without_smooth_levels_is_refused():
    with pytest.raises(InputError, match="smooth levels"):
        PeriodicLevels(5).squares(fmpq(0), fmpq(1))
