"""docs/beyond.md, "Searches in families": each sentence on a family, at its special members as well."""

import random

import pytest
from flint import fmpq

import kahanmaps as km
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.work import Budget
from kahanmaps.laboratory.growth.curves import Line, reduce_map
from kahanmaps.laboratory.laboratory import Laboratory

ROTATIONS = "m' = q*(a*p + d) - e*p; p' = -q*m; q' = p*m"
NAHM = "x' = x^2 - y^2 + a*(u^2 - v^2); y' = -2*x*y - 2*a*u*v; u' = u^2 - v^2 + b*(x^2 - y^2); v' = -2*u*v - 2*b*x*y"
PAIR = "x' = x^2 + a*x*y + b*y; y' = y^2 + a*x*y + b*x"
SPECIES = "x' = x*(a*y + b*z); y' = y*(a*x + z); z' = z*(b*x + y)"

SILVER = [3, 9, 23, 57, 139, 337]  # a(n) = 2 a(n-1) + a(n-2) + ...: 1 + sqrt 2
CUBIC = [2, 4, 8, 13, 20, 28]  # 3 n^2/4 + 1 or + 5/4: a planar cubic Hamiltonian
DEGREES = [
    (ROTATIONS, "a d e", [(0, 0, 0)], lambda n: 2 * n + 1),
    (
        ROTATIONS,
        "a d e",
        [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, 1), (2, 3, 0), (1, 1, 0), (-1, 0, 1), (0, 1, -1), (0, 2, 3)],
        lambda n: 2 * n * n + 1,
    ),
    (ROTATIONS, "a d e", [(1, 1, 1), (-1, 1, 1), (1, 1, -1), (2, 1, 1), (-3, 2, 2)], lambda n: SILVER[n - 1]),
    (NAHM, "a b", [(-1, -1)], lambda n: 2 * n + 1),
    (NAHM, "a b", [(1, 1), (2, "1/2"), (-2, "-1/2"), ("-1/2", -2)], lambda n: (3 * n * n + 2 + n % 2) // 2),
    (NAHM, "a b", [(0, 0)], lambda n: (3 * n * n + 2 + 3 * (n % 2)) // 2),
    # Coefficients of (1 + 2 z^3)/(1 - 4 z + 4 z^2 + 2 z^3 - 5 z^4 + 2 z^5), poles at 1/2, 1, -1.
    (NAHM, "a b", [(0, 1), (0, -1), (1, 0), (-2, 0)], lambda n: [4, 12, 32, 77, 174, 376][n - 1]),
    (PAIR, "a b", [(-2, 0), (-2, 1), (-2, -3)], lambda n: CUBIC[n - 1]),
    (PAIR, "a b", [(1, 1), (1, -1), (1, 3)], lambda n: n + 1),
    (PAIR, "a b", [(-3, 0)], lambda n: (2 * n * n + 3 + (n % 3 > 0)) // 3),
    (PAIR, "a b", [(-1, 0)], lambda n: 2 * n),
    (PAIR, "a b", [(0, 0)], lambda n: 2),
    (PAIR, "a b", [(1, 0)], lambda n: 1),
    (PAIR, "a b", [(-3, 1), (-3, -1), (-3, 2)], lambda n: [2, 4, 7, 12, 20, 33][n - 1]),  # Fibonacci numbers - 1
    (PAIR, "a b", [(0, 1), (-1, 1), (2, 0), (2, 1), (3, 0)], lambda n: 2**n),
    (SPECIES, "a b", [(0, 0), (0, 1), (1, 0)], lambda n: n + 1),
    (SPECIES, "a b", [(-1, 0), (0, -1)], lambda n: 4 * n - 1),
    (SPECIES, "a b", [(0, 2), (0, -2), (2, 0), ("1/2", 0), (0, "1/2")], lambda n: 2 ** (n + 1) - 1),
    (SPECIES, "a b", [(-1, -1), (1, -1), (-1, 1)], lambda n: [3, 9, 25, 67, 179, 477][n - 1]),
    (SPECIES, "a b", [(1, 1), (2, 1), (2, 2), (3, 2)], lambda n: 3**n),
]
CASES = [(text, dict(zip(names.split(), v, strict=True)), d) for text, names, some, d in DEGREES for v in some]


@pytest.mark.parametrize(("equations", "values", "expected"), CASES, ids=[f"{t[:4]} {v}" for t, v, _ in CASES])
def test_degrees_at_special_members(equations, values, expected):
    rng = random.Random(1)
    line = Line(reduce_map(km.System(equations, **values).map, None, rng), rng, Budget(), 10**6)
    count = 5 if "v'" in equations else 6
    degrees = []
    for n in range(count):
        line.step(4**n)
        degrees.append(line.degree)
    assert degrees == [expected(n) for n in range(1, count + 1)]


CONSERVED = [
    (ROTATIONS, {"a": 1, "d": 2, "e": 3}, "(p^2 + q^2)/(1 + eps^2*m^2)"),
    (ROTATIONS, {"a": 1, "d": 2, "e": 0}, "(m^2 + a*p^2 + 2*d*p - d^2*eps^2*q^2)/(1 + a*eps^2*q^2)"),
    (SPECIES, {"a": 0, "b": 0}, "x"),
    (SPECIES, {"a": 0, "b": 1}, "y/x"),
    (SPECIES, {"a": 1, "b": 0}, "z/x"),
    (SPECIES, {"a": -1, "b": 0}, "x - y + z"),
    (SPECIES, {"a": -1, "b": 0}, "x*z/(1 - eps^2*y^2)"),
    (SPECIES, {"a": 0, "b": -1}, "x + y - z"),
    (SPECIES, {"a": 0, "b": -1}, "x*y/(1 - eps^2*z^2)"),
    (PAIR, {"a": 1, "b": 0}, "x/y"),
]


@pytest.mark.parametrize(("equations", "values", "integral"), CONSERVED)
def test_integrals_of_the_families_are_proved_and_no_constants(equations, values, integral):
    symbols = [name for name, value in values.items() if equations == ROTATIONS and value]
    laboratory = Laboratory(km.System(equations, **values), symbols)
    names = [*laboratory.map.variables, *symbols, "eps"]
    function = parse_rational_function(integral, names, {n: fmpq(v) for n, v in values.items() if n not in symbols})
    verdict, _ = laboratory.verdict_on(function)
    assert str(verdict) == "proved"
    wrong = parse_rational_function("x" if "x" in names else "p", names)
    if integral not in ("x", "p"):
        assert str(laboratory.verdict_on(wrong)[0]) == "refuted"


def test_three_integrals_of_the_coupled_nahm_systems_also_where_degrees_are_linear():
    for values in ({"a": -1, "b": -1}, {"a": 2, "b": "1/2"}):
        search = km.find_integrals(km.System(NAHM, **values))
        assert (search.codimension, search.formula_count) == (3, 3)
