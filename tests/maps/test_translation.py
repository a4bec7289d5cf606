"""The n-th point of an orbit in a plane over any field, directly.

Specified here: it is the point that steps lead to, over prime fields, their extensions, Q, Q[t]/g and balls, for smooth
and for degenerate levels; on smooth levels, through poles and for n of any size, it is n times the translation, added
by chords and tangents; iterates compose.
"""

from __future__ import annotations

import random
from itertools import count

import flint
import pytest
from flint import fmpq, fmpq_poly, fq_default_ctx
from helpers import THOROUGH, encloses
from planar_helpers import STARTS, by_gcds, integer_block, random_cubic, reduced

from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import CC, GF, RR
from kahanmaps.errors import SingularStep
from kahanmaps.maps.normal_form import translation
from kahanmaps.maps.normal_form.level_curves import LevelCubic
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, same_point
from kahanmaps.maps.normal_form.translation import NoTranslation, iterate

ZERO_COUNT = 16  # that many steps are taken before doubling


def is_zero(element) -> bool:
    return element == 0


class Finite:
    """Random elements of a field of p^degree elements."""

    def __init__(self, prime: int, degree: int = 1) -> None:
        self.prime, self.q = prime, prime**degree
        self.context = None if degree == 1 else fq_default_ctx(prime, degree)
        self.degree = degree

    def random(self, rng: random.Random):
        if self.context is None:
            return GF(self.prime).convert(rng.randrange(self.prime))
        return self.context([rng.randrange(self.prime) for _ in range(self.degree)])

    def convert(self, number: fmpq):
        if self.context is None:
            return GF(self.prime).convert(number)
        return self.context(int(GF(self.prime).convert(number)))

    def __repr__(self) -> str:
        return f"GF({self.prime}^{self.degree})"


def planes(field: Finite, seed: int, amount: int):
    """Random planes with starts of every kind that are not constant: general, with double and triple roots, level 0."""
    rng = random.Random(f"{field} {seed}")
    for number in count():
        a, b, c, d = (field.random(rng) for _ in range(4))
        u, v = field.random(rng), field.random(rng)
        match number % 6:
            case 3:  # a double root
                a, b, c, d = a * a * c, a * (a * d + 2 * b * c), b * (2 * a * d + b * c), b * b * d
            case 4:  # a triple root
                a, b, c, d = a * a * a, 3 * a * a * b, 3 * a * b * b, b * b * b
            case 5 if v != 0:  # level 0
                d = -(a * u * u * u + b * u * u * v + c * u * v * v) / (v * v * v)
        block = PlanarBlock(a, b, c, d)
        if not block.is_zero and not (u == 0 and v == 0):
            yield block, (u, v, 0 * u + 1)
            amount -= 1
            if amount == 0:
                return


def stepped(block, start, steps):
    """P_0, P_1, ... with W = 1, up to the last before a pole."""
    points = [start]
    for _ in range(steps):
        U, V, W = block.image(points[-1])
        if W == 0:
            break
        points.append((U / W, V / W, W / W))
    return points


def found(block, start, n):
    """The n-th point, or what is said instead."""
    try:
        return iterate(block, start, n, is_zero, inexact=isinstance(start[0], flint.arb | flint.acb))
    except SingularStep as error:
        return str(error)
    except NoTranslation:
        return None


FINITE = [
    *((Finite(p), amount) for p, amount in ((5, 160), (7, 160), (11, 120), (53, 60), (101, 48), (10007, 18))),
    *((Finite(p), 12) for p in (2**61 - 1, 2**89 - 1)),
    *((Finite(p, 2), amount) for p, amount in ((5, 80), (7, 60), (11, 40), (10007, 12))),
    (Finite(5, 3), 60),
]
over_finite = pytest.mark.parametrize(
    ("field", "amount"),
    [
        pytest.param(field, amount, id=repr(field), marks=() if field.q in (7, 101, 10007, 25, 2**89 - 1) else THOROUGH)
        for field, amount in FINITE
    ],
)
NUMBERS = (0, 1, 2, 3, 7, 8, 11, 12, 15, 16, 17, 18, 19, 20, 23, 24, 25, 31, 32, 33, 47, 48, 49, 63)


