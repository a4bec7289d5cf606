"""The Kahan (Hirota-Kimura) map over any field; the time step is 2 eps.

Its image is that of a second implementation, the defining equation solved in Python's own fractions.
"""

from fractions import Fraction
from itertools import product

import pytest
from check_helpers import kahan_step
from flint import fmpq, fmpz
from helpers import (
    EULER_TOP,
    FIELDS,
    SMALLEST_LARGE_PRIME,
    agree,
    encloses,
    fraction,
    over_all_fields,
    over_exact_fields,
    rationals,
    some,
    step_or_none,
    systems_with_points,
    together,
)
from hypothesis import assume, example, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF, RR
from kahanmaps.algebra.matrices import det
from kahanmaps.errors import BadPrime, InputError, PrecisionLost, SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem

integers = st.integers(-9, 9)
steps = rationals().filter(bool)


RICCATI = QuadraticSystem.from_text(["x"], ["x^2"])


def mapped(field, system, point, eps=3):
    """The map, the point over the field and its image; examples without an image are dropped."""
    phi = KahanMap(system, eps, field)
    x = phi.point(point)
    try:
        return phi, x, phi.step(x)
    except (SingularStep, PrecisionLost):
        assume(False)


@given(x=st.tuples(rationals(), rationals(), rationals()), eps=steps)
def test_the_euler_top_obeys_the_equations_of_hirota_and_kimura(x, eps):
    # x1~ - x1 = eps a1 (x2~ x3 + x2 x3~) and cyclic, here with a = (1, -2, 1)
    y = step_or_none(KahanMap(EULER_TOP, eps), x)
    assume(y is not None)
    a = (1, -2, 1)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        assert y[i] - x[i] == eps * a[i] * (y[j] * x[k] + x[j] * y[k])


@given(pair=systems_with_points(dims=(1, 2, 3, 4)), eps=steps)
def test_the_image_is_the_one_computed_in_fractions(pair, eps):
    system, x = pair
    image = step_or_none(KahanMap(system, eps), x)
    expected = kahan_step(system, fraction(eps), [fraction(entry) for entry in x])
    assert (None if image is None else tuple(map(fraction, image))) == expected


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
def test_the_jacobi_determinant_is_the_quotient_of_the_two_denominators(pair, eps):
    system, x = pair
    phi = KahanMap(system, eps)
    assume(phi.determinant(x) != 0)
    assert det(phi.jacobian(x)) * phi.determinant(x) == phi.inverse.determinant(phi.step(x))


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


@over_exact_fields
@some
@given(pair=systems_with_points(entries=st.integers(-2, 2)))
@example(pair=(QuadraticSystem.from_text(["x"], ["x"]), (5,)))
def test_the_map_has_no_value_exactly_where_its_determinant_vanishes(field, pair):
    system, x = pair
    phi = KahanMap(system, 1, field)
    assert (step_or_none(phi, x) is None) is (phi.determinant(x) == 0)


@together("field, eps", product(FIELDS, [0, "0", "0.0", fmpq(0), Fraction(0), fmpz(0)]))
def test_eps_zero_is_refused(field, eps):
    with pytest.raises(InputError, match="found eps = 0, expected another number") as error:
        KahanMap(RICCATI, eps, field)
    assert not isinstance(error.value, BadPrime)


@pytest.mark.parametrize("eps", [7, "7", "14/3", Fraction(-7, 2), fmpq(7)], ids=repr)
def test_a_prime_at_which_eps_vanishes_is_refused_as_the_prime(eps):
    with pytest.raises(BadPrime, match="prime 7 divides the numerator of eps") as error:
        KahanMap(RICCATI, eps, GF(7))
    assert error.value.prime == 7
