"""Exact steps on integers over one common denominator, and the elimination that makes long numbers cheap.

Specified here: the steps are those of fractions solved entry by entry; the elimination used above a threshold (put to 0
below, so that small numbers take the same road) finds what FLINT's solver finds, on matrices of every size, regular or
singular, whose minors share everything, something or nothing with the denominator; and what it finds is not believed
without a proof.
"""

from __future__ import annotations

import random
from math import gcd, prod

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly, fmpz, fmpz_mat
from helpers import NAMED_SYSTEMS, points, random_point, rationals, systems_with_points
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.documents.catalog import load
from kahanmaps.family.draw import draw_with_chi, draw_with_eigenvalues
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits import integer_steps
from kahanmaps.maps.orbits.integer_steps import IntegerPoint
from kahanmaps.systems.quadratic import QuadraticSystem

t = fmpq_poly([0, 1])

FAMILY = {
    "m = 2": draw_with_eigenvalues([1, -2], 1).chosen.system,
    "m = 2, irreducible": draw_with_chi(t**2 - 2, 1).chosen.system,
    "m = 3": draw_with_eigenvalues([1, -2, 3], 2).chosen.system,
    "m = 3, irreducible": draw_with_chi(t**3 - t - 1, 2).chosen.system,
    "m = 4": draw_with_eigenvalues([1, -2, 3, "1/2"], 3).chosen.system,
}
STEPS = {"m = 2": 20, "m = 2, irreducible": 20, "m = 3": 16, "m = 3, irreducible": 16, "m = 4": 10}
ORBITS = [
    *(pytest.param(system, "1/10", STEPS[name], id=name) for name, system in FAMILY.items()),
    # not integrable: digits multiply with every step
    *(pytest.param(system, "1/10", 5, id=name) for name, system in NAMED_SYSTEMS.items()),
]


def start(dim: int) -> tuple[fmpq, ...]:
    return tuple(fmpq(1, i + 2) for i in range(dim))


def rational_step(system: QuadraticSystem, eps: fmpq, x: tuple[fmpq, ...]) -> tuple[fmpq, ...]:
    """(I - eps f'(x)) x~ = (I + eps B) x + 2 eps c, with rational entries, by FLINT."""
    column, one = QQ.column(x), QQ.identity(system.dim)
    right = column + system.B * column * eps + QQ.column(system.c) * (2 * eps)
    return tuple((one - system.over(QQ).jacobian(x) * eps).solve(right).entries())


def walk(system: QuadraticSystem, eps: str, steps: int) -> list[IntegerPoint]:
    stepper, point = KahanMap(system, QQ.convert(eps)).integer_steps, IntegerPoint.from_rationals(start(system.dim))
    found = [point]
    for _ in range(steps):
        found.append(stepper.step(found[-1]))
    return found


def is_in_lowest_terms(point: IntegerPoint) -> bool:
    return point.denominator > 0 and gcd(int(point.denominator), *map(int, point.numerators)) == 1


@pytest.fixture
def always_eliminate(monkeypatch):
    monkeypatch.setattr(integer_steps, "_ELIMINATION_BITS", 0)


@pytest.fixture
def never_eliminate(monkeypatch):
    monkeypatch.setattr(integer_steps, "_ELIMINATION_BITS", 10**9)


@pytest.fixture
def found_by_elimination(monkeypatch, always_eliminate):
    """What each elimination returned, in a list that fills as the test runs."""
    found: list[IntegerPoint | None] = []
    eliminate = integer_steps._eliminate

    def watched(*arguments):
        found.append(eliminate(*arguments))
        return found[-1]

    monkeypatch.setattr(integer_steps, "_eliminate", watched)
    return found


# Points.


@given(x=st.integers(1, 5).flatmap(lambda n: points(n, rationals(10**6))))
def test_a_point_comes_back_from_its_integers(x):
    assert IntegerPoint.from_rationals(x).rationals() == x


