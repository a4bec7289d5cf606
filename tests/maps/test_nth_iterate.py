"""The n-th iterate of a Kahan map directly.

Specified here: over every field it is the point that the orbit comes to, or a singular step that is said as the orbit
says it; over Q no pole on the way goes unnoticed, and what is too long is refused beforehand; iterates compose also
where no orbit can be walked.
"""

import random

import pytest
from flint import arb, fmpq, fmpz
from helpers import encloses, quick, random_point, together
from planar_helpers import STARTS, before, over_members, side_by_side, structure_and_system

from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.errors import BadPrime, PrecisionLost, SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form import rational_iterate, tau
from kahanmaps.maps.normal_form.iterate import NthIterate, special_start
from kahanmaps.maps.normal_form.planes_point import PlanesPoint
from kahanmaps.maps.orbits.iteration import Orbit

NUMBERS = (0, 1, 2, 3, 5, 16, 17, 18, 23, 24, 25, 26, 33, 40)


def coordinates(value):
    """As a tuple; fractions from numerators over one denominator (lowest terms have tests of their own)."""
    if not isinstance(value, PlanesPoint):
        return tuple(value)
    numerators, below = value.common()
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


def poles():
    for name, step in (("a pole at step 2", 2), ("a pole at step 5", 5), ("delta = 1, a pole at step 3", 3)):
        for more in (0, 1, 3, 8, 20, 24, 30):
            yield pytest.param(name, more, step + more - 1, id=f"{name}, {more} steps before")


@pytest.mark.parametrize(("name", "more", "last"), list(poles()))
def test_over_q_a_pole_on_the_way_is_said_with_its_step(name, more, last):
    cubic, start = STARTS[name]
    U, V, W = before(cubic, start, more)
    system, normal_form, (_, u, _, v) = side_by_side(name, "a double root")
    start = (fmpq(U, W), u, fmpq(V, W), v)
    points, end = walked(system, "1/2", QQ, start, 60)
    assert (end.status, end.steps) == ("singular", last)
    iterate = NthIterate(normal_form, "1/2", QQ)
    for n in (last + 1, last + 2, last + 3, 57):
        with pytest.raises(SingularStep, match=f"not defined at step {last}$"):
            iterate.value(start, n)
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
        "h = 0": "at rest",
        "the origin": "at rest",
        "delta = 1": "on three lines",
        "level 0": "on a singular level",
        "no value": "on a singular level",
        "a double root": "on a singular level",
        "a triple root": "on a singular level",
    }
    expected = next((f"the start is {kind} in the plane t = 1" for words, kind in kinds.items() if words in name), "")
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