# The point that steps lead to.


@over_finite
def test_over_a_finite_field_it_is_the_point_that_steps_lead_to(field, amount):
    compared = 0
    for block, start in planes(field, 1, amount):
        points = stepped(block, start, NUMBERS[-1])
        for n in NUMBERS:
            image = found(block, start, n)
            if n < len(points) and image is not None:
                assert same_point(image, points[n])
                compared += 1
    assert compared > amount


@over_finite
def test_a_pole_among_the_first_steps_is_said_with_its_step(field, amount):
    for block, start in planes(field, 2, amount):
        points = stepped(block, start, ZERO_COUNT)
        if len(points) <= ZERO_COUNT:
            assert found(block, start, ZERO_COUNT) == f"the map has no value at step {len(points) - 1}"
        if len(points) <= 4:
            assert found(block, start, 10**6) == f"the map has no value at step {len(points) - 1}"


def test_where_nothing_is_found_the_orbit_is_special():
    # Doubling refuses only small fields' orbits: those that come back, or meet chi = 0 again and again.
    refused, asked = 0, 0
    for field, amount in FINITE:
        for block, start in planes(field, 3, amount):
            asked += 1
            if found(block, start, 1000) is None:
                refused += 1
                assert field.q <= 125
    assert refused < asked / 50


RATIONAL = [
    name for name, case in STARTS.items() if name not in ("h = 0", "the origin") and not name.startswith("no value")
]


def rational(name):
    cubic, (U, V, W) = STARTS[name]
    return PlanarBlock(*map(fmpq, cubic)), (fmpq(U, W), fmpq(V, W), fmpq(1))


@pytest.mark.parametrize("name", RATIONAL)
def test_over_the_rationals_it_is_the_point_that_gcds_give(name):
    block, start = rational(name)
    expected = by_gcds(integer_block(*STARTS[name]), 40)
    for n in (0, 1, 5, 16, 17, 20, 25, 27, 28, 29, 33, 40):
        image = found(block, start, n)
        if n < len(expected):
            assert same_point(image, expected[n])
        elif len(expected) <= (ZERO_COUNT if n <= ZERO_COUNT else 4):
            assert image == f"the map has no value at step {len(expected) - 1}"


@pytest.mark.parametrize("name", ["delta = 1", "a double root", "a triple root", "level 0"])
@pytest.mark.parametrize("n", [300, 301, 302])
def test_on_degenerate_levels_numbers_stay_short_and_exact_far_out(name, n):
    block, start = rational(name)
    assert same_point(found(block, start, n), by_gcds(integer_block(*STARTS[name]), n)[n])


@pytest.mark.parametrize("chi", [[-2, 0, 1], [1, 0, 1], [-1, -1, 0, 1]], ids=["sqrt 2", "i", "cubic"])
def test_over_a_number_field_it_is_the_point_that_steps_lead_to(chi):
    K = EtaleAlgebra(fmpq_poly(chi))
    rng = random.Random(str(chi))
    for _ in range(2):
        block = PlanarBlock(*(K.random(rng, 3) for _ in range(4)))
        start = (K.random(rng, 3), K.random(rng, 3), K.one)
        points = stepped(block, start, 20)
        for n in (16, 17, 19, 20):
            assert same_point(found(block, start, n), points[n])


