"""Portraits: the numbers that are shown, what is in the figure, its window, the flow and chosen starts."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import together
from matplotlib.collections import PathCollection

from kahanmaps.documents.catalog import load
from kahanmaps.maps.floats.classical import MethodEnsemble, VectorField
from kahanmaps.plots.figures import picture_bytes
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.flow import START_COUNT, automatic_starts, equilibria, plane_flow, solution
from kahanmaps.plots.portraits.portrait import neighbours, plot_portrait, portrait_of
from kahanmaps.plots.portraits.trajectories import Trajectories, ensemble_for, follow_orbits
from kahanmaps.plots.portraits.windows import count_outside, fullest_axes, window_of
from kahanmaps.plots.style import Style
from kahanmaps.systems.quadratic import QuadraticSystem

STYLE = Style(width=8.6, font_size=8)
AXES = [point_function(name, ["x", "y"]) for name in "xy"]
LOTKA_VOLTERRA = load("lotka_volterra", {}).system


def orbits(count, steps=20):
    starts = np.stack([np.ones(count), 1.5 + np.arange(count) / count], axis=1)
    return follow_orbits(ensemble_for(LOTKA_VOLTERRA, "1/20", starts, steps), steps)


def trajectories(points):
    return Trajectories(("x", "y"), np.array(points, dtype=float), np.arange(len(points)))


def test_all_points_of_all_orbits_are_there_and_an_axis_may_be_the_step():
    shown = portrait_of(orbits(3), AXES)
    assert shown.points.shape == (21, 3, 2)
    assert (shown.left_out, shown.undefined, shown.labels) == (0, 0, ("$x$", "$y$"))
    shown = portrait_of(orbits(2), ["step", AXES[0]])
    assert shown.points[:, 1, 0].tolist() == list(range(21))
    assert shown.labels == ("step", "$x$")


def test_points_at_a_pole_of_an_axis_or_of_the_color_are_left_out_and_counted():
    result = trajectories([[[1, 0]], [[2, 1]], [[0, 1]]])
    shown = portrait_of(result, [point_function("1/x", "xy"), AXES[1]], color=point_function("1/y", "xy"))
    assert shown.undefined == 2
    assert np.isnan(shown.points[:, 0, 0]).tolist() == [True, False, True]


def test_orbits_that_ended_are_not_called_undefined():
    result = follow_orbits(ensemble_for(QuadraticSystem.from_text(["x"], ["x^2"]), "1", np.array([[0.5], [3.0]]), 2), 2)
    # (x~ - x)/2 = x x~ has a pole at x = 1/2
    assert result.ended == {"met a singular matrix I - eps f'": 1}
    assert portrait_of(result, ["step", point_function("x", "x")]).undefined == 0


def test_explicit_euler_is_what_its_formula_says_and_spirals_outward_where_kahans_orbit_does_not():
    start, (x, y) = np.array([[1.0, 2.0]]), (1.0, 2.0)
    euler = follow_orbits(MethodEnsemble(LOTKA_VOLTERRA, "1/20", start, "euler"), 100).points
    np.testing.assert_allclose(euler[1, 0], [x + 0.1 * x * (1 - y), y + 0.1 * y * (x - 1)])
    kahan = follow_orbits(ensemble_for(LOTKA_VOLTERRA, "1/20", start, 2000), 2000).points
    spiral, closed = (points.sum(axis=2) - np.log(points).sum(axis=2) for points in (euler, kahan))
    assert spiral[-1, 0] > spiral[0, 0] + 0.1
    assert np.ptp(closed) < 0.005  # O(eps^2), for ever


def test_more_orbits_are_one_cloud_with_a_color_for_each_the_widest_first():
    figure = plot_portrait(portrait_of(orbits(8), AXES), STYLE)
    (cloud,) = (c for c in figure.axes[0].collections if isinstance(c, PathCollection))
    # the starts are farther and farther from the equilibrium
    assert cloud.get_array().tolist() == [k for k in range(7, -1, -1) for _ in range(21)]
    assert len(cloud.get_offsets()) == 8 * 21


def test_points_outside_the_window_do_not_spoil_the_colors():
    values = np.append(np.linspace(0, 1, 50), [1e6] * 20)
    result = trajectories(np.stack([values, values], axis=1)[:, None])
    shown = portrait_of(result, AXES, color=AXES[0], window=((0, 2), (0, 2)))
    axes = plot_portrait(shown, STYLE).axes[0]
    assert axes.collections[0].norm.vmax == 1
    assert (axes.get_xlim(), axes.get_ylim(), shown.left_out) == ((0, 2), (0, 2), 20)


def test_points_outside_the_window_are_not_drawn_in_space():
    top = load("euler_top", {}).system
    result = follow_orbits(ensemble_for(top, "1/10", np.array([[1.0, 0.5, 0.2]]), 100), 100)
    axes = [point_function(name, top.variables) for name in top.variables]
    shown = portrait_of(result, axes, window=((0, 2), (-2, 2), (-2, 2)))
    (line, *_) = plot_portrait(shown, STYLE).axes[0].lines
    x = np.asarray(line.get_data_3d()[0], dtype=float)
    assert np.isnan(x).sum() == shown.left_out
    assert np.nanmin(x) >= 0


def test_no_line_goes_through_a_missing_point_and_no_points_at_all_are_an_empty_picture():
    shown = portrait_of(trajectories([[[0, 0]], [[1, 1]], [[np.nan, np.nan]], [[3, 0]]]), AXES, color="step")
    assert len(plot_portrait(shown, STYLE, lines=True).axes[0].collections[0].get_segments()) == 1
    result = trajectories(np.full((2, 1, 2), np.nan))
    assert picture_bytes(plot_portrait(portrait_of(result, AXES, color="step"), STYLE), "png", STYLE)


def circle(turn):
    return np.stack([np.cos(turn), np.sin(turn)], axis=1)


def test_neighbours_on_two_circles_are_joined_and_the_circles_are_not():
    points = circle(2.4 * np.arange(100)) + 5 * (np.arange(100) % 2)[:, None]
    pairs = neighbours(points)
    assert len(pairs) == 100
    assert (pairs[:, 0] % 2 == pairs[:, 1] % 2).all()
    assert np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1).max() < 0.4


def test_an_orbit_that_has_not_come_round_has_two_ends_and_one_in_bunches_none():
    assert len(neighbours(circle(np.linspace(0, 5, 50)))) == 49
    assert np.bincount(neighbours(circle((2 * np.pi / 20 + 1e-4) * np.arange(200))).ravel()).tolist() == [2] * 200


def test_a_cloud_has_no_curve():
    assert neighbours(np.random.default_rng(1).uniform(size=(300, 2))) is None
    assert neighbours(np.full((50, 2), np.nan)) is None


def test_initial_points_and_equilibria_have_different_marks_and_both_are_in_the_legend():
    shown = replace(portrait_of(orbits(8), AXES), flow=plane_flow(LOTKA_VOLTERRA, (0, 1), ((-1, 3), (-1, 3))))
    [legend] = plot_portrait(shown, STYLE).legends
    marks = {
        text.get_text(): line.get_marker() for text, line in zip(legend.get_texts(), legend.get_lines(), strict=True)
    }
    assert list(marks) == ["vector field", "separatrix", "saddle", "center", "initial point"]
    assert (marks["saddle"], marks["center"], marks["initial point"]) == ("x", "o", ">")


def test_the_legend_names_only_what_is_drawn():
    [legend] = plot_portrait(portrait_of(orbits(8), AXES), STYLE).legends
    assert [text.get_text() for text in legend.get_texts()] == ["initial point"]
    assert plot_portrait(portrait_of(orbits(8), AXES, color="step"), STYLE).legends == []


CIRCLE = circle(np.linspace(0, 6, 500))


def test_points_that_are_together_are_all_inside_and_missing_ones_change_nothing():
    window = window_of(CIRCLE)
    missing = np.concatenate([CIRCLE, [[np.nan, np.nan]]])
    assert window_of(missing) == window
    assert count_outside(missing, window) == 0


def test_a_few_points_far_away_are_left_out_and_counted():
    points = np.concatenate([CIRCLE, [[1e9, 0.0], [0.0, -1e12]]])
    window = window_of(points)
    assert all(high - low < 6 for low, high in window)
    assert count_outside(points, window) == 2


def test_starts_stay_in_sight_where_the_orbit_soon_rests():
    decay = np.append([5.0, 2.0, 1.0], np.zeros(997))[:, None]
    assert window_of(decay)[0][1] < 5
    assert window_of(decay, decay[:1])[0][1] > 5


@together("value", [0.0, 1.0, -3.0, 1e300, 1e-300, 1.7e308])
def test_one_value_stands_in_the_middle_of_a_window_of_positive_length(value):
    ((low, high),) = window_of(np.full((3, 1), value))
    assert 0 < high - low < np.inf


def test_the_axes_are_those_that_are_filled_and_in_order_and_the_first_where_nothing_moves():
    t = np.linspace(0, 50, 3000)
    points = np.stack([t, 0 * t, np.sin(np.sqrt(2) * t), 2 * t, np.cos(t)], axis=1)
    assert fullest_axes(points, 2) in ((0, 2), (0, 4), (2, 4))
    assert 1 not in fullest_axes(points, 3)
    assert [fullest_axes(np.ones((4, dim)), count) for dim, count in [(2, 2), (5, 3)]] == [(0, 1), (0, 1, 2)]


BOX = ((-3.0, 3.0), (-3.0, 3.0))


def planar(*rhs):
    return QuadraticSystem.from_text(["x", "y"], rhs)


@pytest.mark.parametrize(
    ("rhs", "kind"),
    [
        (("y", "-x"), "center"),
        (("x + y", "y - x"), "focus"),
        (("x", "2*y"), "node"),
        (("x", "-y"), "saddle"),
        (("y", "x^2"), "degenerate equilibrium"),
    ],
)
def test_eigenvalues_tell_the_kind(rhs, kind):
    assert equilibria(planar(*rhs))[0].kind == kind


def test_arrows_have_the_direction_of_the_field_along_the_axes_as_they_are_drawn():
    flow = plane_flow(planar("x", "-y"), (1, 0), BOX)  # y to the right
    assert (flow.arrows[flow.places[:, 0] > 0, 0] < 0).all()
    lengths = np.linalg.norm(flow.arrows, axis=1)
    assert np.allclose(lengths[lengths > 0], 1)
    assert (lengths == 0).sum() == 1, "the saddle"


def test_separatrices_lie_on_the_level_of_their_saddle():
    flow = plane_flow(planar("y", "x - x^2"), (0, 1), BOX)  # H = y^2/2 - x^2/2 + x^3/3
    inside = [curve[(np.abs(curve) <= 3).all(axis=1)].T for curve in flow.separatrices]
    assert len(inside) == 4
    # the offset from the saddle is 6e-3 and along the eigenvector H is of the third order
    assert max(np.abs(y**2 / 2 - x**2 / 2 + x**3 / 3).max() for x, y in inside) < 1e-6
    assert max(x.max() for x, _ in inside) == pytest.approx(1.5, abs=1e-3)


def test_a_solution_passes_what_is_a_pole_in_time_and_ends_after_its_time():
    curve = solution(VectorField(planar("x^2", "1")), np.array([1.0, 0.0]), BOX)  # x = 1/(1 - t), y = t
    assert np.allclose(curve[:, 0] * (1 - curve[:, 1]), 1, atol=1e-8)
    assert curve[-1, 0] > 3
    rotation, start = VectorField(planar("y", "-x")), np.array([1.0, 0.0])
    short, past = (solution(rotation, start, BOX, time) for time in (1.0, -1.0))
    assert short[-1] == pytest.approx([np.cos(1), -np.sin(1)], abs=2 / 400 * 6)
    assert past[-1, 1] > 0 > short[-1, 1]


@pytest.mark.parametrize("name", ["lotka_volterra", "henon_heiles", "euler_top"])
def test_orbits_from_chosen_starts_stay_and_move_and_are_the_same_every_time(name):
    system = load(name, {}).system
    starts = automatic_starts(system, "1/20")
    points = follow_orbits(ensemble_for(system, "1/20", starts, 300), 300).points
    assert starts.shape == (START_COUNT, system.dim)
    assert np.abs(points).max() < 20
    assert (np.ptp(points, axis=0).max(axis=1) > 1e-3).all()
    np.testing.assert_array_equal(automatic_starts(system, "1/20"), starts)


def test_starts_of_the_predator_and_its_prey_surround_the_equilibrium_of_the_equations():
    # a = 2, b = 1, c = 1, d = 3: the equilibrium with positive coordinates is (d/c, a/b) = (3, 2)
    assert (automatic_starts(load("lotka_volterra", {"a": "2", "d": "3"}).system, "1/40") > [3, 2]).all()


def test_starts_lie_along_the_plane_that_is_named_and_need_no_equilibrium_and_no_motion():
    starts = automatic_starts(load("henon_heiles", {}).system, "1/10", plane=(1, 3))
    assert np.abs(starts[:, 1]).max() == np.abs(starts).max()
    for rhs in ("0", "x^2 + 1"):
        assert automatic_starts(QuadraticSystem.from_text(["x"], [rhs]), "1/10").shape == (START_COUNT, 1)
