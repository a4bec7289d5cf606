"""kahanmaps degrees, singularities, cycles, lyapunov, heights: what they print as text and JSON, exit statuses."""

import pytest
from cli_helpers import time_is_over

from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.invariants.growth import Growth
from kahanmaps.invariants.heights import height_growth
from kahanmaps.laboratory.cycles import _ProjectiveMap, cycle_census
from kahanmaps.laboratory.growth.height_survey import height_survey


def test_counts_are_printed_for_two_eps_by_default(kahanmaps):
    outcome = kahanmaps("cycles weierstrass --prime 31")
    assert outcome.status == 0
    census = cycle_census(load("weierstrass").system, "1/10", 31)
    assert outcome.out.count("# p = 31, eps = ") == 2
    counts = f"indeterminate\t{census.indeterminate}\npre-indeterminate\t{census.pre_indeterminate}\n"
    assert f"{counts}preperiodic\t0\nperiodic\t{census.periodic}\n" in outcome.out
    assert f"cycles\t{census.cycles}, longest {census.longest}\n" in outcome.out


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


def test_p_sets_a_parameter_and_the_error_names_the_option_for_a_prime(kahanmaps):
    outcome = kahanmaps("cycles weierstrass -p 31")
    assert outcome.status == 2
    assert "found '31', expected NAME=VALUE (for a prime use --prime 31)" in outcome.err


def test_numbers_are_printed_per_time_and_per_step(kahanmaps):
    outcome = kahanmaps("lyapunov riccati --eps 1/10 --steps 300 --random 4")
    assert outcome.status == 0
    rows = outcome.rows
    assert rows[0] == ["orbits", "4 of 4"]
    assert rows[1] == ["steps", "300 after 30"]
    assert float(rows[2][1]) == pytest.approx(-2.2745, abs=1e-3)
    assert float(rows[2][2]) == pytest.approx(-2.2745 / 5, abs=1e-3)


def test_where_the_transient_is_cut_nothing_was_counted_and_no_number_is_printed(kahanmaps):
    outcome = kahanmaps("lyapunov riccati --eps 1/10 --steps 100 --transient 100000000 --random 2 --seconds 0.3")
    assert outcome.status == 3
    assert "steps\tnone counted: stopped in the transient, after " in outcome.out
    assert "nan" not in outcome.out


def test_starts_from_a_file(kahanmaps, tmp_path):
    (tmp_path / "starts.csv").write_text("x,y\n1,0\n1/2,1/3\n")
    result = kahanmaps("lyapunov harmonic --eps 1/10 --steps 50 --json --starts", tmp_path / "starts.csv").json
    assert result["orbits"] == 2
    assert result["per_time"] == pytest.approx([0, 0], abs=1e-12)


def test_values_of_eps_that_disagree_are_reported(monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.growth.height_survey.DEFAULT_EPS", (1, 2))
    from kahanmaps.systems.quadratic import QuadraticSystem

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
    system = load("weierstrass").system
    for options in ({"starts": 0}, {"starts": []}, {"effort": 41}):
        with pytest.raises(InputError):
            height_survey(system, **options)


def test_random_starts_have_prime_numerators_and_lie_on_both_sides_of_0():
    """A coordinate is then no simple multiple of 1/eps, where many maps have invariant curves."""
    survey = height_survey(load("euler_top").system, starts=6, steps=2)
    coordinates = [x for orbit in survey.orbits for x in orbit.start]
    assert all(abs(x.p).is_prime() and abs(x.p) >= 13 for x in coordinates)
    assert {x > 0 for x in coordinates} == {True, False}
