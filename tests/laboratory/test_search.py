"""A search recorded and repeated on other maps, and closed forms from spaces that are known modulo primes only."""

from types import SimpleNamespace

import pytest
from flint import nmod

from kahanmaps.algebra.written.text import format_polynomial
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import NoPoint, exponents_up_to
from kahanmaps.laboratory.preserve import search as module
from kahanmaps.laboratory.preserve.closed_forms import closed_forms
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace, gradient_rank
from kahanmaps.laboratory.preserve.hirota_kimura import orbit_profile
from kahanmaps.laboratory.preserve.search import may_be_conjugate, repeat, search


def searched(file, eps=None, seconds=30.0):
    laboratory = Laboratory(file, (), eps)
    known = laboratory.cofactors()
    return laboratory, known, search(laboratory.maps[0], orbit_profile(laboratory.maps), known, seconds)


@pytest.mark.parametrize(
    ("name", "kinds", "independent"),
    [
        ("euler_top", ["relations"], 2),
        ("volterra_periodic_4", ["affine", "cofactor", "cofactor"], 3),
        ("lorenz", [], 0),
    ],
)
def test_searches_can_be_repeated_on_another_map(name, kinds, independent):
    laboratory, known, found = searched(load(name))
    assert [step.kind for step in found.steps] == kinds
    assert gradient_rank(laboratory.maps[0], found.all_spaces) == independent
    assert not may_be_conjugate(found)
    reference, second = laboratory.primes[0], laboratory.maps[1]
    again = repeat(found, second, known, reference)
    assert again is not None
    assert [[len(space.basis) for space in group] for group in again.spaces] == [
        [len(space.basis) for space in group] for group in found.spaces
    ]
    assert gradient_rank(second, again.all_spaces) == independent


def test_cofactors_alone_give_the_three_integrals_of_lyness_of_order_five():
    # x_{n+5} x_n = 3 + x_{n+1} + ... + x_{n+4}: all have numerators of degree 6 and more over x1 x2 x3 x4 x5
    image = ["x2", "x3", "x4", "x5", "(3 + x2 + x3 + x4 + x5)/x1"]
    inverse = ["(3 + x1 + x2 + x3 + x4)/x5", "x1", "x2", "x3", "x4"]
    variables = ["x1", "x2", "x3", "x4", "x5"]
    laboratory = Laboratory(parse_system(f"variables = {variables}\n[map]\nimage = {image}\ninverse = {inverse}"))
    profile = SimpleNamespace(nullities=(), codimension=3)
    found = search(laboratory.maps[0], profile, laboratory.cofactors(), 60.0)
    assert [(step.kind, step.degree) for step in found.steps] == [("cofactor", 6)]
    assert gradient_rank(laboratory.maps[0], found.all_spaces) == 3


def calls_of_a_search(monkeypatch, nullities, wanted=1, by_relations=0, by_cofactors=0):
    """The degrees whose relations are taken and what is told, with stand-ins for the work."""
    taken, told, independent = [], [], [0]

    def relations(map_, degree, *_):
        taken.append(degree)
        independent[0] += by_relations

    def cofactors(*_):
        independent[0] += by_cofactors
        return iter(())

    monkeypatch.setattr(module, "_take_relations", relations)
    monkeypatch.setattr(module, "search_cofactors", cofactors)
    monkeypatch.setattr(module, "gradient_rank", lambda *_: independent[0])
    profile = SimpleNamespace(nullities=nullities, codimension=wanted)
    search(Laboratory(load("lorenz")).maps[0], profile, [], 30.0, told.append)
    return taken, [text for text in told if "cofactors" in text]


