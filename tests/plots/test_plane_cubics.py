"""Plane cubics: all of the real curve is found, every vertex lies on it; symmetric coordinates are what they claim."""

from itertools import pairwise

import numpy as np
import pytest
from flint import arb, ctx

from kahanmaps.maps.normal_form.planar_block import PlanarBlock
from kahanmaps.plots.curves.plane_cubics import (
    ONE_LINE,
    REPEATED,
    THREE_LINES,
    ZERO,
    PlaneCubic,
    symmetric_coordinates,
    transform_cubic,
)
from kahanmaps.plots.curves.plot_invariant_curves import Disc, Rectangle

FORMS = {
    "three lines": (1.0, 0.0, -3.0, 0.0),
    "one line": (1.0, 0.0, 3.0, 0.0),
    "a double line": (0.0, 1.0, 0.0, 0.0),
    "a cube": (1.0, 0.0, 0.0, 0.0),
    "any": (1.0, 2.0, 3.0, 4.0),
}
ACROSS = 1e-11  # Newton's method ends in roundings of the largest term: of the level, where that is large


def vertices(cubic):
    """The vertices that are drawn in a window, as u and v."""
    size = 3 * max(1, abs(cubic.numerator)) ** (1 / 3)
    return np.concatenate(
        Rectangle(((0.1 - 1.5 * size, 0.1 + 1.5 * size), (0.2 - size, 0.2 + size)), 0).curves(cubic)
    ).T


def arcs(cubic):
    """The whole curve on half a sphere: unit vectors (x, y, w) that stand for (u, v) = length (x, y)/w."""
    for rows in Disc(cubic.length).curves(cubic):
        yield np.column_stack([rows, np.sqrt(np.maximum(0, 1 - (rows**2).sum(axis=1)))])


def distance(cubic, u, v):
    """The largest distance of points from the curve, to first order, relative to how far out they are."""
    (a, b, c, d), (p, q, r) = cubic.h, cubic.D
    D = cubic.eps**2 * (p * u * u + q * u * v + r * v * v)
    value = cubic.denominator * (a * u**3 + b * u * u * v + c * u * v * v + d * v**3) - cubic.numerator * (1 + D)
    return float(np.max(np.abs(value) / np.hypot(*cubic.gradient(u, v)) / (cubic.length + np.hypot(u, v))))


@pytest.mark.parametrize("form", FORMS)
def test_every_vertex_lies_on_the_curve_and_those_of_another_level_do_not(form):
    for level in (1e-3, 0.0962, 0.3, 50.0, 1e6, -0.1):
        cubic = PlaneCubic(FORMS[form], 0.5, level, 1.0)
        assert distance(cubic, *vertices(cubic)) < ACROSS * max(1, abs(level))
    cubic = PlaneCubic(FORMS[form], 0.5, 0.1, 1.0)
    assert distance(PlaneCubic(FORMS[form], 0.5, 0.12, 1.0), *vertices(cubic)) > 1e-3


@pytest.mark.parametrize("level", [-1e-13, 0.0])
def test_at_a_tiny_level_the_curve_is_close_to_the_lines_of_h_and_at_zero_on_them(level):
    u, v = vertices(PlaneCubic(FORMS["three lines"], 0.5, level, 1.0))
    to_lines = [abs(u), abs(u - np.sqrt(3) * v) / 2, abs(u + np.sqrt(3) * v) / 2]
    # beside the origin, where they meet, to a twentieth of a mesh of the grid, which nobody sees
    assert np.min(to_lines, axis=0).max() < 1e-3
    assert np.min(to_lines, axis=0)[np.hypot(u, v) > 0.05].max() < 1e-10


