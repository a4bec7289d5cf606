"""The structured facts of the catalogue agree with each other and with the facts in words."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import pytest
from flint import fmpq_poly

from kahanmaps.algebra.text import parse_polynomial
from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.structured_facts import relation_functions
from kahanmaps.errors import InputError

over_the_catalogue = pytest.mark.parametrize("name", names())


# Degrees


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


# The codimension


@pytest.mark.parametrize(("dim", "top", "count"), [(2, 446, 100_128), (8, 50, math.comb(58, 8)), (3, 82, 98_770)])
def test_functions_up_to_a_degree_are_counted_before_they_are_made(dim, top, count):
    variables = [f"x{k}" for k in range(dim)]
    if count <= 100_000:
        assert len(relation_functions(f"degree <= {top}", variables)) == count == math.comb(top + dim, dim)
    else:
        with pytest.raises(InputError, match=f"which is {count} monomials, expected at most 100000$"):
            relation_functions(f"degree <= {top}", variables)
