"""LV(n, k), a family of the catalogue whose names take arguments: its names, and the lemmas of docs/mathematics.md.

Lemmas are identities of polynomials, or hold at rational points with ==; each has a system for which it fails.
"""

import random
from math import prod

import pytest
from flint import fmpq
from helpers import quick

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.modular_matrices import null_space
from kahanmaps.algebra.polynomials import monomials
from kahanmaps.checks.preserve import check_measure
from kahanmaps.checks.theorems import product_density_invariant
from kahanmaps.documents.catalog import load
from kahanmaps.documents.families import degree
from kahanmaps.documents.files import parse_system
from kahanmaps.experiments.results.system_spec import find_file
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.laboratory import Laboratory

EPS = fmpq(3, 17)
NO_SKEW = """
variables = ["x1", "x2", "x3"]
[system]
rhs = ["x1*(x2 - x3)", "x2*(x3 - 2*x1)", "x3*(x1 - x2)"]
[density]
phi = "x1*x2*x3"
"""


def orbit_of(file, count):
    rng = random.Random(file.name)
    points = [tuple(fmpq(rng.randint(1, 40), rng.randint(1, 9)) for _ in range(file.dim))]
    over = file.map.at(EPS)
    while len(points) < count:
        points.append(over.step(points[-1]))
    return points


def test_a_member_goes_where_a_name_of_the_catalogue_goes(tmp_path):
    twice = parse_system('[composition]\nof = [{ system = "lv(3,1)", power = 2 }]', "twice")
    start = (fmpq(1), fmpq(2), fmpq(5))
    over = load("lv(3,1)").map.at(EPS)
    assert twice.map.at(EPS).step(start) == over.step(over.step(start))
    assert find_file("lv(3,1)", tmp_path).system == load("lv(3,1)").system
    assert parse_system(load("lv(6,1)").to_toml(), "again").system == load("lv(6,1)").system


@pytest.mark.parametrize(("n", "k"), [(2, 0), (5, 1), (7, 3)])
def test_the_measure_of_a_skew_system_is_invariant(n, k):
    file = load(f"lv({n},{k})")
    assert str(check_measure(file).verdict) == "proved"
    here, there = orbit_of(file, 2)
    left, right = file.map.at(-EPS).determinant(there), file.map.at(EPS).determinant(here)
    for x, y in zip(here, there, strict=True):
        left, right = left * x, right * y
    assert left == right


def test_without_skewness_the_lemma_says_nothing_and_the_measure_is_not_invariant():
    file = parse_system(NO_SKEW, "other")
    assert product_density_invariant(file.system, file.density) is None
    assert str(check_measure(file).verdict) == "refuted"
    lv = load("lv(3,1)")
    assert product_density_invariant(lv.system, lv.density) is not None
    assert product_density_invariant(lv.system, lv.integrals["I1"]) is None
    assert product_density_invariant(load("euler_top").system, lv.density) is None


# n = 2k + 1


def invariant_polynomials(n):
    """The orbits of monomials of odd degree up to n under the shift of indices."""
    seen, orbits = set(), []
    for d in range(1, n + 1, 2):
        for exponent in map(tuple, monomials(n, d)):
            if exponent not in seen:
                orbits.append({exponent[s:] + exponent[:s] for s in range(n)})
                seen |= orbits[-1]
    return orbits


@pytest.mark.parametrize("k", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_over_the_determinant_there_are_k_plus_1_integrals(k):
    n = 2 * k + 1
    map_ = Laboratory(load(f"lv({n},{k})")).maps[0]
    p, orbits = map_.prime, invariant_polynomials(n)

    def values(x):
        terms = ([prod(pow(c, e, p) for c, e in zip(x, exponent, strict=True)) for exponent in o] for o in orbits)
        return [sum(values) % p for values in terms]

    rows = []
    for x, y in map_.pairs(len(orbits) + 8):
        here, there = (int(map_.map.determinant(point)) for point in (x, y))
        rows.append([(v * here - u * there) % p for u, v in zip(values(x), values(y), strict=True)])
    basis = null_space(rows, len(orbits), p)
    lowest = [min(sum(next(iter(o))) for o, c in zip(orbits, vector, strict=True) if c) for vector in basis]
    assert lowest == list(range(1, n + 1, 2))


# n > 2k + 1


@pytest.mark.parametrize(("n", "k"), [(4, 1), (6, 2), (5, 0)])
def test_the_map_projects_to_the_one_with_the_sum_of_the_middle_species(n, k):
    file, image = load(f"lv({n},{k})"), load(f"lv({2 * k + 1},{k})") if k else None  # LV(1, 0) does not move

    def projected(x):
        return (*x[:k], sum(x[k : n - k], fmpq(0)), *x[n - k :])

    here, there = map(projected, orbit_of(file, 2))
    assert there == (image.map.at(EPS).step(here) if image else here)


@pytest.mark.parametrize(("n", "k"), [(6, 1), (9, 0), (12, 3)])
def test_cross_ratios_are_conserved(n, k):
    file = load(f"lv({n},{k})")
    assert len(file.integrals) == 1 + n - 2 * k - 2 + (k == 1)
    points = orbit_of(file, 3)
    for function in file.integrals.values():
        assert len({function.value(QQ, (*x, EPS)) for x in points}) == 1


@pytest.mark.parametrize(
    ("n", "k"), quick([(n, k) for n in (2, 3, 4, 5) for k in range((n + 1) // 2)], [(2, 0), (3, 1)])
)
def test_the_singularities_give_the_formula_for_the_degrees(n, k):
    growth = degree_growth(load(f"lv({n},{k})").map)
    assert growth.derived is not None
    assert list(growth.degrees) == [degree(n, k, m) for m in range(len(growth.degrees))]
    # The formula satisfies the recurrence that is derived, and agrees at the start.
    coefficients = [int(c) for c in growth.derived.characteristic.coeffs()]
    for m in range(3, 30):
        assert sum(c * degree(n, k, m + i) for i, c in enumerate(coefficients)) == 0


def test_a_sign_changed_changes_the_degrees():
    other = parse_system("[system]\nrhs = \"x' = x*(y + z); y' = y*(x + z); z' = z*(x - y)\"", "other")
    assert list(degree_growth(other.map).degrees)[:4] != [degree(3, 1, m) for m in range(4)]
