"""The n-th iterate of a Kahan map directly: the point that steps lead to, or what an orbit says of a singular step.

In a plane it is n times the translation, added by chords and tangents, also where no orbit can be walked.
"""

import random
from itertools import islice, product

import flint
import pytest
from flint import arb, fmpq, fmpz
from helpers import encloses, ended, quick, random_point, refuses, together
from planar_helpers import (
    STARTS,
    Finite,
    before,
    over_members,
    planar_system,
    planes_over,
    side_by_side,
    structure_and_system,
)

from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.errors import BadPrime, PrecisionLost, SingularStep
from kahanmaps.family.system_normal_form import system_normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form import rational_iterate, tau, translation
from kahanmaps.maps.normal_form.iterate import NthIterate, special_start
from kahanmaps.maps.normal_form.level_curves import LevelCubic
from kahanmaps.maps.normal_form.planar_block import same_point
from kahanmaps.maps.normal_form.planes_point import PlanesPoint
from kahanmaps.maps.normal_form.translation import NoTranslation, iterate
from kahanmaps.maps.orbits.iteration import Orbit, OrbitEnd

NUMBERS = (0, 1, 2, 3, 5, 16, 17, 18, 23, 24, 25, 26, 33, 40)


def coordinates(value):
    """As a tuple; fractions from numerators over one denominator (lowest terms have tests of their own)."""
    if not isinstance(value, PlanesPoint):
        return tuple(value)
    numerators, below = value.over_common_denominator()
    return tuple(fmpq(above, below) for above in numerators)


def walked(system, eps, field, start, steps):
    """The generic orbit, without structure."""
    orbit = Orbit(KahanMap(system, eps, field), start, steps, max_digits=None)
    return [point.x for point in orbit], orbit.end


def reached(result, start, n):
    """The n-th iterate, None where it is singular."""
    try:
        return coordinates(result.value(start, n))
    except SingularStep:
        return None


@pytest.mark.parametrize("prime", quick([3, 5, 7, 11, 101, 10007, 2**61 - 1, 2**89 - 1], [3, 11, 2**61 - 1]))
@over_members
def test_modulo_a_prime_it_is_the_point_of_the_orbit(name, prime):
    normal_form, system = structure_and_system(name)
    field, rng, eps = GF(prime), random.Random(prime), "3/13"
    try:
        iterate = NthIterate(normal_form, eps, field)
    except BadPrime:
        assert prime in (3, 5)  # of S or T
        return
    for _ in range(3):
        start = [rng.randrange(prime) for _ in range(system.dim)]
        points, _ = walked(system, eps, field, start, NUMBERS[-1])
        for n in NUMBERS:
            image = reached(iterate, start, n)
            if n < len(points):
                assert image == points[n]
            elif len(points) <= (16 if n <= 16 else 4):  # a pole among the first steps
                assert image is None or prime < 5


@over_members
def test_over_q_it_is_the_point_of_the_orbit(name):
    normal_form, system = structure_and_system(name)
    start = random_point(system.dim, 6, height=3)
    points, _ = walked(system, "1/10", QQ, start, 27)
    iterate = NthIterate(normal_form, "1/10", QQ)
    for n in (0, 1, 7, 16, 17, 24, 25, 27):
        assert coordinates(iterate.value(start, n)) == points[n]


@pytest.mark.parametrize("more", [0, 1, 3, 8, 20, 24, 30])
@pytest.mark.parametrize("name", ["a pole at step 2", "a pole at step 5", "delta = 1, a pole at step 3"])
def test_over_q_a_pole_on_the_way_is_said_with_its_step(name, more):
    (cubic, start), last = STARTS[name], int(name[-1]) + more - 1
    U, V, W = before(cubic, start, more)
    system, normal_form, (_, u, _, v) = side_by_side(name, "a double root")
    start = (fmpq(U, W), u, fmpq(V, W), v)
    points, end = walked(system, "1/2", QQ, start, 60)
    assert (end.status, end.steps) == ("singular", last)
    iterate = NthIterate(normal_form, "1/2", QQ)
    for n in (last + 1, last + 2, last + 3, 57):
        refuses(f"not defined at step {last}$", iterate.value, start, n, error=SingularStep)
    for n in (0, last):
        assert coordinates(iterate.value(start, n)) == points[n]


