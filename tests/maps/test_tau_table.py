"""Steps and n-th iterates in a plane over Q from one table of two integer sequences.

Specified here: the points are those of the content rule, of plain gcds and of the Kahan map itself, for every kind of
start and every n, primitive, and no number on the way is longer than the result; the determinants of three points
factor into psi and chi, which satisfy every bilinear relation, not only those that are used; psi_n = 0 says that
n T = 0; the values are about a third as long as the points; where the table does not apply the answer is None.
"""

from __future__ import annotations

import random
from itertools import combinations, islice

import pytest
from flint import fmpq, nmod
from helpers import quick
from planar_helpers import (
    STARTS,
    before,
    by_gcds,
    image,
    integer_block,
    planar_system,
    preimage,
    random_blocks,
    reduced,
)

from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form import planar_integers, tau, tau_table
from kahanmaps.maps.normal_form.level_curves import Jacobian
from kahanmaps.maps.normal_form.planar_block import determinant, same_point
from kahanmaps.maps.normal_form.planar_integers import primitive

GENERAL = ["three real roots, irrational", "one real root, irrational", "one rational root", "chi_5 = 0"]
over_general = pytest.mark.parametrize("name", GENERAL)


def walked(block, steps):
    return [reduced(triple) for triple in islice(tau_table.triples(block), steps + 1)]


SMOOTH = [
    name
    for name, case in STARTS.items()
    if not (block := integer_block(*case)).is_constant
    and block.level is not None
    and not block.is_degenerate
    and len(by_gcds(block, 25)) == 26
]
over_smooth = pytest.mark.parametrize("name", SMOOTH)
FIRST = 4  # as long as psi_{n-2} would be zero one steps


def stepped(block, count):
    return [reduced(triple) for triple in islice(block.triples(), count)]


# The points.


@pytest.mark.parametrize(
    ("cubic", "start"),
    [pytest.param(*case, id=name) for name, case in STARTS.items()],
)
def test_the_points_are_those_of_plain_gcds(cubic, start):
    block = integer_block(cubic, start)
    assert walked(block, 25) == by_gcds(block, 25)


@over_general
def test_the_points_are_those_of_the_content_rule_for_long(name):
    block = integer_block(*STARTS[name])
    assert walked(block, 80) == [reduced(triple) for triple in islice(block.triples(), 81)]


@pytest.mark.parametrize("seed", quick(range(4), [0]))
def test_the_points_of_random_planes_are_those_of_plain_gcds(seed):
    for block in random_blocks(f"tau {seed}", 132):
        assert walked(block, 9) == by_gcds(block, 9)


@pytest.mark.parametrize("name", [*GENERAL, "delta = 1", "a double root", "level 0", "h = 0", "large coefficients"])
def test_the_points_are_those_of_the_kahan_map(name):
    cubic, (U, V, W) = STARTS[name]
    phi, x = KahanMap(planar_system(cubic), "1/2"), (fmpq(U, W), fmpq(V, W))
    for triple in walked(integer_block(cubic, (U, V, W)), 12):
        assert (fmpq(triple[0], triple[2]), fmpq(triple[1], triple[2])) == x
        x = phi.step(x)


@pytest.mark.parametrize("steps", [2, 3, 4, 5, 8, 13, 21])
@pytest.mark.parametrize(
    "name",
    [
        "a pole at step 2",
        "a pole at step 5",
        "delta = 1, a pole at step 3",
    ],
)
def test_an_orbit_ends_before_its_pole(name, steps):
    cubic, start = STARTS[name]
    block = integer_block(cubic, before(cubic, start, steps))
    assert walked(block, 40) == by_gcds(block, 40)


@over_general
def test_every_triple_is_primitive(name):
    for triple in islice(tau_table.triples(integer_block(*STARTS[name])), 40):
        assert primitive(triple) == triple


# psi and chi.


def natural_lifts(block, count):
    """P_{-1}, P_0, ... with P_{n+1} W_{n-1} = Psi(P_n), P_0 and P_1 primitive, as fractions."""
    points = [tuple(map(fmpq, triple)) for triple in islice(block.triples(), 2)]
    before_start = primitive(block.block.preimage(block.start))
    i = next(i for i in range(3) if points[1][i] != 0)
    W = block.block.image(points[0])[i] / points[1][i]
    points.insert(0, tuple(entry * (W / before_start[2]) for entry in before_start))
    while len(points) < count:
        points.append(tuple(entry / points[-2][2] for entry in block.block.image(points[-1])))
    return dict(enumerate(points, -1))


