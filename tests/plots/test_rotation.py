"""Rotation numbers as a picture: the lines have the numbers of `geometry`, and gaps where levels are singular."""

import pytest
from helpers import refuses

from kahanmaps import geometry, load
from kahanmaps.algebra.fields import rational
from kahanmaps.plots.rotation import _resonances, plot_rotation

MEMBER = load("paper_m2")


def drawn(style, axes):
    return [line.get_xydata() for line in axes.lines if line.get_linestyle() == style and len(line.get_xydata()) > 2]


def test_the_lines_have_the_rotation_numbers_of_the_initial_points():
    figure = plot_rotation(MEMBER, "1/10", [1, 2, 3, 5], ["5/4", 2, 3, 5], points=5)
    (axes,) = figure.axes
    rotations = [plane.rotations[0] for plane in geometry(MEMBER, ["9/8", 2, 3, 5], "1/10").planes]
    middle = [points[points[:, 0] == 0.5][0, 1] for style in ("-", "--") for points in drawn(style, axes)]
    assert sorted(middle) == sorted(float(rotation.number.mid()) for rotation in rotations)
    middle = [points[points[:, 0] == 0.5][0, 1] for points in drawn(":", axes)]
    assert sorted(middle) == pytest.approx(sorted(float(rotation.flow.mid()) % 1 for rotation in rotations))


def test_no_line_leads_across_a_singular_level():
    """At (1, 2, 3, 4) one of the two level curves consists of three lines."""
    figure = plot_rotation(MEMBER, "1/10", [1, 2, 3, "7/2"], [1, 2, 3, "9/2"], points=9)
    lines = [points for style in ("-", "--") for points in drawn(style, figure.axes[0])]
    assert any(points[0, 0] < 0.5 < points[-1, 0] and 0.5 in points[:, 0] for points in lines)
    assert not any(points[0, 0] < 0.5 < points[-1, 0] and 0.5 not in points[:, 0] for points in lines)


@pytest.mark.parametrize(
    ("name", "ends", "eps"),
    [
        ("mcmillan", [["1/3", "2/5"], ["1/2", "1/5"]], None),
        ("euler_top", [["1/3", "2/5", "3/7"], ["1/3", 2, "3/7"]], "1/10"),
        ("todd", [["1/3", "2/5", "3/7"], ["1/3", 2, "3/7"]], None),
    ],
)
def test_orbits_on_a_curve_have_its_rotation_number(name, ends, eps):
    """Todd's map permutes curves, so that the number is that of an iterate, with a dashed line."""
    (axes,) = plot_rotation(load(name), eps, *ends, points=3).axes
    middle = [(rational(a) + rational(b)) / 2 for a, b in zip(*ends, strict=True)]
    curve = geometry(load(name), middle, eps)
    (points,) = drawn("-" if curve.iterate * curve.steps == 1 else "--", axes)
    assert points[1].tolist() == [0.5, float(curve.rotation.mid())]


def test_the_horizontal_axis_may_be_an_integral():
    """I = x^2 y^2 - x^2 - y^2 + x y."""
    file = load("mcmillan")
    (axes,) = plot_rotation(file, None, ["1/10", "1/5"], ["2/5", "1/5"], points=4, against="I").axes
    (points,) = drawn("-", axes)
    levels = [x * x / 25 - x * x + x / 5 - 1 / 25 for x in (0.1, 0.2, 0.3, 0.4)]
    assert points[:, 0] == pytest.approx(levels)
    assert axes.get_xlabel() == "$I$"
    message = "found no integral 'J' of mcmillan, expected one that it declares: I"
    refuses(message, plot_rotation, file, None, ["1/10", "1/5"], ["2/5", "1/5"], points=4, against="J")


@pytest.mark.parametrize(
    ("system", "ends", "points", "message"),
    [
        (MEMBER, [[1, 2, 3, 5], [2, 2, 3, 5]], 1, "found 1 points, expected 2 to 10000"),
        (MEMBER, [[1, 2, 3, 5], [2, 2, 3, 5]], 10**8, "found 100000000 points, expected 2 to 10000"),
        (MEMBER, [[1, 2, 3, 5], [2, 2, 3, 5]], "5", "found points = '5', expected an integer"),
        (MEMBER, [[1, 2, 3, 5], [2, 2, 3]], 5, "found a point with 3 coordinates, expected 4"),
        (MEMBER, [[0, 0, 0, 0], [0, 0, 0, 0]], 3, "no initial point with a rotation number"),  # fixed points
        (load("lorenz"), [[1, 1, 1], [2, 2, 2]], 2, "no initial point with a rotation number"),
    ],
)
def test_a_segment_without_rotation_numbers_is_refused(system, ends, points, message):
    refuses(message, plot_rotation, system, "1/10", *ends, points=points)


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.1, 0.3, ["1/4", "1/5", "1/6", "1/7", "2/7", "1/8"]),
        (0.2112, 0.2152, ["3/14", "7/33", "10/47"]),
    ],
)
def test_resonances_have_the_smallest_denominators(low, high, expected):
    assert [str(value) for value in _resonances(low, high)] == expected
