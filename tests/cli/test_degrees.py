"""kahanmaps degrees: the sequence, its recurrence, what is told where there is none, and exit statuses."""

from __future__ import annotations

import pytest
from schema_helpers import mistakes


def test_the_degrees_of_the_euler_top(kahanmaps):
    outcome = kahanmaps("degrees euler_top")
    assert (outcome.status, outcome.err) == (0, "")
    assert outcome.out.splitlines() == [
        "# euler_top, generic eps, 2 random lines modulo primes of 63 bits: measured, not proved",
        "degrees\t1, 3, 9, 19, 33, 51, 73, 99, 129, 163, 201, 243",
        "growth\tquadratic growth, dynamical degree 1",
        "recurrence\ta(n) = 3*a(n-1)-3*a(n-2)+a(n-3) for n >= 3, explained by the singularities; 12 measured terms "
        "agree",
        "characteristic polynomial\t(t - 1)^3",
        "closed form\t2*n^2 + 1",
        "generating function\t(1 + 3*z^2) / (1 - 3*z + 3*z^2 - z^3)",
        "singularities\tnothing new after step 3",
        *(
            f"contracted\tC{k}: 2*x1^2*eps^2 + x2^2*eps^2 {sign} 4*x1*x3*eps^2 + 2*x3^2*eps^2 {linear} + 1 = 0, "
            f"degree 2: contracted, a hypersurface again after 3 steps; costs 2 at step 3; meets {met}"
            for k, sign, linear, met in (
                (1, "-", "+ 2*x2*eps", "C1 at step 2, C2 at step 2 (order 2)"),
                (2, "+", "- 2*x2*eps", "C1 at step 2 (order 2), C2 at step 2"),
            )
        ),
        "ended\tthe singularities explain the degrees, and those measured agree",
    ]


def test_generic_eps_is_told_as_such(kahanmaps):
    found = kahanmaps("degrees weierstrass --terms 3 --json").json
    assert (found["eps"], found["time_step"]) == ("generic", "generic")
    assert found["lines"][0]["eps_residue"] != found["lines"][1]["eps_residue"]


def test_a_search_that_ends_without_a_recurrence_gives_3(kahanmaps):
    line = (
        "degrees henon_heiles --steps 3 --max-degree 20"  # patterns end after more steps, so that nothing is explained
    )
    outcome = kahanmaps(line)
    assert outcome.status == 3
    assert "growth\tno recurrence found in 4 terms; d_n/d_(n-1) is 2.42857 at the end, an estimate only" in outcome.out
    assert outcome.err == "stopped early: the degree of iterate 4 is above 20\n"
    assert kahanmaps(f"{line} -q").err == ""


def test_few_terms_suffice_where_the_singularities_explain_them(kahanmaps):
    outcome = kahanmaps("degrees henon_heiles --max-degree 100")
    assert (outcome.status, outcome.err) == (0, "")
    assert "dynamical degree 2.29663026288653824570, root of t^4 - 2*t^3 - 2*t + 1\n" in outcome.out


def test_terms_asked_for_are_enough(kahanmaps):
    assert kahanmaps("degrees henon_heiles --terms 4").status == 0
    assert kahanmaps("degrees henon_heiles --terms 40 --max-degree 20").status == 3


def test_a_recurrence_with_few_terms_to_spare_is_enough_when_the_degree_ends_it(kahanmaps):
    outcome = kahanmaps("degrees lorenz --max-degree 100")
    assert (outcome.status, "dynamical degree 3" in outcome.out) == (0, True)


@pytest.mark.parametrize(
    ("command", "growth"),
    [
        ("--vars x --rhs x --eps=-1", "zero from some iterate on: that iterate is a constant map"),
        ("--vars x --rhs x --eps 1", "no recurrence found in 1 term"),
        ("--vars x,y --rhs 0 --rhs 0", "bounded growth, dynamical degree 1"),
    ],
)
def test_degenerate_maps_are_no_errors(kahanmaps, command, growth):
    outcome = kahanmaps(f"degrees {command}")
    assert (outcome.status, f"growth\t{growth}\n" in outcome.out) == (0, True)


def test_a_pattern_longer_than_the_degrees_explains_them(kahanmaps):
    """The lines x, y, x + 2 y with exponents (1, 3, 3): 2^n up to n = 7, and 255 after that."""
    outcome = kahanmaps("degrees --vars x,y --rhs 3*x*(x+2*y)+6*x*y --rhs=-(y*(x+2*y)+3*x*y) --max-degree 150")
    assert (outcome.status, outcome.err) == (0, "")
    assert "characteristic polynomial\t(t - 1) (t^7 - t^6 - t^5 - t^4 - t^3 - t^2 - t - 1)\n" in outcome.out
    assert "a hypersurface again after 8 steps; costs 1 at step 8; meets C1 at step 7, C3 at step 7\n" in outcome.out
    assert "\nproved\tdynamical degree between 1.566299 and 2: " in outcome.out


# -- a table over values


def test_a_range_of_values_gives_a_table(kahanmaps):
    outcome = kahanmaps("degrees henon_heiles -p c=-2..0:1 --terms 4")
    assert (outcome.status, outcome.err) == (0, "")
    assert [line.split("\t")[:2] for line in outcome.out.splitlines()] == [
        ["c = -2", "1, 3, 7, 17, 39"],
        ["c = -1", "1, 3, 5, 9, 13"],
        ["c = 0", "1, 3, 7, 17, 39"],
    ]


def test_all_combinations_of_ranges_are_measured(kahanmaps):
    line = """degrees --rhs "x' = a*x^2; y' = b*x*y" -p a=1..2 -p b=0..1:1/2 --terms 1"""
    assert [row[0] for row in kahanmaps(line).rows] == [
        f"a = {a}, b = {b}" for a in ("1", "2") for b in ("0", "1/2", "1")
    ]


def test_a_table_in_json_has_a_record_for_each_value(kahanmaps):
    records = kahanmaps("degrees henon_heiles -p c=-1..0 --terms 2 --json").records
    assert [record["document"]["parameters"] for record in records] == [{"c": "-1"}, {"c": "0"}]
    assert [mistakes("degrees", record) for record in records] == [[], []]


def test_a_table_says_how_many_values_are_undecided(kahanmaps):
    outcome = kahanmaps("degrees henon_heiles -p c=-1..0 --terms 40 --max-degree 20")
    assert (outcome.status, outcome.err) == (3, "undecided, or stopped early: 2 of 2\n")
