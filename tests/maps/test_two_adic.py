"""Short solutions of linear systems with integers, modulo powers of 2, against FLINT's solver.

Specified here: what is found is the solution in lowest terms, also where the determinant, the denominator or
coordinates have many factors in common, small primes among them; a solution that is longer than said, and a singular
system, are never answered wrongly.
"""

import random
from itertools import combinations
from math import prod

import pytest
from flint import fmpq_mat, fmpz, fmpz_mat

from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.two_adic import short_solution


def by_flint(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    try:
        return IntegerPoint.from_rationals(fmpq_mat(matrix).solve(fmpq_mat(right)).entries())
    except ZeroDivisionError:
        return None


def with_solution(numerators: list[int], W: int, rng: random.Random, bits: int) -> tuple[fmpz_mat, fmpz_mat]:
    """A system of random integers that numerators / W solves: its rows times the numerators are multiples of W."""
    n, X = len(numerators), numerators
    rows = []
    for _ in range(n):
        row = [W * rng.randint(-(2**bits), 2**bits) for _ in range(n)]
        for i, j in combinations(range(n), 2):
            c = rng.randint(-(2**bits), 2**bits)
            row[i], row[j] = row[i] + c * X[j], row[j] - c * X[i]
        rows.append(row)
    right = [sum(a * x for a, x in zip(row, X, strict=True)) // W for row in rows]
    return fmpz_mat(rows), fmpz_mat(n, 1, right)


def long(rng: random.Random, *factors: int) -> int:
    return prod(factors) * (rng.getrandbits(200) | 1)


@pytest.mark.parametrize("n", [2, 3, 6])
@pytest.mark.parametrize("of_W", [1, 2**30, 3**2 * 5 * 7, 2**127 - 1])
@pytest.mark.parametrize("of_X", [1, 2**20 * 3, 5 * (2**127 - 1), 0])
def test_the_solution_is_found_in_lowest_terms(n, of_W, of_X):
    rng = random.Random(f"{n} {of_W} {of_X}")
    for _ in range(3):
        # All coordinates but the last have factors in common with the denominator.
        X = [rng.choice([1, -1]) * long(rng, of_X) for _ in range(n - 1)] + [long(rng)]
        matrix, right = with_solution(X, long(rng, of_W), rng, 20)
        expected = by_flint(matrix, right)
        assert short_solution(matrix, right, expected.bits) == expected
        assert short_solution(matrix, right, 2 * expected.bits) == expected


@pytest.mark.parametrize("n", [3, 4, 6])
def test_a_prime_that_one_combination_lacks_is_found_at_a_coordinate(n):
    # The weights of the combination are 1, 10, 100, ...; the first coordinate alone lacks the prime as well.
    rng, p = random.Random(n), 10_007
    for _ in range(3):
        X = [p * long(rng), *(long(rng) for _ in range(n - 1))]
        X[1] = -10 * X[2] - sum(10 ** (k - 1) * X[k] for k in range(3, n)) + p * long(rng)
        matrix, right = with_solution(X, long(rng, p**2), rng, 20)
        expected = by_flint(matrix, right)
        assert expected.denominator % p == 0
        assert short_solution(matrix, right, expected.bits) == expected


def test_a_solution_may_be_much_shorter_than_the_entries():
    rng = random.Random(1)
    matrix, right = with_solution([3, -1, 2, 5], 7, rng, 3000)
    assert short_solution(matrix, right, 10) == by_flint(matrix, right)


@pytest.mark.parametrize("bits", [1, 8, 200])
@pytest.mark.parametrize("n", [2, 3, 5, 7])
def test_a_longer_solution_is_never_answered_wrongly(n, bits):
    rng = random.Random(f"{n} {bits}")
    answered = set()
    for allowed in range(0, 4000, 200):
        matrix, right = (fmpz_mat(n, k, [rng.randint(-(2**bits), 2**bits) for _ in range(n * k)]) for k in (n, 1))
        expected, found = by_flint(matrix, right), short_solution(matrix, right, allowed)
        assert found in (None, expected)
        if expected is not None and expected.bits <= allowed:
            answered.add(found is not None)
    assert answered == {True}


@pytest.mark.parametrize("consistent", [True, False], ids=["consistent", "inconsistent"])
@pytest.mark.parametrize("n", range(2, 8))
def test_a_singular_system_has_no_solution_even_if_it_is_consistent(n, consistent):
    rng = random.Random(n)

    def drawn(rows: int, columns: int) -> fmpz_mat:
        return fmpz_mat(rows, columns, [rng.randint(-(2**50), 2**50) for _ in range(rows * columns)])

    for rank in range(1, n):
        matrix = drawn(n, rank) * drawn(rank, n)
        assert short_solution(matrix, matrix * drawn(n, 1) if consistent else drawn(n, 1), 500) is None


def test_a_determinant_with_very_many_factors_2_is_left_to_others():
    matrix, right = fmpz_mat([[1, 0], [0, fmpz(2) ** 100]]), fmpz_mat([[1], [1]])
    assert short_solution(matrix, right, 200) is None