@given(x=st.integers(1, 5).flatmap(lambda n: points(n, rationals(10**6))))
def test_a_point_made_of_rationals_is_in_lowest_terms(x):
    assert is_in_lowest_terms(IntegerPoint.from_rationals(x))


def test_the_common_denominator_is_the_least():
    assert IntegerPoint.from_rationals((fmpq(1, 4), fmpq(-1, 6))) == IntegerPoint((fmpz(3), fmpz(-2)), fmpz(12))


@pytest.mark.parametrize(("x", "bits"), [((fmpq(0),), 1), ((fmpq(255),), 8), ((fmpq(-1, 1024),), 11)], ids=str)
def test_the_bits_of_a_point_are_those_of_its_longest_integer(x, bits):
    assert IntegerPoint.from_rationals(x).bits == bits


def composite_integers(primes=(2, 3, 2**61 - 1), exponent: int = 12):
    """Integers made of few primes, in powers, so that they share much."""
    powers = [st.integers(0, exponent).map(lambda e, p=p: p**e) for p in primes]
    return st.tuples(st.sampled_from([1, -1, 5, -7, 0]), *powers).map(lambda factors: fmpz(prod(factors)))


@given(numerators=st.lists(composite_integers(), min_size=1, max_size=5), denominator=composite_integers())
def test_coordinates_in_lowest_terms_are_those_of_the_fractions(numerators, denominator):
    point = IntegerPoint(tuple(numerators), abs(denominator) or fmpz(1))
    assert point.lowest_terms() == [(entry.p, entry.q) for entry in point.rationals()]


@pytest.mark.parametrize(("system", "eps", "steps"), ORBITS)
def test_coordinates_of_an_orbit_in_lowest_terms_are_those_of_the_fractions(system, eps, steps):
    for point in walk(system, eps, steps):
        assert point.lowest_terms() == [(entry.p, entry.q) for entry in point.rationals()]


# Steps.


@given(pair=systems_with_points(dims=(1, 2, 3, 4)), eps=rationals().filter(bool))
def test_a_step_on_integers_is_the_step_on_fractions(pair, eps):
    system, x = pair
    image = KahanMap(system, eps).integer_steps.step(IntegerPoint.from_rationals(x))
    try:
        expected = rational_step(system, eps, x)
    except ZeroDivisionError:
        expected = None
    assert (None if image is None else image.rationals()) == expected


@given(pair=systems_with_points(dims=(1, 2, 3, 4)), eps=rationals().filter(bool))
def test_an_image_is_in_lowest_terms(pair, eps):
    system, x = pair
    image = KahanMap(system, eps).integer_steps.step(IntegerPoint.from_rationals(x))
    assert image is None or is_in_lowest_terms(image)


@pytest.mark.parametrize(("system", "eps", "steps"), ORBITS)
@pytest.mark.parametrize("threshold", ["never_eliminate", "always_eliminate"])
def test_an_orbit_on_integers_is_the_orbit_on_fractions(system, eps, steps, threshold, request):
    request.getfixturevalue(threshold)
    x = start(system.dim)
    for point in walk(system, eps, steps)[1:]:
        x = rational_step(system, QQ.convert(eps), x)
        assert point.rationals() == x


@pytest.mark.parametrize(("system", "eps", "steps"), ORBITS)
def test_every_point_of_an_orbit_is_in_lowest_terms(system, eps, steps, always_eliminate):
    assert all(is_in_lowest_terms(point) for point in walk(system, eps, steps))


def test_a_step_has_no_image_where_the_determinant_vanishes():
    system = QuadraticSystem.from_text(["x", "y"], ["x^2", "y"])
    assert KahanMap(system, fmpq(1, 2)).integer_steps.step(IntegerPoint.from_rationals((fmpq(1), fmpq(5)))) is None


