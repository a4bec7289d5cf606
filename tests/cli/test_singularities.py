"""kahanmaps singularities: verdicts as text and JSON, exit statuses, and wrong use."""

from cli_helpers import terminal

from kahanmaps.version import __version__


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


def test_long_polynomials_are_shortened_on_a_terminal_only(kahanmaps):
    assert "chars)" in terminal("singularities", "lorenz", "--eps", "1/7", "--steps", "2").out
    assert "chars)" not in kahanmaps("singularities lorenz --eps 1/7 --steps 2").out
