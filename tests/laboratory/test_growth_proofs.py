"""Growth that is proved: monomial maps against measured degrees and published rates, maps of finite order, formulas."""

import random
from dataclasses import replace
from math import prod

import pytest
from flint import fmpq, fmpz_mat, fmpz_poly
from search_helpers import by_formulas

from kahanmaps import Certainty, QuadraticSystem, composed_map, degree_growth, load
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth import degrees, proofs
from kahanmaps.laboratory.growth.proofs import exponent_matrix, linear_iterate, monomial_growth, spectral_radius
from kahanmaps.laboratory.singular import written
from kahanmaps.laboratory.singular.singularities import Patterns, singularities
from kahanmaps.maps.projective import homogeneous_map

OPEN = Patterns((), None, False, "not looked at")


@pytest.mark.parametrize(
    ("variables", "image", "growth", "rate"),
    [
        ("x,y,z", "y; z; z/(x*y^2)", "exponential", "1.59587539516219187780, root of t^6 - 2*t^4 - t^2 - 1"),
        ("x,y,z", "y; z; 1/(x*y)", "exponential", "1.21060779440608593277, root of t^6 - t^4 - 1"),
        ("x,y,z", "7*y; -z/1000000; eps/(x*y)", "exponential", "1.21060779440608593277, root of t^6 - t^4 - 1"),
        ("z,x,y", "1/(x*y); y; z", "exponential", "1.21060779440608593277, root of t^6 - t^4 - 1"),
        ("x,y", "y; y^3/x", "exponential", "2.61803398874989484820, root of t^2 - 3*t + 1"),
        ("x,y", "1/(x^2*y); 1/(x*y)", "exponential", "2.61803398874989484820, root of t^2 - 3*t + 1"),  # negative
        ("x,y", "x*y^2; y", "linear", "1"),
        ("x,y,z", "x*y; y*z; z", "quadratic", "1"),
        ("x,y", "1/x; 1/y", "bounded", "1"),
        ("x,y,z,w", "y; y^3/x*z; w; w^3/z", "exponential", "2.61803398874989484820, root of t^2 - 3*t + 1"),
    ],
)
def test_the_growth_of_monomial_maps_is_proved(variables, image, growth, rate, monkeypatch):
    map_ = by_formulas(variables, image)
    result = degree_growth(map_)
    assert (str(result.growth), result.dynamical_degree.text, result.known) == (growth, rate, Certainty.PROVED)
    monkeypatch.setattr(degrees, "exponent_matrix", lambda map_, eps: None)
    measured = degree_growth(map_, max_terms=6, patterns=OPEN, enclosed=False)
    assert (measured.degrees, bool(measured.primes)) == (result.degrees[:7], True)


def test_a_jordan_block_multiplies_exponential_growth_by_a_power():
    proof = monomial_growth(exponent_matrix(by_formulas("x,y,z,w", "y; y^3/x*z; w; w^3/z"), None))
    assert (proof.power, proof.rate.multiplicity) == (1, 2)
    assert monomial_growth(exponent_matrix(by_formulas("x,y,z,w", "y; y^3/x; w; w^3/z"), None)).power == 0


@pytest.mark.parametrize("seed", range(6))
def test_the_spectral_radius_of_random_matrices(seed):
    rng, n = random.Random(seed), 2 + seed % 3
    matrix = unit = fmpz_mat(n, n, [int(i == k) for i in range(n) for k in range(n)])
    for _ in range(6):  # a product of elementary matrices has determinant 1
        step = fmpz_mat(unit)
        i, k = rng.sample(range(n), 2)
        step[i, k] = rng.choice((-2, -1, 1, 2))
        matrix = matrix * step
    rate = spectral_radius(matrix)
    largest = max(abs(complex(root)) for root, _ in matrix.charpoly().complex_roots())
    assert abs(float(rate.digits) - largest) < 1e-9  # 53 bits of roots of degree 4
    assert len(rate.minimal_polynomial.factor()[1]) == 1
    assert spectral_radius(-matrix).minimal_polynomial == rate.minimal_polynomial


def test_a_composition_of_monomial_maps_is_one():
    f, g = by_formulas("x,y", "x*y; y"), by_formulas("x,y", "3*x; 5*x*y")
    matrices = (fmpz_mat(rows) for rows in ([[1, -1], [0, 1]], [[1, 0], [1, 1]], [[1, 1], [0, 1]]))
    assert exponent_matrix(composed_map(f, g, (f, -1)), None) == prod(matrices, start=1)


@pytest.mark.parametrize("image", ["y; (1 + y)/x", "y; 1/x + eps", "x + y; y"])
def test_other_maps_have_no_exponent_matrix(image):
    assert exponent_matrix(by_formulas("x,y", image), None) is None


def test_a_map_that_is_monomial_at_one_eps_only():
    map_ = by_formulas("x,y", "y; (y^3 + (eps - 1)*y)/x")
    assert exponent_matrix(map_, fmpq(1)) == fmpz_mat([[0, 1], [-1, 3]])
    assert exponent_matrix(map_, None) is exponent_matrix(map_, fmpq(2)) is None


@pytest.mark.parametrize(
    ("image", "period"),
    [
        ("y; (1 + y)/x", 5),
        ("y/7000; 7*(1 + y/7)/(1000*x)", 5),  # the same in the coordinates x/1000, 7 y
        ("y; (1 + y)/x + 0*eps", 5),
        ("y; (2 + y)/x", None),  # integrable, of quadratic growth
        ("y; 1/y - x", None),
        ("y; eps/x", 4),
        ("y; 7/(x*y)", 3),
        ("-y; x", 4),  # the square of the exponent matrix is 1, but that of the map is -1
        ("2*x; y/3", None),
    ],
)
def test_maps_of_finite_order_are_proved_periodic(image, period):
    growth = degree_growth(by_formulas("x,y", image), max_terms=12, patterns=OPEN)
    assert (growth.proof and growth.proof.period) == period
    assert period is None or (growth.proof.is_identity and growth.known is Certainty.PROVED)


