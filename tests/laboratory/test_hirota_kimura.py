"""Relations along orbits: the dimensions of the literature, none for systems without integrals, points where orbits
close."""

import pytest
from helpers import quick
from search_helpers import system

from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.structured_facts import relation_functions, relations
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.hirota_kimura import hirota_kimura_basis, orbit_profile, relations_on_orbit

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


@pytest.mark.parametrize(("name", "k"), quick(RELATIONS, RELATIONS[::3]))
def test_bases_have_the_dimensions_of_the_literature(name, k):
    file = load(name)
    known = relations(file.catalog, file.variables)[k]
    labels = [str(entry) for entry in known.functions]
    basis = hirota_kimura_basis(maps(file), known.functions, labels)
    assert (basis.dimension, basis.agree, basis.period) == (known.dimension, True, None)
    if known.text.startswith("degree <= "):
        degree = int(known.text.removeprefix("degree <= "))
        assert len(relations_on_orbit(maps(file)[0], degree).vectors) == known.dimension


@pytest.mark.parametrize(("name", "degree"), [("euler_top", 4), ("volterra_periodic_3", 5), ("paper_m2", 4)])
def test_multiples_of_relations_of_lower_degrees_may_be_left_out(name, degree):
    leading = frozenset()
    for d in range(1, degree + 1):
        map_, other = maps(load(name))[0], maps(load(name))[0]  # the same orbit
        every, some = relations_on_orbit(map_, d), relations_on_orbit(other, d, leading=leading)
        assert (some.dimension, some.normals, some.point) == (every.dimension, every.normals, every.point)
        assert leading <= some.leading <= every.leading
        leading = some.leading
    assert some.form.ncols() < every.form.ncols()


def test_what_leads_no_relation_of_this_orbit_is_not_left_out():
    map_ = maps(load("lorenz"))[0]
    assert relations_on_orbit(map_, 3, leading=frozenset({(1, 0, 0)})).dimension == 0


def test_a_perturbed_system_loses_its_relations():
    assert orbit_profile(maps(system("x y", "y", "-x + x^2"))).nullities == (0, 0, 1)
    assert orbit_profile(maps(system("x y", "y + x^2/100", "-x + x^2")), max_degree=4).nullities == (0,) * 4


def test_which_coefficients_are_integrals():
    file = load("volterra_periodic_3")
    texts = ["x1 + x2 + x3", "x1 + x2", "x3", "1"]
    basis = hirota_kimura_basis(maps(file), relation_functions(texts, file.variables), texts)
    # the first is the sum of the next two on every orbit, and equal to a number that depends on the orbit
    assert basis.dimension == 2
    assert sum(row.count(False) for row in basis.constant) > 0
    independent = hirota_kimura_basis(maps(file), relation_functions(texts[1:3], file.variables), texts[1:3])
    assert (independent.dimension, independent.constant) == (0, ())
    assert basis.to_json()["integrals"] == [[not same for same in row] for row in basis.constant]