def test_the_elimination_is_used_when_numbers_are_long(monkeypatch):
    # The threshold as it is: m = 3 needs some ten steps to reach it.
    used = []
    eliminate = integer_steps._eliminate
    monkeypatch.setattr(integer_steps, "_eliminate", lambda *a: used.append(a[2].bit_length()) or eliminate(*a))
    walk(FAMILY["m = 3"], "1/10", 20)
    assert used
    assert min(used) >= integer_steps._ELIMINATION_BITS


@pytest.mark.parametrize("name", ["m = 3", "m = 3, irreducible", "m = 4"])
def test_for_the_family_the_elimination_itself_finds_every_step(name, found_by_elimination):
    # It relies on rank 2 modulo the denominator; were that wrong, FLINT's solver would silently do all the work.
    orbit = walk(FAMILY[name], "1/10", 12)
    assert found_by_elimination == orbit[1:]


@pytest.mark.parametrize("steps", [40, pytest.param(60, marks=pytest.mark.slow)])
def test_a_long_orbit_beyond_the_threshold_is_the_orbit_on_fractions(steps):
    x, system = start(6), FAMILY["m = 3"]
    for point in walk(system, "1/10", steps)[1:]:
        x = rational_step(system, fmpq(1, 10), x)
        assert point.rationals() == x


# The elimination against FLINT's solver.


def random_integers(rows: int, columns: int, rng: random.Random, bits: int) -> fmpz_mat:
    return fmpz_mat(rows, columns, [rng.randint(-(2**bits), 2**bits) for _ in range(rows * columns)])


def divide(matrix: fmpz_mat, right: fmpz_mat, likely: fmpz) -> IntegerPoint | None:
    return integer_steps._eliminated(matrix, right, likely) or integer_steps._solved(matrix, right)