@over_members
def test_balls_enclose_the_exact_iterate(name):
    normal_form, system = structure_and_system(name)
    # Large numbers, so that the sixteen steps before the doublings already cost some hundred bits.
    start, field = random_point(system.dim, 6, height=3), RR(2000)
    exact, result = NthIterate(normal_form, "1/10", QQ), NthIterate(normal_form, "1/10", field)
    for n in (0, 1, 10, 24, 30):
        try:
            balls = result.value(start, n)
        except PrecisionLost:  # balls cannot decide that a level is degenerate
            assert "double root" in name
            continue
        value = coordinates(exact.value(start, n))
        assert all(encloses(ball, number) for ball, number in zip(balls, value, strict=True))
        assert all(ball.rad() < arb(2) ** -100 for ball in balls)


def test_a_wrong_doubling_is_noticed(monkeypatch):
    # Every iterate over Q is compared with the orbit modulo a random prime.
    normal_form, _ = structure_and_system("m = 2")
    iterate = tau.iterate
    monkeypatch.setattr(tau, "iterate", lambda block, n: iterate(block, n + 1))
    with pytest.raises(ArithmeticError, match="disagrees with the orbit modulo a prime"):
        NthIterate(normal_form, "1/10", QQ).value([1, 2, 3, "1/4"], 300)


@together("name", STARTS)
def test_starts_on_singular_levels_and_at_rest_are_special_and_no_others_are(name):
    """The level is infinite where the map is not defined, and 0 or delta = 1 as the names of the starts say."""
    _, normal_form, start = side_by_side(name)
    kinds = {
        "h = 0": "fixed",
        "the origin": "fixed",
        "delta = 1": "on three lines",
        "level 0": "on a singular level",
        "no value": "on a singular level",
        "a double root": "on a singular level",
        "a triple root": "on a singular level",
    }
    expected = next(
        (f"the initial point is {kind} in the plane t = 1" for words, kind in kinds.items() if words in name), ""
    )
    assert special_start(normal_form, fmpq(1, 2), start) == expected


def test_a_pole_modulo_a_prime_alone_is_passed_over(monkeypatch):
    normal_form, _ = structure_and_system("m = 2")
    start = [1, 2, 3, fmpq(1, 4)]
    expected = coordinates(NthIterate(normal_form, "1/10", QQ).value(start, 30))
    steps_modulo, random_prime = rational_iterate._steps_modulo, rational_iterate.random_prime
    drawn = [1000003, 1000033, 1000037]  # with a pole at step 2, as if these divided W there
    monkeypatch.setattr(rational_iterate, "random_prime", lambda rng: drawn.pop() if drawn else random_prime(rng))
    monkeypatch.setattr(
        rational_iterate,
        "_steps_modulo",
        lambda *at: (2, (1, 1, 0)) if at[2](fmpz(0)).modulus() < 2**20 else steps_modulo(*at),
    )
    assert coordinates(NthIterate(normal_form, "1/10", QQ).value(start, 30)) == expected
    assert drawn == []


EPS = ("1/2", "1")


def event(system, normal_form, eps, start, steps, digits):
    """What comes first, with the step before it; by three ways, which have to agree."""
    kahan = KahanMap(system, eps)
    walks = [ended(Orbit(kahan, start, steps, normal_form=known, max_digits=digits)) for known in (None, normal_form)]
    assert walks[0] == walks[-1]
    far = ended(Orbit(kahan, start, at=[steps], normal_form=normal_form, max_digits=digits))
    walk = walks[0]
    if walk.is_complete:
        assert (far.status, far.steps) == ("completed", steps)
    elif walk.status == "singular":
        where = f"step {steps} cannot be reached: the map is not defined at step {walk.steps}"
        assert far == OrbitEnd("singular", 0, where)
    else:
        assert far.status == walk.status == "budget"
        assert far.message.endswith(walk.message)
    return walk


