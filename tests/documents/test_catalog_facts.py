"""The structured facts of the catalogue, measured again for random parameters and eps, modulo 2^61 - 1.

The measurements are small and independent of the package: degrees by the ranks of Loewner matrices, relations by the
rank of monomial values along an orbit, codimensions by the rank of gradients. Each of them has a negative control.
"""

from __future__ import annotations

import math
import random
import re
from itertools import chain, pairwise

import pytest
from flint import fmpq, fmpq_poly, nmod_mat
from helpers import random_point

from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.algebra.polynomials import evaluate, gradient
from kahanmaps.algebra.text import parse_polynomial
from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.structured_facts import relation_functions, relations
from kahanmaps.errors import InputError
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem

PRIME = 2**61 - 1
FIELD = GF(PRIME)
FAST_DEGREES = 130  # a Loewner matrix of this size takes a few milliseconds

over_the_catalogue = pytest.mark.parametrize("name", names())
WITH_RELATIONS = [name for name in names() if load(name).catalog.get("relations")]


def generic(name, seed):
    """The system at random values of its parameters, of a height at which no two agree by chance."""
    rng = random.Random(f"{name} {seed}")
    declared = load(name).parameters
    return load(name, {key: fmpq(rng.randint(1, 10**6), rng.randint(1, 10**3)) for key in declared})


def random_map(system, seed):
    rng = random.Random(seed)
    return KahanMap(system, FIELD.random(rng), FIELD), tuple(FIELD.random(rng) for _ in range(system.dim))


# Integrals and densities, exactly.


@pytest.mark.parametrize("name", [name for name in names() if load(name).integrals])
def test_integrals_are_conserved_exactly_along_rational_orbits(name):
    for seed, eps in enumerate((fmpq(1, 3), fmpq(-2, 5))):
        file = generic(name, seed)
        x = random_point(file.system.dim, seed=seed)
        image = KahanMap(file.system, eps).step(x)
        for integral in file.integrals.values():
            assert integral.value(QQ, (*x, eps)) == integral.value(QQ, (*image, eps)) is not None


@pytest.mark.parametrize("name", [name for name in names() if load(name).density])
def test_densities_are_exact_at_random_rational_points(name):
    for seed, eps in enumerate((fmpq(1, 3), fmpq(-2, 5))):
        file = generic(name, seed)
        phi = KahanMap(file.system, eps)
        x = random_point(phi.dim, seed=seed)
        image = phi.step(x)
        at_x, at_image = (file.density.value(QQ, (*point, eps)) for point in (x, image))
        assert at_image * phi.determinant(x) == at_x * phi.inverse.determinant(image) != 0


# Degrees


def degrees_of_iterates(system, count, bound, seed=0):
    """The degrees of the first iterates, restricted to a random line, as long as they stay below `bound`.

    A generic combination of the coordinates is a rational function of t of the degree of the curve, and a Loewner
    matrix (y(s_i) - y(t_j))/(s_i - t_j) larger than this degree has it for its rank.
    """
    phi, origin = random_map(system, seed)
    rng = random.Random(f"line {seed}")
    direction = [FIELD.random(rng) for _ in range(system.dim)]
    weights = [rng.randrange(PRIME) for _ in range(system.dim)]
    size = bound + 1
    places = rng.sample(range(1, PRIME), 2 * size)
    points = [tuple(a + t * b for a, b in zip(origin, direction, strict=True)) for t in places]
    inverse = [[pow(s - t, -1, PRIME) for t in places[size:]] for s in places[:size]]
    found = []
    for _ in range(count):
        points = [phi.step(point) for point in points]
        values = [sum(w * int(entry) for w, entry in zip(weights, point, strict=True)) for point in points]
        entries = [
            (y - z) * factor % PRIME
            for y, row in zip(values[:size], inverse, strict=True)
            for z, factor in zip(values[size:], row, strict=True)
        ]
        rank = nmod_mat(size, size, entries, PRIME).rank()
        if rank == size:
            break
        found.append(rank)
    return found


