"""Ranks of relations and densities of many members modulo a small prime are those of one member at a time."""

from __future__ import annotations

import random
from math import comb

import numpy as np
import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.maps.residues.families import Family
from kahanmaps.maps.residues.relations import ranks


def numbers(name, symbols, members, top, by, prime=307):
    map_ = map_with_symbols(load(name), symbols)
    family, rng = Family(map_, prime), random.Random(1)
    found = np.max([ranks(family, np.array(members), None, top, rng, by) for _ in range(4)], axis=0)
    return [[comb(map_.dim + d, d) - rank for d, rank in enumerate(row, 1)] for row in found.tolist()]


@pytest.mark.parametrize(
    ("name", "symbols", "top", "relations", "densities"),
    [
        ("euler_top", ["a1"], 4, [0, 2, 8, 19], [0, 0, 0, 6]),  # orbits on an intersection of two quadrics
        ("lyness", ["a"], 4, [0, 0, 1, 3], [0, 1, 2, 2]),  # on cubics; x y, and its product with the integral
        ("henon_heiles", ["c"], 2, [0, 0], [0, 1]),
    ],
)
def test_relations_and_densities_are_those_that_are_known(name, symbols, top, relations, densities):
    assert numbers(name, symbols, [[3], [7]], top, "integrals") == [relations, relations]
    assert numbers(name, symbols, [[3], [7]], top, "density") == [densities, densities]


def test_members_are_told_apart():
    # without the term with b1 the gyrostat has a second integral
    assert numbers("zhukovski_volterra_2", ["b1"], [[0], [5]], 2, "integrals") == [[0, 2], [0, 1]]
