"""The Kahan (Hirota-Kimura) map over any field: what it is, in all the ways it can be written, and what it keeps.

Convention: the time step is 2 eps. The map is pinned down by its defining equation, by its explicit forms, by a second
implementation in Python's own fractions, and by formulas printed in the literature; then come its inverse, its
Jacobi matrix, its symmetries, its passage from Q to GF(p) and to balls, and its singular points.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

import pytest
from flint import arb, fmpq, fmpq_mat, fmpz
from helpers import (
    EULER_TOP,
    EXACT_FIELDS,
    FIELDS,
    FORCED_PLANE,
    HENON_HEILES,
    LOTKA_VOLTERRA,
    SMALLEST_LARGE_PRIME,
    agree,
    combine,
    encloses,
    fraction,
    matrices,
    over_all_fields,
    over_exact_fields,
    over_named_systems,
    random_point,
    rationals,
    some,
    step_or_none,
    systems,
    systems_with_points,
)
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.algebra.matrices import det, solve
from kahanmaps.algebra.polynomials import evaluate, ring
from kahanmaps.errors import BadPrime, InexactNumber, InputError, PrecisionLost, SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

integers = st.integers(-9, 9)
steps = rationals().filter(bool)

# The defining equation halves, which GF(2) cannot.
over_fields_with_a_half = pytest.mark.parametrize("field", [K for K in FIELDS if K.characteristic != 2], ids=repr)

RICCATI = QuadraticSystem.from_text(["x"], ["x^2"])


def mapped(field, system, point, eps=3):
    """The map, the point over the field and its image; examples without an image are dropped."""
    phi = KahanMap(system, eps, field)
    x = phi.point(point)
    try:
        return phi, x, phi.step(x)
    except (SingularStep, PrecisionLost):
        assume(False)


# Known answers.


def test_the_riccati_equation_is_mapped_by_a_moebius_map():
    # by hand: (x~ - x)/(2 eps) = x x~, so x~ = x/(1 - 2 eps x)
    assert KahanMap(RICCATI, "1/10").step(["1/3"]) == (fmpq(5, 14),)


def test_a_constant_field_is_followed_for_the_time_two_eps():
    assert KahanMap(QuadraticSystem.from_text(["x", "y"], ["1", "-3"]), "1/4").step([10, 10]) == (
        fmpq(21, 2),
        fmpq(17, 2),
    )


def test_a_linear_system_is_mapped_by_cayleys_transform():
    # (1 - J)^-1 (1 + J) = J for J^2 = -1: with eps = 1 the oscillator turns by a quarter
    phi = KahanMap(QuadraticSystem.from_text(["x", "y"], ["y", "-x"]), 1)
    assert phi.step([3, 4]) == (4, -3)


@given(x=st.tuples(rationals(), rationals(), rationals()), eps=steps)
def test_the_euler_top_obeys_the_equations_of_hirota_and_kimura(x, eps):
    # x1~ - x1 = eps a1 (x2~ x3 + x2 x3~) and cyclic, here with a = (1, -2, 1)
    y = step_or_none(KahanMap(EULER_TOP, eps), x)
    assume(y is not None)
    a = (1, -2, 1)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        assert y[i] - x[i] == eps * a[i] * (y[j] * x[k] + x[j] * y[k])


@given(coefficients=st.tuples(*[rationals()] * 4), x=st.tuples(rationals(), rationals()), eps=steps)
def test_a_homogeneous_planar_hamiltonian_map_divides_by_one_quadratic_form(coefficients, x, eps):
    # x~ = (x + 2 eps f(x)) / (1 + eps^2 D), D = det f'(x); Celledoni, McLachlan, Owren, Quispel 2013
    u, v = ring(["u", "v"]).gens()
    a, b, c, d = coefficients
    H = a * u**3 + b * u**2 * v + c * u * v**2 + d * v**3
    phi = KahanMap(CubicHamiltonian(H, standard_structure(2)).system, eps)
    below = 1 + eps**2 * det(phi.vector_field_jacobian(x))
    assume(below != 0)
    assert phi.step(x) == combine((1 / below, x), (2 * eps / below, phi.vector_field(x)))


# The forms of the map.


@over_fields_with_a_half
@some
@given(pair=systems_with_points(entries=integers))
def test_the_image_solves_the_defining_equation(field, pair):
    phi, x, y = mapped(field, *pair)
    with field.working():
        left = combine((1, y), (-1, x))
        right = combine((2 * phi.eps, phi.system.over(field).polarised(x, y)))
    assert agree(field, left, right)


@over_all_fields
@some
@given(pair=systems_with_points(entries=integers))
def test_the_image_is_one_newton_like_step_of_length_two_eps(field, pair):
    # Phi(x) = x + 2 eps (I - eps f'(x))^-1 f(x)
    phi, x, y = mapped(field, *pair)
    with field.working():
        moved = solve(phi.denominator_matrix(x), field.column(phi.vector_field(x))).entries()
        expected = combine((1, x), (2 * phi.eps, moved))
    assert agree(field, y, expected)


@some
@given(pair=systems_with_points(entries=integers))
def test_modulo_two_the_time_step_vanishes_and_nothing_moves(pair):
    _, x, y = mapped(GF(2), *pair)
    assert y == x


# A second implementation, which shares nothing with the first: the defining equation in fractions, sorted by evaluating
# it at zero and at the unit vectors (it is affine in x~), and plain elimination. It takes any numbers with + - * /.


def step_in_fractions(system: QuadraticSystem, eps: Fraction, x: list[Any]) -> list[Any]:
    n = system.dim
    Q = [[[fraction(form[j, k]) for k in range(n)] for j in range(n)] for form in system.Q]
    B = [[fraction(system.B[i, j]) for j in range(n)] for i in range(n)]
    c = [fraction(entry) for entry in system.c]

    def defect(i: int, y: list[Any]) -> Any:
        """(x~ - x) - 2 eps (Q(x, x~) + B (x + x~)/2 + c) in component i, at x~ = y."""
        bilinear = sum(Q[i][j][k] * x[j] * y[k] for j in range(n) for k in range(n))
        linear = sum(B[i][j] * (x[j] + y[j]) for j in range(n)) / 2
        return y[i] - x[i] - 2 * eps * (bilinear + linear + c[i])

    zero = [Fraction(0)] * n
    units = [[Fraction(int(j == k)) for j in range(n)] for k in range(n)]
    rows = [[*(defect(i, unit) - defect(i, zero) for unit in units), 0 - defect(i, zero)] for i in range(n)]
    for k in range(n):
        pivot = next(i for i in range(k, n) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [entry / rows[k][k] for entry in rows[k]]
        for i in range(n):
            if i != k:
                rows[i] = [a - rows[i][k] * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [row[n] for row in rows]


def both_ways(system: QuadraticSystem, eps: fmpq, x: tuple[fmpq, ...]) -> tuple[list[Fraction], list[Fraction]]:
    """The image by the library and the image in fractions."""
    y = KahanMap(system, eps).step(x)
    return [fraction(entry) for entry in y], step_in_fractions(system, fraction(eps), [fraction(e) for e in x])


@given(pair=systems_with_points(dims=(1, 2, 3, 4)), eps=steps)
def test_the_image_is_the_one_computed_in_fractions(pair, eps):
    system, x = pair
    assume(KahanMap(system, eps).determinant(x) != 0)
    library, fractions = both_ways(system, eps, x)
    assert library == fractions


# The inverse.


@over_all_fields
@some
@given(pair=systems_with_points(entries=integers))
def test_the_step_with_minus_eps_leads_back(field, pair):
    phi, x, y = mapped(field, *pair)
    try:
        back = KahanMap(phi.system, -3, field).step(y)
    except (SingularStep, PrecisionLost):
        assume(False)
    assert agree(field, back, x)


@given(pair=systems_with_points(), eps=steps)
def test_the_inverse_step_undoes_the_step(pair, eps):
    system, x = pair
    phi = KahanMap(system, eps)
    y = step_or_none(phi, x)
    assume(y is not None and phi.inverse.determinant(y) != 0)
    assert phi.inverse_step(y) == x


def test_where_the_map_crushes_there_is_no_way_back():
    phi = KahanMap(QuadraticSystem.from_text(["x"], ["-x"]), 1)  # x~ = (1 - 1)/(1 + 1) x
    assert phi.step([5]) == phi.step([7]) == (0,)
    with pytest.raises(SingularStep):
        phi.inverse_step([0])


@over_all_fields
def test_the_inverse_of_the_inverse_is_the_map(field):
    phi = KahanMap(HENON_HEILES, 3, field)
    assert phi.inverse.inverse.eps == phi.eps


def test_over_balls_the_inverse_has_the_full_precision_of_the_field():
    phi = KahanMap(HENON_HEILES, "1/3", RR(300))
    assert phi.inverse.eps.rel_accuracy_bits() >= 298


# The Jacobi matrix.


@settings(max_examples=25)
@given(pair=systems_with_points(dims=(2,)), eps=steps)
def test_the_jacobi_matrix_is_that_of_the_two_rational_functions_by_cramers_rule(pair, eps):
    system, x = pair
    phi = KahanMap(system, eps)
    assume(phi.determinant(x) != 0)
    variables = ring(system.variables).gens()
    M = [[int(i == j) - eps * f.derivative(j) for j in range(2)] for i, f in enumerate(system.rhs)]
    right = [
        variables[i] + eps * (system.B[i, 0] * variables[0] + system.B[i, 1] * variables[1]) + 2 * eps * system.c[i]
        for i in range(2)
    ]
    below = M[0][0] * M[1][1] - M[0][1] * M[1][0]
    above = [right[0] * M[1][1] - M[0][1] * right[1], M[0][0] * right[1] - right[0] * M[1][0]]
    expected = [(N.derivative(j) * below - N * below.derivative(j))(*x) / below(*x) ** 2 for N in above for j in (0, 1)]
    assert list(phi.jacobian(x).entries()) == expected


@pytest.mark.parametrize("prime", [31, 2**61 - 1])
@some
@given(pair=systems_with_points())
def test_the_jacobi_matrix_modulo_a_prime_is_the_one_reduced(prime, pair):
    system, x = pair
    K = GF(prime)
    there = KahanMap(system, 3, K)
    reduced = tuple(K.convert(entry) for entry in x)
    assume(there.determinant(reduced) != 0)
    assert there.jacobian(reduced) == K.convert_matrix(KahanMap(system, 3).jacobian(x))


@over_exact_fields
def test_the_jacobi_matrix_of_the_inverse_is_the_inverse_jacobi_matrix(field):
    phi = KahanMap(FORCED_PLANE.scaled(5), 3, field)  # integer coefficients
    x = next(x for x in map(phi.point, product(range(3), repeat=2)) if phi.determinant(x) != 0 != det(phi.jacobian(x)))
    assert phi.inverse.jacobian(phi.step(x)) * phi.jacobian(x) == field.identity(2)


@given(pair=systems_with_points(), eps=steps)
def test_the_jacobi_determinant_is_the_quotient_of_the_two_denominators(pair, eps):
    system, x = pair
    phi = KahanMap(system, eps)
    assume(phi.determinant(x) != 0)
    assert det(phi.jacobian(x)) * phi.determinant(x) == phi.inverse.determinant(phi.step(x))


def test_the_jacobi_matrix_has_no_value_at_a_singular_point():
    with pytest.raises(SingularStep):
        KahanMap(RICCATI, "1/2").jacobian([1])


# Symmetries and what is kept.


@given(
    pair=systems_with_points(dims=(2, 3)),
    data=st.data(),
    eps=steps,
)
def test_affine_changes_of_variables_commute_with_the_map(pair, data, eps):
    system, x = pair
    n = system.dim
    M, b = data.draw(matrices(n, n, st.integers(-3, 3))), data.draw(st.tuples(*[rationals()] * n))
    assume(M.det() != 0)
    names = ring(system.variables).gens()
    back = [
        sum((entry * (name - shift) for entry, name, shift in zip(row, names, b, strict=True)), 0 * names[0])
        for row in M.inv().tolist()
    ]
    pulled = [f.compose(*back) for f in system.rhs]
    changed = QuadraticSystem(
        [sum((entry * f for entry, f in zip(row, pulled, strict=True)), 0 * names[0]) for row in M.tolist()]
    )

    def change(point):
        return combine((1, (M * QQ.column(point)).entries()), (1, b))

    y = step_or_none(KahanMap(system, eps), x)
    assume(y is not None)
    assert KahanMap(changed, eps).step(change(x)) == change(y)


def test_a_quadratic_change_of_variables_does_not_commute_with_the_map():
    # y = x^2 takes x' = x/2 to y' = y
    half, whole = QuadraticSystem.from_text(["x"], ["x/2"]), QuadraticSystem.from_text(["x"], ["x"])
    (image,) = KahanMap(half, "1/3").step([1])
    assert KahanMap(whole, "1/3").step([1]) != (image**2,)


@given(pair=systems_with_points(), factor=steps, eps=steps)
def test_a_faster_field_is_a_longer_step(pair, factor, eps):
    system, x = pair
    assert step_or_none(KahanMap(system.scaled(factor), eps), x) == step_or_none(KahanMap(system, factor * eps), x)


@given(pair=systems_with_points(), eps=steps)
def test_the_map_agrees_with_the_flow_to_second_order(pair, eps):
    # The flow after time 2 eps is x + 2 eps f + 2 eps^2 f' f + O(eps^3); the map's remainder is exactly
    # 2 eps^3 (I - eps f')^-1 f' f' f.
    system, x = pair
    phi = KahanMap(system, eps)
    y = step_or_none(phi, x)
    assume(y is not None)
    A, f = phi.vector_field_jacobian(x), QQ.column(phi.vector_field(x))
    taylor = QQ.column(x) + f * (2 * eps) + A * f * (2 * eps**2)
    remainder = solve(phi.denominator_matrix(x), A * A * f) * (2 * eps**3)
    assert QQ.column(y) == taylor + remainder


@given(pair=systems_with_points(), eps=steps)
def test_a_point_stays_put_exactly_when_it_is_an_equilibrium(pair, eps):
    system, x = pair
    moved = [system.over(QQ).value(x)[i] for i in range(system.dim)]
    still = QuadraticSystem([p - fmpq(c) for p, c in zip(system.rhs, moved, strict=True)])
    for here in (system, still):  # the second has an equilibrium at x
        y = step_or_none(KahanMap(here, eps), x)
        assume(y is not None)
        assert (y == x) is (not any(here.over(QQ).value(x)))


# From Q to GF(p) and to balls.


@pytest.mark.parametrize("prime", [23, 31, 2**61 - 1, SMALLEST_LARGE_PRIME])  # denominators are at most 20
@some
@given(pair=systems_with_points(), eps=steps)
def test_the_image_modulo_a_prime_is_the_image_reduced(prime, pair, eps):
    system, x = pair
    K = GF(prime)
    there = KahanMap(system, eps, K)
    reduced = tuple(K.convert(entry) for entry in x)
    assume(there.determinant(reduced) != 0)
    assert there.step(reduced) == tuple(K.convert(entry) for entry in KahanMap(system, eps).step(x))


def test_a_point_can_be_singular_modulo_a_prime_only():
    # x' = x^2, eps = 1/2: the denominator is 1 - x
    assert KahanMap(RICCATI, "1/2").step([8]) == (fmpq(-8, 7),)
    with pytest.raises(SingularStep):
        KahanMap(RICCATI, "1/2", GF(7)).step([8])


@pytest.mark.parametrize("bits", [53, 128])
@some
@given(pair=systems_with_points(), eps=steps)
def test_the_image_over_balls_encloses_the_exact_image(bits, pair, eps):
    system, x = pair
    exact = step_or_none(KahanMap(system, eps), x)
    assume(exact is not None)
    try:
        balls = KahanMap(system, eps, RR(bits)).step(x)
    except PrecisionLost:
        assume(False)
    assert all(encloses(ball, number) for ball, number in zip(balls, exact, strict=True))


@over_named_systems
def test_the_image_over_balls_is_almost_as_precise_as_the_field(system):
    # a step costs bits as the condition number of I - eps f' grows: below 2^20 at these points
    phi = KahanMap(system, "1/10", RR(300))
    y = phi.inverse_step(phi.step(random_point(system.dim, seed=5)))
    assert min(entry.rel_accuracy_bits() for entry in y) > 280


@over_named_systems
def test_the_jacobi_matrix_over_balls_encloses_the_exact_one(system):
    x = random_point(system.dim, seed=5)
    balls = KahanMap(system, "1/10", RR(100)).jacobian(x).entries()
    exact = KahanMap(system, "1/10").jacobian(x).entries()
    assert all(encloses(ball, number) for ball, number in zip(balls, exact, strict=True))


# Singular points.


@over_exact_fields
@some
@given(pair=systems_with_points(entries=st.integers(-2, 2)))
@example(pair=(QuadraticSystem.from_text(["x"], ["x"]), (5,)))
def test_the_map_has_no_value_exactly_where_its_determinant_vanishes(field, pair):
    system, x = pair
    phi = KahanMap(system, 1, field)
    assert (step_or_none(phi, x) is None) is (phi.determinant(x) == 0)


@over_exact_fields
@some
@given(pair=systems_with_points(entries=integers))
def test_the_determinant_is_that_of_one_minus_eps_times_the_jacobi_matrix(field, pair):
    system, x = pair
    phi = KahanMap(system, 3, field)
    expected = field.identity(system.dim) - phi.vector_field_jacobian(x) * field.convert(3)
    assert (phi.denominator_matrix(x), phi.determinant(x)) == (expected, det(expected))


@given(pair=systems_with_points(), eps=steps)
def test_the_rational_determinant_is_that_of_the_rational_matrix(pair, eps):
    system, x = pair
    phi = KahanMap(system, eps)
    assert phi.determinant(x) == det(phi.denominator_matrix(x))


def test_a_singular_step_names_the_point_and_eps():
    with pytest.raises(SingularStep, match=r"at the point 1,2 for eps = 1/2") as caught:
        KahanMap(QuadraticSystem.from_text(["x", "y"], ["x^2", "0"]), "1/2").step([1, 2])
    assert (caught.value.point, caught.value.eps) == ((1, 2), fmpq(1, 2))


def test_a_singular_point_of_many_digits_is_shortened():
    system = QuadraticSystem.from_text(["x", "y"], ["x^2", "0"])
    with pytest.raises(SingularStep) as caught:
        KahanMap(system, "1/2").step([1, 10**5000])
    assert len(str(caught.value)) < 400


def test_over_balls_an_exactly_singular_point_is_singular():
    with pytest.raises(SingularStep):
        KahanMap(RICCATI, "1/2", RR(64)).step([1])


def test_over_balls_a_point_that_may_be_singular_is_left_undecided():
    with pytest.raises(PrecisionLost, match="more bits"):
        KahanMap(RICCATI, "1/2", RR(64)).step([arb(1, 2**-60)])


# The door.


@pytest.mark.parametrize("eps", [fmpq(1, 10), Fraction(1, 10), "1/10", "0.1"], ids=repr)
def test_every_way_to_write_a_number_gives_the_same_map(eps):
    assert KahanMap(HENON_HEILES, eps).step([1, "0.5", Fraction(1, 3), fmpq(2)]) == KahanMap(
        HENON_HEILES, fmpq(1, 10)
    ).step([fmpq(1), fmpq(1, 2), fmpq(1, 3), fmpq(2)])


@pytest.mark.parametrize("eps", [0, "0", "0.0", fmpq(0), Fraction(0), fmpz(0)], ids=repr)
@over_all_fields
def test_eps_zero_is_refused(field, eps):
    with pytest.raises(InputError, match="found eps = 0, expected another number") as refusal:
        KahanMap(RICCATI, eps, field)
    assert not isinstance(refusal.value, BadPrime)


@pytest.mark.parametrize("eps", [7, "7", "14/3", Fraction(-7, 2), fmpq(7)], ids=repr)
def test_a_prime_at_which_eps_vanishes_is_refused_as_the_prime(eps):
    with pytest.raises(BadPrime, match="prime 7 divides the numerator of eps") as refusal:
        KahanMap(RICCATI, eps, GF(7))
    assert refusal.value.prime == 7


def test_a_prime_in_the_denominator_of_eps_is_refused():
    with pytest.raises(BadPrime, match="divides the denominator"):
        KahanMap(RICCATI, "1/7", GF(7))


def test_eps_zero_as_an_element_of_the_field_is_refused():
    with pytest.raises(InputError, match="found eps = 0"):
        KahanMap(RICCATI, GF(7).zero, GF(7))


@pytest.mark.parametrize("field", [*EXACT_FIELDS, RR(64)], ids=repr)
def test_a_machine_number_as_eps_is_refused(field):
    with pytest.raises(InexactNumber):
        KahanMap(RICCATI, 0.1, field)


@over_all_fields
def test_a_machine_number_as_coordinate_is_refused(field):
    with pytest.raises(InexactNumber):
        KahanMap(RICCATI, 3, field).step([0.1])


@pytest.mark.parametrize("point", [[], [1], [1, 2, 3]], ids=len)
def test_a_point_of_another_dimension_is_refused_with_the_variables(point):
    with pytest.raises(InputError, match=f"{len(point)} coordinates, expected 2: x, y"):
        KahanMap(LOTKA_VOLTERRA, 1).step(point)


def test_a_system_whose_coefficients_do_not_reduce_is_refused_with_the_prime():
    with pytest.raises(BadPrime):
        KahanMap(QuadraticSystem.from_text(["x"], ["x^2/7"]), 1, GF(7))


@given(system=systems())
def test_the_field_of_the_map_is_the_field_of_the_system(system):
    phi = KahanMap(system, 1)
    x = phi.point([1] * system.dim)
    assert phi.vector_field(x) == tuple(evaluate(f, QQ, x) for f in system.rhs)
    assert phi.vector_field_jacobian(x) == fmpq_mat(
        system.dim, system.dim, [f.derivative(j)(*x) for f in system.rhs for j in range(system.dim)]
    )


def test_a_map_prints_its_variables_eps_and_field():
    assert repr(KahanMap(LOTKA_VOLTERRA, "0.1", GF(7))) == "KahanMap(x, y; eps=5, over GF(7))"
