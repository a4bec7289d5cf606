"""Comparison of methods: orders, drift against independent code, bins that hide nothing, early ends, and pictures."""

from itertools import pairwise

import numpy as np
import pytest
from flint import fmpq
from helpers import quick, refuses

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import ring
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.inline import System
from kahanmaps.errors import InputError
from kahanmaps.invariants.integrals_and_densities import CommutantIntegral, ModifiedHamiltonian
from kahanmaps.maps.floats.classical import METHODS, SEPARABLE
from kahanmaps.maps.floats.float_orbit import FloatOrbit
from kahanmaps.plots.comparison.compare import _bin_edges, _Bins, compare, small_start
from kahanmaps.plots.comparison.functions import TwoPointFunction, functions_of, known_functions, requested_functions
from kahanmaps.plots.comparison.plot_compare import clipped_from, plot_comparison
from kahanmaps.plots.style import Style
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

EPS = fmpq(1, 20)
CIRCLE = SystemFile.from_system(QuadraticSystem.from_text(["x", "y"], ["y", "-x"]), "circle")
SQUARE = SystemFile.from_system(QuadraticSystem.from_text(["x"], ["x^2"]), "square")


def survey(file, start, steps, requests, methods=("kahan",), eps=EPS, **how):
    return compare(file, start, eps, steps, methods=methods, integrals=requests, orders=False, **how)


TODA = System("a1' = a1*(b2-b1); a2' = a2*(b3-b2); b1' = 2*a1^2; b2' = 2*a2^2 - 2*a1^2; b3' = -2*a2^2")
RIGID_BODY = System("x' = 1/6*y*z; y' = -2/3*z*x; z' = 1/2*x*y")
SYSTEMS = [load("harmonic"), load("henon_heiles"), load("lotka_volterra"), load("euler_top"), TODA, RIGID_BODY]


@pytest.mark.parametrize("file", quick([*SYSTEMS, load("paper_m3")], SYSTEMS[:3]), ids=lambda file: file.name)
def test_measured_orders_are_those_of_theory(file):
    names = [name for name in METHODS if name != "normal-form" or file.member]
    result = compare(file, eps=EPS, steps=1, methods=names, integrals=[], kernel="numpy")
    assert set(result.skipped) == (set() if file.name in ("harmonic", "henon_heiles") else SEPARABLE)
    for run in result.runs:
        # The Gauss method gains two orders for planar homogeneous cubics, of which the member consists.
        order = 6 if (file.member, run.method) == (file.member or 0, "gauss4") else METHODS[run.method].order
        # Slopes between the last two errors above rounding; the next terms of the expansion and rounding change them.
        assert run.order == pytest.approx(order, abs=0.05), run.method


# Independent code: one point at a time, with numpy and fixed-point iterations.
H = 0.1


def henon_heiles(x):
    q1, q2, p1, p2 = x
    return np.array([p1, p2, -q1 - 2 * q1 * q2, -q2 - q1**2 + q2**2])


def fixed_point(image, x):
    for _ in range(60):
        x = image(x)
    return x


def kahan(f, x, h):
    """Kahan's method in its Runge-Kutta form."""
    return fixed_point(lambda y: x + h * (2 * f((x + y) / 2) - f(x) / 2 - f(y) / 2), x)


def gauss(f, x, h):
    A = np.array([[1 / 4, 1 / 4 - np.sqrt(3) / 6], [1 / 4 + np.sqrt(3) / 6, 1 / 4]])
    k = fixed_point(lambda k: np.array([f(x + h * row @ k) for row in A]), np.array([f(x), f(x)]))
    return x + h / 2 * k.sum(axis=0)


def symplectic_euler(f, x, h):
    x = x + h * f(x) * [1, 1, 0, 0]
    return x + h * f(x) * [0, 0, 1, 1]


def verlet(f, x, h):
    x = x + h / 2 * f(x) * [0, 0, 1, 1]
    x = x + h * f(x) * [1, 1, 0, 0]
    return x + h / 2 * f(x) * [0, 0, 1, 1]