@pytest.mark.parametrize(
    ("field", "name"),
    [(RR(200), "three real roots, irrational"), (CC(200), "one real root, irrational"), (RR(200), "one rational root")],
)
def test_balls_enclose_the_exact_point_and_stay_narrow(name, field):
    block, start = rational(name)
    expected = by_gcds(integer_block(*STARTS[name]), 120)
    with field.working():
        balls = PlanarBlock(*map(field.convert, (block.a, block.b, block.c, block.d)))
        first = tuple(map(field.convert, start))
        for n in (1, 10, 17, 30, 31, 32, 64, 100, 119, 120):
            U, V, W = iterate(balls, first, n, field.is_zero)
            u, v, w = expected[n]
            for ball, number in ((U / W, fmpq(u, w)), (V / W, fmpq(v, w))):
                real = ball.real if isinstance(ball, flint.acb) else ball
                assert encloses(real, number)
                # without the doublings some ten bits a step are lost
                assert real.rel_accuracy_bits() > 100


# Poles and large n.


def smooth(field, seed, amount):
    for block, start in planes(field, seed, amount):
        above, below = block.level(start)
        if below != 0 and above != 0 and block.discriminant != 0:
            delta = block.discriminant * above * above / (below * below)
            if delta != 1:
                yield block, start, LevelCubic(block, above, below, start)


@over_finite
def test_on_a_smooth_level_it_is_a_multiple_of_the_translation(field, amount):
    # Chords and tangents, P_0 for zero: P_n = n P_1. Poles on the way do not matter to them.
    rng, passed = random.Random(field.q), 0
    for block, start, cubic in smooth(field, 4, min(amount, 40)):
        for n in (rng.randrange(17, 100), rng.randrange(field.q**2 + 100), rng.randrange(10**30)):
            image = found(block, start, n)
            if isinstance(image, tuple):
                assert any(image)
                assert same_point(image, cubic.multiple(n, block.image(start)))
                passed += 1
    assert passed > 0


@over_finite
def test_iterates_compose(field, amount):
    rng, passed, through = random.Random(field.q), 0, 0
    for block, start in planes(field, 5, min(amount, 60)):
        a, b = rng.randrange(17, 200), rng.randrange(17, 200)
        first = found(block, start, a)
        if not isinstance(first, tuple) or first[2] == 0:
            continue
        one = tuple(entry / first[2] for entry in first)
        second, whole = found(block, one, b), found(block, start, a + b)
        if isinstance(second, tuple) and isinstance(whole, tuple):
            assert same_point(second, whole)
            passed += 1
            through += len(stepped(block, start, a + b)) <= a + b
    assert passed > 5
    # In tiny fields a pole is met at once or never, in large ones hardly ever.
    assert through > 0 or not 20 < field.q < 2000


@pytest.mark.parametrize("prime", [10007, 2**61 - 1, 2**89 - 1])
def test_huge_numbers_of_steps_compose(prime):
    for block, start in planes(Finite(prime), 6, 12):
        first = found(block, start, 10**15)
        one = tuple(entry / first[2] for entry in first)
        assert same_point(found(block, one, 10**30 - 10**15), found(block, start, 10**30))


@pytest.mark.parametrize("prime", [53, 101, 211])
def test_after_the_order_of_T_the_start_is_back(prime):
    seen = 0
    for block, start in planes(Finite(prime), 7, 30):
        points = stepped(block, start, 4 * prime)
        order = next((n for n in range(1, len(points)) if same_point(points[n], start)), None)
        if order is None or order < 20:
            continue
        for k in (1, 2, 10**20):
            assert same_point(found(block, start, k * order), start)
            assert same_point(found(block, start, k * order + 18), points[18 % order])
            assert not same_point(found(block, start, k * order + 1), start)
        seen += 1
    assert seen > 5


@pytest.mark.parametrize("prime", [53, 101])
@pytest.mark.parametrize(
    ("name", "period"),
    [("a double root", lambda p: p), ("a triple root", lambda p: p), ("delta = 1", lambda p: 3 * order_of_minus_8(p))],
)
def test_on_lines_the_period_is_that_of_a_projective_map(name, period, prime):
    cubic, start = STARTS[name]
    field = GF(prime)
    block = PlanarBlock(*map(field.convert, cubic))
    first = tuple(field.convert(entry) / field.convert(start[2]) for entry in start)
    for n in (period(prime) * 10**12, period(prime) * 12345):
        assert same_point(found(block, first, n), first)
        assert not same_point(found(block, first, n + 1), first)
        assert same_point(found(block, first, n + 20), found(block, first, 20))


