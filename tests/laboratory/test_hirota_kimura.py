"""Relations along orbits: the dimensions of the literature, none for systems without integrals, points where orbits
close; relations with few terms hold on exact orbits, and tell numbers, eps and integrals apart."""

from fractions import Fraction
from itertools import islice, product

import pytest
from check_helpers import kahan_step
from flint import fmpq, fmpq_mat
from helpers import fraction, quick
from search_helpers import file_of, system, value_of

from kahanmaps import Laboratory, load, names
from kahanmaps.checks.settings import random_starts
from kahanmaps.documents.structured_facts import relation_functions, relations
from kahanmaps.laboratory.preserve.hirota_kimura import (
    SparseRelation,
    hirota_kimura_basis,
    orbit_profile,
    relations_on_orbit,
    sparse_relations,
)

# Sets of more than 300 functions are measured by the tests of the catalogue.
RELATIONS = [
    (name, k)
    for name in names()
    for k, known in enumerate(relations(load(name).catalog, load(name).system.variables))
    if len(known.functions) <= 300
]


def maps(file):
    return Laboratory(file).maps


@pytest.mark.parametrize(("name", "k"), quick(RELATIONS, RELATIONS[::3]))
def test_bases_have_the_dimensions_of_the_literature(name, k):
    file = load(name)
    known = relations(file.catalog, file.variables)[k]
    labels = [str(entry) for entry in known.functions]
    basis = hirota_kimura_basis(maps(file), known.functions, labels)
    assert (basis.dimension, basis.orbits_agree, basis.period) == (known.dimension, True, None)
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
    assert relations_on_orbit(maps(load("lorenz"))[0], 3, leading=frozenset({(1, 0, 0)})).dimension == 0


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


# Of the literature: the Euler top has (x1^2 - a x3^2) and (x2^2 - b x3^2) with integrals a, b; sums of open and closed
# chains are constant; the Casimir functions of the tops in their Hirota-Kimura form.
WRITTEN = [
    ("euler_top", 2, ["x1^2 + c1*x3^2 + c2 = 0", "x2^2 + c3*x3^2 + c4 = 0"]),
    ("zhukovski_volterra_2", 2, ["x1^2 + 1/2*x2^2 + c1*x3^2 - x1 - 2*x2 + c2 = 0"]),
    ("weierstrass", 3, ["x^3 - eps^2*x*y^2 + 4*eps^2*x^2 - 1/4*y^2 + c1*x + c2 = 0"]),
    ("ishii", 2, ["x^2 - eps^2*y^2 - 1/6*z + c1 = 0", "x*z - 3/2*y^2 + 1/2*eps^2*z^2 + c2*x + c3 = 0"]),
    ("lorenz", 3, []),
]


def relations_of(name, degree):
    return sparse_relations(maps(file_of(name)), degree, file_of(name).variables)


def exact_orbit(file, eps, length, seed=1):
    """Points of an orbit over Q with no two equal, and none at a pole."""
    for start in islice(random_starts(file.system.dim, seed), 50):
        points = [tuple(fraction(entry) for entry in start)]
        while len(points) < length and points[-1] is not None:
            points.append(kahan_step(file.system, eps, points[-1]))
        if points[-1] is not None and len(set(points)) == length:
            return points
    raise AssertionError("no orbit found")


def unknowns_on(relation, file, eps, points):
    """The values of the names that make the relation hold at the points, None where none do."""
    names = sorted({text for _, text in relation.terms if text in relation.names})
    rows = []
    for x in points:
        row = dict.fromkeys((*names, ""), Fraction(0))
        for monomial, text in relation.terms:
            factor = 1 if text in relation.names else value_of(text, (), (), eps)
            row[text if text in relation.names else ""] += factor * value_of(monomial, file.variables, x, eps)
        rows.append([fmpq(row[name].numerator, row[name].denominator) for name in (*names, "")])
    echelon, rank = fmpq_mat(rows).rref()
    if rank != len(names) or any(echelon[k, k] != 1 for k in range(rank)):
        return None
    return {name: -echelon[k, rank] for k, name in enumerate(names)}


@pytest.mark.parametrize(("name", "degree", "texts"), WRITTEN)
def test_the_relations_of_the_literature_are_found_and_hold_on_exact_orbits(name, degree, texts):
    file, found = file_of(name), relations_of(name, degree)
    assert [one.text for one in found] == texts
    for relation, eps in product(found, (Fraction(1, 3), Fraction(-2, 7))):
        values = [unknowns_on(relation, file, eps, exact_orbit(file, eps, 7, seed)) for seed in (1, 2, 3, 4)]
        assert None not in values
        for c in relation.integrals:  # they are no constants
            assert len({each[c] for each in values}) > 1


def test_a_wrong_relation_does_not_hold_on_exact_orbits():
    file = load("euler_top")
    points = exact_orbit(file, Fraction(1, 3), 7)
    right = relations_of("euler_top", 2)[0]
    for terms in ((("x1^2", "1"), ("x3", "c1"), ("1", "c2")), (("x1^2", "2"), ("x3^2", "-1"), ("1", "c1"))):
        integrals = tuple(text for _, text in terms if text.startswith("c"))
        assert unknowns_on(SparseRelation(terms, integrals), file, Fraction(1, 3), points) is None
    assert unknowns_on(right, file, Fraction(1, 3), points) is not None


def test_what_depends_on_eps_alone_is_no_integral():
    (found,) = relations_of("planar_cubic_hamiltonian", 3)
    assert found.text.startswith("x^3 + e1*x^2*y + e2*x*y^2 + e3*y^3 + c1*x^2")
    assert found.integrals == ("c1", "c2", "c3", "c4", "c5", "c6")
    assert found.names == ("e1", "e2", "e3", *found.integrals)
    file = load("planar_cubic_hamiltonian")
    for eps in (Fraction(1, 3), Fraction(-2, 7)):
        one, other = (unknowns_on(found, file, eps, exact_orbit(file, eps, 11, seed)) for seed in (1, 2))
        assert [name for name in found.names if one[name] == other[name]] == ["e1", "e2", "e3"]


def test_what_lower_degrees_imply_is_left_out():
    assert relations_of("euler_top", 3) == ()
