"""kahanmaps period: the order of the translation, told with its planes and poles, and never a traceback.

Walking the orbit gives the same number where that is short enough; at a pole the walk stops and the period is that of
the orbit continued.
"""

import random

import pytest

M3 = "paper_m3 --start 1,2,3,4,5,6 --eps 1/11"

# H = x^3/3 + x y^2 with J = [[0, 3], [-3, 0]]: a member in coordinates of its own
SCALED = 'variables = ["x", "y"]\n[hamiltonian]\nH = "x^3/3 + x*y^2"\nJ = [["0", "3"], ["-3", "0"]]\n'


def walked(kahanmaps, command, steps=10_000):
    """The record of the end of the orbit, step after step."""
    return kahanmaps(*command, f"--steps {steps} --every {steps} --method generic --format jsonl").records[-1]


@pytest.fixture
def scaled(tmp_path):
    path = tmp_path / "scaled.toml"
    path.write_text(SCALED)
    return path


# How many starts for each prime: in some systems most orbits meet a pole, and there is no period to compare.
@pytest.mark.parametrize(
    ("name", "primes", "starts"),
    [
        pytest.param("pair", (7, 13, 17, 31), 4, marks=pytest.mark.slow),
        pytest.param("paper_m3_irreducible", (7, 13, 17, 31), 8, marks=pytest.mark.slow),
        ("scaled", (11, 23), 4),
    ],
)
def test_the_period_is_that_of_the_orbit_walked(kahanmaps, pair, scaled, name, primes, starts):
    """Walks that end at a pole have to be told as such; enough others have to come back, or nothing was compared."""
    system, dim = {"pair": (pair, 4), "scaled": (scaled, 2)}.get(name, (name, 6))
    compared = 0
    for prime in primes:
        rng = random.Random(prime)
        for _ in range(starts):
            start = ",".join(str(rng.randrange(prime)) for _ in range(dim))
            options = f"--start {start} --eps 1/25 --arithmetic mod:{prime}"
            result = kahanmaps("period", system, options, "--json").json
            end = walked(kahanmaps, ("orbit", system, options))
            if end["status"] == "singular":
                assert result["meets_pole"] is True
            elif end["status"] == "periodic":
                assert (result["period"], result["meets_pole"]) == (str(end["period"]), False)
                compared += end["period"] > 1
            else:
                assert int(result["period"]) > end["steps"]
    assert compared >= 4


def test_recognised_members_have_periods(kahanmaps):
    # the right-hand sides of paper_m3, with nothing said of A
    rhs = kahanmaps("systems paper_m3 --json").json["rhs"]
    words = " ".join(f"--rhs='{text}'" for text in rhs)
    command = f"--vars x1,x2,x3,x4,x5,x6 {words} --start 1,2,3,4,5,6 --eps 1/11 --arithmetic mod:10007 --json"
    hidden = kahanmaps(f"period {command}").json
    assert hidden["structure"].startswith("a recognised member")
    assert hidden["period"] == kahanmaps(f"period {M3} --arithmetic mod:10007 --json").json["period"]
