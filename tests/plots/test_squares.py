"""Squares of two maps: exact points, both outcomes, missing points; and what the picture shows of them."""

from dataclasses import replace

import numpy as np
import pytest
from flint import fmpq
from helpers import refuses

from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile
from kahanmaps.family.random_members import parse_chi, random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.plots import squares as module
from kahanmaps.plots.squares import (
    MapPair,
    _in_two_digits,
    pair_of_systems,
    pairs_of_member,
    plot_squares,
    squares,
    widest_axes,
)
from kahanmaps.plots.style import Style
from kahanmaps.systems.quadratic import QuadraticSystem

STYLE = Style(width=12)
START = ["1/2", "-1/3", 0, 1]


@pytest.fixture(scope="module")
def both():
    """Two associated maps, and the control."""
    return [squares(pair, START, "1/50", 2) for pair in pairs_of_member(load("paper_m2"))]


def plane_pair(f, g):
    return MapPair(QuadraticSystem.from_text(["x", "y"], f), QuadraticSystem.from_text(["x", "y"], g), ("f", "g"))


def test_associated_maps_close_exactly_and_those_of_the_control_leave_a_gap(both):
    closed, open_ = both
    assert (closed.closes, closed.verdict) == (True, "closes exactly")
    assert closed.g_after_f == closed.f_after_g
    assert (open_.closes, open_.verdict) == (False, f"gap {open_.gap:.3g}")
    assert open_.gap > 1e-4


def test_one_changed_coefficient_opens_the_square(both):
    f, g = both[0].pair.f, both[0].pair.g
    rhs = [str(p) for p in g.rhs]
    wrong = QuadraticSystem.from_text(g.variables, [rhs[0] + " + 1/1000*x1^2", *rhs[1:]])
    assert squares(MapPair(f, wrong, ("f", "g")), START, "1/50").closes is False


def test_the_points_are_those_of_the_maps(both):
    phi, psi = (KahanMap(system, "1/50") for system in (both[0].pair.f, both[0].pair.g))
    x = phi.point(START)
    assert both[0].g_after_f[1][2] == psi.step(psi.step(phi.step(x)))
    assert both[0].f_after_g[2][1] == phi.step(phi.step(psi.step(x)))


def test_a_gap_by_hand():
    # f = (x^2, 0), g = (y^2, 0), eps = 1/10: x~ = x/(1 - x/5) and x + y^2/5 at (1, 2): 41/20 or 9/5 /(1 - 9/25) = 45/16
    result = squares(plane_pair(["x^2", "0"], ["y^2", "0"]), [1, 2], "1/10")
    assert result.g_after_f[1][1] == (fmpq(41, 20), fmpq(2))
    assert result.f_after_g[1][1] == (fmpq(45, 16), fmpq(2))
    assert result.gap == pytest.approx(45 / 16 - 41 / 20)


def test_a_gap_too_small_for_machine_numbers_is_a_gap():
    result = squares(plane_pair(["x^2", "0"], ["1/10^30*y^2", "0"]), [1, 2], "1/10")
    assert result.closes is False
    assert 0 < result.gap < 1e-29


def test_a_singular_point_is_reported_and_only_existing_corners_are_compared():
    # x~ = x/(1 - 2 eps x) has a pole at x = 5 for eps = 1/10; from 5/3 it is met at the third step
    pair = plane_pair(["x^2", "0"], ["0", "y^2"])
    result = squares(pair, [5, 2], "1/10")
    assert (result.closes, result.verdict) == (None, "no fourth corner")
    assert result.stop_reason == "Phi_f: the map is not defined at a point on the way"
    later = squares(pair, ["5/3", "1/7"], "1/10", 3)
    assert (later.g_after_f[3][0], later.closes, bool(later.stop_reason)) == (None, True, True)


def test_numbers_that_grow_too_long_are_left_out_and_no_step_is_refused(monkeypatch):
    monkeypatch.setattr(module, "MAX_BITS", 40)
    assert "more than 40 bits" in squares(pairs_of_member(load("paper_m2"))[0], START, "1/50", 2).stop_reason
    refuses("expected 1 to 12", squares, plane_pair(["x^2", "0"], ["0", "y^2"]), [1, 2], "1/10", 0)


def test_the_chosen_signs_are_drawn_and_their_neighbour():
    member = replace(random_member_with_eigenvalues([1, 2, 3], seed=1), signs=(1, -1, 1))
    pair, control = pairs_of_member(SystemFile.from_member(member))
    assert pair.names == ("f_+-+", "f_+--")
    assert pair.f == member.chosen.system
    assert control.names == ("J grad H_0", "J grad H_1")


def test_members_are_recognised_in_the_plane_with_twice_the_system_as_the_control():
    pair, _ = pairs_of_member(SystemFile.from_system(load("paper_m2").system))
    assert squares(pair, START, "1/50").closes is True
    file = SystemFile.from_system(QuadraticSystem.from_text(["x", "y"], ["-6*x*y", "3*y^2 - 3*x^2"]))
    assert [squares(pair, [1, "1/2"], "1/10").closes for pair in pairs_of_member(file)] == [True, False]


def test_an_irreducible_chi_leaves_a_map_and_its_inverse():
    pair, _ = pairs_of_member(SystemFile.from_member(random_member_with_chi(parse_chi("t^2 - 2"), seed=3)))
    result = squares(pair, START, "1/50")
    assert result.g_after_f[1][1] == result.g_after_f[0][0]


def test_another_step_is_another_map():
    file = load("lorenz")
    same = squares(pair_of_systems(file, file, "1/100"), [1, 2, 3], "1/100")
    other = squares(pair_of_systems(file, file, "1/100", "1/50"), [1, 2, 3], "1/100")
    assert (same.closes, other.closes) == (True, False)
    assert other.g_after_f[0][1] == KahanMap(file.system, "1/50").step([1, 2, 3])


def test_axes_in_which_nothing_moves_are_not_chosen():
    names = ["a", "x", "b", "y"]
    f = QuadraticSystem.from_text(names, ["0", "1", "0", "x"])
    g = QuadraticSystem.from_text(names, ["0", "0", "0", "1"])
    assert widest_axes([squares(MapPair(f, g, ("f", "g")), [1, 1, 1, 1], "1/10")]) == (1, 3)


def test_rings_hold_their_dots_exactly_where_the_maps_commute(both):
    for panel, result in zip(plot_squares(both, STYLE).axes, both, strict=True):
        rings, dots = (np.array(line.get_data()) for line in panel.lines if line.get_marker() == "o")
        assert np.array_equal(rings, dots) is (result.closes is True)
        assert rings.shape == (2, 9)


def test_a_small_gap_is_shown_magnified_by_a_number_without_computer_notation(both):
    closed, open_ = plot_squares(both, STYLE).axes
    assert (len(closed.child_axes), len(open_.child_axes)) == (0, 1)
    assert open_.child_axes[0].texts[0].get_text().startswith(r"$\times")
    numbers = {6.08: "6.1", 183.0: "180", 0.52: "0.52", 1.26e6: r"1.3\cdot10^{6}"}
    assert {number: _in_two_digits(number) for number in numbers} == numbers
