"""Quadratic systems x' = f(x) = Q(x, x) + B x + c, and the same carried into a field.

Specified here: Q, B, c are what the right-hand sides say (by hand), values and Jacobi matrices obey Taylor's formula,
which is exact in degree 2, the polarisation is Kahan's, coefficients reduce modulo primes, and what is no quadratic
system is refused.
"""

from __future__ import annotations

from fractions import Fraction

import pytest
from flint import fmpq, fmpq_mat
from helpers import (
    EULER_TOP,
    HENON_HEILES,
    LORENZ,
    LOTKA_VOLTERRA,
    agree,
    combine,
    encloses,
    over_all_fields,
    rationals,
    some,
    systems,
    systems_with_points,
)
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.algebra.matrices import trace
from kahanmaps.algebra.polynomials import evaluate, ring
from kahanmaps.errors import BadPrime, InexactNumber, InputError
from kahanmaps.systems.quadratic import MAX_DIMENSION, QuadraticSystem

integers = st.integers(-9, 9)


def plane(first: str, second: str, **parameters) -> QuadraticSystem:
    return QuadraticSystem.from_text(["x", "y"], [first, second], parameters)


# Coefficients.


def test_the_coefficients_are_the_ones_read_off_by_hand():
    system = plane("3*x^2 + x*y - 2*y + 5", "y^2/7")
    assert system.Q == (
        fmpq_mat(2, 2, [fmpq(3), fmpq(1, 2), fmpq(1, 2), fmpq(0)]),
        fmpq_mat(2, 2, [fmpq(0), fmpq(0), fmpq(0), fmpq(1, 7)]),
    )
    assert system.B == fmpq_mat([[0, -2], [0, 0]])
    assert system.c == (5, 0)


@given(system=systems())
def test_a_system_comes_back_from_its_right_hand_sides(system):
    assert QuadraticSystem(system.rhs) == system


@given(system=systems())
def test_a_system_comes_back_from_its_text(system):
    texts = [line.split(" = ")[1] for line in str(system).splitlines()]
    assert QuadraticSystem.from_text(system.variables, texts) == system


def test_a_system_prints_as_its_equations():
    assert str(plane("x*y - x/2", "1")) == "x' = x*y - x/2\ny' = 1"


def test_parameters_are_exact_numbers_of_any_kind():
    expected = plane("x/3", "y/10 + 2")
    assert plane("a*x", "b*y + c", a=Fraction(1, 3), b="0.1", c=2) == expected


def test_a_machine_number_as_parameter_is_refused():
    with pytest.raises(InexactNumber):
        plane("a*x", "y", a=0.5)


@pytest.mark.parametrize(
    ("system", "expected"),
    [(EULER_TOP, True), (LOTKA_VOLTERRA, False), (plane("x^2", "1"), False), (plane("0", "0"), True)],
    ids=["euler_top", "linear terms", "a constant", "zero"],
)
def test_a_system_is_homogeneous_without_linear_terms_and_constants(system, expected):
    assert system.is_homogeneous is expected


DIVERGENCES = [
    (LORENZ, "-41/3"),  # -10 - 1 - 8/3
    (LOTKA_VOLTERRA, "3*x - y + 1"),  # 2 - y + 3x - 1
    (EULER_TOP, "0"),
    (HENON_HEILES, "0"),  # as every Hamiltonian system
]


@pytest.mark.parametrize(("system", "expected"), DIVERGENCES, ids=["lorenz", "lotka_volterra", "euler", "henon_heiles"])
def test_the_divergence_is_the_one_found_by_hand(system, expected):
    assert str(system.divergence) == expected


@given(pair=systems_with_points())
def test_the_divergence_is_the_trace_of_the_jacobi_matrix(pair):
    system, x = pair
    assert evaluate(system.divergence, QQ, x) == trace(system.over(QQ).jacobian(x))


# Values.


