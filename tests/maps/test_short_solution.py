"""Solutions recognized from real approximations, against FLINT's; what is not proved is not returned."""

import random
import sys
from concurrent.futures import ThreadPoolExecutor

import flint
import pytest
from flint import fmpq, fmpq_mat, fmpz, fmpz_mat

from kahanmaps.documents.catalog import load
from kahanmaps.family.random_members import random_member_with_eigenvalues
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits import integer_steps, short_solution
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.iteration import Orbit

BITS = 600
POINT = IntegerPoint((fmpz(1),), fmpz(2) ** BITS)


def system_with(X: list[fmpz], V: fmpz, rng: random.Random, zeros: int = 0) -> tuple[fmpz_mat, fmpz_mat]:
    """A matrix and a right side as long as V, whose solution X/V is n times shorter than its determinant."""
    n, inverse = len(X), fmpz(pow(int(X[-1]), -1, int(V)))
    rows = []
    for i in range(n):
        row = [fmpz(0) if (j - i) % n < zeros else fmpz(rng.getrandbits(BITS)) for j in range(n - 1)]
        last = -sum((a * x for a, x in zip(row, X[:-1], strict=True)), fmpz(0)) * inverse % V
        rows.append([*row, last])
    matrix = fmpz_mat(rows)
    return matrix, fmpz_mat([[entry // V] for entry in (matrix * fmpz_mat(n, 1, X)).entries()])


def random_fractions(n: int, rng: random.Random, factor: int = 1) -> tuple[list[fmpz], fmpz]:
    """Numerators and a denominator; all numerators but the last two share a factor with the denominator."""
    X = [fmpz(rng.getrandbits(BITS - 80) | 1) * factor for _ in range(n - 2)]
    return [*X, fmpz(3), fmpz(2)], fmpz(rng.getrandbits(BITS - 80) | 1) * factor


def by_flint(matrix: fmpz_mat, rhs: fmpz_mat) -> IntegerPoint:
    return IntegerPoint.from_rationals(fmpq_mat(matrix).solve(fmpq_mat(rhs)).entries())


@pytest.mark.parametrize("n", [4, 5, 6, 9])
@pytest.mark.parametrize("zeros", [0, 1, 2])
@pytest.mark.parametrize("factor", [1, 5**9, 2**61 - 1], ids=["no factor", "a small prime", "a long prime"])
def test_a_short_solution_is_found_and_not_with_fewer_bits(n, zeros, factor):
    rng = random.Random(n)
    for _ in range(5):
        X, V = random_fractions(n, rng, factor)
        matrix, rhs = system_with(X, V, rng, zeros)
        found = short_solution.short_solution(matrix, rhs, POINT, BITS)
        assert found == by_flint(matrix, rhs)
        assert short_solution.short_solution(matrix, rhs, POINT, BITS // 2) is None


@pytest.mark.parametrize("n", [4, 6])
def test_a_long_solution_is_not_found_and_a_singular_system_has_none(n):
    rng = random.Random(n)
    matrix = fmpz_mat(n, n, [rng.getrandbits(BITS) for _ in range(n * n)])
    rhs = fmpz_mat(n, 1, [rng.getrandbits(BITS) for _ in range(n)])
    assert short_solution.short_solution(matrix, rhs, POINT, BITS) is None
    singular = fmpz_mat([*matrix.tolist()[1:], [a + b for a, b in zip(*matrix.tolist()[1:3], strict=True)]])
    assert short_solution.short_solution(singular, rhs, POINT, BITS) is None


def test_a_wrong_denominator_is_refused(monkeypatch):
    rng = random.Random(1)
    X, V = random_fractions(6, rng)
    matrix, rhs = system_with(X, V, rng)
    for wrong in (V + 2, V - 2, fmpz(1)):
        monkeypatch.setattr(short_solution, "simple_denominator", lambda *_, wrong=wrong: wrong)
        assert short_solution.short_solution(matrix, rhs, POINT, BITS) is None
    monkeypatch.setattr(short_solution, "simple_denominator", lambda *_: V)
    assert short_solution.short_solution(matrix, rhs, POINT, BITS) == IntegerPoint(tuple(X), V)


def test_what_differs_from_the_solution_by_less_than_the_approximation_shows_is_refused():
    """A change of the right side by 1 changes the solution in its last digits only."""
    rng = random.Random(2)
    X, V = random_fractions(6, rng)
    matrix, rhs = system_with(X, V, rng)
    rhs[3, 0] += 1
    assert short_solution.short_solution(matrix, rhs, POINT, BITS) is None


def test_factors_that_are_not_needed_are_removed(monkeypatch):
    rng = random.Random(4)
    X, V = random_fractions(6, rng, 3**20)
    matrix, rhs = system_with(X, V, rng)
    for factors in (1, 3**20, 3**100):  # with the last of them the multiple of V is longer than half of the digits
        monkeypatch.setattr(short_solution, "_SMALL_FACTORS", factors)
        found = short_solution.short_solution(matrix, rhs, POINT, BITS)
        expected = by_flint(matrix, rhs)
        assert (found.numerators, found.denominator) == (expected.numerators, expected.denominator)


def test_a_factor_that_a_later_coordinate_brings_is_checked_in_the_earlier_ones():
    """x_1 = p/d + 1/(g d f) is so near to p/d that it lacks the factors f and g, and f multiplies its distance."""
    rng = random.Random(1)

    def bits(count: int) -> fmpz:
        return fmpz(rng.getrandbits(count) | 1)

    f, d, g, p = fmpz(2**89 - 1), fmpz(10**9 + 7) ** 13, bits(580), bits(350)
    D = d * f
    P2, P3 = bits(480), bits(480)
    P4 = -(3 * P2 + 5 * P3) * fmpz(pow(7, -1, int(f))) % f + f * bits(380)  # f | 3 P_2 + 5 P_3 + 7 P_4
    rows = []
    for _ in range(4):
        m, a, b = bits(18), bits(600), bits(600)
        c = -(a * P2 + b * P3 + m * (g * p * f + 1)) * fmpz(pow(int(P4), -1, int(D))) % D + D * bits(110)
        rows.append([g * m, a, b, c])
    matrix = fmpz_mat(rows)
    x = [fmpq(p, d) + fmpq(1, g * D), fmpq(P2, D), fmpq(P3, D), fmpq(P4, D)]
    rhs = fmpz_mat([[entry.p] for entry in (fmpq_mat(matrix) * fmpq_mat(4, 1, x)).entries()])
    assert fmpq_mat(matrix).solve(fmpq_mat(rhs)).entries() == x
    assert short_solution.short_solution(matrix, rhs, POINT, BITS) is None


@pytest.mark.parametrize("exponent", [-1500, -250, -1, 250])
@pytest.mark.parametrize("name", ["volterra_periodic_4", "paper_m2", "clebsch_first_flow"])
def test_long_initial_points_and_any_eps_give_the_points_of_fractions(name, exponent):
    phi = load(name).map.at(fmpq(10) ** exponent)
    for x in ([fmpq(1, 3**1300)] + [fmpq(0)] * (phi.dim - 1), [fmpq(7**900, 3**1300 + k) for k in range(phi.dim)]):
        point, x = IntegerPoint.from_rationals(x), tuple(x)
        for _ in range(2):
            point, x = phi.integer_step(point), phi.generic_step(x)
            assert point.rationals() == x


def test_threads_leave_the_precision_of_flint_as_it_was(monkeypatch):
    precision, interval = flint.ctx.prec, sys.getswitchinterval()
    monkeypatch.setattr(short_solution, "_LEAST_BITS", 300)
    phi, start = KahanMap(MEMBER, "1/10"), ["1/2", "-1/3", "2/5", 1, "3/4", "-2/7"]

    def last(_: int) -> IntegerPoint:
        *_, point = Orbit(phi, start, 22)
        return point.value

    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(4) as pool:
            points = list(pool.map(last, range(8)))
    finally:
        sys.setswitchinterval(interval)
    assert all(point == points[0] for point in points)
    assert flint.ctx.prec == precision


MEMBER = random_member_with_eigenvalues([1, -2, 3], 2).chosen.system
WAYS = {"by determinants": (KahanMap(MEMBER, "1/10"), "_by_digits"), "by digits": (None, "_by_determinant")}


@pytest.mark.parametrize(("map_over", "other_way"), WAYS.values(), ids=WAYS)
def test_both_ways_give_the_points_of_an_orbit(map_over, other_way, monkeypatch):
    """Members of the family have the relation between denominators; the Clebsch system does not."""
    map_over = map_over or load("clebsch_first_flow").map.at("3/11")
    monkeypatch.setattr(short_solution, other_way, lambda *_: None)
    monkeypatch.setattr(integer_steps, "solve_fraction_free", lambda *_: pytest.fail("the solution was not found"))
    monkeypatch.setattr(short_solution, "_LEAST_BITS", 900)
    x = tuple(POINT.from_rationals(map_over.point(["1/2", "-1/3", "2/5", 1, "3/4", "-2/7"])).rationals())
    point, found = IntegerPoint.from_rationals(x), 0
    while point.bits < 3000:
        found += short_solution.expected_bits(point) is not None
        image = map_over.integer_step(point)
        x = map_over.generic_step(x)
        assert image == IntegerPoint.from_rationals(x)
        assert image.preceding_denominator == point.denominator
        point = image
    assert found >= 4


def test_heights_that_grow_by_a_factor_are_not_expected_to_be_short():
    def point(bits: int, preceding_bits: int | None) -> IntegerPoint:
        point = IntegerPoint((fmpz(1),), fmpz(1) << bits)
        point.preceding_denominator = None if preceding_bits is None else fmpz(1) << preceding_bits
        return point

    assert short_solution.expected_bits(point(5000, 2500)) is None
    assert 5000 < short_solution.expected_bits(point(5000, 4990)) < 5100
    assert 6000 < short_solution.expected_bits(point(5000, 4200)) < 6100
    assert short_solution.expected_bits(point(5000, None)) > 6000
    assert short_solution.expected_bits(point(500, 490)) is None
