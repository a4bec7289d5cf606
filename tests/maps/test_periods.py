"""The period of an orbit modulo p, found without walking it, and over Q with a proof.

Specified here: over small fields the period, and whether a pole is met, are what walking finds, for every kind of
level; over large ones n T = 0 on the level cubic itself, and for no proper divisor of n; over Q, orders that are known.
"""

from __future__ import annotations

import random
from collections import Counter
from math import lcm

import pytest
from flint import fmpq, fmpq_poly, fmpz, fq_default_ctx
from planar_helpers import STARTS, structure_and_system

from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.algebra.polynomials import ring
from kahanmaps.errors import BadPrime, SingularStep
from kahanmaps.family.draw import draw_with_chi, draw_with_eigenvalues
from kahanmaps.family.planar import normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form import level_curves, periods
from kahanmaps.maps.normal_form.level_curves import (
    Jacobian,
    LevelCubic,
    inverses,
    number_of_points,
    translation_order,
)
from kahanmaps.maps.normal_form.periods import (
    Kind,
    OrbitPeriod,
    _reductions,
    orbit_period,
    period_of,
    period_over_rationals,
    plane_period,
    plane_period_over_rationals,
    poles,
    torsion_order,
)
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, same_point
from kahanmaps.maps.normal_form.schoof import trace_modulo
from kahanmaps.maps.normal_form.translation import iterate
from kahanmaps.maps.orbits.iteration import Orbit
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

MERSENNE = 2**61 - 1


class Small:
    """A field of q elements, with random ones."""

    def __init__(self, prime: int, degree: int = 1) -> None:
        self.prime, self.degree, self.q = prime, degree, prime**degree
        self.context = None if degree == 1 else fq_default_ctx(prime, degree)

    def random(self, rng):
        if self.context is None:
            return GF(self.prime).convert(rng.randrange(self.prime))
        t, total = self.context.gen(), self.context(0)
        for _ in range(self.degree):
            total = total * t + rng.randrange(self.prime)
        return total

    def __repr__(self) -> str:
        return f"GF({self.prime}^{self.degree})"


def blocks(field: Small, rng: random.Random, count: int):
    """Random cubics and points, with more of the degenerate ones than chance gives."""
    for number in range(count):
        a, b, c, d = (field.random(rng) for _ in range(4))
        u, v = field.random(rng), field.random(rng)
        nought = 0 * a
        match number % 12:
            case 8:  # a double root
                a, b, c, d = a * a * c, a * (a * d + 2 * b * c), b * (2 * a * d + b * c), b * b * d
            case 9:  # a triple one
                a, b, c, d = a * a * a, 3 * a * a * b, 3 * a * b * b, b * b * b
            case 10:  # a point of the level 0
                d = nought if v == 0 else -(a * u * u * u + b * u * u * v + c * u * v * v) / (v * v * v)
            case 11 if rng.random() < 0.3:
                a = b = c = d = nought
            case 11 if rng.random() < 0.3:
                u = v = nought
        yield PlanarBlock(a, b, c, d), (u, v, nought + 1)


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
    *((Small(p), 400) for p in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 101)),
    *((Small(p, 2), 200) for p in (3, 5, 7, 11)),
    (Small(3, 3), 150),
    (Small(5, 3), 150),
]


