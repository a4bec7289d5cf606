"""Drift: errors against exact ones, bins that hide nothing, honest zeros and ends, and the picture of them."""

from itertools import pairwise

import numpy as np
import pytest
from flint import fmpq
from helpers import refuses, together

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import ring
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.errors import InputError
from kahanmaps.invariants.integrals_and_densities import CommutantIntegral, ModifiedHamiltonian
from kahanmaps.maps.floats.float_orbit import FloatOrbit
from kahanmaps.plots.drifts.drift import _Bins, _edges, clipped_from, plot_drift, small_start, survey_drift
from kahanmaps.plots.drifts.drift_functions import OfTheImage, functions_of, known_functions, requested_functions
from kahanmaps.plots.style import Style
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

EPS = fmpq(1, 20)
CIRCLE = SystemFile.from_system(QuadraticSystem.from_text(["x", "y"], ["y", "-x"]), "circle")
SQUARE = SystemFile.from_system(QuadraticSystem.from_text(["x"], ["x^2"]), "square")


def survey(file, start, steps, requests, methods=("generic",), eps=EPS, **how):
    return survey_drift(file.system, eps, start, steps, requested_functions(file, eps, requests), methods, **how)


def only(result):
    [curve] = result.curves
    return curve


def test_integrals_with_the_image_in_them_have_their_exact_values():
    file = load("paper_m2")
    start = [fmpq(1, 3), fmpq(-1, 5), fmpq(2, 7), fmpq(1, 2)]
    points = np.array([[float(entry.p) / float(entry.q) for entry in start]] * 3)
    points[1] = np.nan
    hamiltonian, member = file.hamiltonian, file.member
    for integral in (ModifiedHamiltonian(hamiltonian), CommutantIntegral(hamiltonian, member.A, 1)):
        function = OfTheImage(integral, EPS, "I")
        value = integral.value(QQ, EPS, start)
        assert function.at(start) == value
        result = function(points)
        assert np.isnan(result).tolist() == [False, True, False]
        assert result[0] == pytest.approx(int(value.p) / int(value.q), rel=1e-12)


def test_a_hamiltonian_system_without_claims_has_its_modified_hamiltonian():
    x, y = ring(["x", "y"]).gens()
    file = SystemFile.from_hamiltonian(CubicHamiltonian((x**2 + y**2) / 2 + x**3 / 3, standard_structure(2)), "w")
    assert [function.name for function in known_functions(file, EPS)] == ["modified H", "H"]
    survey = survey_drift(file.system, EPS, ["1/4", "1/8"], 100, known_functions(file, EPS), ("generic",))
    assert [bool(curve.errors.max() < 1e-12) for curve in survey.curves] == [True, False]


def test_known_functions_are_claims_and_then_H_and_where_nothing_is_known_the_option_is_named():
    assert [function.name for function in known_functions(load("paper_m2"), EPS)] == ["I1", "I2", "H"]
    assert list(functions_of(load("paper_m2"), EPS)) == ["I1", "I2", "modified H", "H~_1", "H"]
    refuses(r"found no known integral of circle.*--integral NAME=EXPR", known_functions, CIRCLE, EPS)
    text = 'variables = ["x", "y"]\n[system]\nrhs = ["y", "-x"]\n[integrals]\nA = "x*y~ - y*x~"'
    with pytest.raises(InputError, match=r"found only known integrals of w that contain x~.*\(A\).*--integral"):
        known_functions(parse_system(text, "w"), EPS)


def test_expressions_may_contain_eps_and_have_a_name_each():
    [function] = requested_functions(CIRCLE, EPS, [("E", "x^2 + eps*y")])
    assert function(np.array([[2.0, 20.0]])).tolist() == [5.0]
    for requests in ([("", "x"), ("", "x")], [("E", "x"), ("E", "y")]):
        refuses("found two functions of the name", requested_functions, CIRCLE, EPS, requests)


@pytest.mark.parametrize(("text", "k", "scale"), [("x", 0, 2), ("y", 1, None)])
def test_errors_are_relative_and_absolute_where_the_function_is_0_at_the_start(text, k, scale):
    result = survey(CIRCLE, [2, 0], 50, [("E", text)])
    values = np.array([x[k] for _, x in FloatOrbit(CIRCLE.system, EPS, [2, 0], 50)])
    assert only(result).steps.tolist() == list(range(1, 51))
    assert only(result).errors.tolist() == (abs(values[1:] - values[0]) / (scale or 1)).tolist()
    assert result.relative == {"E": scale is not None}
    # 1/10 + 1/5 - 3/10 is 0, and 5.6e-17 in doubles: whether the function is 0 is decided exactly.
    assert survey(CIRCLE, ["1/10", "1/5"], 5, [("E", "x + y - 3/10")]).relative == {"E": False}


def test_the_methods_conserve_different_things():
    result = survey(load("weierstrass"), ["1/4", "1/8"], 1000, [("", "known")], ("generic", "rk4", "midpoint"))
    largest = {(curve.function, curve.method): curve.errors.max() for curve in result.curves}
    assert largest["modified_H", "generic"] < 1e-10 < 1e-5 < largest["modified_H", "rk4"]
    assert largest["H", "generic"] > 1e-5