def test_a_wrong_period_is_not_proved(monkeypatch):
    lyness = by_formulas("x,y", "y; (1 + y)/x")
    assert [n for n in range(1, 11) if linear_iterate(lyness, None, n) is not None] == [5, 10]
    monkeypatch.setattr(proofs, "_BUDGET", 10)
    assert linear_iterate(lyness, None, 5) is None


@pytest.mark.parametrize(("rhs", "eps", "order"), [("3*y; -x", 1, 3), ("y; -x", 1, 4), ("y; -3*x", "1/3", 6)])
def test_a_linear_map_of_finite_order_is_proved_periodic(rhs, eps, order):
    """The Kahan map of x' = a y, y' = -b x rotates by an angle whose half has the tangent eps sqrt(a b)."""
    system = QuadraticSystem.from_text(["x", "y"], rhs.split("; "))
    result = degree_growth(system, eps=eps).proof
    assert (result.period, result.is_identity, result.reason) == (order, True, f"Phi^{order} is the identity")
    assert not degree_growth(system, eps="1/7").proof.is_identity
    assert not degree_growth(system).proof.is_identity


def test_a_linear_iterate_need_not_be_the_identity():
    growth = degree_growth(by_formulas("x,y", "1 + 2/y; 3/(x - 1)"), max_terms=6, patterns=OPEN)
    assert growth.degrees == (1, 2, 1, 2, 1, 2, 1)
    assert (growth.proof.reason, growth.growth) == ("iterate 2 is linear on projective space", Growth.BOUNDED)
    projective = linear_iterate(by_formulas("x,y", "(2*x + y)/(x - 1); y/(x - 1)"), None, 1)
    assert (projective.is_identity, projective.reason) == (False, "the map is linear on projective space")


def test_a_recurrence_that_does_not_fit_the_proof_is_not_given():
    growth = degree_growth(by_formulas("x,y", "y; y^3/x"))
    assert growth.recurrence.text.startswith("a(n) = 3*a(n-1)-a(n-2)")
    other = replace(growth.proof, rate=replace(growth.proof.rate, minimal_polynomial=fmpz_poly([-2, 1])))
    assert replace(growth, proof=other).recurrence is None


DIMENSION_4, DIMENSION_5 = "b; c; d; 3/(b*c*d) - a - b - c - d", "b; c; d; e; 3/(b*c*d*e) - a - b - c - d - e"


@pytest.mark.parametrize(
    ("variables", "image"),
    [
        ("x,y", "y; -x + 1/y^3"),
        ("x,y", "y; (1 + y)/x"),
        ("x,y", "y/1000; -1000*x + 7/(y^2 - 3)"),
        ("x,y", "x*(1 - y)/(1 + x*y); y*(x + 1)^2/(x - y^2)"),
        ("x,y,z", "y; z; (y + z^2)/(x*(1 + y*z))"),
        ("a,b,c,d", DIMENSION_4),
        ("x,y", "x + y^2; y"),  # contracts nothing but infinity
    ],
)
def test_the_affine_jacobian_has_the_factors_of_the_homogeneous_one(variables, image, monkeypatch):
    forms = homogeneous_map(by_formulas(variables, image).at(1))
    expanded, degree = written.poles_and_critical_factors(forms)
    monkeypatch.setattr(written, "_is_short", lambda size, degree: False)
    by_affine_map, same_degree = written.poles_and_critical_factors(forms)
    assert (sorted(map(repr, by_affine_map)), same_degree) == (sorted(map(repr, expanded)), degree)


@pytest.mark.parametrize("name", ["lotka_volterra", "euler_top", "dressing_chain_3"])
def test_the_affine_jacobian_of_kahan_maps(name):
    forms = homogeneous_map(load(name).map.at(1)).forms
    homogeneous = written._critical_factors(forms, len(forms) * (forms[0].total_degree() - 1))
    finite = {str(factor.subs({"z": 1})): k for factor, k in homogeneous}
    finite.pop("1", None)
    assert {str(factor): k for factor, k in written.factors_at_finite_points(forms)} == finite


def test_the_hypersurfaces_of_a_map_of_dimension_5_are_written():
    run = singularities(by_formulas("a,b,c,d,e", "b; c; d; e; 1/(b*c*d*e) - a"), 1)
    assert (str(run.verdict), run.critical_degree) == ("confined", 24)
    assert [(h.polynomial, h.multiplicity) for h in run.hypersurfaces] == [(x, 6) for x in "edcb"]


@pytest.mark.parametrize(("variables", "image"), [("a,b,c,d", DIMENSION_4), ("a,b,c,d,e", DIMENSION_5)])
def test_published_maps_of_dimension_4_and_5_have_derived_quadratic_growth(variables, image):
    growth = degree_growth(by_formulas(variables, image), max_terms=20)
    assert (str(growth.growth), growth.derived is not None) == ("quadratic", True)


@pytest.mark.parametrize(("k", "rate"), [(3, "3"), (5, "5"), (4, "t^2 - 4*t + 1"), (6, "t^2 - 6*t + 1")])
def test_the_published_rates_of_a_planar_family(k, rate):
    growth = degree_growth(by_formulas("x,y", f"y; -x + 1/y^{k}"), enclosed=False)
    assert growth.derived is not None
    assert growth.dynamical_degree.text.endswith(rate)
