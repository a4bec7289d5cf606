"""Cofactors, their products, and the polynomials that have them."""

import pytest
from helpers import DIMENSION

from kahanmaps.documents.catalog import load, names
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.darboux.cofactors import (
    DETERMINANT,
    Cofactor,
    CofactorProduct,
    Sample,
    cofactor_space,
    determinant_factors,
    determinant_polynomial,
    points_needed,
)

SMALL_ONES = [name for name in names() if DIMENSION[name] <= 4]


@pytest.mark.parametrize("name", SMALL_ONES[::4])
def test_the_factors_of_the_determinant_make_up_its_cofactor(name):
    """det(I - eps f') is a product of the factors and of numbers that depend on eps alone, even in eps or not."""
    laboratory = Laboratory(load(name))
    map_ = laboratory.maps[0]
    D = determinant_polynomial(laboratory.map)
    complete = Cofactor("D", 1, D)
    for x, image in map_.pairs(3):
        assert complete.sides(map_, x, image) == DETERMINANT.sides(map_, x, image)
    context = D.context()
    others = D
    for entry in determinant_factors(laboratory.map):
        assert entry.polynomial.subs({"eps": 0}) == context.constant(1)
        while not (others % entry.polynomial):
            others = others // entry.polynomial
    assert all(not any(monomial[: map_.dim]) for monomial in others.monoms())


def test_polynomials_with_a_given_cofactor():
    map_ = Laboratory(load("lotka_volterra")).maps[0]
    sample = Sample.of(map_, [DETERMINANT], points_needed(2, 3))
    # x y has the cofactor det dPhi, constants have 1
    assert cofactor_space(sample, CofactorProduct((1,), 1), 2).basis == [[0, 0, 0, 0, 1, 0]]
    assert cofactor_space(sample, CofactorProduct((0,), 0), 2).basis == [[1, 0, 0, 0, 0, 0]]
    assert cofactor_space(sample, CofactorProduct((2,), 2), 3).basis == []
