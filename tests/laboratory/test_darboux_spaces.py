"""Spaces of polynomials with a common cofactor: their ratios are conserved, and nothing is found where nothing is."""

import random
from math import comb

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.modular_matrices import combine, rank
from kahanmaps.documents.catalog import load
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import exponents_up_to, monomial_values
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace, darboux_spaces, gradient_rank

SMALL = 101


def first_map(file, eps=None):
    return Laboratory(file, (), eps).maps[0]


def values(space, x, prime):
    powers = monomial_values(x, space.degree, prime)
    return [sum(c * m for c, m in zip(vector, powers, strict=True)) % prime for vector in space.basis]


def is_common(map_, space):
    """Whether all ratios are the same at points and their images: P(x~) Q(x) = Q(x~) P(x)."""
    for x, image in map_.pairs(5):
        here, there = values(space, x, map_.prime), values(space, image, map_.prime)
        if any((there[k] * here[0] - there[0] * here[k]) % map_.prime for k in range(len(here))):
            return False
    return True


@pytest.mark.parametrize(
    ("name", "degree", "sizes"),
    [
        ("euler_top", 2, [3]),  # 1 - eps^2 a_j a_k x_i^2, i = 1, 2, 3
        ("zhukovski_volterra_1", 2, [2, 2]),
        ("lorenz", 3, []),
    ],
)
def test_spaces_of_known_maps(name, degree, sizes):
    map_ = first_map(load(name))
    spaces = darboux_spaces(map_, degree)
    assert all(is_common(map_, space) for space in spaces)
    if sizes is not None:
        assert sorted(len(space.basis) for space in spaces) == sizes
    assert gradient_rank(map_, spaces) <= load(name).catalog["codimension"]


def test_a_space_does_not_depend_on_the_basis_it_was_given_by():
    rng = random.Random(1)
    for size in (2, 3):
        vectors = [[rng.randrange(SMALL) for _ in range(comb(4, 2))] for _ in range(size)]
        weights = [[1, 5, 7][:size], [0, 1, 9][:size], [0, 0, 1]][:size]
        entry = DarbouxSpace.spanned_by(2, 2, vectors, SMALL)
        assert entry == DarbouxSpace.spanned_by(2, 2, combine(weights, vectors, SMALL), SMALL)


@given(st.randoms(use_true_random=False))
def test_no_members_of_a_pencil_are_sparser(rng):
    exponents, p = exponents_up_to(2, 2), 11
    dense, sparse = ([rng.randrange(p) for _ in exponents] for _ in range(2))
    for k in rng.sample(range(6), 3):
        sparse[k] = 0
    P, Q = sparse, [(a + 3 * b) % p for a, b in zip(dense, sparse, strict=True)]
    assume(rank([P, Q], p) == 2)
    supports = {
        tuple(k for k, (a, b) in enumerate(zip(P, Q, strict=True)) if (u * a + v * b) % p)
        for u, v in [(0, 1), *((1, v) for v in range(p))]
    }
    by_size = sorted(supports, key=lambda places: (sum(exponents[places[-1]]), len(places), places))
    basis = DarbouxSpace.spanned_by(2, 2, [P, Q], p).basis
    results = [tuple(k for k, entry in enumerate(member) if entry) for member in basis]
    assert results == by_size[:2]
    assert rank([*basis, P, Q], p) == rank(basis, p) == 2
