"""Growth drawn: the degrees and heights that were measured, the laws they follow, and what is estimated."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flint import fmpq

from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.plots.growth import draw_degrees, draw_heights
from kahanmaps.plots.growth_records import HeightCurve, curves_of_record, fit_of, height_curves

SQUARES = tuple(2 * n * n + 1 for n in range(12))  # of the Kahan map of the Euler top
POWERS = tuple(2**n for n in range(10))
TENTH = fmpq(1, 10)
NEITHER = (1, 3, 7, 17, 39, 93, 215, 495, 1137, 2615, 6007, 13797)  # of Henon and Heiles


def growth(degrees, ended="terms"):
    return DegreeGrowth(tuple(degrees), None, ended, "", 0, (), ())


def labels(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def marks(axes):
    """The data of what has marks and no line: what was measured."""
    return [line for line in axes.lines if line.get_linestyle() == "None"]


def curves(axes):
    return [line for line in axes.lines if line.get_linestyle() != "None" and len(line.get_xdata())]


def test_marks_are_the_degrees():
    [axes] = draw_degrees({"top": growth(SQUARES)}).axes
    [points] = marks(axes)
    assert points.get_xdata().tolist() == list(range(12))
    assert points.get_ydata().tolist() == list(SQUARES)


def test_the_curve_is_the_closed_form():
    [curve] = curves(draw_degrees({"top": growth(SQUARES)}).axes[0])
    n, d = curve.get_data()
    assert np.allclose(d, 2 * n**2 + 1)
    assert (n[0], n[-1]) == (0, 11)


def test_the_legend_says_formula_and_dynamical_degree():
    figure = draw_degrees({"top": growth(SQUARES), "lv": growth(POWERS)})
    assert labels(figure) == [r"top: $d_n = 2n^{2} + 1$, $\lambda = 1$", r"lv: $\lambda = 2$"]


def test_a_long_name_leaves_room_for_what_is_said_of_it():
    equations = "x' = -x^2 - x*y/2 - 3/2*x*z + x, y' = -3/2*x*y - y^2 - y*z/2 + y, z' = -x*z/2 - 3/2*y*z - z^2 + z"
    figure = draw_degrees({equations: growth(POWERS)})
    [label] = labels(figure)
    assert label.startswith("x' = -x^2 - x*y/2")
    assert label.endswith(r"...: $\lambda = 2$")
    figure.canvas.draw()
    assert figure.legends[0].get_window_extent().x1 <= figure.bbox.x1


def test_an_eps_is_told_with_what_the_time_step_is():
    figure = draw_degrees({"lv": replace(growth(POWERS), eps=TENTH), "top": growth(SQUARES)})
    assert labels(figure)[0] == r"lv, $\varepsilon = 1/10$: $\lambda = 2$"
    assert figure.legends[0].get_title().get_text().endswith(r"; the time step is $2\varepsilon$")
    assert "varepsilon" not in labels(figure)[1]


def test_what_is_estimated_is_said_and_dotted():
    figure = draw_degrees({"hh": growth(NEITHER, "degree")})
    assert labels(figure) == [r"hh: $\lambda \approx 2.297$ (estimated)"]
    assert [curve.get_linestyle() for curve in curves(figure.axes[0])] == [":"]


def test_degrees_without_recurrence_have_no_dynamical_degree():
    [label] = labels(draw_degrees({"x": growth((1, 2, 4, 7, 8, 12))}))
    assert label == "x: no recurrence found, $d_{5}^{1/5} = 1.644$"


def test_an_irrational_dynamical_degree_is_not_rounded_silently():
    fibonacci = [1, 2]
    while len(fibonacci) < 12:
        fibonacci.append(fibonacci[-1] + fibonacci[-2])
    assert labels(draw_degrees({"f": growth(fibonacci)})) == [r"f: $\lambda = 1.61803\ldots$"]


@pytest.mark.parametrize(("degrees", "scale"), [(SQUARES, "linear"), (POWERS, "log"), (NEITHER, "log")])
def test_exponential_growth_is_drawn_logarithmically(degrees, scale):
    assert draw_degrees({"x": growth(degrees)}).axes[0].get_yscale() == scale


def test_a_degree_0_lies_in_the_band_marked_0():
    [axes] = draw_degrees({"x": growth((1, 2, 2, 0), "constant")}, scale="log").axes
    [points] = marks(axes)
    low, high = axes.get_ylim()
    assert low < points.get_ydata()[3] < 1 < high
    assert [text.get_text() for text in axes.texts] == ["0"]


def test_on_two_logarithmic_scales_the_first_iterate_is_the_first():
    [axes] = draw_degrees({"top": growth(SQUARES)}, scale="loglog").axes
    assert marks(axes)[0].get_xdata()[0] == 1


@pytest.mark.parametrize("wrong", [{}, {str(k): growth(POWERS) for k in range(8)}])
def test_no_system_and_too_many_are_refused(wrong):
    with pytest.raises(InputError, match="expected 1 to 7"):
        draw_degrees(wrong)


@pytest.fixture(scope="module")
def survey():
    return height_survey(load("weierstrass").system, "1/10", starts=[[1, "1/2"], ["1/3", 2]], steps=40)


def test_marks_are_the_heights(survey):
    axes = draw_heights(survey).axes[0]
    for line, orbit in zip(marks(axes), survey.orbits, strict=True):  # from step 1 on: loglog
        steps = line.get_xdata().tolist()
        assert line.get_ydata().tolist() == [orbit.growth.heights[step] for step in steps]
        assert (steps[0], steps[-1]) == (1, 40)
        assert steps[-1] - steps[-2] > 2, "they stand apart"


def test_the_fit_has_the_constant_of_the_library(survey):
    [curve, _] = height_curves(survey)
    n = np.array([1e6, 2e6])
    assert np.allclose(fit_of(curve)(n) / n**2, float(survey.orbits[0].growth.constant), rtol=1e-4)


def test_the_legend_says_eps_time_step_and_constants(survey):
    constants = sorted(float(orbit.growth.constant) for orbit in survey.orbits)
    assert labels(draw_heights(survey)) == [
        rf"$\varepsilon = 1/10$, $2\varepsilon = 1/5$: $c\,n^2$, $c$ = {constants[0]:.3g} to {constants[1]:.3g}"
    ]


def test_a_record_has_fewer_heights_and_the_same_constants(survey):
    record = {"command": "heights", **survey.to_json()}
    full, read = height_curves(survey), curves_of_record(record)
    assert [curve.steps.tolist() for curve in read] == [[0, 1, 2, 4, 8, 16, 32, 40]] * 2
    for ours, theirs in zip(full, read, strict=True):
        assert ours.bits[theirs.steps].tolist() == theirs.bits.tolist()
        assert math.isclose(ours.constant, theirs.constant, rel_tol=1e-5)


def curve(kind, bits, constant=None, ratio=None, eps=TENTH):
    return HeightCurve(eps, np.arange(len(bits)), np.array(bits, dtype=float), kind, constant, ratio, "completed")


def test_exponential_heights_are_a_straight_line():
    drawn = draw_heights([curve(Growth.EXPONENTIAL, [3 * 2**n for n in range(9)], ratio=2.0)]).axes[0]
    assert drawn.get_yscale() == "log"
    assert drawn.get_xscale() == "linear"
    [fit] = curves(drawn)
    assert np.allclose(fit.get_ydata(), 3 * 2.0 ** fit.get_xdata())


def test_undecided_heights_have_no_fit():
    figure = draw_heights([curve(Growth.UNDECIDED, [1, 5, 2])])
    assert curves(figure.axes[0]) == []
    assert labels(figure)[0].endswith(": undecided")


def test_orbits_that_disagree_are_counted():
    figure = draw_heights([curve(Growth.UNDECIDED, [1, 2]), curve(Growth.BOUNDED, [1, 2]), curve(Growth.BOUNDED, [2])])
    assert labels(figure)[0].endswith(": 1 undecided, 2 bounded")


@pytest.mark.parametrize(
    "change",
    [
        {"heights": []},
        {"heights": [{"step": 1, "bits": 2}, {"step": 0, "bits": 2}]},
        {"heights": [{"step": 0, "bits": 10**400}]},
        {"heights": [{"step": 0, "bits": "2"}]},
        {"kind": "cubic"},
        {"eps": "x"},
        {"constant": "many"},
    ],
)
def test_a_wrong_record_is_refused(survey, change):
    record = {"command": "heights", **survey.to_json()}
    record["orbits"][0].update(change)
    with pytest.raises(InputError, match="record: found an orbit that cannot be read"):
        curves_of_record(record)


@pytest.mark.parametrize("record", [[], {}, {"command": "degrees"}, {"command": "heights"}, None])
def test_another_record_is_refused(record):
    with pytest.raises(InputError, match="expected an object written by 'kahanmaps heights --json'"):
        curves_of_record(record)
