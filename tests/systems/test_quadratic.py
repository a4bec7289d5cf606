"""Quadratic systems x' = f(x) = Q(x, x) + B x + c, those with a cubic Hamiltonian, and their solutions in balls."""

from fractions import Fraction

import pytest
from flint import arb, fmpq, fmpq_mat
from helpers import EULER_TOP, agree, over_all_fields, rationals, refuses, some, systems, systems_with_points
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.algebra.matrices import trace
from kahanmaps.algebra.polynomials import evaluate, gradient, monomials, ring
from kahanmaps.errors import BadPrime
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import MAX_DIMENSION, QuadraticSystem
from kahanmaps.systems.taylor import solution

integers = st.integers(-9, 9)


def plane(first: str, second: str, **parameters) -> QuadraticSystem:
    return QuadraticSystem.from_text(["x", "y"], [first, second], parameters)


def test_the_coefficients_are_the_ones_read_off_by_hand():
    system = plane("3*x^2 + x*y - 2*y + 5", "y^2/7")
    assert system.Q == (
        fmpq_mat(2, 2, [fmpq(3), fmpq(1, 2), fmpq(1, 2), fmpq(0)]),
        fmpq_mat(2, 2, [fmpq(0), fmpq(0), fmpq(0), fmpq(1, 7)]),
    )
    assert system.B == fmpq_mat([[0, -2], [0, 0]])
    assert system.c == (5, 0)


@given(system=systems())
def test_a_printed_system_parses_back(system):
    texts = [line.split(" = ")[1] for line in str(system).splitlines()]
    assert QuadraticSystem.from_text(system.variables, texts) == system


def test_parameters_are_exact_numbers_of_any_kind():
    expected = plane("x/3", "y/10 + 2")
    assert plane("a*x", "b*y + c", a=Fraction(1, 3), b="0.1", c=2) == expected


@given(pair=systems_with_points())
def test_the_divergence_is_the_trace_of_the_jacobi_matrix(pair):
    system, x = pair
    assert evaluate(system.divergence, QQ, x) == trace(system.over(QQ).jacobian(x))


@over_all_fields
@some
@given(pair=systems_with_points(entries=integers))
def test_the_value_follows_from_the_coefficients(field, pair):
    system, x = pair
    column = fmpq_mat(system.dim, 1, list(x))
    by_hand = [
        (column.transpose() * system.Q[i] * column)[0, 0] + (system.B * column)[i, 0] + system.c[i]
        for i in range(system.dim)
    ]
    value = system.over(field).value([field.convert(entry) for entry in x])
    assert agree(field, value, [field.convert(entry) for entry in by_hand])


def test_there_is_no_polarisation_modulo_two():
    K = GF(2)
    with pytest.raises(BadPrime):
        EULER_TOP.over(K).polarised([K.one] * 3, [K.one] * 3)


def test_a_system_of_too_many_variables_is_refused():
    names = [f"x{i}" for i in range(MAX_DIMENSION + 1)]
    refuses(f"expected at most {MAX_DIMENSION}", QuadraticSystem, ring(names).gens())


@pytest.mark.parametrize("field", [QQ, GF(10007), GF(2**61 - 1)], ids=repr)
@given(systems_with_points(dims=(1, 2, 3), entries=st.integers(-9, 9).map(fmpq), count=2), st.data())
def test_a_constant_matrix_times_a_system_has_its_values_and_derivatives(field, drawn, data):
    """(C f)(x) = C f(x), (C f)'(x) = C f'(x), and C f of two points, the right-hand side of the map."""
    system, x, y = drawn
    n = system.dim
    C = fmpq_mat(n, n, [data.draw(st.integers(-5, 5)) for _ in range(n * n)])
    local, matrix = system.over(field), field.convert_matrix(C)
    moved = local.transformed(matrix)
    here, there = [field.convert(entry) for entry in x], [field.convert(entry) for entry in y]
    assert moved.value(here) == tuple((matrix * field.column(local.value(here))).entries())
    assert moved.polarised(here, there) == tuple((matrix * field.column(local.polarised(here, there))).entries())
    assert moved.jacobian(here) == matrix * local.jacobian(here)


