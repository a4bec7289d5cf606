"""What a portrait shows of the differential equation, against curves and equilibria that are known; chosen starts."""

import numpy as np
import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.maps.floats.classical import VectorField
from kahanmaps.plots.portraits.flow import COUNT, automatic_starts, equilibria, plane_flow, solution
from kahanmaps.plots.portraits.trajectories import ensemble_for, walked
from kahanmaps.systems.quadratic import QuadraticSystem

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
    to_the_right = flow.places[:, 0] > 0
    assert (flow.arrows[to_the_right, 0] < 0).all()
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


# Starts


@pytest.mark.parametrize("name", ["lotka_volterra", "henon_heiles", "euler_top"])
def test_orbits_from_chosen_starts_stay_and_move_and_are_the_same_every_time(name):
    system = load(name, {}).system
    starts = automatic_starts(system, "1/20")
    points = walked(ensemble_for(system, "1/20", starts, 300), 300).points
    assert starts.shape == (COUNT, system.dim)
    assert np.abs(points).max() < 20
    assert (np.ptp(points, axis=0).max(axis=1) > 1e-3).all()
    np.testing.assert_array_equal(automatic_starts(system, "1/20"), starts)


def test_starts_of_the_predator_and_its_prey_surround_the_equilibrium_of_the_equations():
    # a = 2, b = 1, c = 1, d = 3: the equilibrium with positive coordinates is (d/c, a/b) = (3, 2)
    starts = automatic_starts(load("lotka_volterra", {"a": "2", "d": "3"}).system, "1/40")
    assert (starts > [3, 2]).all()


def test_starts_lie_along_the_plane_that_is_named_and_need_no_equilibrium_and_no_motion():
    starts = automatic_starts(load("henon_heiles", {}).system, "1/10", plane=(1, 3))
    assert np.abs(starts[:, 1]).max() == np.abs(starts).max()
    for rhs in ("0", "x^2 + 1"):
        assert automatic_starts(QuadraticSystem.from_text(["x"], [rhs]), "1/10").shape == (COUNT, 1)
