"""Spaces of polynomials with a common cofactor: their ratios are conserved, and nothing is found where nothing is."""

from __future__ import annotations

import random
from math import comb

import pytest
from flint import nmod_mat
from search_helpers import random_system, system

from kahanmaps.documents.catalog import load
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import combine, echelon, exponents_up_to, monomial_values
from kahanmaps.laboratory.preserve.darboux import darboux_spaces as module
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import (
    DarbouxSpace,
    _is_darboux,
    _of_rank_two,
    darboux_spaces,
    gradient_rank,
)

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
        ("nahm_tetrahedral", 3, [2]),
        ("weierstrass", 3, [2]),
        ("zhukovski_volterra_1", 2, [2, 2]),
        ("paper_m2", 4, None),
        ("lorenz", 3, []),
    ],
)
def test_spaces_of_known_maps(name, degree, sizes):
    map_ = first_map(load(name))
    found = darboux_spaces(map_, degree)
    assert all(is_common(map_, space) for space in found)
    if sizes is not None:
        assert sorted(len(space.basis) for space in found) == sizes
    assert gradient_rank(map_, found) <= load(name).catalog["codimension"]


def test_multiples_of_what_is_known_are_not_found_again():
    map_ = first_map(load("euler_top"))
    known = darboux_spaces(map_, 2)
    again = darboux_spaces(map_, 3, known)
    assert again == []
    assert gradient_rank(map_, known) == 2


def test_spaces_that_share_a_sum_with_known_ones_are_left_to_cofactors():
    # x1 x3 and x2 x4 have different denominators, but (x2 - x4)^2 + 4 x2 x4 and so on are not independent of s^2
    map_ = first_map(load("volterra_periodic_4"))
    affine = DarbouxSpace.spanned_by(4, 1, [[1, 0, 0, 0, 0], [0, 1, 1, 1, 1]], map_.prime)
    assert is_common(map_, affine)
    assert darboux_spaces(map_, 2, [affine]) == []


def test_a_perturbed_basis_is_not_darboux():
    map_ = first_map(load("euler_top"))
    [space] = darboux_spaces(map_, 2)
    assert _is_darboux(map_, space.basis, 2)
    wrong = [[*space.basis[0][:-1], (space.basis[0][-1] + 1) % map_.prime], *space.basis[1:]]
    assert not _is_darboux(map_, wrong, 2)
    assert not is_common(map_, DarbouxSpace(3, 2, wrong))


def test_random_systems_have_none():
    assert darboux_spaces(first_map(random_system(3, 1)), 3) == []


def test_a_space_does_not_depend_on_the_basis_it_was_given_by():
    rng = random.Random(1)
    for size in (2, 3):
        vectors = [[rng.randrange(SMALL) for _ in range(comb(4, 2))] for _ in range(size)]
        weights = [[1, 5, 7][:size], [0, 1, 9][:size], [0, 0, 1]][:size]
        one = DarbouxSpace.spanned_by(2, 2, vectors, SMALL)
        assert one == DarbouxSpace.spanned_by(2, 2, combine(weights, vectors, SMALL), SMALL)


def test_of_a_pencil_the_sparsest_come_first():
    # x^2 + y^2 and 1 + x^2 + y^2
    x2, y2 = exponents_up_to(2, 2).index((2, 0)), exponents_up_to(2, 2).index((0, 2))
    squares = [int(k in (x2, y2)) for k in range(6)]
    space = DarbouxSpace.spanned_by(2, 2, [squares, [1, *squares[1:]]], SMALL)
    assert space.basis == [[1, 0, 0, 0, 0, 0], squares]
    assert set(space.support) == {(0, 0), (2, 0), (0, 2)}


def test_multiples():
    space = DarbouxSpace(2, 1, [[1, 0, 0], [0, 1, 0]])
    assert len(space.multiples(2, SMALL)) == 5  # 1, x, y, x^2, x y
    assert space.multiples(0, SMALL) == []


def test_too_many_dimensions_are_not_searched(monkeypatch):
    monkeypatch.setattr(module, "_antisymmetric", lambda *_: pytest.fail("the relations span too many dimensions"))
    assert darboux_spaces(first_map(load("lagrange_top")), 4, []) == []


def test_linear_maps():
    map_ = first_map(system("x y", "x", "-y"))
    [space] = darboux_spaces(map_, 2)
    assert space.basis[0] == [1, 0, 0, 0, 0, 0]
    assert [k for k, entry in enumerate(space.basis[1]) if entry] == [exponents_up_to(2, 2).index((1, 1))]


@pytest.mark.parametrize(("others", "size"), [(1, 4), (2, 5), (3, 6)])
def test_the_only_combination_of_rank_two_is_found(others, size):
    """u wedge v among random skew matrices, mixed with them: its row space is that of u and v, in the given basis."""
    prime, rng = 2**61 - 1, random.Random(others)

    def vector(length):
        return [rng.randrange(prime) for _ in range(length)]

    def mixed(matrices, weights):
        total = matrices[0] * weights[0]
        for matrix, weight in zip(matrices[1:], weights[1:], strict=True):
            total = total + matrix * weight
        return total

    u, v = vector(size), vector(size)
    forms = [nmod_mat(size, size, [u[i] * v[j] - u[j] * v[i] for i in range(size) for j in range(size)], prime)]
    for _ in range(others):
        full = nmod_mat(size, size, vector(size * size), prime)
        forms.append(full - full.transpose())
    solutions = [mixed(forms, vector(len(forms))) for _ in forms]
    fresh = [vector(size + 2) for _ in range(size)]
    expected = echelon(combine([u, v], fresh, prime), prime)
    found = _of_rank_two(solutions, fresh, prime)
    if (others, size) == (1, 4):  # the Pfaffian has two zeros on a line, and none of them is the only one
        assert found == []
    else:
        assert found == [expected]
    assert _of_rank_two(solutions[:1], fresh, prime) == []