# Of RK4, the midpoint rule and compositions maps/test_float_steps.py has the steps.
BY_HAND = {
    "kahan": kahan,
    "euler": lambda f, x, h: x + h * f(x),
    "gauss4": gauss,
    "symplectic-euler": symplectic_euler,
    "stormer-verlet": verlet,
}


def test_the_table_of_drift_agrees_with_independent_code():
    start, energy = np.array([0.125, -0.25, 0.0625, 0.25]), "(p1^2 + p2^2 + q1^2 + q2^2)/2 + q1^2*q2 - q2^3/3"

    def value(x):
        return (x @ x) / 2 + x[0] ** 2 * x[1] - x[1] ** 3 / 3

    result = survey("henon_heiles", start.tolist(), 100, [("E", energy)], [*BY_HAND])
    for method, step in BY_HAND.items():
        x, errors = start, []
        for _ in range(100):
            x = step(henon_heiles, x, H)
            errors.append(abs(value(x) - value(start)) / abs(value(start)))
        curve = result.drift(method, "E")
        # Rounding errors grow to about 1e-13 in 100 steps.
        assert curve.largest == pytest.approx(max(errors), rel=1e-9, abs=1e-13), method
        assert curve.last == pytest.approx(errors[-1], rel=1e-9, abs=1e-13), method
        assert curve.errors == pytest.approx(np.array(errors)[curve.steps - 1], rel=1e-9, abs=1e-13), method


SOME = ["kahan", "rk4", "midpoint", "stormer-verlet"]  # machine code of the others takes seconds to be compiled
KERNEL_CASES = [("henon_heiles", SOME), ("henon_heiles", list(METHODS)), ("paper_m2", list(METHODS))]


@pytest.mark.parametrize(("name", "methods"), quick(KERNEL_CASES, KERNEL_CASES[:1]))
def test_both_kernels_give_the_same_numbers(name, methods):
    pytest.importorskip("llvmlite")
    results = [compare(name, eps=EPS, steps=300, methods=methods, kernel=kernel) for kernel in ("numpy", "numba")]
    first, second = (result.to_json() for result in results)
    assert first == second
    assert results[0].rows() == results[1].rows()


def test_points_and_functions_may_be_text_and_others_are_refused():
    how = {"eps": EPS, "steps": 3, "methods": ["kahan"], "orders": False}
    first, *others = (
        compare(CIRCLE, start, integrals=functions, **how)
        for start, functions in (
            ("1/2,1/3", "x^2"),
            ({"y": "1/3", "x": "1/2"}, ["x^2"]),
            (["1/2", "1/3"], [("", "x^2")]),
        )
    )
    assert [result.to_json() for result in others] == [first.to_json()] * 2
    for start, message in (
        (1, "found the initial point 1"),
        ([float("nan"), 0], "found the floating-point number nan"),
        ("x=0:1:2,y=0:1:100000", "found 200000 initial points, expected at most 100000"),
    ):
        refuses(message, compare, CIRCLE, start, **how)
    refuses("found 10000000000 steps", compare, CIRCLE, [1, 0], **{**how, "steps": 10**10})
    refuses("found no method, expected some of", compare, CIRCLE, [1, 0], **{**how, "methods": []})


def test_several_initial_points_give_the_largest_drift_of_them():
    starts = [[1, "1/2", "1/3"], [1, "1/2", "1/2"]]
    alone = [compare("euler_top", start, EPS, 100, methods=["rk4"], orders=False) for start in starts]
    result = compare("euler_top", starts, EPS, 100, methods=["rk4"], orders=False)
    for name in result.labels:
        largest = [one.drift("rk4", name).largest for one in alone]
        assert result.drift("rk4", name).largest == max(largest)
    assert result.runs[0].evaluations == 4 * 100 * 2


def test_newton_counts_repeated_steps_and_failures():
    result = compare(SQUARE, [[10], ["1/10"]], "1/2", 3, methods=["midpoint", "gauss4"], integrals=[("", "x")])
    midpoint, gauss4 = result.runs
    assert (midpoint.failures, [end.status for end in midpoint.ends]) == (1, ["singular", "completed"])
    assert midpoint.evaluations == 3 * 3 + 9 * midpoint.repeated
    assert gauss4.ends[1].is_complete
    assert "Newton's method failed in 1 orbit" in result.text


