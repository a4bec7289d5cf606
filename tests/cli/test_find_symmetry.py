"""kahanmaps find-symmetry: groups and generators in text and JSON, and the exit status."""

from __future__ import annotations


def test_the_lorenz_system(kahanmaps):
    outcome = kahanmaps("find-symmetry lorenz")
    assert outcome.status == 0
    assert outcome.out.splitlines() == [
        "# find-symmetry: lorenz, every eps (the time step is 2 eps); everything here is proved",
        "group\t2 signed permutations, none of them reversing",
        "generator\tsymmetry (x, y, z) -> (-x, -y, z)",
        "searched\taffine infinitesimal symmetries and scalings: all",
        "searched\tsigned permutations, with a translation: all",
        "searched\trational matrices S, without a translation: all",
        "# complete: every search came to its end",
    ]


def test_one_parameter_groups_scalings_and_reversals(kahanmaps):
    out = kahanmaps("find-symmetry three_wave").out
    assert "one-parameter group\tlinear, the flow of (v1, -v2, 0, -u1, u2, 0)\n" in out
    assert "scaling\tthe flow of (u1, u2, u3, v1, v2, v3) by t takes the map at eps to that at e^-t eps\n" in out
    assert "group\t64 signed permutations, 32 of them reversing\n" in out
    out = kahanmaps("find-symmetry riccati").out
    assert "generator\treversing symmetry (x) -> (-x - 1)\n" in out


def test_a_search_that_is_too_large_gives_3(kahanmaps):
    names = [f"x{i}" for i in range(17)]
    words = " ".join(f"--rhs={v}^2" for v in names)
    outcome = kahanmaps(f"find-symmetry --vars {','.join(names)} {words}")
    assert outcome.status == 3
    assert "# undecided: infinitesimal symmetries are computed up to dimension 16, found 17\n" in outcome.out
    assert "undecided: signed permutations are tried up to dimension 12, found 17" in outcome.err
    assert kahanmaps(f"find-symmetry --vars {','.join(names)} {words} -q").err == ""
