"""Normalized integrals: conserved as before, with a limit eps -> 0 that is an integral of the flow, and unchanged."""

import random

import pytest

import kahanmaps as km
from kahanmaps import Laboratory, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, degree_in
from kahanmaps.algebra.printing import format_factored
from kahanmaps.invariants.integrals_and_densities import normalized

CLAIMED = [
    (name, claim)
    for name in km.names()
    if km.load(name).map.has_eps and km.load(name).map.time_steps
    for claim in km.load(name).integrals
]
POLARISED = "duffing_polarised"  # a map of two points, whose limit is no function of one


def is_primitive(function: RationalFunction) -> bool:
    parts = function.numerator, function.denominator
    return all(c.q == 1 for P in parts for c in P.coeffs()) and all(P.leading_coefficient() > 0 for P in parts)


def disguised(function: RationalFunction, rng: random.Random, constant: bool) -> RationalFunction:
    """The integral times a function of eps, plus one: with a constant limit or, without `constant`, with another."""
    P, Q = function.numerator, function.denominator
    eps = P.context().gens()[-1]
    a, b, c, d = (rng.choice([-1, 1]) * rng.randint(1, 9) for _ in range(4))
    if constant:
        return RationalFunction((a + b * eps) * eps**4 * P + (c + d * eps**2) * Q, (d + a * eps) * Q)
    return RationalFunction((a + b * eps) * eps**3 * P, (c - d * eps**2) * Q)


@pytest.mark.parametrize(("name", "claim"), CLAIMED)
def test_claims_of_the_catalogue_are_normalized_to_integrals_that_tend_to_those_of_the_flow(name, claim):
    file = km.load(name)
    normal_form = normalized(file.integrals[claim], file.dim)
    alpha, beta, gamma = normal_form.coefficients
    I = file.integrals[claim]
    combined = RationalFunction(alpha * I.numerator + beta * I.denominator, gamma * I.denominator)
    assert combined == normal_form.function
    assert all((degree_in(P, file.dim) == 0 and not P.is_zero()) or P is beta for P in (alpha, beta, gamma))
    assert normal_form.leading is not None
    assert is_primitive(normal_form.leading)
    assert normalized(normal_form.function, file.dim).function == normal_form.function
    if name != POLARISED:
        assert Laboratory(file, flow=True).verdict_on(normal_form.leading)[0].holds
    rng = random.Random(f"{name} {claim}")
    for constant in (True, False):
        assert normalized(disguised(normal_form.function, rng, constant), file.dim).function == normal_form.function


def test_a_function_that_is_not_conserved_does_not_tend_to_an_integral_of_the_flow():
    # The control of the last but one assertion.
    file = km.load("euler_top")
    wrong = parse_rational_function("(1 - eps^2*x1^2)/(1 + eps^2*x2^2)", [*file.variables, "eps"])
    leading = normalized(wrong, 3).leading
    assert format_factored(leading) == "x1^2 + x2^2"
    assert not Laboratory(file, flow=True).verdict_on(leading)[0].holds


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("-3 - 2*eps^2 - eps^4*(24*x - 18*y)/(1 + eps^2*x)", "(4*x - 3*y)/(x*eps^2 + 1)"),
        ("-x*y/2", "x*y"),
        ("eps*x/((1 + eps)*y)", "x/y"),
        ("(a + a*eps*x)/(2 + eps*y)", "(4*x - 2*y)/(y*eps + 2)"),  # a(1 + eps x)/(2 + eps y) - a/2
        ("x/(1 - eps^2*x)", "-x/(x*eps^2 - 1)"),
        ("7*a/eps", "7*a/eps"),
    ],
)
def test_what_is_subtracted_and_divided_out(text, shown):
    normal_form = normalized(parse_rational_function(text, ["x", "y", "a", "eps"]), 2)
    assert normal_form.function == parse_rational_function(shown, ["x", "y", "a", "eps"])


SYSTEMS = [
    "weierstrass",
    "euler_top",
    "nahm_octahedral",
    "zhukovski_volterra_1",
    "volterra_periodic_4",
    # The image of weierstrass under x -> 1000 x, y -> y/7, and a planar cubic without symmetry.
    "x' = 7000*y; y' = 6*x^2/7000000 - 2/7",
    "x' = x^2 - y; y' = 1 - 2*x*y",
]


@pytest.mark.parametrize("system", SYSTEMS)
def test_integrals_are_found_normalized(system):
    search = km.find_integrals(system)
    assert search.integrals
    for integral in search.integrals:
        again = normalized(integral.function, search.file.dim)
        assert (again.function, again.is_shifted) == (integral.function, False)
        assert is_primitive(again.leading)
        assert Laboratory(search.file, flow=True).verdict_on(again.leading)[0].holds
        assert integral.verdict.holds
        assert km.check_integrals(search.file, integral.text).holds
