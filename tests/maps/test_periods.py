"""The period of an orbit modulo p, found without walking it, and over Q with a proof.

Over large fields n T = 0 on the level cubic itself, and for no proper divisor of n.
"""

import random
from collections import Counter
from math import lcm

import pytest
from flint import fmpq, fmpz, fq_default_ctx
from helpers import ended, together
from planar_helpers import STARTS, Finite, planar_system, planes_over, structure_and_system

from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form.division import PeriodicLevels
from kahanmaps.maps.normal_form.level_curves import Jacobian, LevelCubic
from kahanmaps.maps.normal_form.periods import PeriodKind, period_of, plane_period, plane_period_over_rationals, poles
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, same_point
from kahanmaps.maps.normal_form.schoof import trace_modulo
from kahanmaps.maps.orbits.iteration import Orbit


def walked(block, point, q):
    """The period by walking, or None where the formula gives (0, 0, 0), and whether a pole was on the way."""
    image, met = point, bool(block.level(point)[1] == 0)
    for step in range(1, q * q + q + 2):
        image = block.image(image)
        if all(entry == 0 for entry in image):
            return None, True
        below = 1 / next(entry for entry in reversed(image) if entry != 0)
        image = tuple(entry * below for entry in image)
        met = met or bool(image[2] == 0)
        if same_point(image, point):
            return step, met
    raise AssertionError("the orbit did not close")


FIELDS = [
    *((Finite(p), 200) for p in (2, 3, 5, 7, 13, 19, 31, 101)),
    *((Finite(p, 2), 100) for p in (3, 5, 11)),
    (Finite(5, 3), 75),
]


@pytest.mark.parametrize(("field", "count"), FIELDS, ids=[repr(field) for field, _ in FIELDS])
def test_in_a_small_field_the_period_and_the_poles_are_those_that_walking_finds(field, count):
    rng, kinds = random.Random(field.q), Counter()
    for block, point in planes_over(field, rng, count):
        result = plane_period(block, point, field.prime, field.context)
        period, met = walked(block, point, field.q)
        kinds[result.kind] += 1
        assert result.meets_pole == met, result
        if period is not None:
            assert (result.period, result.status) == (period, "periodic"), result
        elif result.kind is PeriodKind.SMOOTH:
            assert_order_on_the_cubic(block, point, result.period, poles(block, field.prime, field.context))
        elif result.kind is PeriodKind.ADDITIVE:
            assert result.period == field.prime
    expected = {PeriodKind.STEPPED} if field.prime <= 3 else {PeriodKind.SMOOTH, PeriodKind.ADDITIVE, PeriodKind.FIXED}
    if field.prime > 3 and field.q < 20:
        expected |= {PeriodKind.TRIANGLE, PeriodKind.VERTEX, PeriodKind.AT_POLE, PeriodKind.UNDEFINED}
    assert expected <= set(kinds)