@over_all_fields
@some
@given(pair=systems_with_points(entries=integers))
def test_the_value_is_that_of_the_right_hand_sides(field, pair):
    system, x = pair
    at = [field.convert(entry) for entry in x]
    expected = [evaluate(polynomial, field, at) for polynomial in system.rhs]
    assert agree(field, system.over(field).value(at), expected)


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


def test_the_jacobi_matrix_of_the_lorenz_system_is_the_one_found_by_hand():
    expected = fmpq_mat(3, 3, [fmpq(e) for e in (-10, 10, 0, 25, -1, -1, 2, 1)] + [fmpq(-8, 3)])
    assert LORENZ.over(QQ).jacobian((1, 2, 3)) == expected


# The polarisation in Kahan's equation.


@given(triple=systems_with_points(count=2))
def test_the_polarisation_is_symmetric(triple):
    system, x, y = triple
    assert system.over(QQ).polarised(x, y) == system.over(QQ).polarised(y, x)


@given(triple=systems_with_points(count=2))
def test_the_polarisation_is_a_combination_of_three_values(triple):
    system, x, y = triple
    f = system.over(QQ).value
    middle = combine((fmpq(1, 2), x), (fmpq(1, 2), y))
    expected = combine((fmpq(-1, 2), f(x)), (2, f(middle)), (fmpq(-1, 2), f(y)))
    assert system.over(QQ).polarised(x, y) == expected


@given(triple=systems_with_points(count=2), t=rationals())
def test_the_polarisation_is_affine_in_each_point(triple, t):
    system, x, y = triple
    p = system.over(QQ).polarised
    between = combine((1 - t, x), (t, y))
    assert p(x, between) == combine((1 - t, p(x, x)), (t, p(x, y)))


def test_there_is_no_polarisation_modulo_two():
    K = GF(2)
    with pytest.raises(BadPrime):
        EULER_TOP.over(K).polarised([K.one] * 3, [K.one] * 3)


# Other fields.


@pytest.mark.parametrize("prime", [31, 2**61 - 1])
@given(pair=systems_with_points())
def test_value_and_jacobi_matrix_modulo_a_prime_are_those_reduced(prime, pair):
    system, x = pair  # denominators are at most 20
    K = GF(prime)
    here, there = system.over(QQ), system.over(K)
    reduced = [K.convert(entry) for entry in x]
    assert there.value(reduced) == tuple(K.convert(entry) for entry in here.value(x))
    assert there.jacobian(reduced) == K.convert_matrix(here.jacobian(x))


def test_modulo_two_the_mixed_term_of_a_quadratic_form_survives():
    system, K = plane("x*y", "x^2"), GF(2)  # although Q has the entry 1/2
    assert system.over(K).value([K.one, K.one]) == (1, 1)


@pytest.mark.parametrize("rhs", ["x*y/7", "x/7", "1/7"])
def test_a_prime_in_a_denominator_of_the_system_is_refused(rhs):
    with pytest.raises(BadPrime) as refusal:
        plane("y", rhs).over(GF(7))
    assert refusal.value.prime == 7


def test_a_prime_in_a_numerator_is_no_obstacle():
    assert plane("7*x*y", "x").over(GF(7)).value([GF(7).one] * 2) == (0, 1)


@given(pair=systems_with_points())
def test_value_and_jacobi_matrix_over_balls_enclose_the_exact_ones(pair):
    system, x = pair
    R = RR(100)
    balls = [R.convert(entry) for entry in x]
    there, here = system.over(R), system.over(QQ)
    found = [*there.value(balls), *there.jacobian(balls).entries()]
    expected = [*here.value(x), *here.jacobian(x).entries()]
    assert all(encloses(ball, number) for ball, number in zip(found, expected, strict=True))


def test_over_balls_everything_has_the_precision_of_the_field():
    local, R = LORENZ.over(RR(300)), RR(300)
    x = [R.convert(text) for text in ("1/3", "1/7", "1/11")]
    balls = [*local.value(x), *local.jacobian(x).entries(), *local.polarised(x, x), *local.hessian_times(x).entries()]
    assert min(ball.rel_accuracy_bits() for ball in balls if not ball.is_exact()) > 280


