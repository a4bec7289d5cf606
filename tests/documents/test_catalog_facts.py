"""The structured facts of the catalogue agree with each other and with the facts in words."""

import re

import pytest
from flint import fmpq_poly

from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.documents.catalog import load, names

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
    "lagrange_top": lambda n: 4 * n * n + 2,
    "so4_euler_manakov": lambda n: 5 * n * n + 1,
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_the_degrees_are_the_values_of_the_closed_form(name):
    catalog = load(name).catalog
    assert catalog["degrees"] == [CLOSED_FORMS[name](n) for n in range(1, len(catalog["degrees"]) + 1)]
    assert any("the values of" in fact for fact in catalog["facts"])


# Growth and verdict


LATEST_BEGINNING = 2


def follow(degrees, minimal):
    """Whether d_0 = 1, d_1, ... obey the recurrence of `minimal` (t - 1) from some n <= LATEST_BEGINNING on.

    At least two equations have to be left then: with fewer, almost any numbers would do.
    """
    d, recurrence = [1, *degrees], minimal * fmpq_poly([-1, 1])  # and a constant
    order = recurrence.degree()
    misses = [sum(recurrence[j] * d[k + j] for j in range(order + 1)) for k in range(len(d) - order)]
    late = next((misses[n:] for n in range(LATEST_BEGINNING + 1) if not any(misses[n:])), [])
    return len(late) >= 2


@pytest.mark.parametrize("name", [name for name in names() if "dynamical_degree" in load(name).catalog])
def test_the_degrees_follow_the_recurrence_of_the_dynamical_degree(name):
    catalog = load(name).catalog
    terms = parse_polynomial(catalog["dynamical_degree"], ["x"]).terms()
    coefficients = {int(monomial[0]): coefficient for monomial, coefficient in terms}
    minimal = fmpq_poly([coefficients.get(k, 0) for k in range(max(coefficients) + 1)])
    assert follow(catalog["degrees"], minimal)
    assert catalog["growth"] == "exponential"
    assert max(root.real for root, _ in minimal.complex_roots()) > 1
