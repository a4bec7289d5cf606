"""kahanmaps heights: orbits from several starts and for two eps, their agreement, and their disagreement."""

from __future__ import annotations

import time

import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.invariants.growth import Growth
from kahanmaps.invariants.heights import height_growth
from kahanmaps.laboratory.growth.height_survey import height_survey

OSCILLATOR = "--vars q,p --rhs p --rhs '2*q^2-q'"  # q'' = -q + 2 q^2; the fourth iterate at eps = 1 is the identity


@pytest.mark.parametrize(
    ("name", "kind"), [("weierstrass", "quadratically"), ("lorenz", "exponentially"), ("harmonic", "linearly")]
)
def test_the_kinds_of_growth(kahanmaps, name, kind):
    outcome = kahanmaps(f"heights {name} --starts 2 --steps 40 --max-digits 3000")
    assert (outcome.status, outcome.err) == (0, "")
    assert len(outcome.rows) == 5
    assert outcome.rows[-1] == [
        "heights",
        f"bit lengths grow {kind} on all 4 exact orbits tried, at 2 values of eps",
    ]
    assert outcome.out.startswith(f"# {name}, eps = 1/10 (time step 2 eps = 1/5), 3/11 (time step 2 eps = 6/11), exact")


def test_starts_that_disagree_are_told(kahanmaps):
    # the axis y = 0 is invariant, and on it Lotka-Volterra is linear
    outcome = kahanmaps("heights lotka_volterra --start 1,2 --start 3,0 --steps 40 --max-digits 3000")
    assert outcome.status == 3
    assert outcome.rows[-1][1] == "heights of exact orbits are undecided: the starts disagree (2 exponential, 2 linear)"


def test_a_special_eps_is_seen_as_such(kahanmaps):
    outcome = kahanmaps(f"heights {OSCILLATOR} --eps 1 --steps 40")
    assert (outcome.status, outcome.rows[-1][1]) == (
        0,
        "points come back on all 3 exact orbits tried, at 1 value of eps",
    )
    assert kahanmaps(f"heights {OSCILLATOR} --steps 40").rows[-1][1] == (
        "bit lengths grow quadratically on all 6 exact orbits tried, at 2 values of eps"
    )


def test_eps_that_disagree_are_told(monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.growth.height_survey.DEFAULT_EPS", (1, 2))
    from kahanmaps.systems.quadratic import QuadraticSystem

    found = height_survey(QuadraticSystem.from_text(["q", "p"], ["p", "2*q^2 - q"]), starts=2, steps=40)
    assert (found.kind, found.kinds) == (Growth.UNDECIDED, (Growth.PERIODIC, Growth.QUADRATIC))
    assert found.text == "heights of exact orbits are undecided: the eps disagree (2 periodic, 2 quadratic)"


def test_too_few_steps_decide_nothing(kahanmaps):
    outcome = kahanmaps("heights weierstrass --steps 4 --starts 1")
    assert (outcome.status, outcome.rows[-1][1]) == (3, "heights of exact orbits are undecided: 0 of 2 orbits decided")


def test_the_time_ends_it(kahanmaps):
    outcome = kahanmaps("heights weierstrass --steps 20 --seconds 0.0001")
    assert (outcome.status, len(outcome.rows)) == (3, 2)
    assert outcome.err == "stopped early: the time was over before all orbits were finished\n"


def test_no_orbit_is_begun_after_the_time(monkeypatch):
    def slow(*arguments, **options):
        time.sleep(0.02)
        return height_growth(*arguments, **{**options, "deadline": None})

    monkeypatch.setattr("kahanmaps.laboratory.growth.height_survey.height_growth", slow)
    survey = height_survey(load("weierstrass").system, starts=3, steps=4, seconds=0.01)
    assert (len(survey.orbits), survey.is_whole) == (1, False)


@pytest.mark.parametrize("steps", [10**26, 10**99], ids=["10^26", "10^99"])
def test_the_time_ends_an_orbit_whose_numbers_stay_short(kahanmaps, steps):
    outcome = kahanmaps(f"heights riccati --eps 1/10 --start 1 --steps {steps} --seconds 0.2")
    assert outcome.status == 3
    assert outcome.err == "stopped early: the time was over before all orbits were finished\n"
    assert "linear" in outcome.rows[-1][1]


def test_a_map_without_a_value_anywhere_is_no_error(kahanmaps):
    outcome = kahanmaps("heights --vars x --rhs x --eps 1")
    assert outcome.status == 3
    assert "det(I - eps f'(x)) = 0" in outcome.out


def test_wrong_values_in_the_library():
    system = load("weierstrass").system
    for options in ({"starts": 0}, {"starts": []}, {"seconds": 0}):
        with pytest.raises(InputError):
            height_survey(system, **options)


def test_starts_given_and_random_do_not_go_together(kahanmaps):
    outcome = kahanmaps("heights weierstrass --start 1,2 --starts 2")
    assert outcome.status == 2
    assert "not both" in outcome.err


def test_random_starts_have_prime_numerators_and_lie_on_both_sides_of_0():
    """A coordinate is then no simple multiple of 1/eps, where many maps have invariant curves."""
    survey = height_survey(load("euler_top").system, starts=6, steps=2)
    coordinates = [x for orbit in survey.orbits for x in orbit.start]
    assert all(abs(x.p).is_prime() and abs(x.p) >= 13 for x in coordinates)
    assert {x > 0 for x in coordinates} == {True, False}