def test_degrees_with_many_relations_come_after_the_cofactors_and_none_after_what_is_wanted(monkeypatch):
    terms = ["polynomials of degree up to 7 with 120 terms and known cofactors"]
    many = module.LARGEST_SPAN
    assert calls_of_a_search(monkeypatch, (0, 3, 21, 20)) == ([2, 4, 3], terms)
    assert calls_of_a_search(monkeypatch, (1, many - 1, 1)) == ([1, 3, 2], terms)
    assert calls_of_a_search(monkeypatch, (1, many, 1)) == ([1], terms)
    assert calls_of_a_search(monkeypatch, (1, 1, 30), by_relations=1) == ([1], [])
    assert calls_of_a_search(monkeypatch, (1, 30, 30), by_cofactors=1) == ([1], terms)
    assert calls_of_a_search(monkeypatch, (30, 30), by_relations=1) == ([1], terms)
    assert calls_of_a_search(monkeypatch, (1, 30), wanted=0) == ([], [])


@pytest.mark.parametrize(("most", "degree", "terms"), [(120, 7, 120), (119, 6, 84), (10, 2, 10), (9, 1, 4)])
def test_cofactors_are_tried_up_to_so_many_terms(most, degree, terms, monkeypatch):
    monkeypatch.setattr(module, "_MOST_TERMS", most)
    (told,) = calls_of_a_search(monkeypatch, ())[1]
    assert told == f"polynomials of degree up to {degree} with {terms} terms and known cofactors"


def test_relations_that_show_nothing_new_are_no_step(monkeypatch):
    laboratory, _, found = searched(load("euler_top"))
    map_, known = laboratory.maps[0], list(found.steps)
    monkeypatch.setattr(module, "darboux_spaces", lambda *_: found.all_spaces)
    module._take_relations(map_, 2, found, float("inf"))
    assert found.steps == known
    nothing = module.Found()
    monkeypatch.setattr(module, "darboux_spaces", lambda *_: found.spaces[0])
    module._take_relations(map_, 2, nothing, float("inf"))
    assert [(step.kind, step.degree, step.product) for step in nothing.steps] == [("relations", 2, None)]


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


def test_the_space_that_shares_numbers_is_taken_of_those_that_look_alike():
    other, same, wanted = [
        DarbouxSpace(1, 1, [[1, int(nmod(above, p) / 7)]]) for above, p in ((3, 101), (4, 101), (4, 10**9 + 7))
    ]
    assert module._most_alike([other, same], [wanted], 101, 10**9 + 7) == [same]


def test_coefficients_are_interpolated():
    found = closed_forms(MODEL, pencil_at, ["x", "y"], ["a"], "symbol")
    assert [format_polynomial(P) for P in found.bases[0]] == ["x*a^2 + 3*eps - 1", "y^2"]
    assert found.reason == ""


def test_special_values_are_passed_over():
    def now_and_then(prime, values):
        if values[0] % 3 == 0:
            raise NoPoint("not here")
        return None if values[1] % 3 == 0 else pencil_at(prime, values)

    found = closed_forms(MODEL, now_and_then, ["x", "y"], ["a"], "symbol")
    assert format_polynomial(found.bases[0][0]) == "x*a^2 + 3*eps - 1"


def test_no_value_anywhere_and_no_time_are_told():
    nowhere = closed_forms(MODEL, lambda prime, values: None, ["x", "y"], ["a"], "symbol", seconds=5)
    assert (nowhere.bases, bool(nowhere.reason)) == (None, True)
    late = closed_forms(MODEL, pencil_at, ["x", "y"], ["a"], "symbol", seconds=-1.0)
    assert (late.bases, bool(late.reason)) == (None, True)


def test_eps_by_weight_and_numbers():
    support = exponents_up_to(1, 2)

    def at(prime, _):
        half = (prime + 1) // 2
        return [DarbouxSpace(1, 2, [[{(0,): half, (2,): 1}.get(m, 0) for m in support]])]

    model = at(2**61 - 1, ())
    assert format_polynomial(closed_forms(model, at, ["x"], [], "by weight").bases[0][0]) == "2*x^2*eps^2 + 1"
    assert format_polynomial(closed_forms(model, at, ["x"], [], "not").bases[0][0]) == "2*x^2 + 1"
