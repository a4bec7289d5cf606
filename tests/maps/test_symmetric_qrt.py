"""Steps by the biquadratic of an orbit of a symmetric QRT map, against single steps by rational functions.

Specified here: every point is the one that single steps give, poles included; forms are found for symmetric QRT maps
and no others, and only where the biquadratic is sure to hold for the whole orbit.
"""

from dataclasses import replace
from itertools import pairwise

import pytest
from flint import fmpq, fmpz, fmpz_mat
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import kahanmaps.maps.orbits.relations.bilinear_steps as bilinear
from kahanmaps import load
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.symmetric_qrt import POINTS, symmetric_qrt

NAMES = ["somos_4", "somos_5", "lyness", "mcmillan", "qrt_symmetric", "discrete_painleve_1"]
OTHERS = ["fibonacci", "hietarinta_viallet", "weierstrass", "lotka_volterra_symplectic_euler", "riccati"]
START = (fmpq(1, 2), fmpq(-1, 3))

small = st.fractions(min_value=-3, max_value=3, max_denominator=5).map(lambda x: fmpq(x.numerator, x.denominator))
matrices = st.lists(st.integers(-2, 2), min_size=6, max_size=6).map(lambda m: fmpz_mat([[m[k] for k in row] for row in
    ((0, 1, 2), (1, 3, 4), (2, 4, 5))]))  # fmt: skip


@pytest.fixture(autouse=True)
def early(monkeypatch):
    """Forms are looked for as soon as numbers grow slowly enough, and orbits here need not be long."""
    monkeypatch.setattr(bilinear, "_LONG", 20)


def points_of(map_over, start, steps):
    """The orbit by single steps, until it ends."""
    points = [IntegerPoint.from_rationals(start)]
    while len(points) <= steps and (image := map_over.integer_step(points[-1])) is not None:
        points.append(image)
    return points


def walked(map_over, start, steps):
    orbit = bilinear.RationalOrbit(map_over, IntegerPoint.from_rationals(start))
    return [point for point, _ in zip(orbit, range(steps + 1), strict=False)], orbit.since


def plain(points):
    """Numerators and denominators, whatever computed them."""
    return [(point.numerators, point.denominator, point.lowest_terms(), point.rationals()) for point in points]


def recurrence(above, below):
    """The map (x, y) -> (y, above/below)."""
    x, y, _ = ring(["x", "y", "eps"]).gens()
    one = x**0
    return explicit_map(["x", "y"], [RationalFunction(y, one), RationalFunction(above(x, y), below(x, y))]).at(1)


@pytest.mark.parametrize("name", NAMES)
def test_points_are_those_of_single_steps(name):
    map_over = load(name).map.at(1)
    expected = points_of(map_over, START, 60)
    found, since = walked(map_over, START, 60)
    assert plain(found) == plain(expected)
    assert since is not None
    assert since < 40
    forms = symmetric_qrt(map_over.equation, expected[:POINTS])
    assert [forms.step([point]) for point in expected[:-1]] == expected[1:]  # of the whole orbit


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=6)
@given(start=st.tuples(small, small))
def test_any_start(name, start):
    map_over = load(name).map.at(1)
    assert plain(walked(map_over, start, 30)[0]) == plain(points_of(map_over, start, 30))


@settings(max_examples=30)
@given(first=matrices, second=matrices, start=st.tuples(small, small))
def test_any_symmetric_qrt_map_with_degenerate_levels(first, second, start):
    def vector(matrix, y):
        return [sum((c * y**k for c, k in zip(row, (2, 1, 0), strict=True)), 0 * y) for row in matrix.tolist()]

    def f(y):
        (a, b, c), (d, e, g) = vector(first, y), vector(second, y)
        return b * g - c * e, c * d - a * g, a * e - b * d

    x, y, _ = ring(["x", "y", "eps"]).gens()
    assume(not (f(y)[1] - x * f(y)[2]).is_zero())
    map_over = recurrence(lambda x, y: f(y)[0] - x * f(y)[1], lambda x, y: f(y)[1] - x * f(y)[2])
    expected = points_of(map_over, start, 25)
    assert plain(walked(map_over, start, 25)[0]) == plain(expected)
    forms = symmetric_qrt(map_over.equation, expected[:POINTS]) if len(expected) > POINTS else None
    if forms is not None:
        assert all(forms.step([here]) in (None, ahead) for here, ahead in pairwise(expected))


@pytest.mark.parametrize("name", OTHERS)
def test_there_are_none_for_other_maps(name):
    map_over = load(name).map.at("3/11")
    points = points_of(map_over, START[: map_over.dim], POINTS)
    assert symmetric_qrt(map_over.factors[0].equation, points) is None


def test_points_alone_prove_nothing():
    """Points on one biquadratic, of which another map makes something else."""
    points = points_of(load("somos_4").map.at(1), START, POINTS)
    assert symmetric_qrt(load("somos_4").map.at(1).equation, points) is not None
    assert symmetric_qrt(load("somos_5").map.at(1).equation, points) is None
    moved = recurrence(lambda x, y: 2 * y + 3 + (x - fmpq(1, 2)), lambda x, y: x * y**2)  # the same at the start
    assert moved.step(START) == load("somos_4").map.at(1).step(START)
    assert symmetric_qrt(moved.equation, points) is None


