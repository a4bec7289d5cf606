"""kahanmaps find-symmetry: groups and generators in text and JSON, and the exit status."""


def test_a_search_that_is_too_large_gives_3(kahanmaps):
    names = [f"x{i}" for i in range(17)]
    words = " ".join(f"--rhs={v}^2" for v in names)
    outcome = kahanmaps(f"find-symmetry --vars {','.join(names)} {words}")
    assert outcome.status == 3
    assert "# undecided: infinitesimal symmetries are computed up to dimension 16, found 17\n" in outcome.out
    assert "undecided: signed permutations are tried up to dimension 12, found 17" in outcome.err
    assert kahanmaps(f"find-symmetry --vars {','.join(names)} {words} -q").err == ""
