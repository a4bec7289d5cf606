"""kahanmaps plot drift."""

from __future__ import annotations

import re


def test_all_methods_are_drawn(kahanmaps):
    done = kahanmaps("plot drift weierstrass --eps 1/20 --start 1/4,1/8 --steps 300")
    assert done.status == 0
    assert "time step 2eps = 1/10" in done.out
    for text in ("Kahan", "RK4", "implicit midpoint", "modified_H"):
        assert text in done.out
    assert done.err == "start 1/4,1/8, eps = 1/20 (time step 2 eps = 1/10)\n"


def test_a_member_of_the_family_is_drawn_in_normal_form_too(kahanmaps):
    done = kahanmaps("plot drift paper_m2 --eps 1/20 --steps 100")
    assert (done.status, "Kahan, normal form" in done.out) == (0, True)


def test_methods_and_functions_are_as_asked_for(kahanmaps):
    done = kahanmaps("plot drift euler_top --eps 1/20 --steps 9 --method rk4 --integral F1 --integral 'E=x1^2+eps'")
    assert done.status == 0
    assert "RK4" in done.out
    assert "Kahan" not in done.out


def test_an_orbit_that_ends_early_is_told_and_drawn(kahanmaps):
    done = kahanmaps("plot drift --vars x --rhs x^2 --eps 1/20 --start 1 --steps 100 --integral I=x")
    assert done.status == 3
    assert "RK4 (ended at step " in done.out
    assert "RK4 ended early: step " in done.err
    assert re.search(r"I along RK4: errors above \S+ are an arrow at the top", done.err)


def test_an_absolute_error_is_told(kahanmaps):
    done = kahanmaps("plot drift --vars x,y --rhs y --rhs=-x --eps 1/20 --start 1,0 --steps 9 --integral I=y")
    assert "absolute error of I" in done.out
    assert "I: absolute errors, for it is 0 at the start" in done.err


def test_an_algebraic_parameter_is_rounded(kahanmaps):
    line = "plot drift euler_top --eps 1/20 --steps 9 --start 1,1,1 -p"
    done, near = (kahanmaps(line, f"'a1={a}'") for a in ("root of t^2 - 2 near 1.4", "1.4142135623730950488"))
    assert done.status == near.status == 0
    assert done.out.splitlines()[:4] == near.out.splitlines()[:4]  # below are the errors of rounding
    assert "may be" in kahanmaps(line, "'a1=root of t^2 - 2'").err