PLANE = ring(["q", "p"])
q, p = PLANE.gens()
FOUR = ("q1", "q2", "p1", "p2")


def cubics(names, degrees=(1, 2, 3)):
    """Polynomials of degree up to 3 with all coefficients drawn."""
    exponents = [m for degree in degrees for m in monomials(len(names), degree)]
    drawn = st.lists(rationals(6), min_size=len(exponents), max_size=len(exponents))
    return drawn.map(lambda c: ring(names).from_dict({m: a for m, a in zip(exponents, c, strict=True) if a != 0}))


@given(cubics(FOUR, (3,)), st.lists(rationals(6), min_size=4, max_size=4))
def test_a_homogeneous_cubic_is_found_about_the_point_it_was_moved_to(H, point):
    moved = CubicHamiltonian(H, standard_structure(4)).about([-c for c in point])
    back = moved.about(moved.centre)  # not that point itself, where H does not depend on all variables
    assert back.is_homogeneous
    assert back.H == H


@pytest.mark.parametrize("H", [q**3 / 3 + p**2 / 2, q**3 + p**3 + q, (q + p - 3) ** 3 + p, q**2 + p**2 + p])
def test_other_cubics_have_no_centre(H):
    assert CubicHamiltonian(H, standard_structure(2)).centre is None


@pytest.mark.parametrize(("H", "centre"), [(q**3 + p**3, (0, 0)), ((q - 1) ** 3, (1, 0)), (q * 0 + 5, (0, 0))])
def test_the_centre_is_the_origin_where_it_can_be(H, centre):
    assert CubicHamiltonian(H, standard_structure(2)).centre == centre


@given(H=cubics(FOUR))
def test_with_the_standard_structure_the_equations_are_the_canonical_ones(H):
    f = CubicHamiltonian(H, standard_structure(4)).system.rhs
    dq1, dq2, dp1, dp2 = gradient(H)
    assert f == (dp1, dp2, -dq1, -dq2)


@pytest.mark.parametrize(
    ("H", "J", "words"),
    [
        (q**3 * p, standard_structure(2), "H has degree 4, expected at most 3"),
        (q**3, standard_structure(4), "expected 2 x 2 for 2 variables"),
        (q**3, fmpq_mat(2, 3), "expected 2 x 2 for 2 variables"),
        (q**3, fmpq_mat([[0, 1], [1, 0]]), r"entry \(1,2\) is 1, entry \(2,1\) is 1, expected opposite"),
    ],
)
def test_what_is_no_cubic_or_no_skew_structure_is_refused(H, J, words):
    refuses(words, CubicHamiltonian, H, J)


@pytest.mark.parametrize("bits", [64, 200])
@pytest.mark.parametrize("time", ["3", "-7/2", "1/1000"])
def test_balls_contain_the_solution_and_are_as_small_as_requested(bits, time):
    rotation = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    logistic = QuadraticSystem.from_text(["x"], ["x - x^2"])
    with RR(3 * bits).working():
        t = arb(fmpq(*map(int, (time + "/1").split("/")[:2])))
        growth = (t.exp() / 3) / (1 + (t.exp() - 1) / 3)  # of x' = x - x^2 from 1/3
        for system, start, exact in ((rotation, [1, 0], [t.cos(), -t.sin()]), (logistic, ["1/3"], [growth])):
            balls = solution(system, start, time, bits)
            for ball, value in zip(balls, exact, strict=True):
                assert ball.contains(value)
                assert not (ball + arb(2) ** (3 - bits)).contains(value)  # the control: they are no larger
    assert solution(rotation, [1, 0], time, bits)[0].rad() > 0


def test_a_solution_that_does_not_exist_is_none_and_constants_stay():
    square = QuadraticSystem.from_text(["x"], ["x^2"])
    assert solution(square, [1], 1) is None
    assert solution(square, [1], 5) is None
    assert [ball.contains(0) for ball in solution(square, [0], 5)] == [True]
    [ball] = solution(QuadraticSystem.from_text(["x"], ["3"]), ["1/7"], 2)
    with RR(200).working():
        assert ball.contains(arb(fmpq(43, 7)))
    refuses("found a point with 2 coordinates, expected 1", solution, square, [1, 2], 1)
