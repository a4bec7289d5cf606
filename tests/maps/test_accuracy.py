"""Automatic precision of balls: every point that is shown is as accurate as asked for, or the orbit ended otherwise.

A first version took the first precision at which a point was NOT accurate enough; the cases here are those that showed
it: members with nearly equal eigenvalues, generic stepping, far iterates.
"""

import pytest
from flint import fmpq

from kahanmaps.algebra.fields import RR
from kahanmaps.family.random_members import random_member_with_eigenvalues
from kahanmaps.family.system_normal_form import system_normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits.iteration import Orbit
from kahanmaps.maps.orbits.orbit import NotAccurate, bits_for
from kahanmaps.systems.quadratic import QuadraticSystem

TOP = QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"])
NEAR = random_member_with_eigenvalues([1, fmpq(10001, 10000), fmpq(10002, 10000)], seed=23)
START = [fmpq(0), fmpq(3, 29), fmpq(2, 27), fmpq(-3, 29), fmpq(3, 26), fmpq(-1, 23)]


def worst(x) -> float:
    """The largest radius over the largest coordinate."""
    return max(float(entry.rad()) for entry in x) / max(abs(float(entry.mid())) for entry in x)


@pytest.mark.parametrize("digits", [15, 40])
@pytest.mark.parametrize("steps", [10, 100, 300])
def test_stepping_is_as_accurate_as_asked_for(steps, digits):
    def orbit_with(bits):
        return Orbit(KahanMap(TOP, "1/10", RR(bits)), [1, 2, 3], steps)

    orbit = orbit_with(bits_for(orbit_with, digits))
    assert all(worst(point.x) <= 10.0**-digits for point in orbit)
    assert orbit.end.status == "completed"


@pytest.mark.parametrize("at", [[1000], [10, 100, 1000, 10000, 100000]])
@pytest.mark.parametrize("digits", [15, 60])
def test_jumps_are_as_accurate_as_asked_for(at, digits):
    system = NEAR.chosen.system
    normal_form = system_normal_form(system, member=NEAR)

    def orbit_with(bits):
        return Orbit(KahanMap(system, "1/20", RR(bits)), START, at=at, normal_form=normal_form)

    orbit = orbit_with(bits_for(orbit_with, digits))
    assert all(worst(point.x) <= 10.0**-digits for point in orbit)
    assert (orbit.end.status, orbit.end.steps) == ("completed", at[-1])


def test_where_no_precision_is_enough_that_is_said():
    # 1/4, 1/3, 1/2, 1, and then a pole, which no ball can tell from a point near it
    riccati = QuadraticSystem.from_text(["x"], ["x^2"])

    def orbit_with(bits):
        return Orbit(KahanMap(riccati, "1/2", RR(bits)), ["1/4"], 9)

    with pytest.raises(NotAccurate, match="give 15 digits"):
        bits_for(orbit_with, 15)
