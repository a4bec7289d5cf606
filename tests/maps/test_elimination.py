"""Fraction-free elimination that takes out what minors share, against FLINT's solver, and inverse maps by elimination.

What the elimination finds is not believed without a proof: it is tried on minors that share everything, something or
nothing with the number that is offered.
"""

import random

import pytest
from flint import fmpq, fmpq_mat, fmpz, fmpz_mat
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.inverse import NotBirational, inverse_rows, why_not_birational
from kahanmaps.maps.orbits.elimination import solve_fraction_free
from kahanmaps.maps.orbits.integer_point import IntegerPoint


def random_integers(rows: int, columns: int, rng: random.Random, bits: int) -> fmpz_mat:
    return fmpz_mat(rows, columns, [rng.randint(-(2**bits), 2**bits) for _ in range(rows * columns)])


def divide(matrix: fmpz_mat, right: fmpz_mat, likely: fmpz) -> IntegerPoint | None:
    return solve_fraction_free(matrix, right, likely) or by_flint(matrix, right)


def by_flint(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    try:
        return IntegerPoint.from_rationals(fmpq_mat(matrix).solve(fmpq_mat(right)).entries())
    except ZeroDivisionError:
        return None


LONG_PRIME = fmpz(2**127 - 1)


@pytest.mark.parametrize("n", range(2, 9))
@pytest.mark.parametrize("consistent", [True, False], ids=["consistent", "inconsistent"])
def test_a_singular_system_has_no_solution_even_if_it_is_consistent(n, consistent):
    rng = random.Random(n)
    for rank in range(1, n):
        matrix = random_integers(n, rank, rng, 50) * random_integers(rank, n, rng, 50)
        right = matrix * random_integers(n, 1, rng, 50) if consistent else random_integers(n, 1, rng, 50)
        assert divide(matrix, right, LONG_PRIME) is None


@pytest.mark.parametrize("n", [4, 5, 6, 7, 8])
def test_minors_that_share_a_factor_by_chance_are_eliminated_as_well(n):
    """A diagonal block W I makes the first pivot W^2, which does not divide the later minors: gcds find what does."""
    rng = random.Random(n)
    W = fmpz(rng.getrandbits(400) | 1)
    for _ in range(10):
        matrix, right = random_integers(n, n, rng, 400), random_integers(n, 1, rng, 400)
        for i, j in ((i, j) for i in range(3) for j in range(3)):
            matrix[i, j] = W if i == j else fmpz(0)
        solution = solve_fraction_free(matrix, right, W)
        assert solution is not None
        assert solution == by_flint(matrix, right)


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


@pytest.mark.parametrize("n", range(1, 9))
@pytest.mark.parametrize(("W", "offered"), CONTENTS.values(), ids=CONTENTS.keys())
def test_minors_with_common_content_are_solved_correctly(n, W, offered):
    """A matrix and a right side, congruent modulo W to a matrix of rank 2 and a column of its image."""
    rng = random.Random(n)
    for _ in range(5):
        plane = random_integers(n, 2, rng, 6)
        matrix = plane * random_integers(2, n, rng, 6) + random_integers(n, n, rng, 6) * W
        right = plane * random_integers(2, 1, rng, 6) + random_integers(n, 1, rng, 6) * W
        assert divide(matrix, right, offered) == by_flint(matrix, right)


# Of the six minors of order 3 the elimination looks at every second one and finds d in all of them; the others do not
# contain it, so that the divisions by d are not exact.
D = LONG_PRIME
DECEPTIVE_BLOCKS = {"regular": [[D, 1], [D**2, 2 * D]], "singular": [[D, 1], [D**2, D]]}


@pytest.mark.parametrize("block", DECEPTIVE_BLOCKS.values(), ids=DECEPTIVE_BLOCKS.keys())
@pytest.mark.parametrize("right", [(1, 1, 0, 0), (1, 2, int(D), 5), (0, 0, int(D), int(D) ** 2)], ids=len)
def test_divisions_that_are_not_exact_do_no_harm(block, right):
    matrix = fmpz_mat([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, *block[0]], [0, 0, *block[1]]])
    column = fmpz_mat(4, 1, list(right))
    assert divide(matrix, column, D) == by_flint(matrix, column)


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
