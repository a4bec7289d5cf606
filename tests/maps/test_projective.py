"""The Kahan map on projective space: its forms over Q and GF(p), all points over GF(p), graphs of maps of finite sets.

The other side is computed with Python's integers from the defining equation (x~ - x)/(2 eps) = Q(x, x~) + B (x + x~)/2
+ c at affine points, from the forms at all others, and by walking along the arrows of a graph.
"""

from __future__ import annotations

import itertools
import random

import numpy as np
import pytest
from check_helpers import kahan_step
from flint import fmpq, fmpq_mat
from helpers import fraction

from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.written.text import parse_rational_function
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.projective import homogeneous_map
from kahanmaps.maps.residues.projective import (
    ProjectiveMap,
    graph_of,
    hasse_weil,
    random_points,
    walk_until_back,
)
from kahanmaps.systems.quadratic import QuadraticSystem

NAMES = ["x", "y", "z", "w"]


def dense(n, seed):
    """A system with all terms, those of degree 1 and 0 too."""
    rng = random.Random(f"dense {n} {seed}")
    names = NAMES[:n]
    terms = ["1", *names, *(f"{a}*{b}" for i, a in enumerate(names) for b in names[i:])]
    rhs = [
        " + ".join(f"({rng.choice((-1, 1)) * rng.randint(1, 9)}/{2 ** rng.randint(0, 2)})*{t}" for t in terms)
        for _ in names
    ]
    return QuadraticSystem.from_text(names, rhs)


def value(form, point, p=0):
    """A form at integers, term by term; modulo p unless p is 0."""
    total = 0
    for monomial, coefficient in form.terms():
        term = coefficient if p == 0 else int(coefficient)
        for entry, exponent in zip(point, monomial, strict=True):
            term = term * entry ** int(exponent)
        total = total + term
    return total if p == 0 else total % p


def normal(values, p):
    lead = next((entry for entry in reversed(values) if entry % p), 0)
    return [entry * pow(lead, -1, p) % p for entry in values] if lead else [0] * len(values)


DENSE = [(1, 0), (2, 0), (2, 1), (3, 0), (4, 0)]


@pytest.mark.parametrize(("n", "seed"), DENSE)
def test_the_forms_at_an_affine_point_are_proportional_to_its_image(n, seed):
    system, rng = dense(n, seed), random.Random(seed)
    forms, factor, _ = homogeneous_map(KahanMap(system, "2/7", QQ))
    assert factor.is_constant()
    assert {int(form.total_degree()) for form in forms} == {n}
    for _ in range(3):
        x = [fmpq(rng.randint(-9, 9), rng.randint(1, 9)) for _ in range(n)]
        *above, below = (value(form, [*x, fmpq(1)]) for form in forms)
        assert below != 0
        expected = kahan_step(system, fraction(fmpq(2, 7)), [fraction(entry) for entry in x])
        assert tuple(fraction(entry / below) for entry in above) == expected


@pytest.mark.parametrize(("n", "seed"), DENSE)
def test_the_matrix_of_linear_forms_sends_the_image_to_zero(n, seed):
    """Over GF(p), in every dimension: sum_j L_ij(X) F_j(X) = 0 at random points of projective space."""
    system, p, rng = dense(n, seed), 10007, random.Random(seed)
    equation = KahanMap(system, "2/7", GF(p)).equation
    forms = homogeneous_map(KahanMap(system, "2/7", GF(p))).forms
    for _ in range(5):
        X = [rng.randrange(p) for _ in range(n + 1)]
        image = [value(form, X, p) for form in forms]
        assert any(image)
        for row in equation.terms:
            assert sum(int(c) * X[k] * image[j] for j in range(n + 1) for k, c in row[j]) % p == 0


def test_what_the_forms_have_in_common_is_divided_out():
    """x' = x, y' = x + 2 y at eps = 1/4: (5 x/3 : ... : 1), a linear map, where the minors have degree 2."""
    forms, factor, _ = homogeneous_map(KahanMap(QuadraticSystem.from_text(["x", "y"], ["x", "x + 2*y"]), "1/4", QQ))
    x, y, z = forms[0].context().gens()
    assert int(factor.total_degree()) == 1
    assert forms[2] == forms[2].leading_coefficient() * z
    assert forms[0] * 3 == forms[2].leading_coefficient() * 5 * x
    assert forms[1] * 3 == forms[2].leading_coefficient() * (4 * x + 9 * y)


