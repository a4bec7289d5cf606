"""Windows: all points where they are together, most of them where some are far away; and which axes are chosen."""

import numpy as np
from helpers import together

from kahanmaps.plots.portraits.windows import fullest_axes, outside, window_of

CIRCLE = np.stack([np.cos(np.linspace(0, 6, 500)), np.sin(np.linspace(0, 6, 500))], axis=1)


def test_points_that_are_together_are_all_inside_and_missing_ones_change_nothing():
    window = window_of(CIRCLE)
    missing = np.concatenate([CIRCLE, [[np.nan, np.nan]]])
    assert window_of(missing) == window
    assert outside(missing, window) == 0


def test_a_few_points_far_away_are_left_out_and_counted():
    points = np.concatenate([CIRCLE, [[1e9, 0.0], [0.0, -1e12]]])
    window = window_of(points)
    assert all(high - low < 6 for low, high in window)
    assert outside(points, window) == 2


def test_starts_stay_in_sight_where_the_orbit_soon_rests():
    decay = np.append([5.0, 2.0, 1.0], np.zeros(997))[:, None]
    assert window_of(decay)[0][1] < 5
    assert window_of(decay, decay[:1])[0][1] > 5


@together("value", [0.0, 1.0, -3.0, 1e300, 1e-300, 1.7e308])
def test_one_value_stands_in_the_middle_of_a_window_of_positive_length(value):
    ((low, high),) = window_of(np.full((3, 1), value))
    assert 0 < high - low < np.inf


def test_the_axes_are_those_that_are_filled_and_in_order():
    t = np.linspace(0, 50, 3000)
    points = np.stack([t, 0 * t, np.sin(np.sqrt(2) * t), 2 * t, np.cos(t)], axis=1)
    assert fullest_axes(points, 2) in ((0, 2), (0, 4), (2, 4))
    assert 1 not in fullest_axes(points, 3)


@together("dim, count", [(2, 2), (5, 2), (5, 3)])
def test_of_points_that_do_not_move_the_first_variables_are_chosen(dim, count):
    assert fullest_axes(np.ones((4, dim)), count) == tuple(range(count))