def order_of_minus_8(prime: int) -> int:
    return next(k for k in range(1, prime) if pow(-8, k, prime) == 1)


def test_a_reduction_modulo_a_prime_is_that_of_the_rational_point():
    rng, field, seen = random.Random(9), GF(2**61 - 1), 0
    for kind in range(10):
        cubic, start = random_cubic(rng, kind), (fmpq(2, 3), fmpq(-1, 5), fmpq(1))
        exact = found(PlanarBlock(*cubic), start, 40)
        if not isinstance(exact, tuple) or exact[2] == 0:
            continue
        modular = found(PlanarBlock(*map(field.convert, cubic)), tuple(map(field.convert, start)), 40)
        assert same_point(modular, [field.convert(entry / exact[2]) for entry in exact])
        seen += 1
    assert seen > 5


# That the tests can fail.


@pytest.mark.parametrize("wrong", ["gamma", "digits"])
def test_with_another_gamma_or_other_digits_the_point_is_another(wrong, monkeypatch):
    block, start = next(iter(planes(Finite(10007), 1, 1)))
    by_curve, digits = translation._by_curve, translation._digits
    if wrong == "gamma":
        monkeypatch.setattr(translation, "_by_curve", lambda P, gamma, *rest: by_curve(P, gamma + 1, *rest))
    else:
        monkeypatch.setattr(translation, "_digits", lambda n: digits(n + 1))
    assert not same_point(found(block, start, 50), stepped(block, start, 50)[50])


def test_digits_are_odd_and_few():
    for n in (*range(1, 300), 10**18, 2**200 - 1):
        value = 0
        for digit, places in translation._digits(n):
            assert digit in (-3, -1, 1, 3)
            value = value + digit << places
        assert value == n
        assert len(translation._digits(n)) <= n.bit_length() // 3 + 1


def test_reduced_triples_of_both_roads_are_the_same():
    block, start = rational("one real root, irrational")
    U, V, W = found(block, start, 30)
    below = U.q.lcm(V.q).lcm(W.q)
    expected = by_gcds(integer_block(*STARTS["one real root, irrational"]), 30)[30]
    assert reduced([(entry * below).p for entry in (U, V, W)]) == expected


MATRICES = {  # by rows, with the period of (1, 2), where it is short
    "no period": (1, 2, 3, 5),
    "period 2": (0, 1, 3, 0),
    "a fixed point": (3, 2, 4, 5),
    "the start again and again": (5, 0, 8, 1),
    "one fixed point": (2, 1, -1, 4),
}


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES)
@pytest.mark.parametrize(("e", "f"), [((1, 0, 4), (2, 0, 9)), ((0, 3, 5), (0, 2, 7)), ((1, 2, 3), (5, 7, 11))])
def test_four_points_on_a_line_tell_all_others_of_a_projective_map(matrix, e, f):
    field = GF(10_007)
    a, b, c, d = map(field.convert, matrix)
    x, y, points = field.one, field.convert(2), []
    for k in range(30):
        points.append(tuple((3 + k) * (x * field.convert(g) + y * field.convert(h)) for g, h in zip(e, f, strict=True)))
        x, y = a * x + b * y, c * x + d * y
    assert all(same_point(translation._along_line(points[:4], n, is_zero), points[n]) for n in range(30))


def test_four_points_of_period_three_tell_nothing():
    points = [tuple(map(GF(101).convert, point)) for point in ((1, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0))]
    assert same_point(translation._along_line(points, 4, is_zero), points[1])
    with pytest.raises(NoTranslation):
        translation._along_line([*points[:3], points[1]], 4, is_zero)