@pytest.mark.parametrize(
    ("image", "degree"),
    [
        (["y", "(y + 2)/x"], 2),
        (["y", "-x + 3*y/(y^2 - 1)"], 3),
        (["y/x", "(x*z + 1)/(x*y)", "x/(y + 1)"], 3),
        (["x + 1", "x + 2*y"], 1),
        (["1/x", "x*y", "z + y"], 3),
    ],
)
@pytest.mark.parametrize("over", [QQ, GF(1000003)])
def test_the_forms_of_an_explicit_map_are_its_minors_without_common_factor(image, degree, over):
    names = NAMES[: len(image)]
    functions = [parse_rational_function(text, [*names, "eps"]) for text in image]
    equation = explicit_map(names, functions).at(1, over).equation
    assert equation.image_degree == degree
    rng = random.Random(degree)
    for last in (1, 1, 0):
        X = [over.convert(k) for k in (*(rng.randint(1, 9) for _ in names), last)]
        found = equation.image(X, over.zero)
        minors = kernel_minors(equation.rows(equation.monomials(X), over.zero))
        assert any(found) or not last
        assert all(a * d == b * c for (a, b), (c, d) in itertools.pairwise(zip(found, minors, strict=True)))


def test_a_map_whose_matrix_is_not_diagonal_has_its_minors():
    assert KahanMap(dense(2, 2), "2/7", QQ).equation.explicit is None
    for power, is_short in ((3, True), (16, False)):  # 30 terms or so, and 459
        text = f"(x + y + 1)^{power}/(x - 2*y - 2)^{power}"
        image = [parse_rational_function(one, ["x", "y", "eps"]) for one in (text, f"x*{text}")]
        assert (explicit_map(["x", "y"], image).at(1).equation.explicit is not None) is is_short


SYSTEMS = {
    "dense in the plane": dense(2, 2),
    "dense in space": dense(3, 1),
    "on a line": dense(1, 3),
    "homogeneous": QuadraticSystem.from_text(["x", "y"], ["x*y + 3*y^2", "2*x^2 - x*y"]),
    "a common factor": QuadraticSystem.from_text(["x", "y"], ["y", "x^2 - 1"]),
    "linear": QuadraticSystem.from_text(["x", "y"], ["x + y", "1 - y"]),
}
over_systems = pytest.mark.parametrize("name", SYSTEMS)


@over_systems
@pytest.mark.parametrize("p", [5, 7])
def test_images_of_all_points_are_the_values_of_the_forms(name, p):
    system = SYSTEMS[name]
    chart = ProjectiveMap(system, "2/11", p)
    forms, factor, _ = homogeneous_map(KahanMap(system, "2/11", GF(p)))
    points = chart.points(np.arange(chart.count))
    assert chart.count == sum(p**k for k in range(system.dim + 1))
    assert len({tuple(column) for column in points.T.tolist()}) == chart.count
    images = chart.images(points).T.tolist()
    for X, image in zip(points.T.tolist(), images, strict=True):
        assert normal(X, p) == X
        assert image == normal([value(form, X, p) for form in forms], p)
    numbers = [int(number) for number in chart.numbers(np.array(images).T)]
    assert chart.table().tolist() == numbers
    assert (chart.factor == "1") == factor.is_constant()
    assert chart.degree == max(int(form.total_degree()) for form in forms)
    assert not chart.is_undefined


@over_systems
def test_images_of_affine_points_obey_the_defining_equation(name):
    system, p = SYSTEMS[name], 7
    eps = 2 * pow(11, -1, p) % p
    chart = ProjectiveMap(system, "2/11", p)
    points = chart.points(np.arange(chart.count - p**system.dim, chart.count))
    images = chart.images(points)
    assert points[-1].tolist() == [1] * p**system.dim
    local = system.over(GF(p))
    checked = 0
    for X, image in zip(points.T.tolist(), images.T.tolist(), strict=True):
        if image[-1] != 1:
            continue
        n, (x, y) = system.dim, (X[:-1], image[:-1])
        for i in range(n):
            right = 2 * int(local.c[i, 0])
            for j in range(n):
                right += int(local.B[i, j]) * (x[j] + y[j])
                right += sum(int(local.tensor[i * n + j, k]) * x[j] * y[k] for k in range(n))
            assert (y[i] - x[i] - eps * right) % p == 0
        checked += 1
    assert checked >= p**system.dim // 2


