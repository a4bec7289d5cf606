"""A search recorded and repeated on other maps, and closed forms from spaces that are known modulo primes only."""

from types import SimpleNamespace

import pytest
from flint import nmod

from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.algebra.work import Budget
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import exponents_up_to
from kahanmaps.laboratory.preserve import search as module
from kahanmaps.laboratory.preserve.darboux import cofactors
from kahanmaps.laboratory.preserve.darboux.cofactors import denominators_among
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace, gradient_rank
from kahanmaps.laboratory.preserve.hirota_kimura import orbit_profile
from kahanmaps.laboratory.preserve.products import candidates
from kahanmaps.laboratory.preserve.search import may_be_conjugate, repeat_search, search_spaces


def searched(file, eps=None):
    laboratory = Laboratory(file, (), eps)
    return laboratory, search_spaces(
        laboratory.maps[0], orbit_profile(laboratory.maps), laboratory.cofactors(), budget=Budget()
    )


@pytest.mark.parametrize(
    ("name", "kinds", "independent"),
    [
        ("euler_top", ["relations"], 2),
        ("volterra_periodic_4", ["affine", "cofactor", "cofactor"], 3),
        ("lorenz", [], 0),
    ],
)
def test_searches_can_be_repeated_on_another_map(name, kinds, independent):
    laboratory, result = searched(load(name))
    assert [step.kind for step in result.steps] == kinds
    assert gradient_rank(laboratory.maps[0], result.all_spaces) == independent
    assert not may_be_conjugate(result)
    reference, second = laboratory.primes[0], laboratory.maps[1]
    again = repeat_search(result, second, reference)
    assert again is not None
    assert [[len(space.basis) for space in group] for group in again.spaces] == [
        [len(space.basis) for space in group] for group in result.spaces
    ]
    assert gradient_rank(second, again.all_spaces) == independent


# Recurrences with Laurent polynomials for integrals: x_{n+N} = 3/(x_{n+1} ... x_{n+N-1}) - x_n - ... - x_{n+N-1}.
FOURTH_ORDER = ("a b c d", ["b", "c", "d", "3/(b*c*d) - a - b - c - d"])


def recurrence(names, image):
    return parse_system(f"variables = {names.split()}\n[map]\nimage = {image}")


def test_laurent_polynomials_are_found_without_the_span_of_the_relations(monkeypatch):
    origins = ["denominator b*c", "common cofactor 1"]
    monkeypatch.setitem(module._COFACTOR_DEGREE, 4, 5)
    monkeypatch.setattr(cofactors, "_MAX_WORK", 200_000)
    monkeypatch.setattr(module, "darboux_spaces", lambda *_: pytest.fail("the relations span too many dimensions"))
    laboratory = Laboratory(recurrence(*FOURTH_ORDER))
    known = laboratory.cofactors()
    profile, dim = orbit_profile(laboratory.maps), laboratory.map.dim
    assert profile.codimension == len(origins)
    over = denominators_among(candidates(laboratory, known, Budget()), dim)
    spaces = search_spaces(laboratory.maps[0], profile, known, over, budget=Budget())
    assert [step.text for step in spaces.steps] == origins
    assert gradient_rank(laboratory.maps[0], spaces.all_spaces) == len(origins)
    # Without the variables for denominators only the polynomial is found.
    with pytest.raises(pytest.fail.Exception):
        search_spaces(laboratory.maps[0], profile, known, budget=Budget())


# The pencil of 1 + a^2 x/(3 eps - 1) and y^2, as if it had been found at each value of a and eps.
def pencil_at(prime, values):
    a, eps = values
    below = nmod(3 * eps - 1, prime)
    if below == 0:
        return None
    entries = {(0, 0): nmod(1, prime), (1, 0): nmod(a * a, prime) / below}
    support = exponents_up_to(2, 2)
    vectors = [[int(entries.get(m, 0)) for m in support], [int(m == (0, 2)) for m in support]]
    return [DarbouxSpace.spanned_by(2, 2, vectors, prime)]


MODEL = pencil_at(2**61 - 1, (12345, 67890))


def closed_forms(model, spaces_at, variables, symbols, eps_enters, budget):
    """What a laboratory makes of spaces that are given by the prime and the values, and not found on maps."""
    laboratory = SimpleNamespace(map_for=lambda *place: place, symbols=symbols, root=None, seed=0)
    return Laboratory.formulas(laboratory, model, lambda place: spaces_at(*place), budget, variables, eps_enters)


def test_coefficients_are_interpolated():
    formulas = closed_forms(MODEL, pencil_at, ["x", "y"], ["a"], "symbol", budget=Budget())
    assert [format_polynomial(P) for P in formulas.bases[0]] == ["x*a^2 + 3*eps - 1", "y^2"]
    assert formulas.reason == ""
