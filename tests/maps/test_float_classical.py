"""RK4 and the implicit midpoint rule: a step is that of the formula, and how orbits end."""

from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq_mat

from kahanmaps.maps.floats.classical import ClassicalOrbit
from kahanmaps.systems.quadratic import QuadraticSystem

SQUARE = QuadraticSystem.from_text(["x"], ["x^2"])


def walk(system, eps, start, steps, method):
    orbit = ClassicalOrbit(system, eps, start, steps, method)
    return np.concatenate([x for _, x in orbit.portions()]), orbit.end


def test_a_midpoint_equation_without_solution_ends_the_orbit():
    # y = x + y^2/2 with x = 10 has no real solution.
    x, end = walk(SQUARE, "1/2", [10], 100, "midpoint")
    assert (end.status, end.steps, len(x)) == ("singular", 0, 1)
    assert "midpoint equation" in end.message


def butcher(f, h, x):
    """The step of the classical Runge-Kutta method, in fractions."""
    a = f(x)
    b = f([p + h / 2 * q for p, q in zip(x, a, strict=True)])
    c = f([p + h / 2 * q for p, q in zip(x, b, strict=True)])
    d = f([p + h * q for p, q in zip(x, c, strict=True)])
    return [p + h / 6 * (q + 2 * r + 2 * s + t) for p, q, r, s, t in zip(x, a, b, c, d, strict=True)]


def test_a_step_of_rk4_is_that_of_the_formula():
    system = QuadraticSystem.from_text(["x", "y"], ["x^2 - 3*x*y + 2*y - 1", "5*y^2 + x*y - x + 1/2"])

    def field(p):
        return [p[0] ** 2 - 3 * p[0] * p[1] + 2 * p[1] - 1, 5 * p[1] ** 2 + p[0] * p[1] - p[0] + Fraction(1, 2)]

    x, _ = walk(system, "1/20", ["1/3", "-2/5"], 1, "rk4")
    expected = butcher(field, Fraction(1, 10), [Fraction(1, 3), Fraction(-2, 5)])
    assert x[1].tolist() == pytest.approx([float(entry) for entry in expected], rel=1e-14)


# With h/2 = 1/2 the matrix I - A/2 has zeros where Gauss would divide: rows have to be exchanged.
CAYLEY = [
    [[2, 1], [1, 0]],
    [[2, 2, 0], [0, 2, 2], [2, 0, 2]],
    [[2, 1, 3], [4, 2, 1], [1, 5, 1]],
    [[2, 0, 1, 0], [1, 3, 0, 2], [0, 4, 2, 1], [5, 0, 0, 1]],
    [[0, 1, 0], [0, 0, 1], [1, 1, 0]],
]


@pytest.mark.parametrize("rows", [*CAYLEY, [[3]], [[1, 2, 3], [4, 5, 6], [7, 8, 10]]])
def test_midpoint_of_linear_equations_is_their_cayley_transform(rows):
    n = len(rows)
    names = ["x", "y", "z", "w"][:n]
    rhs = [" + ".join(f"{a}*{name}" for a, name in zip(row, names, strict=True)) for row in rows]
    entry, A = fmpq_mat(n, n, [int(i == j) for i in range(n) for j in range(n)]), fmpq_mat(rows)
    start = fmpq_mat(n, 1, [1, -2, 3, 5][:n])
    expected = (entry - A / 2).solve((entry + A / 2) * start)
    x, end = walk(QuadraticSystem.from_text(names, rhs), "1/2", [str(e) for e in start.entries()], 1, "midpoint")
    assert end.status == "completed"
    assert x[1].tolist() == pytest.approx([float(e.p) / float(e.q) for e in expected.entries()], rel=1e-12)