def test_points_beyond_the_first_portion_have_their_own_images():
    chart = ProjectiveMap(SYSTEMS["dense in the plane"], "2/11", 191)  # 36673 points, in portions of 32768
    points = chart.points(np.arange(chart.count))
    assert (chart.images(points)[:, 32_700:] == chart.images(points[:, 32_700:])).all()
    assert (chart.table()[32_700:] == chart.numbers(chart.images(points[:, 32_700:]))).all()


def test_the_common_factor_is_looked_for_up_to_dimension_six():
    def chart(n):
        names = [f"x{k}" for k in range(n)]
        rhs = ["x0", *(f"x0 + x{k}" for k in range(1, n))]
        return ProjectiveMap(QuadraticSystem.from_text(names, rhs), "1/3", 7)

    # A linear map: n minors of degree n in common but for one factor.
    assert (chart(6).degree, chart(6).factor.count("z")) == (1, 1)
    assert (chart(7).degree, chart(7).factor) == (7, None)


def test_points_with_one_coordinate_are_the_first_and_those_without_are_none():
    chart = ProjectiveMap(SYSTEMS["dense in space"], "1/3", 5)
    assert chart.points(np.array([0, 1, 5, 6, 31])).T.tolist() == [
        [1, 0, 0, 0],
        [0, 1, 0, 0],
        [4, 1, 0, 0],
        [0, 0, 1, 0],
        [0, 0, 0, 1],
    ]
    assert chart.numbers(chart.points(np.arange(chart.count))).tolist() == list(range(chart.count))
    assert chart.numbers(np.zeros((4, 2), dtype=np.int64)).tolist() == [-1, -1]


@pytest.mark.parametrize("p", [3, 5, 7, 101, 2**29 - 3])
def test_normalised_columns_are_multiples_with_a_last_coordinate_of_one(p):
    chart = ProjectiveMap(SYSTEMS["dense in the plane"], "1/11", p)
    columns = [[1, 2, p - 1], [2, p - 1, 0], [p - 2, 0, 0], [0, 0, 0], [p - 1, 1, 2]]
    found = chart.normalised(np.array(columns).T).T.tolist()
    assert found == [normal(column, p) for column in columns]


def test_a_matrix_permutes_the_points_as_it_moves_them():
    p = 7
    chart = ProjectiveMap(SYSTEMS["dense in the plane"], "1/11", p)
    matrix = fmpq_mat([[1, 2], [3, 4]])
    for X, number in zip(
        chart.points(np.arange(chart.count)).T.tolist(), chart.permutation(matrix).tolist(), strict=True
    ):
        moved = normal([(X[0] + 2 * X[1]) % p, (3 * X[0] + 4 * X[1]) % p, X[2]], p)
        assert chart.points(np.array([number])).T.tolist() == [moved]


@pytest.mark.parametrize(("prime", "eps"), [(2, "1/3"), (2**31 - 1, "1/3"), (9, "1/3")])
def test_primes_out_of_range_and_composite_ones_are_refused(prime, eps):
    with pytest.raises(InputError):
        ProjectiveMap(SYSTEMS["homogeneous"], eps, prime)


@pytest.mark.parametrize("eps", ["5/3", "1/5"])
def test_an_eps_without_a_reduction_is_refused(eps):
    with pytest.raises(BadPrime):
        ProjectiveMap(SYSTEMS["homogeneous"], eps, 5)


def test_a_map_without_a_value_anywhere_says_so():
    chart = ProjectiveMap(QuadraticSystem.from_text(["x", "y"], ["x", "y"]), 1, 7)
    assert chart.is_undefined
    assert not chart.images(chart.points(np.arange(7, chart.count)))[-1].any()


# Graphs: arrows from 0, ..., n - 1, some of which lead nowhere


