"""kahanmaps plot drift."""


def test_an_algebraic_parameter_is_rounded(kahanmaps):
    line = "plot drift euler_top --eps 1/20 --steps 9 --start 1,1,1 -p"
    done, near = (kahanmaps(line, f"'a1={a}'") for a in ("root of t^2 - 2 near 1.4", "1.4142135623730950488"))
    assert done.status == near.status == 0
    assert done.out.splitlines()[:4] == near.out.splitlines()[:4]  # below are the errors of rounding
    assert "may be" in kahanmaps(line, "'a1=root of t^2 - 2'").err
