"""Invariant curves: planes and orbits agree with the exact map, dots lie on their curves, and wrong ones do not."""

from dataclasses import replace

import numpy as np
import pytest
from flint import fmpq_poly
from helpers import refuses, together

from kahanmaps.algebra.fields import QQ
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import HypothesisError
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.maps.floats.float_orbit import to_floats
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.plots.curves.invariant_curves import find_invariant_curves
from kahanmaps.plots.curves.plane_cubics import ONE_LINE, THREE_LINES, ZERO
from kahanmaps.plots.curves.plot_invariant_curves import Disc, panels_of, plot_invariant_curves, view_of
from kahanmaps.plots.style import Style
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

STYLE = Style(width=12)
START = {2: ["1/3", "1/5"], 4: ["1/2", "-1/3", 0, 1], 6: [1, 0, "1/2", 0, "1/3", 1]}
# Dots and coefficients are right to 2^-53; the defect is relative to the terms of the equation, about ten of them.
ROUNDING = 1e-14


def monkey_saddle():
    return QuadraticSystem.from_text(["x", "y"], ["-6*x*y", "3*y^2 - 3*x^2"])  # H = x^3 - 3 x y^2


def defect(cubic, u, v):
    """How far points are from a curve: the largest of its equation there, over the sum of the terms of it."""
    (a, b, c, d), (p, q, r) = cubic.h, cubic.D
    terms = [cubic.denominator * term for term in (a * u**3, b * u * u * v, c * u * v * v, d * v**3)]
    terms += [-cubic.numerator * cubic.eps**2 * term for term in (p * u * u, q * u * v, r * v * v)]
    terms.append(-cubic.numerator + 0 * u)
    size = sum(map(abs, terms))
    return float(np.max(np.abs(sum(terms)) / np.where(size > 0, size, 1.0)))


def another_structure():
    return SystemFile.from_hamiltonian(CubicHamiltonian(load("paper_m2").hamiltonian.H, 3 * standard_structure(4)))


PLUS = random_member_with_eigenvalues([1, -2], seed=7)
MEMBERS = {
    "m = 1": lambda: SystemFile.from_system(monkey_saddle()),
    "m = 2": lambda: load("paper_m2"),
    "m = 3": lambda: load("paper_m3"),
    "real quadratic roots": lambda: SystemFile.from_member(random_member_with_chi(fmpq_poly([-2, 0, 1]), seed=3)),
    "one real root of three": lambda: load("paper_m3_irreducible"),
    "a sign": lambda: SystemFile.from_member(replace(PLUS, signs=(1, -1))),
    "hidden": lambda: SystemFile.from_system(load("paper_m2").system),
    "hidden, another J": another_structure,
}


@pytest.fixture(scope="module")
def curves():
    cache = {}

    def of(name):
        if name not in cache:
            file = MEMBERS[name]()
            cache[name] = find_invariant_curves(file, [START[file.system.dim]], "1/20", 60)
        return cache[name]

    return of


@pytest.mark.parametrize("name", MEMBERS)
def test_all_dots_lie_on_the_curve_of_their_plane_and_those_of_another_eps_do_not(curves, name):
    file = MEMBERS[name]()
    other = find_invariant_curves(file, [START[file.system.dim]], "1/21", 60)
    for plane, wrong in zip(curves(name).planes, other.planes, strict=True):
        [orbit], [moved] = plane.orbits, wrong.orbits
        if plane.is_real:
            assert defect(orbit.cubic, orbit.u, orbit.v) < ROUNDING
            assert plane.shape == ZERO or defect(orbit.cubic, moved.u, moved.v) > 1e-4


def test_dots_of_one_plane_do_not_lie_on_the_curve_of_another(curves):
    first, second = curves("m = 2").planes
    assert defect(first.orbits[0].cubic, second.orbits[0].u, second.orbits[0].v) > 0.01


@pytest.mark.parametrize("name", MEMBERS)
def test_the_planes_together_are_the_exact_orbit(curves, name):
    file, result = MEMBERS[name](), curves(name)
    phi, point = KahanMap(file.system, "1/20"), START[file.system.dim]
    for k in range(8):
        # The planes are added up in doubles: a few roundings of numbers as large as the orbit's.
        assert result.originals[0][k] == pytest.approx(to_floats(phi.point(point)), rel=1e-10, abs=1e-10)
        point = phi.step(point)


def test_the_curve_is_the_conserved_quantity_of_the_catalogue(curves):
    # paper_m2 claims I1 and I2 = h_i/(1 + eps^2 D_i): at the start they are the levels, up to 1/chi'(root) = -1, 1
    file, result = load("paper_m2"), curves("m = 2")
    levels = sorted(abs(p.orbits[0].cubic.numerator / p.orbits[0].cubic.denominator) for p in result.planes)
    point = [QQ.convert(entry) for entry in (*START[4], "1/20")]
    claimed = [f.numerator(*point) / f.denominator(*point) for f in file.integrals.values()]
    assert levels == pytest.approx(sorted(map(abs, to_floats(claimed))))


def test_roots_are_named_exactly_where_they_are_rational(curves):
    assert [plane.root_text for plane in curves("m = 3").planes] == ["1", "2", "3"]
    assert [plane.root_text for plane in curves("real quadratic roots").planes] == ["-1.4142", "1.4142"]
    # t^3 + t^2 - 1, by PARI/GP 2.15: polroots
    assert [plane.root_text for plane in curves("one real root of three").planes] == ["0.75488", "-0.87744 +- 0.74486i"]


