"""Steps by bilinear forms along an orbit, against single steps by linear systems.

Specified here: every point is the one that single steps give, in lowest terms as well; forms are found where orbits lie
on elliptic curves and Abelian surfaces, and nowhere else; forms that are wrong cost time and nothing else.
"""

from math import prod

import pytest
from flint import fmpq, fmpz
from planar_helpers import begin, over, single_steps, walked

import kahanmaps.maps.orbits.relations.bilinear_steps as bilinear
import kahanmaps.maps.orbits.relations.elliptic_orbit as elliptic
import kahanmaps.maps.orbits.relations.rational_orbit as rational_orbit
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.orbits.integer_point import IntegerPoint


@pytest.fixture(autouse=True)
def early(monkeypatch):
    """Forms are searched for as soon as numbers grow slowly enough, and orbits here need not be long."""
    monkeypatch.setattr(rational_orbit, "_MIN_BITS", 20)
    monkeypatch.setattr(rational_orbit, "_MIN_BITS_BY_COORDINATES", 20)
    monkeypatch.setattr(rational_orbit, "_LONGER_THAN_START", 0)


@pytest.fixture
def no_curves(monkeypatch):
    """Nor are there curves."""
    monkeypatch.setattr(elliptic, "elliptic_steps", lambda *_: None)


@pytest.mark.parametrize(
    ("name", "steps", "lag"),
    [
        ("euler_top", 40, 1),
        ("volterra_periodic_4", 30, 1),  # in a hyperplane
        ("weierstrass", 60, 1),
        ("discrete_painleve_1", 60, 1),
        ("lagrange_top", 18, 1),
        ("three_wave", 18, 1),
        ("clebsch_first_flow", 16, 2),  # Abelian surfaces, one section more than coordinates
    ],
)
def test_points_are_those_of_single_steps_in_lowest_terms(name, steps, lag, no_curves):
    map_over = over(name)
    expected = single_steps(map_over, begin(map_over), steps)
    points, orbit = walked(map_over, expected[0], steps)
    assert points == expected
    assert orbit.since is not None
    assert orbit.since < steps
    forms = bilinear.bilinear_forms(map_over, points[-1])
    assert forms is not None
    assert forms.lag == lag
    assert [forms.step(expected[k - 3 : k], k) for k in range(3, steps + 1)] == expected[3:]  # of the whole orbit


@pytest.mark.parametrize("name", ["lorenz", "henon_heiles", "kirchhoff_generic", "hietarinta_viallet"])
def test_there_are_no_forms_where_there_is_no_abelian_variety(name):
    map_over = over(name)
    assert bilinear.bilinear_forms(map_over, begin(map_over)) is None


def test_wrong_forms_give_no_point_and_the_orbit_goes_on(monkeypatch, no_curves):
    map_over = over("euler_top")
    expected = single_steps(map_over, begin(map_over), 25)
    right = bilinear.bilinear_forms(map_over, expected[0])
    for k in range(4):
        changed = bilinear.bilinear_forms(map_over, expected[0])
        changed.coefficients[k, 0] += 1
        assert changed.step(expected[10:13], 13) is None
        assert right.step(expected[10:13], 13) == expected[13]
    monkeypatch.setattr(bilinear, "bilinear_forms", lambda *_: changed)
    assert walked(map_over, begin(map_over), 25)[0] == expected


def test_points_are_in_lowest_terms_also_where_an_orbit_leaves_a_curve_for_one_step():
    # z -> z / (1 + z) is 1/Z, 1/(Z + 1), ..., and y is 0 but where Z + k is none of the zeros of p.
    field = ring(["z", "y", "u", "eps"])
    z, y, u, _ = field.gens()
    entry, last, Z = field.constant(1), 32, fmpz(2) ** 360
    p = prod((1 - z * (Z + k) for k in range(last + 1) if k != last - 1), start=entry)
    images = [
        RationalFunction(z, 1 + z),
        RationalFunction(p + u, entry),
        RationalFunction(y * (1 - z * (Z + last)), entry),
    ]
    map_over = explicit_map(["z", "y", "u"], images).at(1)
    start = IntegerPoint.from_rationals((fmpq(1, Z), fmpq(0), fmpq(0)))
    points, orbit = walked(map_over, start, last + 3)
    assert points == single_steps(map_over, start, last + 3)
    assert orbit.since < last - 1
    assert any(point.numerators[1] for point in points)
