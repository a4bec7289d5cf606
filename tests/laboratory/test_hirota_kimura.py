"""Relations along orbits: the dimensions of the literature, none for systems without integrals, points where orbits
close."""

from __future__ import annotations

from math import comb
from types import SimpleNamespace

import pytest
from flint import nmod_mat
from helpers import quick
from search_helpers import random_system, system

from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.structured_facts import relation_functions, relations
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint, monomial_values
from kahanmaps.laboratory.preserve import hirota_kimura as module
from kahanmaps.laboratory.preserve.hirota_kimura import (
    OrbitRelations,
    Profile,
    hirota_kimura_basis,
    orbit_profile,
    relations_on_orbit,
    span_of_relations,
)

# Sets of more than 300 functions are measured by the tests of the catalogue.
RELATIONS = [
    (name, k)
    for name in names()
    for k, known in enumerate(relations(load(name).catalog, load(name).system.variables))
    if len(known.functions) <= 300
]
# The degree in which all integrals show, where all degrees would take long.
SHOWS = {"clebsch_first_flow": 2, "kirchhoff_case": 2, "lagrange_top": 2, "so4_euler_manakov": 2, "three_wave": 3}
SHOWS |= {"henon_heiles": 4, "paper_m2": 4, "zhukovski_volterra_2": 4, "lorenz": 6}
SHOWS |= {"paper_m3": 3, "paper_m3_irreducible": 3, "kirchhoff_generic": 3, "volterra_periodic_5": 3}


def maps(file, eps=None, seed=0):
    return Laboratory(file, (), eps, seed).maps


@pytest.mark.parametrize(("name", "k"), quick(RELATIONS, RELATIONS[::2]))
def test_bases_have_the_dimensions_of_the_literature(name, k):
    file = load(name)
    known = relations(file.catalog, file.variables)[k]
    labels = [str(one) for one in known.functions]
    found = hirota_kimura_basis(maps(file), known.functions, labels)
    assert (found.dimension, found.agree, found.period) == (known.dimension, True, None)
    if known.text.startswith("degree <= "):
        degree = int(known.text.removeprefix("degree <= "))
        assert len(relations_on_orbit(maps(file)[0], degree).vectors) == known.dimension


@pytest.mark.parametrize("name", names())
def test_codimensions_are_those_of_the_catalogue(name):
    file = load(name)
    found = orbit_profile(maps(file), max_degree=SHOWS.get(name))
    assert found.codimension == file.catalog["codimension"]
    assert (found.agree, found.complete, found.period) == (True, True, None)
    assert list(found.codimensions) == sorted(found.codimensions)


@pytest.mark.parametrize(("name", "degree"), [("euler_top", 3), ("lorenz", 3), ("three_wave", 2)])
def test_as_many_points_as_are_independent_make_all_relations(name, degree):
    map_, other = maps(load(name))[0], maps(load(name))[0]  # the same orbit
    every = relations_on_orbit(map_, degree)
    independent = every.kernel.ncols() - every.dimension
    again = relations_on_orbit(other, degree, independent)
    assert (again.vectors, again.normals, again.end) == (every.vectors, every.normals, every.end)
    # With a point less there are relations too many, so that all points are used, of another orbit.
    assert relations_on_orbit(other, degree, independent - 1).dimension == every.dimension


@pytest.mark.parametrize(
    "independent",  # monomials of degree at most d
    [
        lambda d: comb(d + 2, 2),  # in the plane
        lambda d: comb(d + 3, 3) - comb(d + 1, 3),  # on a quadric in dimension 3
        lambda d: 3 * d + 1,  # on the twisted cubic
    ],
)
def test_macaulays_bound_holds_and_is_reached(independent):
    assert all(module._most(independent(d), d) >= independent(d + 1) for d in range(1, 9))
    assert module._most(independent(8), 8) == independent(9)
    assert module._most(independent(8) - 1, 8) < independent(9)


