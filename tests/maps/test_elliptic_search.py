"""Curves behind points modulo a prime, and the forms that sections are, on curves that are made up.

Specified here: sections of every degree are found from coordinates that are some of them; bases are bases; primes that
all coordinates have in common are seen.
"""

import random

import pytest
from flint import fmpq, fmpq_mat, nmod

import kahanmaps.maps.orbits.relations.elliptic_search as search
from kahanmaps.maps.orbits.relations.sections import _of_multiples, forms
from kahanmaps.maps.somos import around, first_terms

P = 2**61 - 1
WARD = tuple(first_terms(fmpq(2), fmpq(3), fmpq(5)))


def modular(length):
    first, others = first_terms(*(nmod(x, P) for x in (12345, 678910, 1112131415)))
    return around(first, length), around(others, length, first)


def points_on_a_curve(degree, size, length):
    """Points whose coordinates are random combinations of the sections."""
    W, U = modular(length + 4)
    rng = random.Random(10 * degree + size)
    rows = [[rng.randrange(P) for _ in range(degree)] for _ in range(size)]
    points = []
    for n in range(2, length):
        values = [sum((f * c for f, c in zip(forms(degree, W, U, n), row, strict=True)), nmod(0, P)) for row in rows]
        points.append([int(value / values[-1]) for value in values])
    return points


@pytest.mark.parametrize(
    ("degree", "size"),
    [(2, 2), (3, 3), (4, 3), (4, 4), (5, 3), (5, 4), (5, 5), (6, 3), (6, 6), (7, 3), (7, 5), (7, 7), (8, 4), (8, 8)],
)
def test_curves_of_any_degree(degree, size):
    points = points_on_a_curve(degree, size, 150)
    result = None
    for needed in search.points_needed(size - 1):
        try:
            result = result or search.curve(points[:needed], P)
        except ArithmeticError:
            continue
    assert result is not None
    assert result.sections.degree == degree
    assert search.curve(points[: result.sections.points_used], P, result.sections) == result


@pytest.mark.parametrize("degree", range(2, 8))
def test_sections_of_multiples_are_a_basis_and_belong_to_their_degree(degree):
    W, U = (around(WARD[0], 20), around(WARD[1], 20, WARD[0]))
    rows = [
        [*forms(degree + 1, W, U, n), *(U[n] * entry for entry in _of_multiples(degree, W, n))] for n in range(2, 18)
    ]
    assert len(rows[0]) == 2 * degree + 1
    assert fmpq_mat(rows).rank() == degree + 1
    assert fmpq_mat([row[degree + 1 :] for row in rows]).rank() == degree