def psi_and_chi(block, until):
    """psi_1, ... and chi_{-2}, ... as fractions; the third of all indices lacks gamma^(1/3)."""
    start = tau.start_near(block)
    assert start.base == 0
    table = tau_table.TauTable(start)
    psi_scales = {n: start.psi.scale(n) for n in range(1, 5)}
    chi_scales = {n: start.chi.scale(n) for n in range(-2, 3)}
    for scales, t, first in ((psi_scales, table.psi_t, 5), (chi_scales, table.chi_t, 3)):
        for n in range(first, until + 1):
            scales[n] = t[n - 1] * scales[n - 1] ** 2 / scales[n - 2]
    psi = {n: table.psi[n] * psi_scales[n] for n in range(1, until + 1)}
    chi = {n: table.chi[n] * chi_scales[n] for n in range(-1, until + 1)}
    return start.gamma, psi, {**chi, -2: start.chi[-2] * start.chi.scale(-2)}


def cubed(values, n, gamma):
    return values[n] ** 3 * (gamma if n % 3 == 0 else 1)


@over_general
def test_determinants_of_three_points_factor(name):
    block = integer_block(*STARTS[name])
    gamma, psi, chi = psi_and_chi(block, 17 if name != "chi_5 = 0" else 8)
    P = natural_lifts(block, 8 if name != "chi_5 = 0" else 5)
    for i, j, k in combinations(sorted(P), 3):
        # Cubes, or there would be a cube root of gamma; chi_0 = 3 det(P_{-1}, P_0, P_1) decides the factor.
        product = cubed(chi, i + j + k, gamma)
        for n in (j - i, k - i, k - j):
            product *= cubed(psi, n, gamma)
        assert 216 * gamma * determinant(P[i], P[j], P[k]) ** 3 == product


def weighted(left, right, a, b, gamma):
    """left - right with gamma where the cube roots leave it."""
    if (a % 3 == 0) != (b % 3 == 0):
        return (gamma * left - right) if b % 3 == 0 else (left - gamma * right)
    return left - right


@pytest.mark.parametrize("name", GENERAL[:3])
def test_all_bilinear_relations_hold(name):
    gamma, psi, chi = psi_and_chi(integer_block(*STARTS[name]), 16)
    for phi, first in ((psi, 2), (chi, -1)):
        for a in range(first, 9):
            for b in range(2, 8):
                if a + b <= 16 and a - b in phi:
                    left = phi[a + 1] * phi[a - 1] * psi[b] ** 2
                    right = psi[b + 1] * psi[b - 1] * phi[a] ** 2
                    assert phi[a + b] * phi[a - b] == weighted(left, right, a, b, gamma)


@pytest.mark.parametrize("name", GENERAL)
def test_psi_5_and_psi_6_are_known_polynomials_of_gamma(name):
    gamma, psi, _ = psi_and_chi(integer_block(*STARTS[name]), 6)
    assert psi[5] == 32 - 27 * gamma
    assert psi[6] == 6 * (28 - 27 * gamma)


def test_psi_n_is_zero_modulo_a_prime_where_n_T_is_zero():
    # psi are integer polynomials of gamma, up to a power of its denominator.
    prime, seen, rng = 61, 0, random.Random(1)
    for _ in range(40):
        block = integer_block([rng.randint(-9, 9) for _ in range(4)], (rng.randint(1, 9), 5, 7))
        if block.level is None or block.is_degenerate or block.bad % prime == 0:
            continue
        start = tau.start_near(block)
        if start is None or start.base or start.gamma.p % prime == 0:
            continue
        gamma, psi, _ = psi_and_chi(block, 40)
        curve = Jacobian(nmod(int(gamma.p), prime) / int(gamma.q))
        for n in range(1, 41):
            assert (psi[n].p % prime == 0) == (curve.multiple(n, curve.T) is None)
            seen += psi[n].p % prime == 0
    assert seen > 20


@pytest.mark.parametrize("name", GENERAL[:3])
def test_the_values_are_about_a_third_as_long_as_the_points(name):
    block = integer_block(*STARTS[name])
    table = tau_table.TauTable(tau.start_near(block))
    psi, chi, (_, _, W) = table.psi[80], table.chi[80], table.point(80)
    # psi_80 and chi_80 against P_80; bad primes and the neighbours' lengths account for the rest
    assert abs(psi.bit_length() - W.bit_length() / 3) < 0.05 * W.bit_length()
    assert abs(chi.bit_length() - W.bit_length() / 3) < 0.05 * W.bit_length()


# The n-th point.


