"""Level curves: their vertices lie on the level, poles make no curves, orbits of the map lie on those of integrals."""

import numpy as np
import pytest
from flint import fmpq

from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.plots.curves.level_sets import level_curves, levels_through
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.trajectories import ensemble_for, walked

SQUARE = ((-2.0, 2.0), (-2.0, 2.0))
STARTS = np.array([[-0.5, 0.0], [-0.3, 0.4]])


@pytest.fixture(scope="module")
def weierstrass():
    file = load("weierstrass", {})
    points = walked(ensemble_for(file.system, "1/5", STARTS, 200), 200).points
    return file, points


def distances(points, curves):
    """From each point to the nearest vertex."""
    vertices = np.concatenate([piece for pieces in curves for piece in pieces])
    return np.array([np.hypot(*(vertices - x).T).min() for x in points.reshape(-1, 2)])


def test_the_integral_has_its_level_at_every_vertex(weierstrass):
    file, _ = weierstrass
    function = point_function("modified_H", file.variables, fmpq(1, 5), named=file.integrals)
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
    function = point_function(text, file.variables, fmpq(1, 5), named=file.integrals)
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


def test_functions_of_other_variables_and_too_many_levels_are_refused():
    with pytest.raises(InputError, match="found y in it, expected a function of x and z alone"):
        level_curves(point_function("x + y", ["x", "y", "z"]), (0, 2), 3, [1.0], SQUARE)
    with pytest.raises(InputError, match="found 201 levels"):
        level_curves(point_function("x", ["x", "y"]), (0, 1), 2, range(201), SQUARE)