def by_flint(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    try:
        return IntegerPoint.from_rationals(fmpq_mat(matrix).solve(fmpq_mat(right)).entries())
    except ZeroDivisionError:
        return None


sizes = pytest.mark.parametrize("n", range(1, 9))
LONG_PRIME = fmpz(2**127 - 1)


@sizes
@pytest.mark.parametrize("bits", [1, 8, 200])
def test_elimination_solves_random_systems(n, bits, always_eliminate):
    rng = random.Random(f"{n} {bits}")
    for _ in range(20):
        matrix, right = random_integers(n, n, rng, bits), random_integers(n, 1, rng, bits)
        assert divide(matrix, right, fmpz(rng.getrandbits(300) | 1)) == by_flint(matrix, right)


@sizes
def test_elimination_alone_solves_systems_whose_leading_minors_do_not_vanish(n):
    rng = random.Random(n)
    for _ in range(20):
        matrix, right = random_integers(n, n, rng, 100), random_integers(n, 1, rng, 100)
        assert integer_steps._eliminate(matrix, right, fmpz(rng.getrandbits(300))) == by_flint(matrix, right)


@pytest.mark.parametrize("n", range(2, 9))
@pytest.mark.parametrize("consistent", [True, False], ids=["consistent", "inconsistent"])
def test_a_singular_system_has_no_solution_even_if_it_is_consistent(n, consistent, always_eliminate):
    rng = random.Random(n)
    for rank in range(1, n):
        matrix = random_integers(n, rank, rng, 50) * random_integers(rank, n, rng, 50)
        right = matrix * random_integers(n, 1, rng, 50) if consistent else random_integers(n, 1, rng, 50)
        assert divide(matrix, right, LONG_PRIME) is None


def of_rank_two_modulo(W: fmpz, n: int, rng: random.Random) -> tuple[fmpz_mat, fmpz_mat]:
    """A matrix and a right side, congruent modulo W to a matrix of rank 2 and a column of its image."""

    plane = random_integers(n, 2, rng, 6)
    matrix = plane * random_integers(2, n, rng, 6) + random_integers(n, n, rng, 6) * W
    return matrix, plane * random_integers(2, 1, rng, 6) + random_integers(n, 1, rng, 6) * W


CONTENTS = {
    "a long prime": (LONG_PRIME, LONG_PRIME),
    "its square": (LONG_PRIME**2, LONG_PRIME**2),
    "a product with small primes": (LONG_PRIME * 2**40 * 3**20, LONG_PRIME * 2**40 * 3**20),
    "powers of two": (fmpz(2) ** 300, fmpz(2) ** 300),
    "a part of the number offered": (LONG_PRIME, LONG_PRIME * (2**521 - 1)),
    "more than the number offered": (LONG_PRIME * (2**89 - 1), LONG_PRIME),
    "a number too short to matter": (fmpz(2**31 - 1), fmpz(2**31 - 1)),
    "nothing": (fmpz(1), LONG_PRIME),
}


@pytest.mark.parametrize("n", range(3, 9))
@pytest.mark.parametrize(("W", "offered"), CONTENTS.values(), ids=CONTENTS.keys())
def test_minors_with_common_content_are_solved_correctly(n, W, offered, always_eliminate):
    rng = random.Random(n)
    for _ in range(5):
        matrix, right = of_rank_two_modulo(W, n, rng)
        assert divide(matrix, right, offered) == by_flint(matrix, right)


@pytest.mark.parametrize("n", range(3, 9))
def test_common_content_is_taken_out_by_the_elimination_itself(n):
    rng = random.Random(n)
    matrix, right = of_rank_two_modulo(LONG_PRIME, n, rng)
    assert integer_steps._eliminate(matrix, right, LONG_PRIME) == by_flint(matrix, right)


@pytest.mark.parametrize("n", range(3, 9))
def test_a_vanishing_pivot_makes_the_elimination_step_aside(n, always_eliminate):
    matrix = fmpz_mat(n, n, [int(i + j == n - 1) for i in range(n) for j in range(n)])  # the reversal
    right = fmpz_mat(n, 1, list(range(n)))
    assert integer_steps._eliminate(matrix, right, LONG_PRIME) is None
    assert divide(matrix, right, LONG_PRIME).numerators == tuple(reversed(range(n)))


# Of the six minors of order 3 the elimination looks at every second one and finds d in all of them; the others do not
# contain it, so that the divisions by d are not exact.
D = LONG_PRIME
DECEPTIVE_BLOCKS = {
    "regular": [[D, 1], [D**2, 2 * D]],
    "singular": [[D, 1], [D**2, D]],
}


def deceptive(block) -> fmpz_mat:
    return fmpz_mat([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, *block[0]], [0, 0, *block[1]]])


@pytest.mark.parametrize("block", DECEPTIVE_BLOCKS.values(), ids=DECEPTIVE_BLOCKS.keys())
@pytest.mark.parametrize("right", [(1, 1, 0, 0), (1, 2, int(D), 5), (0, 0, int(D), int(D) ** 2)], ids=len)
def test_divisions_that_are_not_exact_do_no_harm(block, right, always_eliminate):
    matrix, column = deceptive(block), fmpz_mat(4, 1, list(right))
    assert divide(matrix, column, D) == by_flint(matrix, column)


def test_a_solution_of_a_singular_system_is_not_taken_for_the_image():
    # Here the wrong divisions even hide that the determinant vanishes, and what is found solves the equations.
    matrix, column = deceptive(DECEPTIVE_BLOCKS["singular"]), fmpz_mat(4, 1, [1, 1, 0, 0])
    found = integer_steps._eliminate(matrix, column, D)
    assert matrix.det() == 0
    assert matrix * fmpz_mat(4, 1, found.numerators) == column * found.denominator


@sizes
def test_the_solution_is_in_lowest_terms_with_a_positive_denominator(n, always_eliminate):
    rng = random.Random(n)
    matrix, right = random_integers(n, n, rng, 20) * fmpz(6), random_integers(n, 1, rng, 6) * fmpz(4)
    for sign in (1, -1):
        assert is_in_lowest_terms(divide(matrix * sign, right, LONG_PRIME))


