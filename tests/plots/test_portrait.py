"""Portraits: the numbers that are shown, and what is in the figure that shows them."""

from dataclasses import replace

import numpy as np
from matplotlib.collections import PathCollection

from kahanmaps.documents.catalog import load
from kahanmaps.plots.figures import picture_bytes
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.flow import plane_flow
from kahanmaps.plots.portraits.portrait import neighbours, plot_portrait, portrait_of
from kahanmaps.plots.portraits.trajectories import Trajectories, ensemble_for, euler_orbits, walked
from kahanmaps.plots.style import Style
from kahanmaps.systems.quadratic import QuadraticSystem

STYLE = Style(width=8.6, font_size=8)
AXES = [point_function(name, ["x", "y"]) for name in "xy"]
LOTKA_VOLTERRA = load("lotka_volterra", {}).system


def orbits(count, steps=20):
    starts = np.stack([np.ones(count), 1.5 + np.arange(count) / count], axis=1)
    return walked(ensemble_for(LOTKA_VOLTERRA, "1/20", starts, steps), steps)


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
    result = walked(ensemble_for(QuadraticSystem.from_text(["x"], ["x^2"]), "1", np.array([[0.5], [3.0]]), 2), 2)
    # (x~ - x)/2 = x x~ has a pole at x = 1/2
    assert result.ended == {"met a singular matrix I - eps f'": 1}
    assert portrait_of(result, ["step", point_function("x", "x")]).undefined == 0


def test_explicit_euler_is_what_its_formula_says_and_spirals_outward_where_kahans_orbit_does_not():
    start, (x, y) = np.array([[1.0, 2.0]]), (1.0, 2.0)
    euler = euler_orbits(LOTKA_VOLTERRA, "1/20", start, 100).points
    np.testing.assert_allclose(euler[1, 0], [x + 0.1 * x * (1 - y), y + 0.1 * y * (x - 1)])
    kahan = walked(ensemble_for(LOTKA_VOLTERRA, "1/20", start, 2000), 2000).points
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
    result = walked(ensemble_for(top, "1/10", np.array([[1.0, 0.5, 0.2]]), 100), 100)
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


# Neighbours on a curve


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
    nearly_rational = neighbours(circle((2 * np.pi / 20 + 1e-4) * np.arange(200)))
    assert np.bincount(nearly_rational.ravel()).tolist() == [2] * 200


def test_a_cloud_has_no_curve():
    assert neighbours(np.random.default_rng(1).uniform(size=(300, 2))) is None
    assert neighbours(np.full((50, 2), np.nan)) is None


def test_initial_points_and_equilibria_have_different_marks_and_both_are_in_the_legend():
    result = orbits(8)
    shown = replace(portrait_of(result, AXES), flow=plane_flow(LOTKA_VOLTERRA, (0, 1), ((-1, 3), (-1, 3))))
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
