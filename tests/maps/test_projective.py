"""The Kahan map on projective space: its forms over Q and GF(p), all points over GF(p), graphs of maps of finite sets.

The other side is computed with Python's fractions from the defining equation at affine points, from the forms modulo p,
and by walking along the arrows of a graph.
"""

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
from kahanmaps.errors import InputError
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.projective import homogeneous_map
from kahanmaps.maps.residues.projective import ProjectiveMap, graph_of, hasse_weil, random_points, walk_until_back
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


@pytest.mark.parametrize(
    ("image", "degree"),
    [
        (["y", "-x + 3*y/(y^2 - 1)"], 3),
        (["y/x", "(x*z + 1)/(x*y)", "x/(y + 1)"], 3),
        (["1/x", "x*y", "z + y"], 3),
    ],
)
def test_the_forms_of_an_explicit_map_are_its_minors_without_common_factor(image, degree):
    names, over = NAMES[: len(image)], GF(1000003)
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
        ProjectiveMap(SYSTEMS["linear"], eps, prime)


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