def stated(name, at_most):
    return [d for d in load(name).catalog["degrees"] if d <= at_most]


@over_the_catalogue
def test_the_degrees_of_the_iterates_are_those_that_are_stated(name):
    expected = stated(name, FAST_DEGREES)
    assert len(expected) >= 2
    file = generic(name, 1)
    assert degrees_of_iterates(file.system, len(expected), max(expected) + 1) == expected


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in names() if max(load(name).catalog["degrees"]) > FAST_DEGREES])
def test_the_large_degrees_are_those_that_are_stated(name):
    expected = load(name).catalog["degrees"]
    assert degrees_of_iterates(generic(name, 2).system, len(expected), max(expected) + 1) == expected


def test_the_degrees_of_a_system_altered_a_little_are_seen_to_be_others():
    altered = QuadraticSystem.from_text(["x1", "x2", "x3"], ["x2*x3 + x1^2", "-2*x3*x1", "x1*x2"])
    assert degrees_of_iterates(load("euler_top").system, 2, 12) == [3, 9]
    assert degrees_of_iterates(altered, 3, 30) == [3, 9, 23]


def test_degrees_above_the_bound_are_not_given():
    assert degrees_of_iterates(load("lorenz").system, 4, 10) == [3, 9]


def test_henon_heiles_has_the_same_degrees_where_the_flow_is_integrable():
    assert degrees_of_iterates(load("henon_heiles", {"c": -6}).system, 5, 94) == load("henon_heiles").catalog["degrees"]


def test_for_special_parameters_the_degrees_are_smaller():
    # The facts are for generic parameters: without b2 this is the case with one nonzero component.
    special = load("zhukovski_volterra_2", {"b2": 0})
    assert degrees_of_iterates(special.system, 4, 34) == [3, 9, 19, 33]
    assert load("zhukovski_volterra_2").catalog["degrees"][:4] == [3, 9, 23, 57]


@over_the_catalogue
def test_the_facts_in_words_give_the_same_degrees(name):
    catalog = load(name).catalog
    (fact,) = [fact for fact in catalog["facts"] if "the degrees of the iterates are" in fact]
    words = re.search(r"the degrees of the iterates are ([0-9]+(?:, [0-9]+)*)", fact)[1]
    assert [int(d) for d in words.split(", ")] == catalog["degrees"]


