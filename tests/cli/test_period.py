"""kahanmaps period: the order of the translation, told with its planes and poles, and never a traceback.

Walking the orbit gives the same number where that is short enough; at a pole the walk stops and the period is that of
the orbit continued.
"""

from __future__ import annotations

import random

import pytest

PAIR = "--start 1/2,-1/5,0,1 --eps 1/10"
M3 = "paper_m3 --start 1,2,3,4,5,6 --eps 1/11"

# H = x^3/3 + x y^2 with J = [[0, 3], [-3, 0]]: a member in coordinates of its own
SCALED = 'variables = ["x", "y"]\n[hamiltonian]\nH = "x^3/3 + x*y^2"\nJ = [["0", "3"], ["-3", "0"]]\n'
# Two planes whose coordinates are mixed by J.
MIXED = """variables = ["a", "b", "c", "d"]
[hamiltonian]
H = "a^3 + 2*c^3 + a*b^2 + c*d^2 - c^2*d"
J = [["0", "2", "0", "0"], ["-2", "0", "0", "0"], ["0", "0", "0", "1/5"], ["0", "0", "-1/5", "0"]]
"""


def walked(kahanmaps, command, steps=10_000):
    """The record of the end of the orbit, step after step."""
    return kahanmaps(*command, f"--steps {steps} --every {steps} --method generic --format jsonl").records[-1]


@pytest.fixture
def files(tmp_path):
    for name, text in (("scaled", SCALED), ("mixed", MIXED)):
        (tmp_path / f"{name}.toml").write_text(text)
    return tmp_path


# How many starts for each prime: in some systems most orbits meet a pole, and there is no period to compare.
@pytest.mark.parametrize(
    ("name", "starts"),
    [
        pytest.param("pair", 4, marks=pytest.mark.slow),
        pytest.param("paper_m3_irreducible", 8, marks=pytest.mark.slow),
        ("scaled", 6),
        pytest.param("mixed", 24, marks=pytest.mark.slow),
    ],
)
def test_the_period_is_that_of_the_orbit_walked(kahanmaps, pair, files, name, starts):
    """Walks that end at a pole have to be told as such; enough others have to come back, or nothing was compared."""
    system = {"pair": pair, "scaled": files / "scaled.toml", "mixed": files / "mixed.toml"}.get(name, name)
    dim = {"pair": 4, "scaled": 2, "mixed": 4}.get(name, 6)
    compared = 0
    for prime in (7, 13, 17, 31):
        rng = random.Random(prime)
        for _ in range(starts):
            start = ",".join(str(rng.randrange(prime)) for _ in range(dim))
            options = f"--start {start} --eps 1/25 --arithmetic mod:{prime}"
            found = kahanmaps("period", system, options, "--json").json
            end = walked(kahanmaps, ("orbit", system, options))
            if end["status"] == "singular":
                assert found["meets_pole"] is True
            elif end["status"] == "periodic":
                assert (found["period"], found["meets_pole"]) == (str(end["period"]), False)
                compared += end["period"] > 1
            else:
                assert int(found["period"]) > end["steps"]
    assert compared >= 4


def test_the_period_is_printed_with_a_line_for_each_plane(kahanmaps, pair):
    assert kahanmaps("period", pair, PAIR, "--arithmetic mod:10007").out.splitlines() == [
        "# pair, eps = 1/10 (time step 2 eps = 1/5), mod:10007 arithmetic",
        "period\t17121375",
        "plane\tt = 10005 mod 10007\tperiod 5073\ta smooth level cubic",
        "plane\tt = 1 mod 10007\tperiod 10125\ta smooth level cubic",
        "poles\tthe orbit meets none",
        "# periodic: the orbit has period 17121375 and meets no pole of the map",
    ]


def test_that_a_pole_is_met_is_told(kahanmaps, pair):
    out = kahanmaps("period", pair, "--start 1/2,-1/3,0,1 --eps 1/10 --arithmetic mod:2305843009213693951").out
    assert "period\t332306998856115862344354572863389520\n" in out
    assert "poles\tthe orbit meets one\n" in out
    assert "continued through its poles the orbit has period" in out.splitlines()[-1]


