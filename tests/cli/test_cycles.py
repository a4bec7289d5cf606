"""kahanmaps cycles: the counts as text and JSON, several primes and eps, and wrong use."""

from kahanmaps.documents.catalog import load
from kahanmaps.laboratory.cycles import cycle_census


def test_counts_are_printed_for_two_eps_by_default(kahanmaps):
    outcome = kahanmaps("cycles weierstrass --prime 31")
    assert outcome.status == 0
    census = cycle_census(load("weierstrass").system, "1/10", 31)
    assert outcome.out.count("# p = 31, eps = ") == 2
    counts = f"indeterminate\t{census.indeterminate}\npre-indeterminate\t{census.pre_indeterminate}\n"
    assert f"{counts}preperiodic\t0\nperiodic\t{census.periodic}\n" in outcome.out
    assert f"cycles\t{census.cycles}, longest {census.longest}\n" in outcome.out


def test_samples(kahanmaps):
    found = kahanmaps("cycles weierstrass --prime 499 --samples 40 --eps 1/7 --seed 2 --json").json
    (run,) = found["runs"]
    assert (run["complete"], run["looked_at"], run["open"]) == (False, 40, 0)
    assert run["cycles"] is None
    assert found == kahanmaps("cycles weierstrass --prime 499 --samples 40 --eps 1/7 --seed 2 --json").json


def test_no_law_refuses_an_integrable_map_that_exchanges_levels(kahanmaps):
    first = "(-2*x^4*y^2-x^4-2*x^2*y-y^2-2)/(x^5*y^2+x^5*y+x^5-x^3*y^2+x^3+x*y^2-x*y+x)"
    outcome = kahanmaps(f"cycles --vars x,y --image '{first}; (x^2-y)/(x^2*y+1)' --prime 47")
    assert "longest 114" in outcome.out
    assert "compatible" not in outcome.out


def test_the_time_is_that_of_all_runs_and_what_was_stopped_says_so(kahanmaps):
    outcome = kahanmaps("cycles paper_m3_irreducible --prime 31 --samples 5 --prime 11 --seconds 0.001")
    assert outcome.status == 3
    assert outcome.out.count("time limit") == 4
    outcome = kahanmaps("cycles paper_m3_irreducible --prime 11 --seconds 0.001 --json")
    assert [(run["stopped"], run["looked_at"]) for run in outcome.json["runs"]] == [(True, 0)] * 2


def test_p_is_a_parameter_and_a_prime_is_told_how_to_be_typed(kahanmaps):
    outcome = kahanmaps("cycles weierstrass -p 31")
    assert outcome.status == 2
    assert "found '31', expected NAME=VALUE (the prime of cycles is --prime 31)" in outcome.err
