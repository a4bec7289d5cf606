"""Exact steps on integers over one common denominator, and the elimination that makes long numbers cheap.

Specified here: the steps are those of fractions solved entry by entry; the elimination used above a threshold (put to 0
below, so that small numbers take the same road) finds what FLINT's solver finds, on matrices of every size, regular or
singular, whose minors share everything, something or nothing with the denominator; and what it finds is not believed
without a proof; rows of the equation that do not depend on x are taken out, and the steps stay the same.
"""

import random
from math import prod

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly, fmpz, fmpz_mat
from helpers import NAMED_SYSTEMS, rationals, systems_with_points
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.documents.catalog import load
from kahanmaps.errors import SingularStep
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


def composite_integers(primes=(2, 3, 2**61 - 1), exponent: int = 12):
    """Integers made of few primes, in powers, so that they share much."""
    powers = [st.integers(0, exponent).map(lambda e, p=p: p**e) for p in primes]
    return st.tuples(st.sampled_from([1, -1, 5, -7, 0]), *powers).map(lambda factors: fmpz(prod(factors)))


@given(numerators=st.lists(composite_integers(), min_size=1, max_size=5), denominator=composite_integers())
def test_coordinates_in_lowest_terms_are_those_of_the_fractions(numerators, denominator):
    point = IntegerPoint(tuple(numerators), abs(denominator) or fmpz(1))
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


@pytest.mark.parametrize(("system", "eps", "steps"), ORBITS)
@pytest.mark.parametrize("threshold", ["never_eliminate", "always_eliminate"])
def test_an_orbit_on_integers_is_the_orbit_on_fractions(system, eps, steps, threshold, request):
    request.getfixturevalue(threshold)
    x = start(system.dim)
    for point in walk(system, eps, steps)[1:]:
        x = rational_step(system, QQ.convert(eps), x)
        assert point.rationals() == x


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


# Rows of the equation that do not depend on x are taken out.


NAMES = ["x", "y", "z", "w"]
LINEAR = ["y", "x + 2*y - w", "3*z + 1", "0", "x - y + z - w"]
QUADRATIC = ["x*y - z^2", "w^2 + x", "x*z - 2*y*w + 1", "y^2 - y"]
small = st.fractions(-5, 5, max_denominator=7).map(lambda q: fmpq(q.numerator, q.denominator))


@st.composite
def partly_linear(draw) -> QuadraticSystem:
    """Systems of dimension 4, one to four of whose equations are linear, in any order."""
    count = draw(st.integers(1, 4))
    lines = [draw(st.sampled_from(LINEAR)) for _ in range(count)]
    lines += [draw(st.sampled_from(QUADRATIC)) for _ in range(4 - count)]
    return QuadraticSystem.from_text(NAMES, draw(st.permutations(lines)))


@given(system=partly_linear(), eps=small, x=st.tuples(small, small, small, small))
def test_a_step_is_that_of_fractions_and_a_pole_is_one(system, eps, x):
    assume(eps != 0)
    over = KahanMap(system, eps)
    image = over.integer_steps.step(IntegerPoint.from_rationals(x))
    try:
        expected = over.generic_step(x)
    except SingularStep:
        assert image is None
    else:
        assert image == IntegerPoint.from_rationals(expected)


@pytest.mark.parametrize("name", ["clebsch_first_flow", "euler_top", "weierstrass"])
def test_nothing_is_taken_out_where_there_is_nothing_or_where_minors_are_quicker(name):
    assert load(name).map.at("3/11").integer_steps._constant is None


def test_dependent_rows_leave_no_value_anywhere():
    singular = KahanMap(QuadraticSystem.from_text(NAMES, ["x", "y^2", "x*z", "w"]), 1)
    assert singular.integer_steps.step(IntegerPoint.from_rationals((fmpq(1),) * 4)) is None
