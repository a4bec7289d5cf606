"""RK4 and the implicit midpoint rule: their orders, what they conserve, and that both ways to compute agree."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kahanmaps.errors import InputError
from kahanmaps.maps.float_classical import METHODS, ClassicalOrbit
from kahanmaps.maps.float_numbers import exact, to_float
from kahanmaps.systems.catalog import load
from kahanmaps.systems.quadratic import QuadraticSystem

GROWTH = QuadraticSystem.from_text(["x"], ["x"])
CIRCLE = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
SQUARE = QuadraticSystem.from_text(["x"], ["x^2"])


def walk(system, eps, start, steps, method, **how):
    orbit = ClassicalOrbit(system, eps, start, steps, method, **how)
    return np.concatenate([x for _, x in orbit.portions()]), orbit.end


@pytest.mark.parametrize(("method", "order"), [("rk4", 4), ("midpoint", 2)])
def test_the_order_is_that_of_the_method(method, order):
    def error(steps):
        return abs(walk(GROWTH, f"1/{2 * steps}", [1], steps, method)[0][-1, 0] - math.e)

    assert math.log2(error(20) / error(40)) == pytest.approx(order, abs=0.1)


def test_midpoint_of_a_linear_equation_is_its_cayley_transform():
    x, _ = walk(GROWTH, "1/10", [1], 3, "midpoint")
    assert x[:, 0] == pytest.approx([(1.1 / 0.9) ** k for k in range(4)], rel=1e-14)


def test_midpoint_solves_its_equation():
    system = load("lotka_volterra").system
    x, _ = walk(system, "1/5", [1, "1/2"], 50, "midpoint")
    y = (x[1:] + x[:-1]) / 2
    field = np.array([[to_float(form(*map(exact, point.tolist()))) for form in system.rhs] for point in y])
    assert np.abs(x[1:] - x[:-1] - 0.4 * field).max() < 1e-14


def test_midpoint_conserves_quadratic_integrals_and_rk4_does_not():
    drift = {}
    for method in METHODS:
        x, _ = walk(CIRCLE, "1/10", [1, 0], 1000, method)
        drift[method] = abs((x**2).sum(axis=1) - 1).max()
    assert drift["midpoint"] < 1e-12
    # A step of RK4 multiplies x^2 + y^2 by 1 - h^6/72 + h^8/576, h = 1/5.
    assert drift["rk4"] == pytest.approx(1000 * (0.2**6 / 72 - 0.2**8 / 576), rel=1e-3)


@pytest.mark.slow  # compiling takes a second and more
@pytest.mark.parametrize("method", METHODS)
def test_compiled_and_plain_steps_are_the_same_numbers(method):
    pytest.importorskip("numba")
    system = load("henon_heiles").system
    first, second = (
        walk(system, "1/20", ["1/10", "1/7", "1/9", "-1/8"], 500, method, compiled=compiled)[0]
        for compiled in (False, True)
    )
    assert (first == second).all()


def test_an_orbit_to_infinity_ends_as_an_overflow():
    x, end = walk(SQUARE, "1/2", [10], 100, "rk4")
    assert end.status == "overflow"
    assert np.isfinite(x).all()
    assert len(x) == end.steps + 1


def test_a_midpoint_equation_without_solution_ends_the_orbit():
    # y = x + y^2/2 with x = 10 has no real solution.
    x, end = walk(SQUARE, "1/2", [10], 100, "midpoint")
    assert (end.status, end.steps, len(x)) == ("singular", 0, 1)
    assert "midpoint equation" in end.message


def test_no_steps_leave_the_start():
    x, end = walk(CIRCLE, "1/2", [1, 2], 0, "rk4")
    assert (x.tolist(), end.status) == ([[1.0, 2.0]], "completed")


@pytest.mark.parametrize(("start", "method"), [([1], "euler"), ([1, 2], "rk4")])
def test_wrong_values_are_refused(start, method):
    with pytest.raises(InputError, match="expected"):
        ClassicalOrbit(GROWTH, "1/2", start, 1, method)
