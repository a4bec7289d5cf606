"""Integrals of the differential equation, by the searches that find those of maps."""

from __future__ import annotations

import random

import pytest
from flint import fmpq

from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.algebra.written.text import parse_rational_function
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.errors import InputError
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import exponents_up_to
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.laboratory.preserve.limit.flow import ModularFlow, is_kept_by_flow

PRIME = 2**61 - 1


def derivative(file, function, x):
    """f . grad I at a point."""
    f = file.system.over(QQ).value(x)
    P, Q = function.numerator, function.denominator
    at = (*x, fmpq(1))
    values = [evaluate(one, QQ, at) for one in (P, Q)]
    slopes = [[evaluate(one.derivative(k), QQ, at) for k in range(len(x))] for one in (P, Q)]
    return sum((f[k] * (slopes[0][k] * values[1] - values[0] * slopes[1][k]) for k in range(len(x))), fmpq(0))


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("euler_top", 2),  # both energies, classical
        ("henon_heiles", 1),  # for its c not integrable: H alone
        ("nahm_tetrahedral", 1),
        ("weierstrass", 1),
        ("volterra_periodic_3", 2),
        ("zander_120", 1),
        ("harmonic", 1),
        ("lotka_volterra", 0),  # its integral is no rational function
        ("lorenz", 0),
    ],
)
def test_the_rational_integrals_of_a_flow_are_found(name, count):
    file = load(name)
    found = find_integrals(file, flow=True, max_degree=4)
    assert len(found.integrals) == count == found.codimension
    rng = random.Random(1)
    for one in found.integrals:
        assert str(one.verdict) == "proved"
        x = tuple(fmpq(rng.randint(1, 9), rng.randint(1, 9)) for _ in range(file.dim))
        assert derivative(file, one.function, x) == 0


def test_symbols_stay_in_the_formulas_of_a_flow():
    found = find_integrals(load("euler_top"), symbols=["a1", "a2"], flow=True)
    assert len(found.integrals) == 2
    assert any("a1" in one.text for one in found.integrals)
    assert all("eps" not in one.text for one in found.integrals)


def test_a_flow_may_have_an_integral_that_its_map_has_lost():
    """Three lines with the exponents (1, 3, 3): the degrees of the iterates grow like 2^n for long (d_8 = 255)."""
    text = 'variables = ["x", "y"]\n[system]\nrhs = ["3*x*(x+2*y) + 6*x*y", "-(y*(x+2*y) + 3*x*y)"]'
    [one] = find_integrals(parse_system(text), flow=True).integrals
    assert one.text == "x*y^3*(x + 2*y)^3"
    assert find_integrals(parse_system(text), max_degree=7).codimension == 0


@pytest.mark.parametrize("text", ["x^2 + y^2", "x/y", "(x^2 + y^2)/(x^2 + y^2 + 1)"])
def test_what_a_flow_conserves_is_decided_by_multiplying_out(text):
    rotation = parse_system('variables = ["x", "y"]\n[system]\nrhs = ["y", "-x"]')
    function = parse_rational_function(text, ["x", "y", "eps"])
    conserved = derivative(rotation, function, (fmpq(2), fmpq(1, 3))) == 0
    assert is_kept_by_flow(rotation.system, function) == conserved == (text != "x/y")


def test_the_series_of_a_solution_solve_the_equation():
    """x' = y, y' = -x from (a, b): x = a cos t + b sin t; and monomials are multiplied as series."""
    flow = ModularFlow(parse_system('variables = ["x", "y"]\n[system]\nrhs = ["y", "-x"]').system, PRIME)
    rows, (a, b), period = flow.along_orbit(2, 8)
    assert period is None
    support = exponents_up_to(2, 2)
    x, y, xy = ([row[support.index(e)] for row in rows] for e in ((1, 0), (0, 1), (1, 1)))
    assert [(k + 1) * x[k + 1] % PRIME for k in range(7)] == y[:7]
    assert [-(k + 1) * y[k + 1] % PRIME for k in range(7)] == x[:7]
    assert xy == [sum(x[i] * y[k - i] for i in range(k + 1)) % PRIME for k in range(8)]
    assert (x[0], y[0]) == (a, b)


def test_a_step_moves_monomials_by_their_derivatives():
    file = load("euler_top")
    flow = ModularFlow(file.system, PRIME)
    field = GF(PRIME)
    [(x, image)] = flow.pairs(1)
    here, there = flow.moved(x, image, 3)
    f = file.system.over(field).value([field.convert(c) for c in x])
    for exponent, before, after in zip(exponents_up_to(3, 3), here, there, strict=True):
        slope = 0
        for k, e in enumerate(exponent):
            if e:
                factors = [x[j] ** (exponent[j] - (j == k)) for j in range(3)]
                slope += e * factors[0] * factors[1] * factors[2] * int(f[k])
        assert (after - before - slope) % PRIME == 0


@pytest.mark.parametrize(
    ("file", "eps", "words"),
    [(load("lyness"), None, "found an explicit map"), (load("harmonic"), "1/10", "found eps = 1/10")],
)
def test_only_vector_fields_have_a_flow(file, eps, words):
    with pytest.raises(InputError, match=words):
        Laboratory(file, (), eps, flow=True)
