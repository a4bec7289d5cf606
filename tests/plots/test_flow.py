"""What a portrait shows of the differential equation, against curves and equilibria that are known."""

import numpy as np
import pytest

from kahanmaps.plots.portraits.flow import equilibria, plane_flow, solutions
from kahanmaps.plots.portraits.portrait import neighbours
from kahanmaps.systems.quadratic import QuadraticSystem

BOX = ((-3.0, 3.0), (-3.0, 3.0))


def planar(*rhs):
    return QuadraticSystem.from_text(["x", "y"], rhs)


@pytest.mark.parametrize(
    ("rhs", "kind"),
    [
        (("y", "-x"), "centre"),
        (("x + y", "y - x"), "focus"),
        (("x", "2*y"), "node"),
        (("x", "-y"), "saddle"),
        (("y", "x^2"), "degenerate equilibrium"),
    ],
)
def test_eigenvalues_tell_the_kind(rhs, kind):
    assert equilibria(planar(*rhs))[0].kind == kind


def test_equilibria_that_fill_a_line_are_not_marked():
    assert len(equilibria(planar("x*y", "x"))) > 4
    assert plane_flow(planar("x*y", "x"), (0, 1), BOX).equilibria == ()


def test_arrows_have_the_direction_of_the_field_along_the_axes_as_they_are_drawn():
    found = plane_flow(planar("x", "-y"), (1, 0), BOX)  # y to the right
    to_the_right = found.places[:, 0] > 0
    assert (found.arrows[to_the_right, 0] < 0).all()
    lengths = np.linalg.norm(found.arrows, axis=1)
    assert np.allclose(lengths[lengths > 0], 1)
    assert (lengths == 0).sum() == 1, "the saddle"


def test_separatrices_lie_on_the_level_of_their_saddle():
    found = plane_flow(planar("y", "x - x^2"), (0, 1), BOX)  # H = y^2/2 - x^2/2 + x^3/3
    inside = [curve[(np.abs(curve) <= 3).all(axis=1)].T for curve in found.separatrices]
    assert len(inside) == 4
    # the offset from the saddle is 6e-3 and along the eigenvector H is of the third order
    assert max(np.abs(y**2 / 2 - x**2 / 2 + x**3 / 3).max() for x, y in inside) < 1e-6
    assert max(x.max() for x, _ in inside) == pytest.approx(1.5, abs=1e-3)


def test_a_solution_passes_what_is_a_pole_in_time_and_ends_after_its_time():
    (curve,) = solutions(planar("x^2", "1"), np.array([[1.0, 0.0]]), BOX)  # x = 1/(1 - t), y = t
    assert np.allclose(curve[:, 0] * (1 - curve[:, 1]), 1, atol=1e-8)
    assert curve[-1, 0] > 3
    (short,) = solutions(planar("y", "-x"), np.array([[1.0, 0.0]]), BOX, time=1.0)
    assert short[-1] == pytest.approx([np.cos(1), -np.sin(1)], abs=2 / 400 * 6)
    (past,) = solutions(planar("y", "-x"), np.array([[1.0, 0.0]]), BOX, time=-1.0)
    assert past[-1, 1] > 0 > short[-1, 1]


def test_neighbours_on_two_circles_are_joined_and_the_circles_are_not():
    turn = 2.4 * np.arange(100)
    points = np.stack([np.cos(turn) + 5 * (np.arange(100) % 2), np.sin(turn), 0 * turn], axis=1)
    pairs = neighbours(points)
    assert len(pairs) == 100
    assert (pairs[:, 0] % 2 == pairs[:, 1] % 2).all()
    assert np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1).max() < 0.4


def test_an_orbit_that_has_not_come_round_has_two_ends():
    turn = np.linspace(0, 5, 50)
    assert len(neighbours(np.stack([np.cos(turn), np.sin(turn)], axis=1))) == 49


def test_bunches_of_a_nearly_rational_rotation_are_joined_to_one_curve():
    turn = (2 * np.pi / 20 + 1e-4) * np.arange(200)
    pairs = neighbours(np.stack([np.cos(turn), np.sin(turn)], axis=1))
    assert np.bincount(pairs.ravel()).tolist() == [2] * 200


def test_a_cloud_has_no_curve():
    assert neighbours(np.random.default_rng(1).uniform(size=(300, 2))) is None
    assert neighbours(np.full((50, 2), np.nan)) is None