@pytest.mark.parametrize("dim", [2, 3, 4])
def test_random_systems_have_no_relations(dim):
    found = orbit_profile(maps(random_system(dim, dim)), max_degree=5)
    assert found.nullities == (0,) * 5
    assert (found.codimension, found.first_degree, found.degree) == (0, None, 5)


def test_a_perturbed_system_loses_its_relations():
    assert orbit_profile(maps(system("x y", "y", "-x + x^2"))).nullities == (0, 0, 1)
    assert orbit_profile(maps(system("x y", "y + x^2/100", "-x + x^2")), max_degree=4).nullities == (0,) * 4


def test_relations_vanish_along_the_orbit_and_not_along_another():
    map_ = maps(load("euler_top"))[0]
    map_.random_point = lambda: (1, 2, 3)
    found = relations_on_orbit(map_, 2)

    def vanish(start):
        map_.random_point = lambda: start
        return all(
            sum(c * m for c, m in zip(vector, monomial_values(x, 2, map_.prime), strict=True)) % map_.prime == 0
            for vector in found.vectors
            for x in map_.orbit(20)
        )

    assert (len(found.vectors), found.codimension) == (2, 2)
    assert vanish((1, 2, 3))
    assert not vanish((1, 2, 4))


def test_the_relations_of_all_orbits_span_a_space():
    # 1 - eps^2 a2 a3 x1^2 and its cyclic images; two relations for each orbit
    assert len(span_of_relations(maps(load("euler_top"))[0], 2)) == 3
    assert span_of_relations(maps(load("lorenz"))[0], 3) == []


def test_which_coefficients_are_integrals():
    file = load("volterra_periodic_3")
    texts = ["x1 + x2 + x3", "x1 + x2", "x3", "1"]
    found = hirota_kimura_basis(maps(file), relation_functions(texts, file.variables), texts)
    # the first is the sum of the next two on every orbit, and equal to a number that depends on the orbit
    assert found.dimension == 2
    assert sum(row.count(False) for row in found.constant) > 0
    independent = hirota_kimura_basis(maps(file), relation_functions(texts[1:3], file.variables), texts[1:3])
    assert (independent.dimension, independent.constant) == (0, ())
    assert found.to_json()["integrals"] == [[not same for same in row] for row in found.constant]


@pytest.mark.parametrize(
    ("file", "eps", "period"),
    [
        (system("x y", "y", "-x + x^2"), 1, 4),
        (load("henon_heiles"), 1, 4),
        (load("henon_heiles", {"c": 5}), -1, 4),
        (system("x", "1 + x^2"), "1/2", 4),  # x = tan of an angle, each step an eighth of a turn
        (system("x y", "y", "-3*x"), "1/3", 6),  # a sixth of a turn: conics go through the points
        (system("x y", "y", "-3*x"), 1, 3),
        (system("x y z", "0", "0", "0"), None, 1),
    ],
)
def test_orbits_that_close_are_points(file, eps, period):
    found = orbit_profile(maps(file, eps))
    assert (found.period, found.codimension, found.agree) == (period, file.system.dim, True)
    variables = relation_functions("degree <= 1", file.variables)
    assert hirota_kimura_basis(maps(file, eps), variables, ["f"] * len(variables)).period in (period, None)


def test_the_time_and_the_number_of_unknowns_are_limited():
    top = load("lagrange_top")
    assert not orbit_profile(maps(top), seconds=0.0).complete
    assert orbit_profile(maps(top), seconds=0.0).nullities == ()
    assert orbit_profile(maps(top), max_degree=1).complete


def test_there_are_not_too_many_unknowns(monkeypatch):
    monkeypatch.setattr(module, "MAX_UNKNOWNS", 30)
    asked = orbit_profile(maps(load("lorenz")), max_degree=6)
    assert (asked.nullities, asked.complete, asked.is_settled) == ((0, 0, 0), False, False)  # 35 of degree 4
    # nothing more was asked for than the dimension allows
    assert orbit_profile(maps(load("lorenz"))).complete


