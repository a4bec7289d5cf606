"""Level curves: their vertices lie on the level, poles make no curves, orbits of the map lie on those of integrals."""

import numpy as np
import pytest
from flint import fmpq
from helpers import refuses

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.documents.catalog import load
from kahanmaps.errors import ExpressionError
from kahanmaps.plots.curves.level_sets import level_curves, levels_through
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.trajectories import ensemble_for, follow_orbits

SQUARE = ((-2.0, 2.0), (-2.0, 2.0))
STARTS = np.array([[-0.5, 0.0], [-0.3, 0.4]])


@pytest.fixture(scope="module")
def weierstrass():
    file = load("weierstrass", {})
    return file, follow_orbits(ensemble_for(file.system, "1/5", STARTS, 200), 200).points


def distances(points, curves):
    """From each point to the nearest vertex."""
    vertices = np.concatenate([piece for pieces in curves for piece in pieces])
    return np.array([np.hypot(*(vertices - x).T).min() for x in points.reshape(-1, 2)])


def test_the_integral_has_its_level_at_every_vertex(weierstrass):
    file, _ = weierstrass
    function = point_function("modified_H", file.variables, fmpq(1, 5), known_functions=file.integrals)
    levels = levels_through(function, STARTS)
    curves = level_curves(function, (0, 1), 2, levels, ((-1.5, 1.0), (-2.0, 2.0)))
    for level, pieces in zip(levels, curves, strict=True):
        assert pieces
        for piece in pieces:
            # Newton's method ends at the rounding of polynomials with values of order 1 and gradients not below 0.1
            np.testing.assert_allclose(function(piece), level, atol=1e-12)


@pytest.mark.parametrize(("text", "is_kept"), [("modified_H", True), ("-2*x^3 + y^2/2 + 2*x", False)])
def test_orbits_lie_on_the_curves_of_the_integral_and_leave_those_of_the_energy_of_the_flow(weierstrass, text, is_kept):
    file, points = weierstrass
    function = point_function(text, file.variables, fmpq(1, 5), known_functions=file.integrals)
    curves = level_curves(function, (0, 1), 2, levels_through(function, STARTS), ((-1.5, 1.0), (-2.0, 2.0)))
    mesh = 4 / 300  # vertices are at most that far apart along the curve
    farthest = distances(points, curves).max()
    assert farthest < 0.75 * mesh if is_kept else farthest > 2 * mesh


def test_a_pole_is_no_curve():
    # 1/x changes its sign across x = 0, where it is never 1: contours of its values would run along the pole
    curves = level_curves(point_function("1/x", ["x", "y"]), (0, 1), 2, [1.0], SQUARE)
    np.testing.assert_allclose(np.concatenate(curves[0])[:, 0], 1.0)


def test_levels_through_starts_are_each_once_and_poles_none():
    function = point_function("x/y", ["x", "y"])
    assert levels_through(function, np.array([[2.0, 1.0], [4.0, 2.0], [1.0, 0.0], [-1.0, 1.0]])) == (-1.0, 2.0)


def test_the_plane_may_be_one_of_many_variables():
    curves = level_curves(point_function("z - x", ["x", "y", "z"]), (2, 0), 3, [1.0], SQUARE)
    z, x = np.concatenate(curves[0]).T
    np.testing.assert_allclose(z - x, 1.0)


def test_too_many_levels_are_refused():
    refuses("found 201 levels", level_curves, point_function("x", ["x", "y"]), (0, 1), 2, range(201), SQUARE)


POINTS = np.array([[[1.0, 2.0], [3.0, 0.0]], [[np.nan, np.nan], [-1.0, 5.0]]])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("y", [[2, 0], [np.nan, 5]]),
        ("x^2 - y/2", [[0, 9], [np.nan, -1.5]]),
        ("x/y", [[0.5, np.nan], [np.nan, -0.2]]),  # a pole, and a point that is not there
        ("7", [[7, 7], [np.nan, 7]]),  # a constant is not where there is no point
        ("x + eps + a", [[4.25, 6.25], [np.nan, 2.25]]),
    ],
)
def test_values_keep_the_shape_of_the_points(text, expected):
    function = point_function(text, ["x", "y"], fmpq(1, 4), {"a": fmpq(3)})
    np.testing.assert_array_equal(function(POINTS), expected)


def test_a_value_beyond_the_range_of_doubles_is_missing_without_a_warning():
    assert np.isnan(point_function("x^9", ["x"])(np.array([1e200])))


def test_a_name_is_that_of_an_integral_or_unknown():
    named = {"I1": parse_rational_function("x*y/eps", ["x", "y", "eps"])}
    assert point_function("I1", ["x", "y"], fmpq(1, 2), known_functions=named)(np.array([2.0, 3.0])) == 12
    message = "found the name H, expected one of x, y, eps; integrals are named I1"
    refuses(message, point_function, "H", ["x", "y"], known_functions=named)


def test_text_is_parsed_and_nothing_else_and_eps_needs_a_value():
    refuses("a function call", point_function, "__import__('os')", ["x"], error=ExpressionError)
    refuses("no value of eps", point_function, "eps*x", ["x"])


@pytest.mark.parametrize(
    ("text", "label"), [("x1", "$x_1$"), ("x1^2*y", "$x_1^2 y$"), ("(x1-1)/y", "$(x_1 - 1) / y$"), ("y+0*x1", "$y$")]
)
def test_labels_are_formulas_where_they_are_short(text, label):
    assert point_function(text, ["x1", "y"]).label == label