def test_a_system_without_known_integral_has_those_of_a_quick_search():
    result = compare(RIGID_BODY, ["1/2", "1/3", "1/4"], EPS, 500, orders=False)
    assert set(result.origins.values()) == {"found", "flow"}
    for name, origin in result.origins.items():
        assert (result.drift("kahan", name).largest < 1e-12) == (origin == "found")


def test_a_fixed_point_has_no_errors_and_no_order():
    result = compare(CIRCLE, [0, 0], EPS, 10, methods=["kahan"], integrals=[("", "x + 1")])
    assert (result.time, result.runs[0].order, result.runs[0].errors) == (None, None, ())
    assert any("no errors" in note for note in result.notes)


def test_curves_are_written_as_csv_and_parquet(tmp_path):
    result = compare("euler_top", [1, "1/2", "1/3"], EPS, 10, methods=["kahan", "euler"])
    result.write(tmp_path / "c.csv")
    head, *lines = (tmp_path / "c.csv").read_text(encoding="utf-8").splitlines()
    assert head == "kind,method,function,eps,step,value,evaluations"
    assert len(lines) == len(result.rows()) == 2 * 4 * 10 + sum(len(run.errors) for run in result.runs)
    parquet = pytest.importorskip("pyarrow.parquet")
    result.write(tmp_path / "c.parquet")
    assert parquet.read_table(tmp_path / "c.parquet").to_pylist() == result.rows()
    refuses(r"found .*c.npy, expected a name that ends with", result.write, tmp_path / "c.npy")


def test_seconds_come_from_the_clock_that_is_given_only():
    ticks = iter(range(100))
    result = compare(CIRCLE, [1, 0], EPS, 5, methods=["kahan", "rk4"], integrals=[], clock=lambda: float(next(ticks)))
    assert [run.seconds for run in result.runs] == [1.0, 1.0]
    assert "seconds" in result.text
    assert "seconds" not in survey(CIRCLE, [1, 0], 5, [("", "x")]).text


def test_integrals_with_the_image_in_them_have_their_exact_values():
    file = load("paper_m2")
    start = [fmpq(1, 3), fmpq(-1, 5), fmpq(2, 7), fmpq(1, 2)]
    points = np.array([[float(entry.p) / float(entry.q) for entry in start]] * 3)
    points[1] = np.nan
    hamiltonian, member = file.hamiltonian, file.member
    for integral in (ModifiedHamiltonian(hamiltonian), CommutantIntegral(hamiltonian, member.A, 1)):
        function = TwoPointFunction(integral, EPS, "I")
        value = integral.value(QQ, EPS, start)
        assert function.at(start) == value
        result = function(points)
        assert np.isnan(result).tolist() == [False, True, False]
        assert result[0] == pytest.approx(int(value.p) / int(value.q), rel=1e-12)


def test_a_hamiltonian_system_without_claims_has_its_modified_hamiltonian():
    x, y = ring(["x", "y"]).gens()
    file = SystemFile.from_hamiltonian(CubicHamiltonian((x**2 + y**2) / 2 + x**3 / 3, standard_structure(2)), "w")
    result = compare(file, ["1/4", "1/8"], EPS, 100, methods=["kahan"], orders=False)
    assert result.origins == {"modified H": "theorem", "H": "flow"}
    assert [curve.largest < 1e-12 for curve in result.curves] == [True, False]


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
    [curve] = result.curves
    assert curve.steps.tolist() == list(range(1, 51))
    assert curve.errors.tolist() == (abs(values[1:] - values[0]) / (scale or 1)).tolist()
    assert result.relative == {"E": scale is not None}
    # 1/10 + 1/5 - 3/10 is 0, and 5.6e-17 in doubles: whether the function is 0 is decided exactly.
    assert survey(CIRCLE, ["1/10", "1/5"], 5, [("E", "x + y - 3/10")]).relative == {"E": False}


