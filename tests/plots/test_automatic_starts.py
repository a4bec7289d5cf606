"""Chosen starts: the same ones every time, different orbits, and orbits that stay where the system lets them."""

import numpy as np
import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.plots.portraits.automatic_starts import COUNT, automatic_starts
from kahanmaps.plots.portraits.trajectories import ensemble_for, walked
from kahanmaps.systems.quadratic import QuadraticSystem


@pytest.mark.parametrize("name", ["lotka_volterra", "henon_heiles", "euler_top"])
def test_orbits_from_chosen_starts_stay_and_move(name):
    system = load(name, {}).system
    starts = automatic_starts(system, "1/20")
    points = walked(ensemble_for(system, "1/20", starts, 300), 300).points
    assert starts.shape == (COUNT, system.dim)
    assert np.abs(points).max() < 20
    assert (np.ptp(points, axis=0).max(axis=1) > 1e-3).all()


def test_starts_are_the_same_every_time():
    system = load("weierstrass", {}).system
    np.testing.assert_array_equal(automatic_starts(system, "1/10"), automatic_starts(system, "1/10"))


def test_starts_of_the_predator_and_its_prey_surround_the_equilibrium_of_the_equations():
    # a = 2, b = 1, c = 1, d = 3: the equilibrium with positive coordinates is (d/c, a/b) = (3, 2)
    starts = automatic_starts(load("lotka_volterra", {"a": "2", "d": "3"}).system, "1/40")
    assert (starts > [3, 2]).all()


@pytest.mark.parametrize("rhs", [["0"], ["x^2 + 1"]])
def test_there_are_starts_without_an_equilibrium_or_motion(rhs):
    assert automatic_starts(QuadraticSystem.from_text(["x"], rhs), "1/10").shape == (COUNT, 1)


def test_starts_lie_along_the_plane_that_is_named():
    starts = automatic_starts(load("henon_heiles", {}).system, "1/10", plane=(1, 3))
    assert np.abs(starts[:, 1]).max() == np.abs(starts).max()
