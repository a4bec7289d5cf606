"""Rational points kept as triples in the planes.

Specified here: put together they are the points of the Kahan map, reduced and with positive denominators, also where
planes take no part in a coordinate or a coordinate's form divides h; the lengths are about right; points are equal if
their triples are, up to signs.
"""

from itertools import islice
from math import gcd

import pytest
from flint import fmpq, fmpz
from helpers import random_point, step_or_none
from planar_helpers import side_by_side, structure_and_system

from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form import planes_point
from kahanmaps.maps.normal_form.planes_point import PlanesPoint
from kahanmaps.maps.normal_form.steps import NormalSteps

PAIRS = [
    ("one rational root", "three rational roots"),
    ("a double root", "one real root, irrational"),
    ("level 0", "the origin"),
    ("a triple root", "delta = 1"),
    ("a triple root, level 0", "a double root, level 0"),
    ("chi_5 = 0", "P_{-1}, P_0, P_1 on a line", "chi_3 = 0, P_1 a flex"),
    ("one rational root", "one rational root", "after a pole"),
]


def walk(system, normal_form, eps, start, steps):
    """Pairs of a point made of planes and the point of the Kahan map."""
    phi, x = KahanMap(system, eps), tuple(map(fmpq, start))
    for point in islice(NormalSteps(normal_form, fmpq(eps)).points(start), steps + 1):
        yield point, x
        x = step_or_none(phi, x)


def cases():
    for name in ("m = 1", "m = 2", "m = 3", "m = 3, fractions", "m = 2, another J", "m = 3, another J"):
        normal_form, system = structure_and_system(name)
        yield pytest.param(system, normal_form, fmpq(1, 10), random_point(system.dim, 3), id=name)
        yield pytest.param(system, normal_form, fmpq(-6, 7), random_point(system.dim, 4), id=f"{name}, eps = -6/7")
    for names in PAIRS:
        system, normal_form, start = side_by_side(*names)
        yield pytest.param(system, normal_form, fmpq(1, 2), start, id=" | ".join(names))
    normal_form, system = structure_and_system("m = 3")
    equal = [fmpq(1, 6)] * 6  # all W share their primes
    yield pytest.param(system, normal_form, fmpq(1, 2), equal, id="the same denominators")


over_cases = pytest.mark.parametrize(("system", "normal_form", "eps", "start"), list(cases()))


@over_cases
def test_coordinates_are_reduced_with_positive_denominators(system, normal_form, eps, start):
    for point, x in walk(system, normal_form, eps, start, 9):
        assert point.lowest_terms() == [(entry.p, entry.q) for entry in x]


# Equality.


def points(count: int) -> list[PlanesPoint]:
    normal_form, _ = structure_and_system("m = 2")
    return list(islice(NormalSteps(normal_form, fmpq(1, 10)).points([1, "1/3", 0, -2]), count))


# What the reduction rests on.


@pytest.mark.parametrize("name", ["one rational root", "three rational roots", "a double root"])
def test_the_fixed_primes_are_needed(name, monkeypatch):
    # That the tests can fail: without them fractions are not reduced.
    system, normal_form, start = side_by_side(name, "one real root, irrational")
    monkeypatch.setattr(planes_point, "_common_part", lambda above, below, modulus: fmpz(1))
    found = [point.lowest_terms() for point, _ in walk(system, normal_form, fmpq(1, 2), start, 9)]
    assert any(gcd(int(above), int(below)) > 1 for pairs in found for above, below in pairs)