@pytest.mark.parametrize(
    ("field", "count"), [(field, count // 2) for field, count in FIELDS], ids=[repr(field) for field, _ in FIELDS]
)
def test_in_a_small_field_the_period_and_the_poles_are_those_that_walking_finds(field, count):
    rng, kinds = random.Random(field.q), Counter()
    for block, point in blocks(field, rng, count):
        found = plane_period(block, point, field.prime, field.context)
        period, met = walked(block, point, field.q)
        kinds[found.kind] += 1
        assert found.meets_pole == met, found
        if period is not None:
            assert (found.period, found.status) == (period, "periodic"), found
        elif found.kind is Kind.SMOOTH:
            assert_order_on_the_cubic(block, point, found.period, poles(block, field.prime, field.context))
        elif found.kind is Kind.ADDITIVE:
            assert found.period == field.prime
    expected = {Kind.STEPPED} if field.prime <= 3 else {Kind.SMOOTH, Kind.ADDITIVE, Kind.FIXED}
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


@pytest.mark.parametrize("prime", [5, 7, 11, 13, 17, 19, 31, 37, 211])
def test_three_lines_and_their_vertices_have_the_period_of_minus_8_and_3(prime):
    rng, field, kinds = random.Random(prime), Small(prime), Counter()
    while kinds.total() < 40:
        ((block, point),) = blocks(field, rng, 1)
        above, below = block.level(point)
        if below == 0 or block.discriminant * above * above != below * below:
            continue
        found = plane_period(block, point, prime)
        kinds[found.kind] += 1
        period, met = walked(block, point, prime)
        assert found.meets_pole == met
        assert period is None or found.period == period
        assert found.period == (3 if found.kind is Kind.VERTEX else 3 * order_of_minus_8(prime))
    assert set(kinds) == {Kind.TRIANGLE, Kind.VERTEX} or prime == 211


def order_of_minus_8(prime: int) -> int:
    return next(k for k in range(1, prime) if pow(-8, k, prime) == 1)


@pytest.mark.parametrize("prime", [5, 13, 101, 2**31 - 1, 2**61 - 1])
def test_a_start_at_a_pole_comes_back_after_four_steps(prime):
    field, rng, seen = Small(prime), random.Random(prime), 0
    while seen < 10:
        a, b, c, v = (field.random(rng) for _ in range(4))
        # -D(0, v) = (c^2 - 3 b d) v^2 = 1 gives d.
        if b == 0 or v == 0:
            continue
        block, point = PlanarBlock(a, b, c, (c * c - 1 / (v * v)) / (3 * b)), (0 * a, v, 0 * a + 1)
        found = plane_period(block, point, prime)
        if found.kind is Kind.AT_POLE:
            image = point
            for _ in range(4):
                assert image == point or not same_point(image, point)
                image = block.image(image)
            assert same_point(image, point)
            assert (found.period, found.meets_pole) == (4, True)
            seen += 1


# Large fields.


@pytest.mark.parametrize(
    "prime", [2**31 - 1, 2**31 + 11, 2**40 - 87, 2**61 - 1, pytest.param(2**89 - 1, marks=pytest.mark.slow)]
)
def test_in_a_large_prime_field_n_T_is_zero_and_no_smaller_multiple_is(prime):
    field, rng = Small(prime), random.Random(3)
    for block, point in blocks(field, rng, 2):
        found = plane_period(block, point, prime)
        assert (found.kind, found.status) == (Kind.SMOOTH, "periodic")
        assert found.period > 10
        assert_order_on_the_cubic(block, point, found.period, poles(block, prime))


@pytest.mark.parametrize(
    ("prime", "degree"),
    [
        (2**20 + 7, 2),
        pytest.param(2**31 - 1, 2, marks=pytest.mark.slow),
        pytest.param(2**20 + 7, 4, marks=pytest.mark.slow),
        pytest.param(MERSENNE, 2, marks=pytest.mark.slow),
    ],
)
def test_in_an_extension_of_a_large_field_too(prime, degree):
    field = Small(prime, degree)
    for block, point in blocks(field, random.Random(1), 1):
        found = plane_period(block, point, field.prime, field.context)
        assert found.status == "periodic"
        assert_order_on_the_cubic(block, point, found.period, poles(block, field.prime, field.context))


def test_a_field_that_is_too_large_is_not_decided_and_says_so():
    field = Small(2**61 - 1, 5)
    ((block, point),) = blocks(field, random.Random(1), 1)
    found = plane_period(block, point, field.prime, field.context)
    assert (found.status, found.period) == ("undecided", None)
    assert "about 2^304 elements" in found.text


def test_in_a_field_that_is_too_large_no_pole_is_met_where_there_is_none():
    prime, seen = 10_007, Counter()
    for block, point in blocks(Small(prime), random.Random(2), 30):
        found = plane_period(block, point, prime, largest=100)
        if found.status == "undecided":
            has_poles = bool(poles(block, prime))
            assert found.meets_pole is (None if has_poles else False)
            seen[has_poles] += 1
    assert min(seen[True], seen[False]) > 0


def test_whether_a_pole_is_met_is_known_where_walking_is_too_long_and_both_happen():
    prime = 60_013
    rng, answers = random.Random(8), Counter()
    for block, point in blocks(Small(prime), rng, 30):
        found = plane_period(block, point, prime)
        if found.kind is not Kind.SMOOTH:
            continue
        image, met = point, False
        for _ in range(found.period):
            image = block.image(image)
            if image[2] == 0:
                met = True
                break
        assert found.meets_pole == met
        answers[met, bool(poles(block, prime))] += 1
    assert answers[True, True] > 3
    assert answers[False, False] > 3
    assert answers[True, False] == 0


@pytest.mark.parametrize("prime", [2**31 - 1, MERSENNE])
def test_the_iterate_computed_by_doublings_is_back_at_the_start_after_a_period(prime):
    field, rng = Small(prime), random.Random(12)
    for block, point in blocks(field, rng, 4):
        found = plane_period(block, point, prime)
        assert same_point(iterate(block, point, found.period, lambda value: bool(value == 0)), point)
        for factor, _ in fmpz(found.period).factor():
            n = found.period // int(factor)
            assert not same_point(iterate(block, point, n, lambda value: bool(value == 0)), point)


# The parts.


def test_the_order_of_T_is_found_by_baby_and_giant_steps_as_by_adding():
    prime = 10_007
    for gamma in range(2, 150):
        element = GF(prime).convert(gamma)
        curve = Jacobian(element)
        point, n = curve.T, 1
        while point is not None:
            point, n = curve.add(point, curve.T), n + 1
        assert translation_order(element, prime) == n


@pytest.mark.parametrize(("prime", "degree"), [(1009, 1), (1000003, 1), (37, 2), (11, 3)])
def test_the_trace_of_frobenius_modulo_small_primes_gives_the_number_of_points(prime, degree):
    field, rng = Small(prime, degree), random.Random(prime)
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


def test_in_characteristic_2_an_orbit_is_walked_to_its_end_or_as_far_as_allowed(monkeypatch):
    lengths = set()
    for block, point in blocks(Small(2), random.Random(3), 60):
        found = plane_period(block, point, 2)
        if found.kind is not Kind.STEPPED or found.status != "periodic":
            continue
        lengths.add(found.period)
        monkeypatch.setattr(periods, "_WALK", found.period)
        assert plane_period(block, point, 2) == found
        monkeypatch.setattr(periods, "_WALK", found.period - 1)
        assert plane_period(block, point, 2).status == "undecided"
        monkeypatch.undo()
    assert lengths == {1, 2}


@pytest.mark.parametrize("field", [Small(10_007), Small(37, 2)], ids=repr)
def test_with_the_number_of_points_modulo_small_primes_the_order_of_T_is_the_same(field, monkeypatch):
    rng = random.Random(5)
    gammas = [gamma for gamma in (field.random(rng) for _ in range(20)) if gamma not in (0, 1)]
    orders = [translation_order(gamma, field.q, field.context) for gamma in gammas]
    for radius in (2, 10):
        monkeypatch.setattr(level_curves, "_RADIUS", radius)
        assert [translation_order(gamma, field.q, field.context) for gamma in gammas] == orders


def test_all_multiples_at_once_are_the_multiples_one_by_one():
    curve = Jacobian(GF(1009).convert(5))
    points, order = curve.multiples(curve.T, 100)
    assert (len(points), order) == (100, None)
    assert points == [curve.multiple(k, curve.T) for k in range(1, 101)]
    assert curve.multiples(None, 100) == ([], 1)


def test_one_division_inverts_many():
    values = [GF(101).convert(k) for k in range(1, 60)]
    assert [a * b for a, b in zip(values, inverses(values), strict=True)] == [1] * 59
    assert inverses([]) == []


def test_the_number_of_points_is_known_when_one_multiple_lies_in_the_interval():
    assert number_of_points(96, 101) == 96
    assert number_of_points(3, 101) is None


def test_three_points_on_a_line_add_up_to_nothing_and_tangents_count_twice():
    prime = 10_007
    rng = random.Random(2)
    for block, point in blocks(Small(prime), rng, 8):
        if plane_period(block, point, prime).kind is not Kind.SMOOTH:
            continue
        cubic = LevelCubic(block, *block.level(point), point)
        P, Q = block.image(point), cubic.multiple(5, block.image(point))
        for R in (cubic.third(P, Q), cubic.third(P, P)):
            above, below = block.level(R)
            assert above * cubic.below == below * cubic.above
        assert same_point(cubic.third(P, cubic.third(P, P)), P)
        assert same_point(Q, block.image(block.image(block.image(block.image(P)))))  # Psi is the translation
        assert same_point(cubic.add(cubic.subtract(Q, P), P), Q)
        assert cubic.is_zero(cubic.subtract(Q, Q))


# Members.


@pytest.mark.parametrize(
    ("chi", "prime"), [([2, -3, 1], 31), ([1, 0, 1], 31), ([1, 0, 1], 29), ([1, 1, 0, 1], 7), ([-2, 0, 0, 1], 13)]
)
def test_the_period_of_a_member_is_that_of_its_kahan_map_where_that_meets_no_pole(chi, prime):
    member = draw_with_chi(fmpq_poly(chi), seed=5)
    form, field, rng = normal_form(member), GF(prime), random.Random(4)
    phi, whole, kinds = KahanMap(member.chosen.system, "1/10", field), 0, Counter()
    for _ in range(30):
        start = [rng.randrange(prime) for _ in range(form.dim)]
        found = orbit_period(form, "1/10", start, prime)
        if not isinstance(found.period, int) or found.period > 3000:
            continue
        orbit = Orbit(phi, start, found.period)
        for _ in orbit:
            pass
        kinds[orbit.end.status] += 1
        assert orbit.end.status == ("singular" if found.meets_pole else "periodic")
        if not found.meets_pole:
            assert orbit.end.period == found.period == lcm(*(plane.period for plane in found.planes))
            whole += 1
    assert whole > 0


def test_modulo_2_the_map_is_the_identity_where_there_is_a_normal_form():
    for seed in range(20):
        member = draw_with_chi(fmpq_poly([1, 1, 1]), seed=seed)
        form, start = normal_form(member), [1, 0, 1, 1]
        try:
            found = orbit_period(form, "1/3", start, 2)
        except BadPrime:
            continue
        assert (found.period, found.meets_pole) == (1, False)
        assert [int(e) for e in KahanMap(member.chosen.system, "1/3", GF(2)).step(start)] == start
        return
    raise AssertionError("no member has a normal form modulo 2")


def test_what_is_said_about_poles_is_in_the_text():
    form = normal_form(draw_with_eigenvalues([1, -2], seed=7))
    found = orbit_period(form, "1/10", [1, 2, 3, 4], 10_007)
    assert isinstance(found, OrbitPeriod)
    assert found.text.splitlines()[1].startswith("t = ")
    assert {True: "stops at a pole", False: "meets no pole", None: "if it meets any"}[found.meets_pole] in found.text


def test_a_prime_at_which_chi_has_a_repeated_root_is_refused():
    form = normal_form(draw_with_eigenvalues([1, -2], seed=7))
    with pytest.raises(BadPrime):
        orbit_period(form, "1/10", [1, 2, 3, 4], 3)


# Over the rationals.


def test_the_division_values_give_the_levels_of_order_5_and_6():
    # psi_5 = 32 - 27 gamma and psi_6 = 6 (28 - 27 gamma) gamma^(1/3), up to factors.
    assert torsion_order(fmpq(32, 27))[0] == 5
    assert torsion_order(fmpq(28, 27))[0] == 6


# h, and a point (u, v) of one of the few levels that have a period over Q.
PERIODIC_OVER_Q = [
    ((0, 2, -1, 2), ("-1/3", "-1/3"), 5),
    ((0, -3, -3, -2), ("-1/3", "1/3"), 5),
    ((0, -3, -3, -3), ("-2/9", "1/9"), 6),
    ((0, -1, -3, -3), (-1, "1/3"), 6),
]


@pytest.mark.parametrize(("h", "start", "period"), PERIODIC_OVER_Q)
def test_a_rational_orbit_of_period_5_or_6_comes_back(h, start, period):
    block = PlanarBlock(*(fmpq(c) for c in h))
    u, v = (QQ.convert(value) for value in start)
    found = plane_period_over_rationals(block, (u, v, fmpq(1)))
    assert (found.status, found.period) == ("periodic", period)
    orbit = plane_orbit(h, start, period)
    assert orbit.end.status == ("singular" if found.meets_pole else "periodic")
    assert found.meets_pole or orbit.end.period == period


def plane_orbit(h, start, steps) -> Orbit:
    """The orbit of u' = h_v, v' = -h_u over Q with eps = 1/2, for which 2 eps (u, v) = (u, v)."""
    a, b, c, d = (fmpq(entry) for entry in h)
    u, v = ring(["u", "v"]).gens()
    cubic = CubicHamiltonian(a * u**3 + b * u**2 * v + c * u * v**2 + d * v**3, standard_structure(2))
    orbit = Orbit(KahanMap(cubic.system, "1/2"), start, steps)
    for _ in orbit:
        pass
    return orbit


def test_the_orbit_next_to_it_does_not_come_back():
    h, start = (0, 2, -1, 2), ("-1/3", "-1/4")
    found = plane_period_over_rationals(PlanarBlock(*(fmpq(c) for c in h)), (*map(QQ.convert, start), fmpq(1)))
    assert found.status == "aperiodic"
    assert plane_orbit(h, start, 14).end.status == "completed"


@pytest.mark.parametrize("name", STARTS)
def test_a_period_of_a_plane_over_q_is_what_walking_shows(name):
    cubic, (U, V, W) = STARTS[name]
    block = PlanarBlock(*(fmpq(c) for c in cubic))
    start = point = (fmpq(U, W), fmpq(V, W), fmpq(1))
    found = plane_period_over_rationals(block, start)
    met = False
    for step in range(1, 13):  # Mazur: no torsion point of a cubic over Q has an order above 12
        point = block.image(point)
        if not any(point):
            break
        met = met or point[2] == 0
        if same_point(point, start):
            assert (found.status, found.period, found.meets_pole) == ("periodic", step, met)
            return
    assert found.status in ("aperiodic", "undefined") or (met and found.meets_pole)


def test_an_element_of_a_number_field_is_torsion_or_not_as_over_q():
    K = EtaleAlgebra(fmpq_poly([-2, 0, 1]))
    assert torsion_order(K.convert(fmpq(32, 27))) == (5, "5 T = 0")
    order, reason = torsion_order(K.generator)
    assert order is None
    assert "has the orders" in reason


def test_random_rational_orbits_are_proved_not_to_be_periodic():
    for chi in ([2, -3, 1], [-2, 0, 1]):
        form = normal_form(draw_with_chi(fmpq_poly(chi), seed=3))
        found = period_over_rationals(form, "1/10", ["1/2", "-1/3", 0, 1])
        assert (found.status, found.period) == ("aperiodic", None)
        assert "orders" in found.text


def test_the_origin_is_a_fixed_point_over_q():
    form = normal_form(draw_with_eigenvalues([1, -2], seed=7))
    assert period_over_rationals(form, "1/10", [0, 0, 0, 0]).period == 1


@pytest.mark.parametrize(("gamma", "first"), [(fmpq(7, 3), 101), (fmpq(5, 101), 103), (fmpq(1, 101 * 103), 107)])
def test_a_number_is_reduced_at_primes_above_100_that_do_not_divide_its_denominator(gamma, first):
    for (prime, residue, context), expected in zip(_reductions(gamma), (first, 109, 113), strict=False):
        assert prime >= first
        assert (int(residue) * int(gamma.q) - int(gamma.p)) % prime == 0
        assert context is None
        if expected == first:
            assert prime == first


@pytest.mark.parametrize(
    ("chi", "primes"),
    [
        ([-2, 0, 1], [(101, 2), (103, 1), (107, 2), (109, 2), (113, 1)]),  # 2 is a square modulo 1 and 7 mod 8
        ([-2, 0, 0, 1], [(101, 1), (103, 3), (107, 1), (109, 1), (113, 1)]),  # cubes: p = 2 mod 3, or 2 is one
        ([fmpq(-1, 101), 0, 1], [(103, 2), (107, 1), (109, 2)]),
    ],
)
def test_an_algebraic_number_is_reduced_to_the_smallest_residue_field_above_a_prime(chi, primes):
    K = EtaleAlgebra(fmpq_poly(chi))
    for (prime, residue, context), (expected, degree) in zip(_reductions(K.generator), primes, strict=False):
        assert prime == expected
        assert (1 if context is None else context.degree()) == degree
        total = 0 * residue
        for coefficient in reversed(chi):  # chi(residue) = 0, by Horner
            coefficient = fmpq(coefficient)
            number = int(coefficient.p) * pow(int(coefficient.q), -1, prime)
            total = total * residue + (number if context is None else context(number))
        assert total == 0


@pytest.mark.parametrize("name", ["m = 2", "m = 2, another J"])
@pytest.mark.parametrize("prime", [29, 31])
def test_the_period_in_the_systems_own_coordinates_is_what_walking_shows(name, prime):
    structure, system = structure_and_system(name)
    kahan = KahanMap(system, "1/10", GF(prime))
    walked = set()
    for start in (["1/2", "-1/3", 0, 1], [1, 2, 3, 4], [5, 0, 0, 1]):
        found = period_of(structure, "1/10", start, prime)
        home = point = kahan.point(start)
        for step in range(1, prime**4):
            try:
                point = kahan.step(point)
            except SingularStep:
                assert found.meets_pole is not False
                walked.add("singular")
                break
            if point == home:
                assert (found.status, found.period, found.meets_pole) == ("periodic", step, False)
                walked.add("periodic")
                break
    assert walked
    assert period_of(structure, "1/10", [1, 2, 3, 4]).status == "aperiodic"