def test_the_solution_zero_has_the_denominator_one(always_eliminate):
    matrix = fmpz_mat([[2, 1, 0], [1, 3, 1], [0, 1, 5]])
    assert divide(matrix, fmpz_mat(3, 1), LONG_PRIME) == IntegerPoint((fmpz(0),) * 3, fmpz(1))


# Its tools.

long_integers = st.integers(-(2**300), 2**300)


@given(
    batches=st.lists(st.lists(long_integers, min_size=1, max_size=8), min_size=1, max_size=3),
    divisor=long_integers.filter(bool),
)
def test_exact_division_undoes_multiplication_batch_after_batch(batches, divisor):
    into = integer_steps._ExactDivisor(fmpz(divisor)).into
    assert [into([fmpz(quotient * divisor) for quotient in batch]) for batch in batches] == batches


@given(quotients=st.lists(st.integers(-5, 5), min_size=4, max_size=8), power=st.integers(0, 200))
def test_exact_division_by_powers_of_two_undoes_a_shift(quotients, power):
    values = [fmpz(quotient << power) for quotient in quotients]
    assert integer_steps._ExactDivisor(fmpz(1) << power).into(values) == quotients


@given(odd=long_integers.map(lambda a: 2 * a + 1), bits=st.integers(1, 700))
def test_the_inverse_modulo_a_power_of_two_is_pythons(odd, bits):
    assert int(integer_steps._inverse_modulo_power_of_two(fmpz(odd), bits)) == pow(odd, -1, 2**bits)


@given(odd=long_integers.map(lambda a: 2 * a + 1), power=st.integers(0, 300))
def test_trailing_zeros_are_the_power_of_two_in_a_number(odd, power):
    assert integer_steps._trailing_zeros(fmpz(odd << power)) == power


def test_an_orbit_from_another_start_agrees_too(always_eliminate):
    system, x = FAMILY["m = 3"], random_point(6, seed=11)
    point = IntegerPoint.from_rationals(x)
    for _ in range(5):
        point, x = KahanMap(system, fmpq(-3, 7)).integer_steps.step(point), rational_step(system, fmpq(-3, 7), x)
    assert point.rationals() == x


@pytest.mark.parametrize(
    ("matrix", "right", "numerators", "denominator"),
    [
        ([[1, 0], [0, 2]], [1, 1], (2, 1), 2),
        ([[0, 1], [1, 0]], [3, 5], (5, 3), 1),  # determinant -1
        ([[-2, 0], [0, 3]], [2, 6], (-1, 2), 1),
        ([[-2]], [3], (-3,), 2),
        ([[0, 1, 0], [1, 0, 0], [0, 0, 2]], [4, 6, 1], (12, 8, 1), 2),
    ],
)
def test_cramers_rule_gives_lowest_terms_over_a_positive_denominator(matrix, right, numerators, denominator):
    found = integer_steps._cramer(fmpz_mat(matrix), fmpz_mat([[entry] for entry in right]))
    assert (found.numerators, found.denominator) == (numerators, denominator)


# Explicit maps, whose matrices are diagonal.


@pytest.mark.parametrize("name", ["hietarinta_viallet", "fibonacci", "lyness", "todd", "somos_5"])
def test_steps_of_explicit_maps_are_those_of_fractions(name):
    over = load(name).map.at("3/11")
    assert over.integer_steps._is_diagonal
    x = start(over.dim)
    for _ in range(6):
        image = over.generic_step(x)
        assert over.integer_steps.step(IntegerPoint.from_rationals(x)) == IntegerPoint.from_rationals(image)
        x = image


def test_an_explicit_map_has_no_value_where_one_denominator_vanishes():
    assert load("lyness").map.at(1).integer_steps.step(IntegerPoint.from_rationals((fmpq(0), fmpq(2)))) is None