def test_progress_is_told():
    said = []
    orbit_profile(maps(load("euler_top")), progress=said.append)
    assert said == ["relations of degree 1 along orbits", "relations of degree 2 along orbits"]


def test_a_map_without_values_has_no_profile():
    with pytest.raises(NoPoint):
        orbit_profile(maps(system("x y", "x", "3*y"), 1))


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in names() if load(name).system.dim >= 5])
def test_higher_degrees_show_no_more(name):
    """The relations of degree d that are multiples of those of degree d - 1 add nothing to the codimension."""
    file = load(name)
    found = orbit_profile(maps(file, seed=3), max_degree=5, seconds=100)
    assert (found.codimension, found.degree) == (file.catalog["codimension"], 5)


@pytest.mark.slow
def test_small_primes_agree_where_orbits_are_long_enough():
    file = load("euler_top")
    for prime in (10007, 20011, 30011):
        map_ = ModularMap(with_symbols(file), prime, 5)
        assert len(relations_on_orbit(map_, 2).vectors) == 2


@pytest.mark.parametrize(
    ("nullities", "codimensions", "expected"),
    [
        ((), (), (0, 0, None, False)),
        ((0, 1, 3), (0, 1, 1), (3, 1, 2, False)),
        ((0, 0, 1, 4), (0, 0, 1, 1), (4, 1, 3, True)),
        ((0, 0, 1, 4), (0, 0, 1, 2), (4, 2, 3, False)),
        ((1, 2, 3, 4), (2, 2, 2, 1), (4, 2, 1, False)),
        ((0, 0, 0, 0, 0), (0, 0, 0, 0, 0), (5, 0, None, True)),
    ],
)
def test_a_profile_is_settled_where_the_last_of_four_degrees_shows_no_more(nullities, codimensions, expected):
    found = Profile(3, nullities, codimensions, None, True, True)
    assert (found.degree, found.codimension, found.first_degree, found.is_settled) == expected


@pytest.mark.parametrize(
    ("degrees", "expected", "with_known"),
    [  # for each degree and map: how many vectors, the codimension, the period
        ([[(0, 0, None), (0, 0, None)], [(1, 1, None), (1, 1, None)]], ((0, 1), (0, 1), None, True), 2),
        ([[(1, 1, None), (0, 0, None)], [(1, 1, None), (1, 1, None)]], ((0, 1), (0, 1), None, False), 2),
        ([[(0, 0, None), (0, 0, None)], [(1, 1, None), (1, 0, None)]], ((0, 1), (0, 0), None, False), 1),
        ([[(2, 2, None), (2, 2, None)], [(9, 2, None), (9, 2, None)]], ((2,), (2,), None, True), 2),  # orbits on curves
        (
            [[(2, 2, 6), (2, 2, 6)], [(9, 3, 6), (9, 3, 6)]],
            ((2, 9), (2, 3), 6, True),
            3,
        ),  # orbits that close are points
        ([[(1, 1, 5), (1, 1, 6)], [(4, 1, 6), (4, 1, 6)]], ((1, 4), (1, 1), 6, True), 2),
    ],
)
def test_a_profile_has_the_least_numbers_of_all_maps(degrees, expected, with_known, monkeypatch):
    maps = [SimpleNamespace(dim=3, prime=101, step=lambda x: x, random_point=lambda: (1, 2, 3)) for _ in range(2)]

    def along(map_, degree, most=None):
        count, codimension, period = degrees[degree - 1][next(k for k, one in enumerate(maps) if one is map_)]
        return OrbitRelations(nmod_mat(0, 0, 101), count, [[1, 0, 0], [0, 1, 0], [0, 0, 1]][:codimension], period, ())

    monkeypatch.setattr(module, "relations_on_orbit", along)
    found = orbit_profile(maps, known=lambda map_, point: [[1, 1, 0]], max_degree=2)
    assert (found.nullities, found.codimensions, found.period, found.agree) == expected
    assert (found.complete, found.with_known) == (True, with_known)
