"""Growth drawn: the degrees and heights that were measured, the laws they follow, and what is estimated."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flint import fmpq
from helpers import refuses, together

from kahanmaps.documents.catalog import load
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.plots.growth import (
    HeightCurve,
    curves_of_record,
    degrees_of_record,
    fit_of,
    height_curves,
    plot_degrees,
    plot_heights,
)

TENTH = fmpq(1, 10)
SQUARES = tuple(2 * n * n + 1 for n in range(12))  # of the Kahan map of the Euler top
POWERS = tuple(2**n for n in range(10))
NEITHER = (1, 3, 7, 17, 39, 93, 215, 495, 1137, 2615, 6007, 13797)  # of Henon and Heiles
FIBONACCI = (1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233)


def growth(degrees, ended="terms"):
    return DegreeGrowth(tuple(degrees), None, ended, "", 0, (), ())


def labels(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def marks(axes):
    """What has marks and no line: what was measured."""
    return [line for line in axes.lines if line.get_linestyle() == "None"]


def curves(axes):
    return [line for line in axes.lines if line.get_linestyle() != "None" and len(line.get_xdata())]


def test_marks_are_the_degrees_and_the_curve_is_the_closed_form():
    [axes] = plot_degrees({"top": growth(SQUARES)}).axes
    [points], [curve] = marks(axes), curves(axes)
    assert points.get_xdata().tolist() == list(range(12))
    assert points.get_ydata().tolist() == list(SQUARES)
    n, d = curve.get_data()
    assert np.allclose(d, 2 * n**2 + 1)
    assert (n[0], n[-1]) == (0, 11)


@pytest.mark.parametrize(
    ("degrees", "label", "line"),
    [
        (growth(SQUARES), r"x: $d_n = 2n^{2} + 1$, $\lambda = 1$", "-"),
        (growth(POWERS), r"x: $\lambda = 2$", "-"),
        (growth(FIBONACCI), r"x: $\lambda = 1.61803\ldots$", "-"),
        (replace(growth(POWERS), eps=TENTH), r"x, $\varepsilon = 1/10$: $\lambda = 2$", "-"),
        (growth(NEITHER, "degree"), r"x: $\lambda \approx 2.297$ (estimated)", ":"),
        (growth((1, 2, 4, 7, 8, 12)), "x: no recurrence found, $d_{5}^{1/5} = 1.644$", ":"),
    ],
)
def test_the_legend_says_what_is_known_and_dots_what_is_estimated(degrees, label, line):
    figure = plot_degrees({"x": degrees})
    assert labels(figure) == [label]
    assert [curve.get_linestyle() for curve in curves(figure.axes[0])] == [line]
    assert figure.legends[0].get_title().get_text().endswith("time step is $2\\varepsilon$") is (degrees.eps == TENTH)


def test_exponential_growth_is_drawn_logarithmically_and_two_such_scales_begin_at_the_first_iterate():
    scales = [plot_degrees({"x": growth(degrees)}).axes[0].get_yscale() for degrees in (SQUARES, POWERS, NEITHER)]
    assert scales == ["linear", "log", "log"]
    [axes] = plot_degrees({"top": growth(SQUARES)}, scale="loglog").axes
    assert marks(axes)[0].get_xdata()[0] == 1


def test_a_degree_0_lies_in_the_band_marked_0_and_no_line_leads_there():
    [axes] = plot_degrees({"x": growth((1, 2, 2, 0), "constant")}, scale="log").axes
    [points], [curve] = marks(axes), curves(axes)
    low, high = axes.get_ylim()
    assert low < points.get_ydata()[3] < 1 < high
    assert [text.get_text() for text in axes.texts] == ["0"]
    assert np.isnan(curve.get_ydata()).tolist() == [False, False, False, True]


@pytest.fixture(scope="module")
def survey():
    return height_survey(load("weierstrass").system, "1/10", starts=[[1, "1/2"], ["1/3", 2]], steps=40)


def test_marks_are_the_heights_and_the_legend_has_the_constants(survey):
    figure = plot_heights(survey)
    for line, orbit in zip(marks(figure.axes[0]), survey.orbits, strict=True):  # from step 1 on: loglog
        steps = line.get_xdata().tolist()
        assert line.get_ydata().tolist() == [orbit.growth.heights[step] for step in steps]
        assert (steps[0], steps[-1]) == (1, 40)
        assert steps[-1] - steps[-2] > 2, "they stand apart"
    low, high = sorted(float(orbit.growth.constant) for orbit in survey.orbits)
    assert labels(figure) == [
        rf"$\varepsilon = 1/10$ (time step 1/5): $h_n \sim c\,n^2$, $c$ = {low:.3g} to {high:.3g}"
    ]


def test_the_fit_has_the_constant_of_the_library(survey):
    [curve, _] = height_curves(survey)
    n = np.array([1e6, 2e6])
    assert np.allclose(fit_of(curve)(n) / n**2, float(survey.orbits[0].growth.constant), rtol=1e-4)


def curve(kind, bits, ratio=None):
    return HeightCurve(TENTH, np.arange(len(bits)), np.array(bits, dtype=float), kind, None, ratio, "completed")


def test_exponential_heights_are_a_straight_line():
    drawn = plot_heights([curve(Growth.EXPONENTIAL, [3 * 2**n for n in range(9)], ratio=2.0)]).axes[0]
    assert (drawn.get_yscale(), drawn.get_xscale()) == ("log", "linear")
    [fit] = curves(drawn)
    assert np.allclose(fit.get_ydata(), 3 * 2.0 ** fit.get_xdata())


def test_undecided_heights_have_no_fit_and_orbits_that_disagree_are_counted():
    figure = plot_heights([curve(Growth.UNDECIDED, [1, 5, 2]), *[curve(Growth.BOUNDED, [1, 2])] * 2])
    assert curves(figure.axes[0]) == []
    assert labels(figure)[0].endswith(": 1 undecided, 2 bounded")


def test_a_record_has_fewer_heights_and_the_same_constants(survey):
    full, read = height_curves(survey), curves_of_record({"command": "heights", **survey.to_json()})
    assert [curve.steps.tolist() for curve in read] == [[0, 1, 2, 4, 8, 16, 32, 40]] * 2
    for ours, theirs in zip(full, read, strict=True):
        assert ours.bits[theirs.steps].tolist() == theirs.bits.tolist()
        assert math.isclose(ours.constant, theirs.constant, rel_tol=1e-5)


@pytest.fixture(scope="module")
def degrees():
    return degree_growth(load("lotka_volterra").system, "1/7")


def test_degrees_that_are_read_are_those_that_were_written(degrees):
    assert degrees_of_record({"command": "degrees", "system": "lv", **degrees.to_json()}) == ("lv", degrees)


@together(
    "change",
    [
        *({"degrees": wrong} for wrong in ([], [0], [1, -1], [1, 2.5], [True], [10**400], "1, 2")),
        *({"eps": "x"}, {"lines": [{}]}, {"seed": None}),
    ],
)
def test_wrong_degrees_are_refused(degrees, change):
    record = {"command": "degrees", "system": "lv", **degrees.to_json(), **change}
    refuses("record: found degrees that cannot be read", degrees_of_record, record)


@together(
    "change",
    [
        *({"heights": [{"step": 0, "bits": wrong}]} for wrong in (10**400, "2", True)),
        *({"heights": []}, {"heights": [{"step": 1, "bits": 2}, {"step": 0, "bits": 2}]}),
        *({"kind": "cubic"}, {"eps": "x"}, {"constant": "many"}),
    ],
)
def test_wrong_heights_are_refused(survey, change):
    record = {"command": "heights", **survey.to_json()}
    record["orbits"][0].update(change)
    refuses("record: found an orbit that cannot be read", curves_of_record, record)
