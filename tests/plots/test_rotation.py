"""Rotation numbers as a picture: the lines have the numbers of `geometry`, and gaps where levels are singular."""

import pytest

from kahanmaps import InputError, geometry, load
from kahanmaps.plots.rotation import plot_rotation

MEMBER = load("paper_m2")


def drawn(style, axes):
    return [line.get_xydata() for line in axes.lines if line.get_linestyle() == style and len(line.get_xydata()) > 2]


def test_the_lines_have_the_rotation_numbers_of_the_initial_points():
    figure = plot_rotation(MEMBER.normal_form, "1/10", [1, 2, 3, 5], ["5/4", 2, 3, 5], points=5)
    (axes,) = figure.axes
    rotations = [plane.rotations[0] for plane in geometry(MEMBER, ["9/8", 2, 3, 5], "1/10").planes]
    middle = [points[points[:, 0] == 0.5][0, 1] for style in ("-", "--") for points in drawn(style, axes)]
    assert sorted(middle) == sorted(float(rotation.number.mid()) for rotation in rotations)
    middle = [points[points[:, 0] == 0.5][0, 1] for points in drawn(":", axes)]
    assert sorted(middle) == pytest.approx(sorted(float(rotation.flow.mid()) % 1 for rotation in rotations))


def test_no_line_leads_across_a_singular_level():
    """At (1, 2, 3, 4) one of the two level curves consists of three lines."""
    figure = plot_rotation(MEMBER.normal_form, "1/10", [1, 2, 3, "7/2"], [1, 2, 3, "9/2"], points=9)
    lines = [points for style in ("-", "--") for points in drawn(style, figure.axes[0])]
    assert any(points[0, 0] < 0.5 < points[-1, 0] and 0.5 in points[:, 0] for points in lines)
    assert not any(points[0, 0] < 0.5 < points[-1, 0] and 0.5 not in points[:, 0] for points in lines)


def test_a_segment_of_fixed_points_has_no_rotation_number():
    with pytest.raises(InputError, match="no initial point with a smooth level"):
        plot_rotation(MEMBER.normal_form, "1/10", [0, 0, 0, 0], [0, 0, 0, 0], points=3)


@pytest.mark.parametrize(
    ("last", "points", "message"),
    [
        ([2, 2, 3, 5], 1, "found 1 points, expected at least 2"),
        ([2, 2, 3, 5], "5", "found points = '5', expected an integer"),
        ([2, 2, 3], 5, "found points with 4 and 3 coordinates"),
    ],
)
def test_a_segment_needs_two_points_of_the_same_dimension(last, points, message):
    with pytest.raises(InputError, match=message):
        plot_rotation(MEMBER.normal_form, "1/10", [1, 2, 3, 5], last, points=points)
