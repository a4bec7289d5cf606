"""kahanmaps heights: orbits from several starts and for two eps, their agreement, and their disagreement."""

import time

import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.invariants.growth import Growth
from kahanmaps.invariants.heights import height_growth
from kahanmaps.laboratory.growth.height_survey import height_survey


def test_eps_that_disagree_are_told(monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.growth.height_survey.DEFAULT_EPS", (1, 2))
    from kahanmaps.systems.quadratic import QuadraticSystem

    found = height_survey(QuadraticSystem.from_text(["q", "p"], ["p", "2*q^2 - q"]), starts=2, steps=40)
    assert (found.kind, found.kinds) == (Growth.UNDECIDED, (Growth.PERIODIC, Growth.QUADRATIC))
    assert found.text == "heights of exact orbits are undecided: the eps disagree (2 periodic, 2 quadratic)"


def test_no_orbit_is_begun_after_the_time(monkeypatch):
    def slow(*arguments, **options):
        time.sleep(0.02)
        return height_growth(*arguments, **{**options, "deadline": None})

    monkeypatch.setattr("kahanmaps.laboratory.growth.height_survey.height_growth", slow)
    survey = height_survey(load("weierstrass").system, starts=3, steps=4, seconds=0.01)
    assert (len(survey.orbits), survey.is_whole) == (1, False)


def test_wrong_values_in_the_library():
    system = load("weierstrass").system
    for options in ({"starts": 0}, {"starts": []}, {"seconds": 0}):
        with pytest.raises(InputError):
            height_survey(system, **options)


def test_random_starts_have_prime_numerators_and_lie_on_both_sides_of_0():
    """A coordinate is then no simple multiple of 1/eps, where many maps have invariant curves."""
    survey = height_survey(load("euler_top").system, starts=6, steps=2)
    coordinates = [x for orbit in survey.orbits for x in orbit.start]
    assert all(abs(x.p).is_prime() and abs(x.p) >= 13 for x in coordinates)
    assert {x > 0 for x in coordinates} == {True, False}
