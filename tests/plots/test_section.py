"""Poincare sections: crossings of known curves, integrals at the crossings, and the level curves drawn with them."""

import numpy as np
import pytest

from kahanmaps import FloatEnsemble, InputError, load
from kahanmaps.plots.comparison.functions import requested_axis
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.section import crossings_of, hyperplane_of, plot_section, restrict, section_of

TOP = load("euler_top")
NAMES = ["x1", "x2", "x3"]


@pytest.mark.parametrize(("step", "error"), [(0.2, 1e-6), (0.1, 1e-8), (0.05, 1e-10)])
def test_crossings_of_a_helix_have_an_error_of_order_6(step, error):
    t = step * np.arange(2000) + 0.01
    helix = np.stack([np.cos(t), np.sin(t), t], axis=1)
    for direction, first in (("up", 1.5 * np.pi), ("down", 0.5 * np.pi)):
        points, skipped = crossings_of(helix, helix[:, 0], direction)
        at = points[:, 2]
        expected = first + 2 * np.pi * np.arange(len(at))
        assert len(at) == int((t[-3] - first) / (2 * np.pi)) + 1
        assert np.abs(at - expected).max() < error
        assert np.abs(points[:, 0]).max() < 1e-12
        assert not skipped


def test_crossings_between_distant_points_are_left_out():
    """tan t runs through infinity: its values change sign there without a crossing."""
    t = 0.1 * np.arange(400) + 0.03
    points = np.stack([np.tan(t), t], axis=1)
    found, skipped = crossings_of(points, points[:, 0], "down")
    assert len(found) == 0
    assert skipped > 10
    assert len(crossings_of(points, points[:, 0], "up")[0]) > 10


def section(eps, steps=4000):
    ensemble = FloatEnsemble(TOP, eps, np.array([[0.3, 1.0, -0.5], [-0.2, 0.4, 0.9]]))
    return section_of(ensemble, point_function("x1 - 1/10", NAMES), steps)


def test_integrals_have_their_values_at_the_crossings():
    for k, points in enumerate(section("1/20").crossings):
        assert len(points) > 50
        for name in ("F1", "F2"):
            integral = requested_axis(TOP, load("euler_top").at("1/20").eps, name)
            start = np.array([[0.3, 1.0, -0.5], [-0.2, 0.4, 0.9]][k])
            assert np.abs(integral(points) - integral(start)).max() < 1e-7
            assert np.abs(integral(points + np.array([0, 0.01, 0.01])) - integral(start)).max() > 1e-5


def test_portions_of_an_orbit_are_joined():
    """An ensemble delivers points in portions; the crossings are those of the whole orbit."""
    ensemble = FloatEnsemble(TOP, "1/20", np.array([[0.3, 1.0, -0.5]]))
    points = np.concatenate(list(ensemble.records(4000, 1)))[:, 0]
    assert np.array_equal(crossings_of(points, points[:, 0] - 0.1)[0], section("1/20").crossings[0])


def test_an_integral_is_restricted_to_the_hyperplane():
    plane = point_function("x1 - 2*x2 - 1", NAMES)
    restricted = restrict(point_function("x1^2 + x3", NAMES), plane, (1, 2))
    assert restricted(np.array([7.0, 2.0, 3.0])) == 28
    assert restrict(point_function("x1^2 + x3", NAMES), plane, (0, 1)) is None


def test_the_level_curves_lead_through_the_crossings():
    found = section("1/20")
    axes = [point_function(name, NAMES) for name in ("x2", "x3")]
    integral = restrict(requested_axis(TOP, TOP.at("1/20").eps, "F1"), point_function("x1 - 1/10", NAMES), (1, 2))
    figure = plot_section(found, axes, curves=[integral])
    (lines,) = figure.axes[0].collections
    vertices = np.concatenate([path.vertices for path in lines.get_paths()])
    nearest = [np.linalg.norm(vertices - points[0, 1:], axis=1).min() for points in found.crossings]
    assert max(nearest) < 0.02
    with pytest.raises(InputError, match="found no crossing"):
        plot_section(section("1/20", 3), axes)


@pytest.mark.parametrize("text", ["x1^2", "1/x1 = 2", "3", "x1*x2=1", "eps*x1 = 0"])
def test_a_hyperplane_is_a_linear_equation(text):
    eps = TOP.at("1/20").eps
    with pytest.raises(InputError, match="expected a linear equation"):
        hyperplane_of(TOP, eps, text)
    assert hyperplane_of(TOP, eps, "x1 - 2*x2 = -1/3")(np.array([1.0, 2.0, 5.0])) == pytest.approx(-8 / 3)


def test_the_variable_that_is_constant_is_no_axis():
    assert section("1/20").widest_axes(point_function("x1 - 1/10", NAMES)) == (1, 2)