CLOSED_FORMS = {
    "planar_cubic_hamiltonian": lambda n: -(-3 * n * n // 4) + 1,
    "euler_top": lambda n: 2 * n * n + 1,
    "zhukovski_volterra_1": lambda n: 2 * n * n + 1,
    "volterra_periodic_4": lambda n: 3 * n * n + 1,
    "lagrange_top": lambda n: 4 * n * n + 2,
    "so4_euler_manakov": lambda n: 5 * n * n + 1,
    "kirchhoff_case": lambda n: 5 * n * n + 1,
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_the_degrees_are_the_values_of_the_closed_form(name):
    catalog = load(name).catalog
    assert catalog["degrees"] == [CLOSED_FORMS[name](n) for n in range(1, len(catalog["degrees"]) + 1)]
    assert any("the values of" in fact for fact in catalog["facts"])


# Growth and verdict


@over_the_catalogue
def test_growth_degrees_and_verdict_go_together(name):
    catalog = load(name).catalog
    second = [a - 2 * b + c for a, b, c in zip(*(catalog["degrees"][k:] for k in range(3)), strict=False)]
    verdicts = {"bounded": "linearisable", "quadratic": "integrable", "exponential": "not integrable"}
    assert catalog["verdict"] == verdicts[catalog["growth"]]
    if catalog["growth"] == "bounded":
        assert set(catalog["degrees"]) == {1}
    elif catalog["growth"] == "quadratic":
        assert max(second) <= 10
        assert second[-1] <= 2 * max(second[:2])
    else:
        assert all(late > early for early, late in pairwise(second))


@pytest.mark.parametrize("name", [name for name in names() if "dynamical_degree" in load(name).catalog])
def test_the_degrees_follow_the_recurrence_of_the_dynamical_degree(name):
    catalog = load(name).catalog
    terms = parse_polynomial(catalog["dynamical_degree"], ["x"]).terms()
    coefficients = {int(monomial[0]): coefficient for monomial, coefficient in terms}
    minimal = fmpq_poly([coefficients.get(k, 0) for k in range(max(coefficients) + 1)])
    recurrence = minimal * fmpq_poly([-1, 1])  # and a constant
    d, order = [1, *catalog["degrees"]], recurrence.degree()
    assert len(d) > order
    for k in range(len(d) - order):
        assert sum(recurrence[j] * d[k + j] for j in range(order + 1)) == 0
    assert catalog["growth"] == "exponential"
    assert max(root.real for root, _ in minimal.complex_roots()) > 1


# Relations


def vanishing(system, functions, seed=0):
    """A basis of the combinations of the functions that vanish along a random orbit, and its map and start."""
    phi, start = random_map(system, seed)
    rows, x = [], start
    for _ in range(len(functions) + 5):
        rows.append([int(evaluate(function, FIELD, x)) for function in functions])
        x = phi.step(x)
    matrix = nmod_mat(len(rows), len(functions), [entry for row in rows for entry in row], PRIME)
    return nullspace(FIELD, matrix), phi, start


@pytest.mark.parametrize("name", WITH_RELATIONS)
def test_the_dimensions_of_the_relations_are_those_that_are_stated(name):
    for seed in range(2):
        file = generic(name, seed)
        for stated_relations in relations(file.catalog, file.variables):
            basis, _, _ = vanishing(file.system, stated_relations.functions, seed)
            assert len(basis) == stated_relations.dimension, stated_relations.text


def test_a_system_altered_a_little_has_no_relations():
    altered = QuadraticSystem.from_text(["x1", "x2", "x3"], ["x2*x3 + x1^2", "-2*x3*x1 + x2^2", "x1*x2"])
    functions = relation_functions(["x1^2", "x2^2", "x3^2", "1"], altered.variables)
    assert len(vanishing(altered, functions)[0]) == 0
    assert len(vanishing(load("euler_top").system, functions)[0]) == 2


def test_a_relation_that_lacks_one_of_its_functions_is_gone():
    file = generic("lagrange_top", 3)
    for stated_relations in relations(file.catalog, file.variables)[:3]:
        for k in range(4):
            fewer = [f for j, f in enumerate(stated_relations.functions) if j != k]
            assert len(vanishing(file.system, fewer)[0]) == 0


def test_where_two_moments_of_inertia_agree_there_are_more_relations():
    # The dimensions are for generic parameters: with a1 = a2, m12 is an integral.
    functions = relation_functions("degree <= 2", load("so4_euler_manakov").variables)
    assert len(vanishing(load("so4_euler_manakov", {"a2": 1}).system, functions)[0]) == 10


# Densities that are polynomials


def densities(system, degree, seed=0):
    """The dimension of the space of the polynomials phi up to a degree for which dx/phi is invariant."""
    phi, _ = random_map(system, seed)
    rng = random.Random(seed)
    functions = relation_functions(f"degree <= {degree}", system.variables)
    rows = []
    for _ in range(len(functions) + 5):
        x = tuple(FIELD.random(rng) for _ in range(phi.dim))
        image = phi.step(x)
        at_x, at_image = phi.determinant(x), phi.inverse.determinant(image)
        rows += [
            int(evaluate(function, FIELD, image) * at_x - evaluate(function, FIELD, x) * at_image)
            for function in functions
        ]
    return len(functions) - nmod_mat(len(functions) + 5, len(functions), rows, PRIME).rank()


WITHOUT_FORMULA = ["lagrange_top", "clebsch_first_flow", "kirchhoff_case", "so4_euler_manakov"]


@pytest.mark.parametrize("name", WITHOUT_FORMULA)
def test_the_facts_speak_of_densities_of_degree_six_and_there_are_none_up_to_three(name):
    assert any("polynomials of degree 6 that has dimension 2" in fact for fact in load(name).catalog["facts"])
    assert densities(generic(name, 5).system, 3) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", WITHOUT_FORMULA)
def test_there_are_two_densities_of_degree_six(name):
    file = generic(name, 5)
    assert [densities(file.system, degree) for degree in (5, 6)] == [0, 2]


def test_a_density_that_is_known_is_found_and_none_where_there_is_none():
    found = {name: densities(generic(name, 5).system, 3) for name in ("zander_120", "nahm_octahedral", "lorenz")}
    assert found == {"zander_120": 1, "nahm_octahedral": 1, "lorenz": 0}


# The codimension


def bilinear_forms(file):
    """The matrices K for which x^T K x~ is conserved (CMOQ 2013; Petrera and Suris 2016), homogeneous systems only."""
    if file.hamiltonian is None or not file.system.is_homogeneous:
        return []
    J = FIELD.convert_matrix(file.hamiltonian.J)
    if file.member is None:
        return [J.inv()]
    A = FIELD.convert_matrix(file.member.A).transpose()
    forms = [J]
    for _ in range(file.system.dim // 2 - 1):
        forms.append(forms[-1] * A)
    return forms


def gradients(file, seed=0):
    """Gradients, at a random point, of all functions known to be constant along its orbit."""
    found = []
    phi, x = random_map(file.system, seed)
    for integral in file.integrals.values():
        above, below = integral.numerator, integral.denominator
        point = (*x, phi.eps)
        a, b = evaluate(above, FIELD, point), evaluate(below, FIELD, point)
        slopes = zip(gradient(above)[: phi.dim], gradient(below)[: phi.dim], strict=True)
        found.append([int(evaluate(p, FIELD, point) * b - evaluate(q, FIELD, point) * a) for p, q in slopes])
    for form in bilinear_forms(file):
        column, image = FIELD.column(x), FIELD.column(phi.step(x))
        slope = form * image + phi.jacobian(x).transpose() * form.transpose() * column
        found.append([int(entry) for entry in slope.entries()])
    for known in relations(file.catalog, file.variables):
        basis, _, start = vanishing(file.system, known.functions, seed)
        assert start == x
        slopes = [[evaluate(entry, FIELD, x) for entry in gradient(function)] for function in known.functions]
        for vector in basis:
            found.append([int(sum(c * s[i] for c, s in zip(vector, slopes, strict=True))) for i in range(phi.dim)])
    return found


@over_the_catalogue
def test_the_codimension_is_the_rank_of_all_gradients_that_are_known(name):
    file = generic(name, 4)
    found = gradients(file)
    rank = (
        nmod_mat(len(found), file.system.dim, [entry for row in found for entry in row], PRIME).rank() if found else 0
    )
    assert rank == file.catalog["codimension"]


def test_the_gradient_of_a_function_that_is_not_conserved_raises_the_rank():
    found = gradients(generic("euler_top", 4))
    assert nmod_mat(len(found), 3, [*chain(*found)], PRIME).rank() == 2
    assert nmod_mat(len(found) + 1, 3, [*chain(*found), 1, 2, 3], PRIME).rank() == 3


@pytest.mark.parametrize(("dim", "top", "count"), [(2, 446, 100_128), (8, 50, math.comb(58, 8)), (3, 82, 98_770)])
def test_functions_up_to_a_degree_are_counted_before_they_are_made(dim, top, count):
    variables = [f"x{k}" for k in range(dim)]
    if count <= 100_000:
        assert len(relation_functions(f"degree <= {top}", variables)) == count == math.comb(top + dim, dim)
    else:
        with pytest.raises(InputError, match=f"which is {count} monomials, expected at most 100000$"):
            relation_functions(f"degree <= {top}", variables)
