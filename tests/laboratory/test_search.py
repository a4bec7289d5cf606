"""A search recorded and repeated on other maps; spaces with zeros at the same places are told apart for every seed."""

import random
from functools import cache

import pytest
from flint import nmod_poly
from helpers import quick
from search_helpers import map_file, system, values_on_orbits

from kahanmaps import Budget, Certainty, Laboratory, find_integrals, load, orbit_profile
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.laboratory.preserve import search as module
from kahanmaps.laboratory.preserve.darboux import cofactors
from kahanmaps.laboratory.preserve.darboux.cofactors import denominators_among
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace, gradient_rank
from kahanmaps.laboratory.preserve.products import candidates
from kahanmaps.laboratory.preserve.search import Branches, find_branches, may_be_conjugate, repeat_search, search_spaces


@pytest.mark.parametrize(
    ("name", "kinds", "independent"),
    [
        ("euler_top", ["relations"], 2),
        ("volterra_periodic_4", ["affine", "cofactor", "cofactor"], 3),
        ("lorenz", [], 0),
    ],
)
def test_searches_can_be_repeated_on_another_map(name, kinds, independent):
    laboratory = Laboratory(load(name))
    reference, (first, second) = laboratory.primes[0], laboratory.maps
    result = search_spaces(first, orbit_profile(laboratory.maps), laboratory.cofactors(), budget=Budget())
    assert [step.kind for step in result.steps] == kinds
    assert gradient_rank(first, result.all_spaces) == independent
    assert not may_be_conjugate(result)
    again = repeat_search(result, second, reference)
    assert again is not None
    sizes = [[[len(space.basis) for space in group] for group in search.spaces] for search in (again, result)]
    assert sizes[0] == sizes[1]
    assert gradient_rank(second, again.all_spaces) == independent


# A recurrence with Laurent polynomials for integrals
FOURTH_ORDER = map_file("a b c d", "b", "c", "d", "3/(b*c*d) - a - b - c - d")


def test_laurent_polynomials_are_found_without_the_span_of_the_relations(monkeypatch):
    origins = ["denominator b*c", "common cofactor 1"]
    monkeypatch.setitem(module._COFACTOR_DEGREE, 4, 5)
    monkeypatch.setattr(cofactors, "_MAX_WORK", 200_000)
    monkeypatch.setattr(module, "darboux_spaces", lambda *_: pytest.fail("the relations span too many dimensions"))
    laboratory = Laboratory(FOURTH_ORDER)
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


# f = grad H x grad K with quadratic H(x, y) and K(y, z). By exchanging H and K each of the two pencils becomes the
# other: (K + const)/(1 - eps^2 (a (dK/dz)^2 ...)) has its zeros where the other one has them.
DX, DY = "(2*a1*x + a2*y + a4)", "(a2*x + 2*a3*y + a5)"
KY, KZ = "(2*b1*y + b2*z + b4)", "(b2*y + 2*b3*z + b5)"
VALUES = {"a1": 2, "a2": 3, "a3": 5, "a4": 7, "a5": -1, "b1": 3, "b2": 1, "b3": -4, "b4": 2, "b5": 11}
FAMILY = system("x y z", f"{DY}*{KZ}", f"-{DX}*{KZ}", f"{DX}*{KY}", **VALUES)


@cache
def found_with(symbols, seed):
    search = find_integrals(FAMILY, symbols=symbols.split(), seed=seed)
    assert {integral.verdict for integral in search.integrals} == {Certainty.PROVED}
    return [integral.text for integral in search.integrals], search.reason


@pytest.mark.parametrize("seed", quick([1, 2, 3], [1]))
def test_two_alike_pencils_give_the_same_formulas_for_every_seed(seed):
    texts, reason = found_with("a3 b3", seed)
    assert (texts, reason) == (found_with("a3 b3", 0)[0], "")
    assert len(texts) == 2
    for text in texts:
        values = values_on_orbits(FAMILY, text, ["1/9"], starts=1, steps=2, a3=5, b3=-4)
        assert {len(each) for each in values} == {1}


def spaces(prime, values, numbers, order):
    """Spaces 1, x + c y of degree 1 in the plane with these c, shuffled."""
    results = [DarbouxSpace(2, 1, [[1, 0, 0], [0, c(prime, *values) % prime, 1]]) for c in numbers]
    random.Random(f"{order} {prime} {values}").shuffle(results)
    return results


@pytest.mark.parametrize("order", range(3))
def test_shuffled_spaces_are_put_in_order_on_every_map(order):
    numbers = [
        lambda p, a, eps: a * pow(1 + eps * eps * a, -1, p),
        lambda p, a, eps: -a * eps * pow(2, -1, p),
        lambda p, a, eps: 7 * pow(3, -1, p),
    ]
    first, second = Laboratory(system("x y", "a*y", "x", a="2"), ["a"]).maps
    model = spaces(first.prime, (*first.values, first.eps), numbers, order)
    branches = find_branches(model, lambda p, values: spaces(p, values, numbers, order), ("a", "eps"), 0, Budget())
    assert branches is not None
    assert branches.position == (1, 1)
    ordered = [
        branches.in_order(spaces(m.prime, (*m.values, m.eps), numbers, order + 5), m) for m in (first, first, second)
    ]
    assert ordered[0] == ordered[1]
    which = []
    for m, group in zip((first, second), ordered[1:], strict=True):
        values = [c(m.prime, *m.values, m.eps) % m.prime for c in numbers]
        which.append([values.index(entry.basis[1][1]) for entry in group])
    assert which[0] == which[1]
    assert sorted(which[0]) == [0, 1, 2]


def test_spaces_are_not_put_in_order_where_their_coefficients_are_equal_or_undefined():
    m = Laboratory(system("x y", "a*y", "x", a="2"), ["a"]).maps[0]
    a, eps = ring(("a", "eps")).gens()
    value, one = m.values[0], a**0
    pairs = (3 * one, one), (a, 2 * one), (eps, a - value)
    three, half_of_a, pole = (RationalFunction(*pair) for pair in pairs)
    half = value * pow(2, -1, m.prime) % m.prime
    different, equal = ([DarbouxSpace(2, 1, [[1, 0, 0], [0, c, 1]]) for c in pair] for pair in ((half, 3), (3, 3)))
    assert Branches((1, 1), (three, half_of_a)).in_order(different, m) == different[::-1]
    assert Branches((1, 1), (three, three)).in_order(equal, m) is None
    assert Branches((1, 1), (three, pole)).in_order(different, m) is None


def test_conjugate_spaces_have_no_branches():
    """The coefficients are the square roots of 1 + eps^2, at values of eps where this is a square modulo the prime."""

    def conjugate_spaces(prime, values):
        factors = nmod_poly([-1 - values[0] ** 2, 0, 1], prime).factor()[1]
        roots = [-int(factor[0]) for factor, _ in factors if factor.degree() == 1]
        return spaces(prime, values, [lambda *_, c=c: c for c in roots], 0) if len(roots) == 2 else None

    model = conjugate_spaces(23, (5,))  # 1 + 5^2 = 7^2 modulo 23
    assert sorted(space.basis[1][1] for space in model) == [7, 16]
    assert find_branches(model, conjugate_spaces, ("eps",), 0, Budget()) is None