def test_a_complex_plane_has_two_panels_with_dots_but_no_curve(curves):
    result = curves("one real root of three")
    real, pair = result.planes
    assert (real.orbits[0].cubic is None, pair.orbits[0].cubic is None) == (False, True)
    assert np.iscomplexobj(pair.orbits[0].u)
    assert [(place, column) for place, _, column in panels_of(result)] == [("1", "uv"), ("2", "u"), ("2", "v")]


def test_a_sign_turns_one_plane_around(curves):
    plus = find_invariant_curves(SystemFile.from_member(PLUS), [START[4]], "1/20", 3)
    # The first factor is t + 2 with sign +: same plane, same orbit; the other one has h -> -h.
    assert [plane.root_text for plane in plus.planes] == ["-2", "1"]
    same, turned = curves("a sign").planes
    assert same.orbits[0].u[:4] == pytest.approx(plus.planes[0].orbits[0].u)
    assert abs(turned.orbits[0].u[1] - plus.planes[1].orbits[0].u[1]) > 1e-6


def test_one_pole_ends_the_orbit_in_all_planes_and_a_plane_at_rest_is_said_to_be_one():
    system = QuadraticSystem.from_text(["x", "y", "z", "w"], ["-6*x*z", "0", "3*z^2 - 3*x^2", "-y^2"])
    curves = find_invariant_curves(SystemFile.from_system(system), [["3/5", 1, "4/5", 1]], "1/6", 5)
    assert {len(plane.orbits[0].u) for plane in curves.planes} == {1}
    system = QuadraticSystem.from_text(["x", "y", "z", "w"], ["0", "0", "-x^2", "0"])
    curves = find_invariant_curves(SystemFile.from_system(system), [[1, 3, 1, 1]], "1/6", 5)
    assert ZERO in [plane.shape for plane in curves.planes]


@together(
    "starts, steps, message",
    [
        ([], 5, "found 0 initial points"),
        ([START[4]] * 8, 5, "found 8 initial points"),
        ([START[4]], -1, "found -1 steps"),
    ],
)
def test_wrong_sizes_are_refused(starts, steps, message):
    refuses(message, find_invariant_curves, load("paper_m2"), starts, "1/20", steps)


def test_a_system_without_normal_form_is_refused_with_the_reason():
    file = SystemFile.from_member(random_member_with_eigenvalues([1, 1], seed=7))
    refuses("chi has a repeated root", find_invariant_curves, file, [START[4]], "1/20", 5, error=HypothesisError)


def test_the_dots_drawn_are_the_orbit_and_those_of_one_step_have_one_color_in_all_panels(curves):
    result = curves("m = 3")
    clouds = [axes.collections[0] for axes in plot_invariant_curves(result, STYLE, original=(0, 1)).axes[:4]]
    for cloud in clouds:
        assert np.array_equal(cloud.get_array(), np.arange(61))
        assert cloud.norm is clouds[0].norm
    orbit = result.planes[1].orbits[0]
    assert np.array_equal(clouds[2].get_offsets(), np.stack([orbit.u, orbit.v], axis=1))


def test_the_lines_drawn_lie_on_the_curve(curves):
    result = curves("m = 2")
    lines = [line for line in plot_invariant_curves(result, STYLE).axes[0].lines if line.get_marker() == "None"]
    u, v = (np.concatenate([line.get_data()[k] for line in lines]) for k in (0, 1))
    window = view_of(result.planes[0])
    inside = np.hypot(u, v) < 10 * np.abs(window.window).max()  # what is farther is cut off where it is not seen
    assert inside.any()
    assert defect(result.planes[0].orbits[0].cubic, u[inside], v[inside]) < 1e-7


def test_a_circle_of_poles_is_met_at_the_first_step_and_said_in_the_picture():
    # 1 + eps^2 D = 1 - 36 eps^2 (x^2 + y^2) is 0 at (3/5, 4/5) for eps = 1/6
    curves = find_invariant_curves(SystemFile.from_system(monkey_saddle()), [["3/5", "4/5"], [1, 3]], "1/6", 5)
    assert curves.poles == (1, None)
    figure = plot_invariant_curves(curves, STYLE, labels=("one", "two"))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["one (a pole at step 1)", "two"]


def test_the_disc_shows_every_dot_on_its_curve(curves):
    result = curves("m = 2")
    for axes in plot_invariant_curves(result, STYLE, projective=True).axes[:2]:
        assert np.linalg.norm(axes.collections[0].get_offsets(), axis=1).max() <= 1
    plane = result.planes[0]
    orbit, disc = plane.orbits[0], Disc.of(plane)
    x, y = disc.place(orbit.u, orbit.v)
    vertices = np.concatenate(disc.curves(orbit.cubic))
    # neighbouring vertices are at most 0.02 apart
    assert max(np.linalg.norm(vertices - point, axis=1).min() for point in np.stack([x, y], axis=1)) < 0.02


def test_the_window_counts_what_it_leaves_out(curves):
    plane = curves("m = 2").planes[0]
    view, orbit = view_of(plane), plane.orbits[0]
    (left, right), (low, high) = view.window
    is_inside = (left <= orbit.u) & (orbit.u <= right) & (low <= orbit.v) & (orbit.v <= high)
    assert view.outside == np.sum(~is_inside)
    assert view.outside < 0.25 * len(orbit.u)


def test_a_threefold_curve_is_drawn_with_equal_scales(curves):
    stretches = {plane.shape: view_of(plane).stretch for plane in curves("m = 2").planes}
    assert stretches[THREE_LINES] == 1 != stretches[ONE_LINE]