@over_all_fields
def test_a_system_over_a_field_is_made_once(field):
    assert HENON_HEILES.over(field) is HENON_HEILES.over(field)


def test_a_system_remembers_the_right_field_among_many():
    primes = [7, 11, 13, 17, 19, 23, 29, 31, 37, 41]
    system = plane("100*x", "y")
    values = [system.over(GF(p)).value([GF(p).one] * 2)[0] for p in primes + primes]
    assert [int(value) for value in values] == [100 % p for p in primes + primes]


# Derived systems and normal forms.


@given(pair=systems_with_points(), factor=rationals())
def test_a_scaled_system_has_scaled_values(pair, factor):
    system, x = pair
    assert system.scaled(factor).over(QQ).value(x) == combine((factor, system.over(QQ).value(x)))


@given(system=systems())
def test_equal_systems_hash_alike(system):
    same = QuadraticSystem(system.rhs)
    assert (same, hash(same)) == (system, hash(system))


@given(system=systems())
def test_systems_that_differ_in_a_constant_are_different(system):
    shifted = QuadraticSystem([system.rhs[0] + 1, *system.rhs[1:]])
    assert shifted != system


@pytest.mark.parametrize(
    "other",
    [plane("y", "x^2"), plane("-y", "x"), QuadraticSystem.from_text(["x", "z"], ["z", "x"]), "x' = y"],
    ids=["Q", "B", "names", "text"],
)
def test_systems_that_differ_in_form_matrix_or_names_are_different(other):
    assert plane("y", "x") != other


# What is refused.


def test_a_right_hand_side_of_degree_three_is_refused_by_its_variable():
    with pytest.raises(InputError, match="of y' has degree 3, expected at most 2"):
        plane("x", "x*y^2")


@pytest.mark.parametrize("texts", [["x"], ["x", "y", "x"]], ids=len)
def test_another_number_of_right_hand_sides_than_of_variables_is_refused(texts):
    with pytest.raises(InputError, match=f"{len(texts)} right-hand sides for the 2 variables x, y"):
        QuadraticSystem.from_text(["x", "y"], texts)


def test_no_right_hand_side_is_refused():
    with pytest.raises(InputError, match="no right-hand side"):
        QuadraticSystem([])


def test_another_number_of_polynomials_than_of_variables_is_refused():
    with pytest.raises(InputError, match="found 1 right-hand sides for the 2 variables"):
        QuadraticSystem(ring(["x", "y"]).gens()[:1])


def test_a_system_of_too_many_variables_is_refused():
    names = [f"x{i}" for i in range(MAX_DIMENSION + 1)]
    with pytest.raises(InputError, match=f"expected at most {MAX_DIMENSION}"):
        QuadraticSystem(ring(names).gens())


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


@pytest.mark.parametrize("field", [QQ, GF(10007)], ids=repr)
@given(systems_with_points(dims=(1, 2, 3), entries=st.integers(-9, 9).map(fmpq), count=2))
def test_values_differ_by_what_derivatives_say(field, drawn):
    """f(x + v) = f(x) + f'(x) v + f''(v, v)/2 for f of degree 2, and f'(x + v) = f'(x) + f''(v)."""
    system, x, v = drawn
    local = system.over(field)
    here, step = [field.convert(entry) for entry in x], [field.convert(entry) for entry in v]
    there, column = [a + b for a, b in zip(here, step, strict=True)], field.column(step)
    change = local.jacobian(here) * column + local.hessian_times(step) * column * field.convert(fmpq(1, 2))
    assert local.value(there) == tuple((field.column(local.value(here)) + change).entries())
    assert local.jacobian(there) == local.jacobian(here) + local.hessian_times(step)
    assert local.polarised(here, here) == local.value(here)