def walked(image):
    """The least point of its cycle for each periodic point, how many arrows are missing, and how many points fall."""
    label, falling = [-1] * len(image), 0
    for start in range(len(image)):
        seen, point = [], start
        while point >= 0 and point not in seen:
            seen.append(point)
            point = image[point]
        if point == start:
            label[start] = min(seen)
        falling += point < 0 and image[start] >= 0
    return label, sum(i < 0 for i in image), falling


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, 8, 9, 40])
def test_a_graph_is_the_one_that_walking_shows(n):
    rng = random.Random(n)
    for _ in range(20):
        least = rng.choice((0, -1))
        image = [rng.randint(least, n - 1) for _ in range(n)]
        if rng.random() < 0.3:
            image = rng.sample(range(n), n)  # a permutation
        graph = graph_of(np.array(image))
        label, lost, falling = walked(image)
        assert (graph.label.tolist(), graph.lost, graph.falling) == (label, lost, falling)
        labels, lengths = graph.lengths
        assert dict(zip(labels.tolist(), lengths.tolist(), strict=True)) == {k: label.count(k) for k in label if k >= 0}
        for first in range(n + 1):
            assert graph.is_seen(labels, first).tolist() == [k in label[first:] for k in labels.tolist()]


def test_a_long_way_to_a_long_cycle_is_gone_to_its_end():
    image = [*range(1, 100), 50]  # 0 -> ... -> 49 -> the cycle 50, ..., 99
    assert graph_of(np.array(image)).label.tolist() == [-1] * 50 + [50] * 50
    fall = graph_of(np.array([*range(1, 100), -1]))
    assert (fall.lost, fall.falling, set(fall.label.tolist())) == (1, 99, {-1})


@over_systems
def test_walks_come_back_when_the_table_says(name):
    chart = ProjectiveMap(SYSTEMS[name], "2/11", 5)
    table = chart.table().tolist()
    back, lost = walk_until_back(chart, chart.points(np.arange(chart.count)), 12)
    for start in range(chart.count):
        point, expected = start, (-1, -1)
        for step in range(1, 13):
            point = table[point]
            if point < 0:
                expected = (-1, step - 1)
            elif point == start:
                expected = (step, -1)
            else:
                continue
            break
        assert (int(back[start]), int(lost[start])) == expected


def test_a_walk_is_stopped_before_the_step_that_is_named():
    chart = ProjectiveMap(QuadraticSystem.from_text(["x", "y"], ["1", "0"]), "1/2", 7)  # x~ = x + 1: period 7
    start = chart.points(np.array([chart.count - 1]))
    assert [int(found[0]) for found in walk_until_back(chart, start, 7)] == [7, -1]
    assert [int(found[0]) for found in walk_until_back(chart, start, 6)] == [-1, -1]
    told = []
    assert [int(found[0]) for found in walk_until_back(chart, start, 9, lambda k: told.append(k) or k < 4)] == [-1, -1]
    assert told == [1, 2, 3, 4]


def test_random_points_are_normalised_and_come_again():
    chart = ProjectiveMap(SYSTEMS["dense in the plane"], "1/11", 3)
    points = random_points(chart, 400, seed=5)
    assert points.shape == (3, 400)
    assert all(normal(column, 3) == column for column in points.T.tolist())
    assert {int(k) for k in chart.numbers(points)} == set(range(chart.count))
    assert (points == random_points(chart, 400, seed=5)).all()
    assert (points != random_points(chart, 400, seed=6)).any()


@pytest.mark.parametrize(("p", "most"), [(2, 5), (3, 7), (5, 10), (7, 13), (11, 18), (13, 21), (17, 26), (101, 122)])
def test_the_largest_number_of_points_of_a_curve_of_genus_one(p, most):
    """The values of N_q(1) in the tables of curves with many points (manypoints.org)."""
    assert hasse_weil(p) == most


def test_curves_over_gf_5_have_at_most_so_many_points_and_one_has_them():
    """All y^2 = x^3 + a x + b with a nonzero discriminant, counted with the point at infinity."""
    p, counts = 5, []
    for a, b in itertools.product(range(p), repeat=2):
        if (4 * a**3 + 27 * b**2) % p:
            counts.append(1 + sum((y * y - x**3 - a * x - b) % p == 0 for x in range(p) for y in range(p)))
    assert max(counts) <= hasse_weil(p)
    assert min(counts) >= 2 * (p + 1) - hasse_weil(p)