@pytest.mark.parametrize("form", FORMS)
def test_every_line_through_the_origin_meets_the_curve_as_often_as_the_equation_has_roots(form):
    # an independent count: the real roots of s^3 + p s - q for lines between those that were followed
    cubic = PlaneCubic(FORMS[form], 0.5, 0.2, 1.0)
    results = list(arcs(cubic))
    for angle in np.linspace(0.0123, np.pi - 0.01, 40):
        x, y = np.cos(angle), np.sin(angle)
        a, b, c, d = cubic.h
        p, q, r = cubic.D
        D, h = p * x * x + q * x * y + r * y * y, a * x**3 + b * x * x * y + c * x * y * y + d * y**3
        roots = np.roots([1, 0, cubic.eps**2 * D, -h / cubic.numerator])
        expected = sum(abs(root.imag) < 1e-9 for root in roots)
        crossings = 0
        for arc in results:
            side = arc[:, 0] * y - arc[:, 1] * x
            crossings += int(np.sum(side[1:] * side[:-1] < 0))
        assert crossings == expected


def test_neighbouring_vertices_are_close_and_arcs_end_at_infinity_or_at_each_other():
    for arc in arcs(PlaneCubic(FORMS["three lines"], 0.5, 1e-6, 1.0)):
        assert all(abs(before @ after) > np.cos(0.03) for before, after in pairwise(arc))
    result = arcs(PlaneCubic(FORMS["three lines"], 0.5, 0.3, 1.0))
    ends = [row for arc in result for row in (arc[0], arc[-1]) if row[2] > 1e-6]
    for end in ends:
        assert sum(np.linalg.norm(end - other) < 1e-6 for other in ends) == 2


def test_a_start_that_goes_to_infinity_has_the_conic_as_its_curve_and_where_all_curves_meet_there_is_none():
    u, v = vertices(PlaneCubic(FORMS["three lines"], 0.5, 1.0, 0.0))
    assert np.hypot(u, v) == pytest.approx(1 / 3)  # 1 - 36 eps^2 (u^2 + v^2) = 0
    none = PlaneCubic(FORMS["three lines"], 0.5, 0.0, 0.0)
    assert (Rectangle(((-2, 2), (-2, 2)), 0).curves(none), Disc(1.0).curves(none)) == ((), ())


def test_the_flow_moves_on_the_level_of_h():
    u, v = vertices(PlaneCubic(FORMS["one line"], 0.5, 0.2, 1.0).flow_through(1.0, 0.5))
    assert u**3 + 3 * u * v * v == pytest.approx(1.75)


def test_the_gradient_is_the_derivative():
    cubic, step = PlaneCubic(FORMS["any"], 0.5, 0.2, 0.7), 1e-5
    ends = np.array([[[0.3 + step, 0.4], [0.3 - step, 0.4]], [[0.3, 0.4 + step], [0.3, 0.4 - step]]])
    # central differences of a cubic: error step^2 times the third derivative
    expected = np.diff(cubic.value(ends), axis=1)[:, 0] / (-2 * step)
    assert cubic.gradient(0.3, 0.4) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("coefficients", "shape", "sign"),
    [
        ((0, 1, 1, 0), THREE_LINES, -3),
        ((2, -3, -5, 1), THREE_LINES, -3),
        ((-1, 0, 3, 0), THREE_LINES, -3),  # the angle is at the cut of atan2
        ((1, 0, 0, 1), ONE_LINE, 3),
        ((1, 2, 3, 4), ONE_LINE, 3),
        ((-5, 1, 0, 7), ONE_LINE, 3),
        ((0, 0, 1, 1), REPEATED, None),
        ((0, 0, 0, 0), ZERO, None),
    ],
)
def test_the_cubic_becomes_symmetric_and_areas_and_values_are_kept(coefficients, shape, sign):
    with ctx.workprec(256):
        block = PlanarBlock(*map(arb, coefficients))
        result, matrix = symmetric_coordinates(block)
        f, g, k, l = matrix.entries()
        a, b, c, d = new = transform_cubic(block, matrix)
        assert result == shape
        assert float(f * l - g * k) == pytest.approx(1)
        if sign is not None:
            assert a > 0
            assert [float(b), float(c / a), float(d)] == pytest.approx([0, sign, 0], abs=1e-60)
        u, v = arb(3), arb(-7)
        assert float(PlanarBlock(*new).h(f * u + g * v, k * u + l * v)) == pytest.approx(float(block.h(u, v)))
