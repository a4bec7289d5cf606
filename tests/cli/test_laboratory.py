"""kahanmaps cycles, lyapunov, heights, period: what they print as text and JSON, exit statuses."""

import pytest
from cli_helpers import time_is_over
from helpers import refuses

from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.documents.catalog import load
from kahanmaps.invariants.growth import Growth
from kahanmaps.invariants.heights import height_growth
from kahanmaps.laboratory.cycles import _ProjectiveMap
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.systems.quadratic import QuadraticSystem


@pytest.mark.parametrize("form", ["", "--json"])
def test_what_seconds_stopped_says_so_and_nothing_is_begun_after_it(kahanmaps, monkeypatch, form):
    complete = _ProjectiveMap.images
    images = lambda space, X: (time_is_over if space.prime == 7 else complete)(space, X)  # noqa: E731
    monkeypatch.setattr(_ProjectiveMap, "images", images)
    outcome = kahanmaps(f"cycles weierstrass --prime 5 --prime 7 --prime 11 --seconds 1000 {form}")
    assert outcome.status == 3
    assert outcome.err.startswith("stopped after 1000 s (--seconds): p = 7")
    if form:
        assert [(run["prime"], run["stopped"]) for run in outcome.json["runs"]] == [(5, False), (5, False), (7, True)]
    else:
        assert (outcome.out.count("# p = "), outcome.out.count("time limit")) == (3, 1)


def test_numbers_are_printed_per_time_and_per_step(kahanmaps):
    outcome = kahanmaps("lyapunov riccati --eps 1/10 --steps 300 --random 4")
    assert outcome.status == 0
    assert outcome.rows[:2] == [["orbits", "4 of 4"], ["steps", "300 after 30"]]
    assert list(map(float, outcome.rows[2][1:3])) == pytest.approx([-2.2745, -2.2745 / 5], abs=1e-3)


def test_starts_from_a_file(kahanmaps, tmp_path):
    (tmp_path / "starts.csv").write_text("x,y\n1,0\n1/2,1/3\n")
    result = kahanmaps("lyapunov harmonic --eps 1/10 --steps 50 --json --starts", tmp_path / "starts.csv").json
    assert result["orbits"] == 2
    assert result["per_time"] == pytest.approx([0, 0], abs=1e-12)


def test_values_of_eps_that_disagree_are_reported(monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.growth.height_survey.DEFAULT_EPS", (1, 2))
    survey = height_survey(QuadraticSystem.from_text(["q", "p"], ["p", "2*q^2 - q"]), starts=2, steps=40)
    assert (survey.kind, survey.kinds) == (Growth.UNDECIDED, (Growth.PERIODIC, Growth.QUADRATIC))
    assert survey.text == "heights of exact orbits are undecided: the eps disagree (2 periodic, 2 quadratic)"


def test_no_orbit_is_begun_after_the_budget_is_spent(monkeypatch):
    def expensive(*arguments, **options):
        count_work(1e6)
        return height_growth(*arguments, **{**options, "budget": Budget()})

    monkeypatch.setattr("kahanmaps.laboratory.growth.height_survey.height_growth", expensive)
    survey = height_survey(load("weierstrass").system, starts=3, steps=4, effort=-6)
    assert (len(survey.orbits), survey.is_complete) == (1, False)


def test_wrong_values_in_the_library():
    for options in ({"starts": 0}, {"starts": []}, {"effort": 41}):
        refuses("found .*expected", height_survey, load("weierstrass").system, **options)


def test_random_starts_have_prime_numerators_and_lie_on_both_sides_of_0():
    """A coordinate is then no simple multiple of 1/eps, where many maps have invariant curves."""
    survey = height_survey(load("euler_top").system, starts=6, steps=2)
    coordinates = [x for orbit in survey.orbits for x in orbit.start]
    assert all(abs(x.p).is_prime() and abs(x.p) >= 13 for x in coordinates)
    assert {x > 0 for x in coordinates} == {True, False}


def test_recognised_members_have_periods(kahanmaps):
    # the right-hand sides of paper_m3, with nothing said of A
    words = " ".join(f"--rhs='{text}'" for text in kahanmaps("systems paper_m3 --json").json["rhs"])
    others = "--start 1,2,3,4,5,6 --eps 1/11 --arithmetic mod:10007 --json"
    hidden = kahanmaps(f"period --vars x1,x2,x3,x4,x5,x6 {words} {others}").json
    assert hidden["structure"].startswith("a recognised member")
    assert hidden["period"] == kahanmaps(f"period paper_m3 {others}").json["period"]
