"""Spaces with zeros at the same places are told apart by their coefficients, whatever the primes and the order."""

import random
from functools import cache

import pytest
from helpers import quick
from search_helpers import system, values_on_orbits

from kahanmaps.algebra.work import Budget
from kahanmaps.checks.claims import Certainty
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.laboratory.preserve.search import find_branches

# f = grad H x grad K with quadratic H(x, y) and K(y, z). By exchanging H and K each of the two pencils becomes the
# other: (K + const)/(1 - eps^2 (a (dK/dz)^2 ...)) has its zeros where the other one has them.
DX, DY = "(2*a1*x + a2*y + a4)", "(a2*x + 2*a3*y + a5)"
KY, KZ = "(2*b1*y + b2*z + b4)", "(b2*y + 2*b3*z + b5)"
VALUES = {"a1": 2, "a2": 3, "a3": 5, "a4": 7, "a5": -1, "b1": 3, "b2": 1, "b3": -4, "b4": 2, "b5": 11}
FAMILY = system("x y z", f"{DY}*{KZ}", f"-{DX}*{KZ}", f"{DX}*{KY}", **VALUES)


@cache
def found_with(symbols, seed):
    search = find_integrals(FAMILY, symbols=symbols.split(), seed=seed)
    return (
        [integral.text for integral in search.integrals],
        {integral.verdict for integral in search.integrals},
        search.reason,
    )


@pytest.mark.parametrize("seed", quick([1, 2, 3], [1]))
def test_two_alike_pencils_give_the_same_formulas_for_every_seed(seed):
    texts, verdicts, reason = found_with("a3 b3", seed)
    assert (texts, reason) == (found_with("a3 b3", 0)[0], "")
    assert (len(texts), verdicts) == (2, {Certainty.PROVED})
    for text in texts:
        values = values_on_orbits(FAMILY, text, ["1/9"], starts=1, steps=2, a3=5, b3=-4)
        assert {len(each) for each in values} == {1}


def spaces(prime, values, numbers, order):
    """Spaces 1, x + c y of degree 1 in the plane with these c, shuffled."""
    results = [DarbouxSpace(2, 1, [[1, 0, 0], [0, c(prime, *values) % prime, 1]]) for c in numbers]
    random.Random(f"{order} {prime} {values}").shuffle(results)
    return results


def root_of(n, prime):
    """A square root of n modulo a prime, None where there is none."""
    from flint import nmod_poly

    factors = nmod_poly([-n % prime, 0, 1], prime).factor()[1]
    return None if len(factors) == 1 and factors[0][0].degree() == 2 else int(-factors[0][0][0])


@pytest.mark.parametrize("order", range(3))
def test_shuffled_spaces_are_put_in_order_on_every_map(order):
    numbers = [
        lambda p, a, eps: a * pow(1 + eps * eps * a, -1, p),
        lambda p, a, eps: -a * eps * pow(2, -1, p),
        lambda p, a, eps: 7 * pow(3, -1, p),
    ]
    laboratory = Laboratory(system("x y", "a*y", "x", a="2"), ["a"])
    first, second = laboratory.maps
    model = spaces(first.prime, (*first.values, first.eps), numbers, order)
    branches = find_branches(model, lambda p, values: spaces(p, values, numbers, order), ("a", "eps"), 0, Budget())
    assert branches is not None
    assert branches.place == (1, 1)
    ordered = [
        branches.in_order(spaces(m.prime, (*m.values, m.eps), numbers, order + 5), m) for m in (first, first, second)
    ]
    assert ordered[0] == ordered[1]
    which = [
        [
            next(k for k, c in enumerate(numbers) if c(m.prime, *m.values, m.eps) % m.prime == entry.basis[1][1])
            for entry in g
        ]
        for m, g in zip((first, second), ordered[1:], strict=True)
    ]
    assert which[0] == which[1]
    assert sorted(which[0]) == [0, 1, 2]


@pytest.mark.parametrize("names", [(), ("a",)])
def test_spaces_that_are_conjugate_have_no_order(names):
    """x + sqrt(2) y, or x + sqrt(2) a y, and its conjugate: two spaces modulo the primes where 2 is a square."""

    def alike(prime, values):
        root = root_of(2, prime)
        return None if root is None else spaces(prime, values, [lambda p, a=1: root * a, lambda p, a=1: -root * a], 0)

    prime = next(map_.prime for map_ in Laboratory(FAMILY).other_maps(20) if root_of(2, map_.prime) is not None)
    model = alike(prime, (3,) * len(names))
    assert find_branches(model, alike, names, 0, Budget()) is None