def test_other_first_coordinates_are_no_recurrence():
    x, y, _ = ring(["x", "y", "eps"]).gens()
    one, ahead = x**0, RationalFunction(2 * y + 3, x * y**2)
    points = points_of(load("somos_4").map.at(1), START, POINTS)
    for first in (RationalFunction(-y, one), RationalFunction(y + 1, one), RationalFunction(y, 2 * one)):
        assert symmetric_qrt(explicit_map(["x", "y"], [first, ahead]).at(1).equation, points) is None


def test_equations_that_are_no_recurrence():
    points = points_of(load("somos_4").map.at(1), START, POINTS)
    equation = load("somos_4").map.at(1).equation
    (one, zero, side), (other, below, above) = equation.terms
    assert (zero, other) == ((), ())
    for rows in (((one, one, side), (other, below, above)), ((one, zero, side), (one, below, above))):
        assert symmetric_qrt(replace(equation, terms=rows), points) is None
    # x y x~ = x y y is no map where x y = 0.
    exponents = (*equation.exponents, (2, 1, 0), (2, 2, 0))
    last = len(exponents) - 1
    rows = (((last - 1, fmpq(1)),), (), ((last, fmpq(-1)),)), equation.terms[1]
    assert symmetric_qrt(replace(equation, exponents=exponents, terms=rows), points) is None


def test_a_long_start_is_walked_by_single_steps_until_points_are_longer(monkeypatch):
    map_over = load("lyness").map.at(1)
    start = (fmpq(2**90 + 1, 3**50), fmpq(5**40, 7**30))
    found, since = walked(map_over, start, 60)
    assert plain(found) == plain(points_of(map_over, start, 60))
    assert found[since - 2].bits < 8 * found[0].bits <= found[since - 1].bits


def test_orbits_of_four_points_have_no_forms():
    map_over = recurrence(lambda x, y: x**0, lambda x, y: x)
    points = points_of(map_over, START, POINTS)
    assert points[4] == points[0]
    assert symmetric_qrt(map_over.equation, points) is None
    found, since = walked(map_over, (fmpq(2**300), fmpq(3**200)), 30)
    assert (found[4], since) == (found[0], None)


def test_a_denominator_that_is_0_modulo_the_prime_is_left_to_single_steps():
    map_over = load("lyness").map.at(1)
    forms = symmetric_qrt(map_over.equation, points_of(map_over, START, POINTS))
    for x in ((fmpq(1, 2**61 - 1), fmpq(1, 3)), (fmpq(1, 3), fmpq(1, 2**61 - 1)), (fmpq(2**61 - 1), fmpq(1, 3))):
        assert forms.step([IntegerPoint.from_rationals(x)]) is None


def test_at_a_pole_there_is_no_point():
    map_over = load("mcmillan").map.at(1)
    orbit = [(fmpq(3, 7), fmpq(1))]  # where the map has no value
    for _ in range(POINTS):
        orbit.insert(0, map_over.inverse_step(orbit[0]))
    points = [IntegerPoint.from_rationals(x) for x in orbit]
    forms = symmetric_qrt(map_over.equation, points[:POINTS])
    assert [forms.step([point]) for point in points] == [*points[1:], None]
    assert walked(map_over, orbit[0], 20) == (points, None)


def test_zeros_on_the_way():
    map_over = load("discrete_painleve_1").map.at(1)
    start = (fmpq(0), fmpq(5, 3))
    expected = points_of(map_over, start, 20)
    forms = symmetric_qrt(map_over.equation, expected[:POINTS])
    assert forms.step(expected[:1]) == expected[1]


def test_factors_divide_the_bound_and_are_divided_out():
    map_over = load("somos_4").map.at(1)
    points = points_of(map_over, START, 30)
    forms = symmetric_qrt(map_over.equation, points[:POINTS])
    bound, factors = abs(forms.coefficients.det()), set()
    for here, ahead in pairwise(points):
        (_, below), (p, q) = here.lowest_terms()
        A = (forms.coefficients * fmpz_mat(3, 1, [p * p, p * q, q * q])).entries()[0]
        factor = fmpq(A, below * ahead.lowest_terms()[1][1])
        assert factor.q == 1
        assert bound % factor.p == 0
        factors.add(abs(factor.p))
    assert len(factors) > 1


def test_points_of_fractions_and_of_integers_are_compared_by_value():
    one = IntegerPoint.from_rationals([fmpq(1, 2), fmpq(-2, 3)])
    other = IntegerPoint((fmpz(3), fmpz(-4)), fmpz(6))
    assert one == other
    assert other == one
    assert hash(one) == hash(other)
    assert one != IntegerPoint((fmpz(3), fmpz(4)), fmpz(6))
    assert (one.bits, one.exceeding(2), one.exceeding(3)) == (3, 3, 0)
    assert one.lowest_terms() == other.lowest_terms()
