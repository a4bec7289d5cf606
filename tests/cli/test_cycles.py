"""kahanmaps cycles: the counts as text and JSON, several primes and eps, and wrong use."""

from kahanmaps.documents.catalog import load
from kahanmaps.laboratory.finite.cycles import cycle_census


def test_counts_are_printed_for_two_eps_by_default(kahanmaps):
    outcome = kahanmaps("cycles weierstrass --prime 31")
    assert outcome.status == 0
    census = cycle_census(load("weierstrass").system, "1/10", 31)
    assert outcome.out.count("# p = 31, eps = ") == 2
    assert f"lost\t{census.lost}\nfalling\t{census.falling}\n" in outcome.out
    assert f"periodic\t{census.periodic}\ncycles\t{census.cycles}, longest {census.longest}" in outcome.out
    assert "reversing symmetry\t1,0;0,-1\n" in outcome.out
    assert "\n# compatible in all 2 runs with: integrable bound\n" in outcome.out


def test_samples(kahanmaps):
    found = kahanmaps("cycles weierstrass --prime 499 --samples 40 --eps 1/7 --seed 2 --json").json
    (run,) = found["runs"]
    assert (run["complete"], run["looked_at"], run["open"]) == (False, 40, 0)
    assert run["cycles"] is None
    assert found == kahanmaps("cycles weierstrass --prime 499 --samples 40 --eps 1/7 --seed 2 --json").json


def test_an_inline_system_and_a_reversor(kahanmaps):
    inline = "cycles --vars x,y --rhs y --rhs '6*x^2 - 2' --prime 31 --eps 1/7"
    assert kahanmaps(inline, "--reversor '1,0;0,-1'").out == kahanmaps(inline).out


def test_a_prime_may_stand_behind_p_as_parameters_do(kahanmaps):
    short = kahanmaps("cycles weierstrass -p 31 --json").json
    long = kahanmaps("cycles weierstrass --prime 31 --json").json
    assert short == long
    both = kahanmaps("cycles euler_top -p a1=2 -p 11 --prime 13 --json").json
    assert both["primes"] == [13, 11]
    assert both["document"] == kahanmaps("cycles euler_top -p a1=2 --prime 13 --json").json["document"]