def test_an_orbit_that_ends_early_is_no_whole_one():
    result = survey(SQUARE, [10], 100, [("E", "x")], ("rk4", "midpoint"), eps=fmpq(1, 2))
    assert {method: end.is_complete for method, end in result.ends.items()} == {"rk4": False, "midpoint": False}
    assert [len(curve.steps) for curve in result.curves][1] == 0


@together(
    "start, steps, eps, methods",
    [
        ([1], 10, "1/2", ("generic",)),
        ([1, 2], 0, "1/2", ("generic",)),
        ([1, 2], 10**10, "1/2", ("generic",)),
        ([1, 2], 10, 0, ("generic",)),
        ([1, 2], 10, "1/2", ("euler",)),
        ([1, 2], 10, "1/2", ("normal-form",)),
    ],
)
def test_wrong_values_are_refused(start, steps, eps, methods):
    with pytest.raises(InputError, match=r"expected|needs"):
        survey_drift(CIRCLE.system, eps, start, steps, requested_functions(CIRCLE, EPS, [("E", "x")]), methods)


def test_a_pole_at_the_start_is_refused_and_points_without_a_value_are_counted():
    refuses("E is not defined in floating point at the initial point", survey, CIRCLE, [1, 0], 10, [("E", "1/(x - 1)")])
    file = SystemFile.from_system(QuadraticSystem.from_text(["x"], ["1"]), "shift")
    result = survey(file, [0], 10, [("E", "1/(x - 1)")], eps=fmpq(1, 2))  # x_n = n
    assert only(result).undefined == 1
    assert only(result).steps.tolist() == list(range(2, 11))


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize("portion", [1, 7, 1000, 5000])
def test_the_largest_of_every_bin_is_kept_however_errors_come(linear, portion):
    errors = np.random.default_rng(1).random(3000)
    bins = _Bins(_edges(3000, linear))
    for first in range(0, 3000, portion):
        bins.add(first + 1, errors[first : first + portion])
    curve = bins.curve("generic", "E")
    edges = _edges(3000, linear)
    expected = [errors[low:high].max() for low, high in pairwise(edges)]
    assert curve.errors.tolist() == expected
    assert errors[curve.steps - 1].tolist() == expected


def test_a_random_start_is_the_same_for_the_same_seed_and_small_enough_for_rk4():
    first, second, other = (small_start(CIRCLE.system, EPS, seed) for seed in (0, 0, 1))
    assert first == second != other
    result = survey(load("paper_m2"), small_start(load("paper_m2").system, EPS), 1000, [("", "I1")], ("rk4",))
    assert result.ends["rk4"].is_complete


def drawn(result, **how):
    return plot_drift(result, Style(width=12), **how)


def test_there_is_a_panel_for_each_function_and_a_line_for_each_method():
    result = survey(load("weierstrass"), ["1/4", "1/8"], 300, [("", "known")], ("generic", "rk4", "midpoint"))
    figure = drawn(result)
    assert [axes.get_ylabel() for axes in figure.axes] == ["relative error of modified $H$", "relative error of $H$"]
    assert [len(axes.lines) for axes in figure.axes] == [3, 3]
    assert len({line.get_linestyle() for line in figure.axes[0].lines}) == 3
    assert all(line.get_ydata().max() < axes.get_ylim()[1] for axes in figure.axes for line in axes.lines)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["Kahan", "RK4", "implicit midpoint"]
    assert figure.legends[0].get_title().get_text() == r"time step $2\varepsilon = 1/10$"


def test_the_label_of_a_panel_is_not_broken_within_a_formula():
    result = survey(load("euler_top"), [1, "1/2", "1/3"], 9, [("", "(x1^2 - 3*x2^2 + 7*x3^2)/(1 - x2^2)")])
    [axes] = drawn(result).axes
    assert axes.get_ylabel() == "relative error of\n" + "(x1^2 - 3*x2^2 + 7*x3^2)/(1 - ".replace(" ", "\xa0")


def test_an_exact_0_is_in_the_band_and_not_left_out():
    [axes] = drawn(survey(CIRCLE, [1, 0], 20, [("E", "0*x + 1 + 0*y")])).axes
    heights = axes.lines[0].get_ydata()
    assert len(heights) == 20
    assert [text.get_text() for text in axes.texts] == ["0"]
    assert (heights >= axes.get_ylim()[0]).all()
    assert len(axes.patches) == 1


def test_what_blows_up_is_an_arrow_and_flattens_nothing_and_an_orbit_that_ends_early_has_a_cross():
    result = survey(SQUARE, ["1/10"], 2000, [("E", "x")], ("generic", "rk4"))
    [axes] = drawn(result).axes
    limit = clipped_from(result, "E")
    assert any(line.get_marker() == "^" and line.get_ydata().tolist() == [limit] for line in axes.lines)
    assert axes.get_ylim()[1] < 10 * limit < result.curves[1].errors.max()
    assert not axes.patches  # no band for errors of 0, as there are none
    assert any("ended at step" in text.get_text() for text in axes.figure.legends[0].get_texts())
    [axes] = drawn(survey(SQUARE, ["1"], 30, [("E", "1/x")], ("generic", "midpoint"))).axes
    assert [line.get_marker() for line in axes.lines].count("x") == 1