def test_over_the_rationals_an_orbit_is_proved_aperiodic(kahanmaps, pair):
    outcome = kahanmaps("period", pair, PAIR, "--json")
    assert (outcome.status, outcome.json["status"], outcome.json["period"]) == (0, "aperiodic", None)
    assert [plane["reason"] for plane in outcome.json["planes"]] == [
        "T has the orders 18 and 56 modulo 101 and 103",
        "T has the orders 34 and 50 modulo 101 and 103",
    ]
    assert outcome.json["planes"][0]["field_size"] is None
    assert "period\tnone\n" in kahanmaps("period", pair, PAIR).out


def test_modulo_two_the_map_is_the_identity(kahanmaps, pair):
    options = "--start 1,0,1,1 --eps 1/7 --arithmetic mod:2"
    assert walked(kahanmaps, ("orbit", pair, options), 9)["period"] == 1
    outcome = kahanmaps("period", pair, options, "--json")
    assert (outcome.status, outcome.json["period"]) == (0, "1")


def test_a_field_too_large_gives_3_and_says_so(kahanmaps, pair):
    outcome = kahanmaps("period", pair, f"--start 1,2,3,4 --eps 1 --arithmetic mod:{2**255 - 19} --json")
    assert (outcome.status, outcome.json["status"], outcome.json["period"]) == (3, "undecided", None)
    assert "more than about 2^192" in outcome.json["planes"][0]["reason"]
    assert "undecided: the period was not found" in outcome.err


def test_a_start_where_the_map_has_no_value_gives_3(kahanmaps):
    # H = x y^2/2 with a repeated factor: at y = 1/eps = 1 a pole of the map that nothing leads on from
    outcome = kahanmaps("period --vars x,y --rhs x*y --rhs=-y^2/2 --start 2,1 --eps 1 --json")
    assert (outcome.status, outcome.json["status"], outcome.json["period"]) == (3, "undefined", None)
    assert outcome.json["meets_pole"] is True
    assert "cannot be continued" in outcome.err


def test_recognised_members_have_periods(kahanmaps):
    # the right-hand sides of paper_m3, with nothing said of A
    rhs = kahanmaps("systems paper_m3 --json").json["rhs"]
    words = " ".join(f"--rhs='{text}'" for text in rhs)
    command = f"--vars x1,x2,x3,x4,x5,x6 {words} --start 1,2,3,4,5,6 --eps 1/11 --arithmetic mod:10007 --json"
    hidden = kahanmaps(f"period {command}").json
    assert hidden["structure"].startswith("a hidden member")
    assert hidden["period"] == kahanmaps(f"period {M3} --arithmetic mod:10007 --json").json["period"]


def test_a_prime_that_the_coordinates_of_the_normal_form_do_not_have_is_refused(kahanmaps, files):
    outcome = kahanmaps("period", files / "scaled.toml", "--start 1,2 --eps 1 --arithmetic mod:3")
    assert (outcome.status, "the prime 3 divides" in outcome.err) == (2, True)


# Levels


def test_the_levels_with_a_period_are_printed(kahanmaps):
    assert kahanmaps("period --levels 6").out.splitlines()[1:] == [
        "period 6 only\t-27*gamma + 28",
        "rational gamma\t28/27",
    ]
    assert "rational gamma\tnone" in kahanmaps("period --levels 7").out


def test_the_levels_of_a_system_are_those_of_its_planes(kahanmaps):
    text = "--vars u,v --rhs 2*u^2-2*u*v+6*v^2 --rhs -4*u*v+v^2"
    assert "(h/(1 + eps^2*D))^2 = 1/324" in kahanmaps(f"period {text} --eps 1/2 --levels 5").out
    assert "no real level" in kahanmaps(f"period {text} --eps 1/2 --levels 9").out
    assert "gamma = 1" not in kahanmaps(f"period {text} --eps 1/2 --levels 5").out


def test_a_plane_whose_cubic_has_a_square_has_no_level_with_a_period(kahanmaps):
    said = "none but perhaps 0: disc(h) = 0, so that gamma = 1 on every level"
    assert said in kahanmaps("period --vars u,v --rhs u^2 --rhs -2*u*v --eps 1/2 --levels 5").out
