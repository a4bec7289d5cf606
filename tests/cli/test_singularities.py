"""kahanmaps singularities: verdicts as text and JSON, exit statuses, and wrong use."""

from __future__ import annotations

import pytest
from cli_helpers import shell, terminal

from kahanmaps.version import __version__


def test_confined_singularities_are_told_with_their_steps(kahanmaps):
    outcome = kahanmaps("singularities weierstrass --eps 1/2")
    assert outcome.status == 0
    lines = outcome.out.splitlines()
    assert lines[0] == "# weierstrass, dimension 2, eps is half the time step"
    assert "3*x - 1\tdegree 1, pole\tcontracted by step 1, confined after 4 steps" in lines
    assert "  ranks 0 0 0 1 0 0 0 1 0 0 0 1\tpoles 1 1 1 0 1 1 1 0 1 1 1 0" in lines
    assert lines[-1] == "# confined"


def test_not_confined_is_an_answer(kahanmaps):
    outcome = kahanmaps("singularities lotka_volterra --eps 1/10 --steps 7")
    assert (outcome.status, outcome.err) == (0, "")
    assert "not confined within 7 steps" in outcome.out


def test_two_eps_and_the_symbolic_denominator_by_default(kahanmaps):
    found = kahanmaps("singularities euler_top --json").json
    assert (found["command"], found["version"], found["verdict"]) == ("singularities", __version__, "confined")
    assert len({run["eps"] for run in found["runs"]}) == 2
    assert len(found["symbolic_denominator"]) == 1
    for run in found["runs"]:
        assert run["critical_degree"] == 8
        for hypersurface in run["hypersurfaces"]:
            assert len(hypersurface["ranks"]) == 12
            assert len(set(hypersurface["primes"])) == 2
    assert found["document"]["system"]


@pytest.mark.parametrize(
    ("arguments", "verdict", "status"),
    [
        ("harmonic", "no singularities", 0),
        ("riccati", "nothing contracted", 0),
        ("harmonic -p w=-1 --eps 1", "singular everywhere", 0),
        ("--vars x,y --rhs 0 --rhs 0", "no singularities", 0),
        ("three_wave --eps 1/7 --steps 4", "confined", 0),
        ("euler_top --seconds 0.0000001", "undecided", 3),
    ],
)
def test_other_verdicts(kahanmaps, arguments, verdict, status):
    outcome = kahanmaps(f"singularities {arguments}")
    assert outcome.status == status
    assert outcome.out.splitlines()[-1] == f"# {verdict}"
    assert outcome.err.startswith("undecided: ") == (status == 3)
    assert kahanmaps(f"singularities {arguments} --json").json["verdict"] == verdict


def test_long_polynomials_are_shortened_on_a_terminal_only(kahanmaps):
    assert "chars)" in terminal("singularities", "lorenz", "--eps", "1/7", "--steps", "2").out
    assert "chars)" not in kahanmaps("singularities lorenz --eps 1/7 --steps 2").out


def test_help_fits_the_screen(tmp_path):
    outcome = shell("kahanmaps singularities --help", tmp_path, COLUMNS="80")
    assert outcome.status == 0
    assert max(map(len, outcome.out.splitlines())) <= 80


def test_one_eps_at_which_the_map_has_no_value_is_not_the_verdict(kahanmaps):
    """At eps = 5/11, the first of the two that are drawn, I - eps B = 0; at the other one the map is linear."""
    outcome = kahanmaps("singularities --vars x --rhs 11/5*x")
    assert outcome.status == 3
    assert "singular everywhere" in outcome.out
    assert "no singularities" in outcome.out
    assert outcome.out.splitlines()[-1] == "# undecided"
    assert "the two eps tell different things" in outcome.err


def test_a_map_into_a_hypersurface_is_told(kahanmaps):
    """At eps = -1 the map of x' = x is x -> 0, so that nothing can be confined."""
    outcome = kahanmaps("singularities --vars x,y --rhs x --rhs y^2 --eps=-1")
    assert (outcome.status, outcome.err) == (0, "")
    assert outcome.out.splitlines()[-1] == "# not dominant"
    found = kahanmaps("singularities --vars x,y --rhs x --rhs y^2 --eps=-1 --json").json
    assert [(run["dominant"], run["hypersurfaces"]) for run in found["runs"]] == [(False, [])]
    assert kahanmaps("singularities --vars x,y --rhs x --rhs y^2 --eps=-2 --json").json["runs"][0]["dominant"]