def assert_order_on_the_cubic(block, point, order, at_infinity):
    """T = image - point has this order, computed with chords and tangents of the level cubic."""
    above, below = block.level(point)
    for zero in [point, *at_infinity]:
        cubic = LevelCubic(block, above, below, zero)
        T = block.image(zero)
        assert cubic.is_zero(cubic.multiple(order, T))
        for prime, _ in fmpz(order).factor():
            assert not cubic.is_zero(cubic.multiple(order // int(prime), T))


@pytest.mark.parametrize("prime", [2**31 - 1, 2**40 - 87, 2**61 - 1, pytest.param(2**89 - 1, marks=pytest.mark.slow)])
def test_in_a_large_prime_field_n_T_is_zero_and_no_smaller_multiple_is(prime):
    field, rng = Finite(prime), random.Random(3)
    for block, point in planes_over(field, rng, 2):
        period = plane_period(block, point, prime)
        assert (period.kind, period.status) == (PeriodKind.SMOOTH, "periodic")
        assert period.period > 10
        assert_order_on_the_cubic(block, point, period.period, poles(block, prime))


def test_whether_a_pole_is_met_is_known_where_walking_is_too_long_and_both_happen():
    prime = 10_009
    rng, answers = random.Random(8), Counter()
    for block, point in planes_over(Finite(prime), rng, 40):
        period = plane_period(block, point, prime)
        if period.kind is not PeriodKind.SMOOTH:
            continue
        image, met = point, False
        for _ in range(period.period):
            image = block.image(image)
            if image[2] == 0:
                met = True
                break
        assert period.meets_pole == met
        answers[met, bool(poles(block, prime))] += 1
    assert answers[True, True] > 3
    assert answers[False, False] > 3
    assert answers[True, False] == 0


@pytest.mark.parametrize(("prime", "degree"), [(1009, 1), (1000003, 1), (37, 2), (11, 3)])
def test_the_trace_of_frobenius_modulo_small_primes_gives_the_number_of_points(prime, degree):
    field, rng = Finite(prime, degree), random.Random(prime)
    context = field.context or fq_default_ctx(prime, 1)
    for _ in range(10):
        a2, a4, a6 = (context(int(field.random(rng))) if degree == 1 else field.random(rng) for _ in range(3))
        trace, modulus = trace_modulo(a2, a4, a6, context, int(4 * field.q**0.5) + 4)
        points = field.q + 1 - (trace if 2 * trace < modulus else trace - modulus)
        # A point of a curve with so many points.
        x = next(x for x in (context(k) for k in range(100)) if (((x + a2) * x + a4) * x + a6).is_square())
        curve = Jacobian(0 * x)
        curve.a2, curve.a4 = a2, a4
        assert curve.multiple(points, (x, (((x + a2) * x + a4) * x + a6).sqrt())) is None
        assert abs(points - field.q - 1) <= 2 * field.q**0.5


@pytest.mark.parametrize(
    ("name", "prime"),
    [("m = 2", 29), ("m = 2, another J", 31), ("m = 2, i", 19), ("m = 2, i", 29), ("m = 2, sqrt 2", 13)],
)
def test_the_period_of_a_member_is_that_of_its_kahan_map_where_that_meets_no_pole(name, prime):
    normal_form, system = structure_and_system(name)
    kahan, rng, ends = KahanMap(system, "1/10", GF(prime)), random.Random(4), Counter()
    for _ in range(20):
        start = [rng.randrange(prime) for _ in range(4)]
        period = period_of(normal_form, "1/10", start, prime)
        if not isinstance(period.period, int) or period.period > 3000:
            continue
        end = ended(Orbit(kahan, start, period.period))
        assert end.status == ("singular" if period.meets_pole else "periodic")
        if not period.meets_pole:
            assert end.period == period.period == lcm(*(plane.period for plane in period.planes))
        ends[end.status] += 1
    assert ends["periodic"] > 0
    assert period_of(normal_form, "1/10", [1, 2, 3, 4]).status == "aperiodic"


# h, and a point (u, v) of one of the few levels that have a period over Q.
PERIODIC_OVER_Q = [
    ((0, 2, -1, 2), ("-1/3", "-1/3"), 5),
    ((0, -3, -3, -2), ("-1/3", "1/3"), 5),
    ((0, -3, -3, -3), ("-2/9", "1/9"), 6),
    ((0, -1, -3, -3), (-1, "1/3"), 6),
]


@pytest.mark.parametrize(("h", "start", "period"), PERIODIC_OVER_Q)
def test_a_rational_orbit_of_period_5_or_6_has_that_period_but_for_its_pole(h, start, period):
    u, v = (QQ.convert(value) for value in start)
    result = plane_period_over_rationals(PlanarBlock(*map(fmpq, h)), (u, v, fmpq(1)))
    assert (result.status, result.period, result.meets_pole) == ("periodic", period, True)
    assert ended(Orbit(KahanMap(planar_system(h), "1/2"), start, period)).status == "singular"  # 2 eps (u, v) = (u, v)


@together("name", STARTS)
def test_a_period_of_a_plane_over_q_is_what_walking_shows(name):
    cubic, (U, V, W) = STARTS[name]
    block = PlanarBlock(*(fmpq(c) for c in cubic))
    start = point = (fmpq(U, W), fmpq(V, W), fmpq(1))
    period = plane_period_over_rationals(block, start)
    met = False
    for step in range(1, 13):  # Mazur: no torsion point of a cubic over Q has an order above 12
        point = block.image(point)
        if not any(point):
            break
        met = met or point[2] == 0
        if same_point(point, start):
            assert (period.status, period.period, period.meets_pole) == ("periodic", step, met)
            return
    assert period.status in ("aperiodic", "undefined") or (met and period.meets_pole)


RATIONAL = {5: fmpq(32, 27), 6: fmpq(28, 27), 9: fmpq(8, 9), 12: fmpq(80, 81)}


@together("period", range(1, 31))
def test_the_rational_levels_are_those_of_periods_5_6_9_and_12(period):
    assert PeriodicLevels(period).gammas == ((RATIONAL[period],) if period in RATIONAL else ())