@over_smooth
def test_every_point_up_to_60_is_that_of_steps(name):
    block = integer_block(*STARTS[name])
    expected = stepped(block, 61)
    base = tau.start_near(block).base
    assert [reduced(tau_table.iterate(block, n)) for n in range(FIRST + base, 61)] == expected[FIRST + base :]


@pytest.mark.parametrize("name", ["P_{-1}, P_0, P_1 on a line", "chi_7 = 0"])
def test_points_further_away_are_those_of_steps(name):
    block = integer_block(*STARTS[name])
    expected = stepped(block, 258)
    for n in (61, 64, 95, 96, 97, 127, 128, 129, 200, 255, 256, 257):
        assert reduced(tau_table.iterate(block, n)) == expected[n]


@pytest.mark.parametrize("seed", quick(range(2), [0]))
def test_iterates_in_random_planes_are_those_of_plain_gcds(seed):
    compared = 0
    for block in random_blocks(f"iterate {seed}", 44):
        expected = by_gcds(block, 12)
        for n in (8, 9, 10, 11, 12):
            found = tau_table.iterate(block, n)
            if found is not None and n < len(expected):
                assert reduced(found) == expected[n]
                compared += 1
    assert compared > 60


@over_smooth
def test_every_iterate_is_primitive(name):
    block = integer_block(*STARTS[name])
    for n in (11, 17, 30, 45):
        found = tau_table.iterate(block, n)
        assert primitive(found) == found


@pytest.mark.parametrize("steps", [7, 8, 9, 16, 30])
def test_a_pole_is_passed_over(steps):
    # The two neighbours of a pole are the same on every level; from P_{pole + 2} on one can step again.
    cubic, start = STARTS["a pole at step 2"]
    block = integer_block(cubic, before(cubic, start, steps))
    pole = steps + 2
    found = {n: reduced(tau_table.iterate(block, n)) for n in range(pole - 1, 2 * pole)}
    U, V, W = by_gcds(block, 2 * pole)[-1]
    assert found[pole - 1] == (U, V, W)
    assert same_point(found[pole], (U, V, 0))
    assert found[pole + 1] == reduced((U, V, -W))
    assert reduced(preimage(cubic, found[pole + 2])) == found[pole + 1]
    for n in range(pole + 2, 2 * pole - 1):
        above, below = block.block.level(found[n])
        assert fmpq(above, below) == block.level
        assert reduced(image(cubic, found[n])) == found[n + 1]


# Budgets.


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("n", [100, 127, 180])
def test_no_number_is_longer_than_the_result(name, n, monkeypatch):
    lengths = []
    divide = planar_integers.divide_exactly

    def watched(values, divisor):
        lengths.extend(value.bit_length() for value in values)
        return divide(values, divisor)

    monkeypatch.setattr(planar_integers, "divide_exactly", watched)
    found = tau_table.iterate(integer_block(*STARTS[name]), n)
    # A tenth, for bad primes and the three points around the base.
    assert max(lengths) < 1.1 * max(entry.bit_length() for entry in found)
    assert len(lengths) < 20 * n.bit_length()


# Where it does not apply.


@pytest.mark.parametrize("name", ["three real roots, irrational", "P_{-1}, P_0, P_1 on a line", "chi_2 = 0"])
def test_few_steps_are_left_to_the_steps(name):
    block = integer_block(*STARTS[name])
    base = tau.start_near(block).base
    assert [n for n in range(20) if tau_table.iterate(block, n) is None] == list(range(FIRST + base))


@pytest.mark.parametrize("name", ["h = 0", "the origin"])
def test_a_constant_orbit_is_at_its_start(name):
    block = integer_block(*STARTS[name])
    assert {tau_table.iterate(block, n) for n in (0, 5, 10**30)} == {block.start}


@pytest.mark.parametrize(
    "name",
    [
        "delta = 1",
        "delta = 1, a vertex",
        "level 0",
        "a double root",
        "a triple root",
        "no value at the start",
        "no value at the start, level 0",
        "period 5 but for a pole",
        "a pole at step 3",
    ],
)
def test_where_doubling_does_not_apply_the_answer_is_none(name):
    assert tau_table.iterate(integer_block(*STARTS[name]), 100) is None


# That the tests can fail.


@pytest.mark.parametrize("change", [1, -1])
def test_with_another_gamma_divisions_leave_a_remainder(change, monkeypatch):
    block = integer_block(*STARTS["one real root, irrational"])
    start = tau.start_near(block)
    start.gamma += change
    monkeypatch.setattr(tau_table, "start_near", lambda block: start)
    with pytest.raises(ArithmeticError, match="left a remainder"):
        tau_table.iterate(block, 100)