def test_a_pole_at_the_start_is_refused_and_points_without_a_value_are_counted():
    refuses("E is not defined in floating point at the initial point", survey, CIRCLE, [1, 0], 10, [("E", "1/(x - 1)")])
    file = SystemFile.from_system(QuadraticSystem.from_text(["x"], ["1"]), "shift")
    result = survey(file, [0], 10, [("E", "1/(x - 1)")], eps=fmpq(1, 2))  # x_n = n
    [curve] = result.curves
    assert (curve.undefined, curve.steps.tolist()) == (1, list(range(2, 11)))


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize("portion", [1, 7, 1000, 5000])
def test_the_largest_of_every_bin_is_kept_however_errors_come(linear, portion):
    errors = np.random.default_rng(1).random((3000, 2))
    bins = _Bins(_bin_edges(3000, linear))
    for first in range(0, 3000, portion):
        bins.add(first + 1, errors[first : first + portion])
    curve = bins.curve("kahan", "E")
    edges = _bin_edges(3000, linear)
    expected = [errors[low:high].max() for low, high in pairwise(edges)]
    assert curve.errors.tolist() == expected
    assert errors.max(axis=1)[curve.steps - 1].tolist() == expected
    assert curve.last == errors[-1].max()


def test_a_random_start_is_the_same_for_the_same_seed_and_small_enough_for_rk4():
    first, second, other = (small_start(CIRCLE.system, EPS, seed) for seed in (0, 0, 1))
    assert first == second != other
    result = survey(load("paper_m2"), None, 1000, [("", "I1")], ("rk4",))
    assert not result.runs[0].early


def drawn(result, **how):
    return plot_comparison(result, Style(width=12), **how)


def test_there_is_a_panel_for_each_function_and_a_line_for_each_method():
    result = survey(load("weierstrass"), ["1/4", "1/8"], 300, [("", "known")], ("kahan", "rk4", "midpoint"))
    figure = drawn(result)
    assert [axes.get_ylabel() for axes in figure.axes] == ["relative error of modified $H$", "relative error of $H$"]
    assert [len(axes.lines) for axes in figure.axes] == [3, 3]
    assert len({line.get_linestyle() for line in figure.axes[0].lines}) == 3
    assert all(line.get_ydata().max() < axes.get_ylim()[1] for axes in figure.axes for line in axes.lines)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["Kahan", "RK4", "implicit midpoint"]
    assert figure.legends[0].get_title().get_text() == r"time step $2\varepsilon = 1/10$"


def test_errors_are_plotted_against_step_and_work_with_the_slopes_of_the_orders():
    result = compare("weierstrass", ["1/4", "1/8"], EPS, 10, methods=["kahan", "rk4"], integrals=[])
    [axes] = drawn(result, show="error").axes
    for line, run in zip(axes.lines, result.runs, strict=False):
        assert line.get_xdata().tolist() == [float((2 * at.eps).p) / float((2 * at.eps).q) for at in run.errors]
        assert line.get_ydata().tolist() == [at.error for at in run.errors]
    for line, order in zip(axes.lines[2:4], (2, 4), strict=True):
        (x, end), (y, low) = line.get_xdata(), line.get_ydata()
        assert np.log(y / low) / np.log(x / end) == pytest.approx(order)
    [axes] = drawn(result, show="work").axes
    assert axes.lines[1].get_xdata().tolist() == [4 * at.steps for at in result.runs[1].errors]
    refuses("no reference solution", drawn, survey(CIRCLE, [1, 0], 5, [("", "x")]), show="error")
    refuses("found no known integral", drawn, result)
    refuses("found the picture 'speed', expected", drawn, result, show="speed")


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
    result = survey(SQUARE, ["1/10"], 2000, [("E", "x")], ("kahan", "rk4"))
    [axes] = drawn(result).axes
    limit = clipped_from(result, "E")
    assert any(line.get_marker() == "^" and line.get_ydata().tolist() == [limit] for line in axes.lines)
    assert axes.get_ylim()[1] < 10 * limit < result.curves[1].errors.max()
    assert not axes.patches  # no band for errors of 0, as there are none
    assert any("ended at step" in text.get_text() for text in axes.figure.legends[0].get_texts())
    [axes] = drawn(survey(SQUARE, ["1"], 30, [("E", "1/x")], ("kahan", "midpoint"))).axes
    assert [line.get_marker() for line in axes.lines].count("x") == 1