def seen_from(cubic, eps, sixths, runs):
    """The events of starts with coordinates in sixths, and that far steps end so, too."""
    system = planar_system(cubic)
    normal_form, seen = system_normal_form(system), []
    for u, v in product([fmpq(i, 6) for i in sixths], repeat=2):
        for steps, digits in runs:
            walk = event(system, normal_form, eps, [u, v], steps, digits)
            seen.append(walk.status)
            far = ended(Orbit(KahanMap(system, eps), [u, v], at=[10**12], normal_form=normal_form, max_digits=digits))
            if not walk.is_complete:
                assert far.status == walk.status
    return seen


# Roots: three rational, none rational, triple.
@pytest.mark.parametrize("cubic", [(0, 3, -4, -4), (1, 0, 0, -2), (1, 3, 3, 1)])
def test_small_starts_end_alike_by_steps_and_by_jumps(cubic):
    seen = [status for eps in EPS for status in seen_from(cubic, eps, range(-6, 7, 3), [(70, 12), (26, 3)])]
    assert {"singular", "budget"} & set(seen)


@over_members
def test_members_end_alike_by_steps_and_by_jumps(name):
    normal_form, system = structure_and_system(name)
    for seed, eps in enumerate(EPS):
        event(system, normal_form, eps, random_point(system.dim, seed, height=2), 30, 40)


def planes(field, seed, amount):
    """Random planes with starts of every kind that are not constant."""
    result = planes_over(field, random.Random(f"{field} {seed}"), 10**9)
    return islice((case for case in result if not case[0].is_zero and case[1][:2] != (0, 0)), amount)


def stepped(block, start, steps):
    """P_0, P_1, ... with W = 1, up to the last before a pole."""
    points = [start]
    for _ in range(steps):
        U, V, W = block.image(points[-1])
        if W == 0:
            break
        points.append((U / W, V / W, W / W))
    return points


def translated(block, start, n):
    """The n-th point, or what is said instead."""
    try:
        return iterate(block, start, n, lambda x: x == 0, inexact=isinstance(start[0], flint.arb | flint.acb))
    except SingularStep as error:
        return str(error)
    except NoTranslation:
        return None


FINITE = [(Finite(7), 160), (Finite(101), 48), (Finite(10007), 18), (Finite(2**89 - 1), 12), (Finite(5, 2), 30)]
FINITE += [(Finite(5, 3), 60)]
over_finite = pytest.mark.parametrize(("field", "amount"), quick(FINITE, FINITE[:-1]), ids=repr)
TIMES = (0, 1, 2, 3, 7, 8, 11, 12, 15, 16, 17, 18, 19, 20, 23, 24, 25, 31, 32, 33, 47, 48, 49, 63)


@over_finite
def test_over_a_finite_field_it_is_the_point_that_steps_lead_to(field, amount):
    compared = 0
    for block, start in planes(field, 1, amount):
        points = stepped(block, start, TIMES[-1])
        for n in TIMES:
            image = translated(block, start, n)
            if n < len(points) and image is not None:
                assert same_point(image, points[n])
                compared += 1
    assert compared > amount


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
            image = translated(block, start, n)
            if isinstance(image, tuple):
                assert any(image)
                assert same_point(image, cubic.multiple(n, block.image(start)))
                passed += 1
    assert passed > 0


@pytest.mark.parametrize("wrong", ["gamma", "digits"])
def test_with_another_gamma_or_other_digits_the_point_is_another(wrong, monkeypatch):
    block, start = next(iter(planes(Finite(10007), 1, 1)))
    by_curve, digits = translation._point_by_curve, translation._digits
    if wrong == "gamma":
        monkeypatch.setattr(translation, "_point_by_curve", lambda P, gamma, *others: by_curve(P, gamma + 1, *others))
    else:
        monkeypatch.setattr(translation, "_digits", lambda n: digits(n + 1))
    assert not same_point(translated(block, start, 50), stepped(block, start, 50)[50])
