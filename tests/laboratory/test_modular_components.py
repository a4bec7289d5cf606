"""Points modulo primes become affine subspaces, hypersurfaces and single points, and these conditions over Q."""

import random
from itertools import product

import pytest
from flint import fmpq

from kahanmaps.laboratory.scan.lift import lift_conjugate_points, lift_hypersurfaces, lift_linear
from kahanmaps.laboratory.scan.modular_components import find_components

FIELD_PRIMES = (53, 59, 61, 67, 71, 73, 79, 83, 89, 97, 101, 103)
PRIMES = (31, 37, 41)


def points_where(condition, p, count):
    return [x for x in product(range(p), repeat=count) if condition(*x) % p == 0]


def found_in(points, p, count, seed=0):
    return find_components(points, p, p**count, 0, random.Random(seed))


def test_two_lines_and_points_beside_them_are_told_apart():
    points = points_where(lambda a, b: (a - 3 * b) * (a + b - 1), 31, 2)
    result = found_in([*points, (5, 0), (7, 1)], 31, 2)
    assert set(result.linear[1]) == {((1, 28, 0),), ((1, 1, 30),)}
    assert set(result.linear[0]) == {((1, 0, 26), (0, 1, 0)), ((1, 0, 24), (0, 1, 30))}
    assert not result.hypersurfaces


def test_a_curve_is_found_among_points_by_chance():
    rng = random.Random(1)
    noise = [(rng.randrange(31), rng.randrange(31)) for _ in range(4)]
    points = points_where(lambda a, b: a * a + b * b - 1, 31, 2)
    result = found_in([*points, *noise], 31, 2)
    assert len(result.hypersurfaces[()]) == 1
    assert len(result.linear[0]) == len(set(noise) - set(points))


def test_a_curve_in_a_plane_of_space_is_found():
    points = [x for x in product(range(31), repeat=3) if x[0] == 1 and (x[1] * x[2] + 1) % 31 == 0]
    result = found_in(points, 31, 3)
    assert list(result.hypersurfaces) == [((1, 0, 0, 30),)]
    assert not result.linear.get(0)


def test_three_hyperplanes_of_a_space_of_dimension_6_are_told_apart():
    rng = random.Random(3)
    points = [tuple(0 if i == k else rng.randrange(1, 79) for i in range(6)) for k in range(3) for _ in range(60)]
    components = find_components(points, 79, 79 * 60, 5, random.Random(0))
    assert sorted(components.linear[5]) == [(tuple(int(i == k) for i in range(7)),) for k in (2, 1, 0)]


def test_what_is_not_there_modulo_the_third_prime_is_not_lifted():
    point = {p: [((1, p - 2),)] for p in PRIMES}
    assert list(lift_linear(point)) == [((fmpq(1), fmpq(-2)),)]
    assert lift_linear({**point, 41: [((1, 41 - 3),)]}) == {}


def test_a_point_of_low_height_may_be_missing_modulo_one_of_four_primes():
    low = {p: [((1, p - 2),)] for p in PRIMES}
    assert lift_linear({**low, 43: [((1, 5),)]}) == {((fmpq(1), fmpq(-2)),): PRIMES}
    high = {p: [((1, p - 15),)] for p in PRIMES}
    assert lift_linear({**high, 43: [((1, 5),)]}) == {}


def zeros(condition, *others):
    """The points (a, ...) modulo primes where a condition on a holds, the others by functions of a."""
    return {p: [(a, *(f(a) % p for f in others)) for a in range(p) if condition(a) % p == 0] for p in FIELD_PRIMES}


@pytest.mark.parametrize(
    ("condition", "others", "names", "expected"),
    [
        (lambda a: a**2 - 5, [], "a", ["a^2 - 5"]),
        (lambda a: a**2 - 5, [lambda a: 3, lambda a: 2 * a + 1], "abc", ["a^2 - 5", "b - 3", "2*a - c + 1"]),
    ],
)
def test_points_over_number_fields_have_an_equation_for_each_parameter(condition, others, names, expected):
    points = lift_conjugate_points(zeros(condition, *others), names, random.Random(1))
    assert [[*map(str, equations)] for equations, _ in points] == [expected]


def test_points_over_number_fields_have_to_be_there_modulo_all_primes_but_one():
    result = zeros(lambda a: a**2 - 5)
    there = [p for p in FIELD_PRIMES if result[p]]
    assert lift_conjugate_points({**result, there[0]: []}, "a", random.Random(1))  # one is let off
    assert not lift_conjugate_points({**result, there[0]: [], there[1]: []}, "a", random.Random(1))


@pytest.mark.parametrize("spoilt", [False, True])
def test_a_product_is_factored_and_has_to_agree_modulo_the_last_prime(spoilt):
    expected = {"a^2 + 2*b^2 - 3", "a*b - 2"}
    hypersurfaces = {}
    for p in PRIMES:
        both = [[-3 % p, 0, 0, 1, 0, 2], [-2 % p, 0, 0, 0, 1, 0]]
        hypersurfaces[p] = [[-4 % p, 0, 0, 1, 0, 2], both[1]] if spoilt and p == 41 else both
    results = {str(form) for form, _ in lift_hypersurfaces(hypersurfaces, ["a", "b"])}
    assert results == ({"a*b - 2"} if spoilt else expected)
