"""Densities: every point is counted once, in the cell it lies in, whatever the portions."""

import numpy as np
import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.plots import density
from kahanmaps.plots.density import density_of
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.trajectories import ensemble_for, portions_of, walked

AXES = [point_function(name, ["x", "y"]) for name in "xy"]
UNIT = ((0.0, 1.0), (0.0, 1.0))


def test_counts_are_those_of_numpy():
    points = np.random.default_rng(0).normal(0.5, 0.4, (5000, 2))
    found = density_of([points], AXES, UNIT, (7, 11))
    expected, _, _ = np.histogram2d(points[:, 1], points[:, 0], bins=(7, 11), range=UNIT)
    np.testing.assert_array_equal(found.counts, expected)
    assert found.counts.sum() + found.outside == found.points == 5000


def test_portions_do_not_matter(monkeypatch):
    points = np.random.default_rng(1).random((999, 3, 2))
    whole = density_of([points], AXES, UNIT, (5, 5))
    monkeypatch.setattr(density, "_AT_ONCE", 100)
    np.testing.assert_array_equal(density_of(portions_of(points, 50), AXES, UNIT, (5, 5)).counts, whole.counts)


def test_the_streamed_counts_are_those_of_the_kept_points():
    system = load("lotka_volterra", {}).system
    starts = np.array([[1.0, 2.0], [1.0, 3.0]])
    window = ((0.0, 4.0), (0.0, 4.0))
    streamed = density_of(ensemble_for(system, "1/20", starts, 500).records(500, 1), AXES, window, (9, 9))
    kept = walked(ensemble_for(system, "1/20", starts, 500), 500).points
    np.testing.assert_array_equal(streamed.counts, density_of([kept], AXES, window, (9, 9)).counts)
    assert streamed.points == 2 * 501


def test_points_on_the_edges_are_inside():
    corners = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]])
    assert density_of([corners], AXES, UNIT, (2, 2)).counts.tolist() == [[1, 1], [1, 1]]


def test_orbits_that_have_ended_are_neither_inside_nor_outside():
    found = density_of([np.array([[np.nan, np.nan], [0.5, 0.5], [2.0, 0.5]])], AXES, UNIT, (1, 1))
    assert (found.points, found.outside, found.counts.tolist()) == (2, 1, [[1]])


def test_infinite_values_and_huge_ones_are_outside():
    found = density_of([np.array([[1e308, 0.5], [-1e308, 0.5]])], AXES, UNIT, (1, 1))
    assert found.outside == 2


@pytest.mark.parametrize(("axes", "shape"), [(AXES[:1], (2, 2)), (AXES, (0, 2)), (AXES, (10**5, 10**5))])
def test_wrong_grids_are_refused(axes, shape):
    with pytest.raises(InputError):
        density_of([np.zeros((1, 2))], axes, UNIT, shape)
