"""Functions of points in doubles: coordinates, expressions and integrals, many points at a time, NaN at poles."""

import numpy as np
import pytest
from flint import fmpq

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.errors import ExpressionError, InputError
from kahanmaps.plots.point_functions import point_function

POINTS = np.array([[[1.0, 2.0], [3.0, 0.0]], [[np.nan, np.nan], [-1.0, 5.0]]])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("y", [[2, 0], [np.nan, 5]]),
        ("x^2 - y/2", [[0, 9], [np.nan, -1.5]]),
        ("x/y", [[0.5, np.nan], [np.nan, -0.2]]),  # a pole, and a point that is not there
        ("7", [[7, 7], [np.nan, 7]]),  # a constant is not where there is no point
        ("x + eps + a", [[4.25, 6.25], [np.nan, 2.25]]),
    ],
)
def test_values_keep_the_shape_of_the_points(text, expected):
    function = point_function(text, ["x", "y"], fmpq(1, 4), {"a": fmpq(3)})
    np.testing.assert_array_equal(function(POINTS), expected)


def test_a_value_beyond_the_range_of_doubles_is_missing_without_a_warning():
    assert np.isnan(point_function("x^9", ["x"])(np.array([1e200])))


def test_a_name_is_that_of_an_integral_or_unknown():
    named = {"I1": parse_rational_function("x*y/eps", ["x", "y", "eps"])}
    assert point_function("I1", ["x", "y"], fmpq(1, 2), named=named)(np.array([2.0, 3.0])) == 12
    with pytest.raises(InputError, match=r"found the name H, expected one of x, y, eps; integrals are named I1"):
        point_function("H", ["x", "y"], named=named)


def test_text_is_parsed_and_nothing_else_and_eps_needs_a_value():
    with pytest.raises(ExpressionError):
        point_function("__import__('os')", ["x"])
    with pytest.raises(InputError, match="no value of eps"):
        point_function("eps*x", ["x"])


@pytest.mark.parametrize(
    ("text", "label"), [("x1", "$x_1$"), ("x1^2*y", "$x_1^2 y$"), ("(x1-1)/y", "$(x_1 - 1) / y$"), ("y+0*x1", "$y$")]
)
def test_labels_are_formulas_where_they_are_short(text, label):
    assert point_function(text, ["x1", "y"]).label == label
