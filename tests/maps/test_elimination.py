"""Fraction-free elimination against FLINT's solver, and inverse maps by elimination."""

import random

import pytest
from flint import fmpq, fmpq_mat, fmpz_mat
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.inverse import NotBirational, inverse_rows, why_not_birational
from kahanmaps.maps.orbits.elimination import solve_fraction_free
from kahanmaps.maps.orbits.integer_point import IntegerPoint


def random_integers(rows: int, columns: int, rng: random.Random, bits: int) -> fmpz_mat:
    return fmpz_mat(rows, columns, [rng.randint(-(2**bits), 2**bits) for _ in range(rows * columns)])


def by_flint(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    try:
        return IntegerPoint.from_rationals(fmpq_mat(matrix).solve(fmpq_mat(right)).entries())
    except ZeroDivisionError:
        return None


@pytest.mark.parametrize("n", range(2, 9))
@pytest.mark.parametrize("consistent", [True, False], ids=["consistent", "inconsistent"])
def test_a_singular_system_has_no_solution_even_if_it_is_consistent(n, consistent):
    rng = random.Random(n)
    for rank in range(1, n):
        matrix = random_integers(n, rank, rng, 50) * random_integers(rank, n, rng, 50)
        right = matrix * random_integers(n, 1, rng, 50) if consistent else random_integers(n, 1, rng, 50)
        assert solve_fraction_free(matrix, right) is None


@pytest.mark.parametrize("n", range(1, 9))
@pytest.mark.parametrize("prime", [1, 2**40, 2**127 - 1])
def test_a_regular_system_is_solved_in_lowest_terms_even_if_its_minors_share_factors(n, prime):
    """A matrix and a right side, congruent to a matrix of rank 2 and a column of its image modulo a number."""
    rng = random.Random(n)
    for _ in range(10):
        plane = random_integers(n, 2, rng, 6)
        matrix = plane * random_integers(2, n, rng, 6) + random_integers(n, n, rng, 6) * prime
        right = plane * random_integers(2, 1, rng, 6) + random_integers(n, 1, rng, 6) * prime
        assert solve_fraction_free(matrix, right) == by_flint(matrix, right) is not None


def test_a_pivot_that_is_0_is_left_to_flint():
    assert solve_fraction_free(fmpz_mat([[0, 1, 1], [0, 2, 1], [1, 0, 0]]), fmpz_mat([[1], [2], [3]])) is None


def made(variables, *image):
    names = [*variables.split(), "eps"]
    return explicit_map(names[:-1], [parse_rational_function(text, names) for text in image])


BIRATIONAL = [
    made("x y", "y", "-x + y^2 + eps"),
    made("x y", "x^2/y", "x/y"),
    made("x y", "(x^2 + y^2)/x", "y*(x^2 + y^2)/x^2"),  # no equation is linear in an unknown: resultants
    made("x y", "eps*x/(x^2 + y^2)", "y/(x^2 + y^2)"),
    made("x y z", "x + eps*(y + x*z)^2", "y + x*z", "z + x^2"),
    made("x y z", "x + y^2", "y + z^2", "z + (x + y^2)^2"),
    made("x y z w", "y", "z", "w", "(z*x + y*w + 1)/(x*y + z)"),
    # FLINT's Python cannot order the factors here modulo primes of 63 bits
    made("x y", "(x*y + 1)/(x + y)", "(x*y^2 - x*y - y^2 + y)/(4*x + 4*y)"),
]


@pytest.mark.parametrize("map_", BIRATIONAL, ids=str)
@given(data=st.data())
def test_the_inverse_leads_back_from_both_sides(map_, data):
    start = [fmpq(data.draw(st.integers(2, 30)), data.draw(st.integers(1, 9))) for _ in range(map_.dim)]
    eps = fmpq(data.draw(st.integers(1, 9)), 7)
    over = map_.at(eps)
    if over.determinant(start) == 0:
        return
    image = over.step(start)
    if over.inverse.determinant(image) != 0:
        assert over.inverse.step(image) == tuple(start)
    assert why_not_birational(map_.rows) == ""


@pytest.mark.parametrize(
    ("map_", "sentence"),
    [
        (made("x y", "x^2", "y"), "at least 2 preimages"),
        (made("x y", "x*y", "x + y"), "at least 2 preimages"),
        (made("x y", "x*(x + y)/(x - y + 1)", "y*(x + y)/(x - y + 1)"), "at least 2 preimages"),
        (made("x y", "x^3 + y", "y^3 + x"), "at least 9 preimages"),
        (made("x y z", "x^2 + y", "y^2 + z", "z^2 + eps*x"), "at least 8 preimages"),
        (made("x y", "x + y", "(x + y)^2"), "not dominant"),
        (made("x y", "1", "y"), "not dominant"),
        (made("x y", "x + y", "x + y"), "not dominant"),
    ],
    ids=str,
)
def test_a_map_that_is_not_birational_is_found_out(map_, sentence):
    assert sentence in why_not_birational(map_.rows)
    with pytest.raises(NotBirational, match=sentence):
        inverse_rows(map_.rows)
