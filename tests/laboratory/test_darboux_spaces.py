"""Cofactors, and spaces of polynomials with a common one: their ratios are conserved, and nothing is found where
nothing is. All Darboux polynomials of a degree have their identities on exact points.
"""

import random
from math import comb

import pytest
from flint import fmpq
from helpers import DIMENSION
from hypothesis import assume, given
from hypothesis import strategies as st
from search_helpers import map_file, system

from kahanmaps import QQ, Certainty, KahanMap, Laboratory, darboux_polynomials, load, names
from kahanmaps.algebra.modular_matrices import combine, rank
from kahanmaps.algebra.polynomials import RationalFunction, evaluate
from kahanmaps.laboratory.modular_points import exponents_up_to
from kahanmaps.laboratory.preserve.darboux import darboux_polynomials as module
from kahanmaps.laboratory.preserve.darboux.cofactors import (
    DETERMINANT,
    Cofactor,
    determinant_factors,
    determinant_polynomial,
)
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace

SMALL = 101


def test_a_space_does_not_depend_on_the_basis_it_was_given_by():
    rng = random.Random(1)
    for size in (2, 3):
        vectors = [[rng.randrange(SMALL) for _ in range(comb(4, 2))] for _ in range(size)]
        weights = [[1, 5, 7][:size], [0, 1, 9][:size], [0, 0, 1]][:size]
        entry = DarbouxSpace.spanned_by(2, 2, vectors, SMALL)
        assert entry == DarbouxSpace.spanned_by(2, 2, combine(weights, vectors, SMALL), SMALL)


@given(st.randoms(use_true_random=False))
def test_no_members_of_a_pencil_are_sparser(rng):
    exponents, p = exponents_up_to(2, 2), 11
    dense, sparse = ([rng.randrange(p) for _ in exponents] for _ in range(2))
    for k in rng.sample(range(6), 3):
        sparse[k] = 0
    P, Q = sparse, [(a + 3 * b) % p for a, b in zip(dense, sparse, strict=True)]
    assume(rank([P, Q], p) == 2)
    supports = {
        tuple(k for k, (a, b) in enumerate(zip(P, Q, strict=True)) if (u * a + v * b) % p)
        for u, v in [(0, 1), *((1, v) for v in range(p))]
    }
    by_size = sorted(supports, key=lambda places: (sum(exponents[places[-1]]), len(places), places))
    basis = DarbouxSpace.spanned_by(2, 2, [P, Q], p).basis
    assert [tuple(k for k, entry in enumerate(member) if entry) for member in basis] == by_size[:2]
    assert rank([*basis, P, Q], p) == rank(basis, p) == 2


SMALL_ONES = [name for name in names() if DIMENSION[name] <= 4]


@pytest.mark.parametrize("name", SMALL_ONES[::4])
def test_the_factors_of_the_determinant_make_up_its_cofactor(name):
    """det(I - eps f') is a product of the factors and of numbers that depend on eps alone, even in eps or not."""
    laboratory = Laboratory(load(name))
    map_ = laboratory.maps[0]
    D = determinant_polynomial(laboratory.map)
    complete = Cofactor("D", 1, D)
    for x, image in map_.pairs(3):
        assert complete.modular_fraction(map_, x, image) == DETERMINANT.modular_fraction(map_, x, image)
    context = D.context()
    others = D
    for entry in determinant_factors(laboratory.map):
        assert entry.polynomial.subs({"eps": 0}) == context.constant(1)
        while not (others % entry.polynomial):
            others = others // entry.polynomial
    assert all(not any(monomial[: map_.dim]) for monomial in others.monoms())


def test_darboux_polynomials_of_the_literature():
    """Two lines that are kept, and no integral; the pencils of two integrals (petrera-pfadler-suris-2011)."""
    searches = darboux_polynomials(load("lotka_volterra"), 4), darboux_polynomials(load("volterra_periodic_4"), 2)
    assert [search.reason for search in searches] == ["", ""]
    lines, pencils = ({one.cofactor: [*map(str, one.polynomials)] for one in search.spaces} for search in searches)
    assert lines == {"C[x]": ["x"], "C[y]": ["y"]}  # products are not listed
    assert pencils["C[x1]*C[x3]"] == ["x1*x3", "x2^2*eps^2 - 2*x2*x4*eps^2 + x4^2*eps^2 - 1"]
    assert pencils["1"][0] == "x1 + x2 + x3 + x4"


@pytest.mark.parametrize("name", ["nahm_octahedral", "dressing_chain_3"])
def test_ratios_of_one_space_are_conserved_along_exact_orbits(name: str) -> None:
    file = load(name)
    rng = random.Random(name)
    seen = 0
    for space in darboux_polynomials(file, 4).spaces:
        for eps in (fmpq(1, 7), fmpq(-2, 5)):
            x = tuple(fmpq(rng.randint(-9, 9), rng.randint(1, 9)) for _ in file.variables)
            image = KahanMap(file.system, eps).step(x)
            before = [evaluate(P, QQ, (*x, eps)) for P in space.polynomials]
            after = [evaluate(P, QQ, (*image, eps)) for P in space.polynomials]
            for k in range(1, len(before)):
                assert after[k] * before[0] == before[k] * after[0]
                seen += 1
            assert all(value != 0 for value in before), "a random point should lie on no Darboux curve"
    assert seen > 0


@pytest.mark.parametrize("eps", [-1, 1])
def test_a_map_that_is_not_birational_at_the_eps_in_force_has_no_darboux_polynomials(eps):
    # At eps = -1 every point goes to x = 0, and all multiples of x would have the cofactor 0.
    search = darboux_polynomials(system("x y", "x", "y"), 2, eps=eps)
    assert search.spaces == ()
    assert f"at eps = {eps} the map" in search.reason


@pytest.mark.parametrize(("symbols", "cofactor"), [((), "1/5*(y + 1)*1/(x)^2"), (("a",), "(1/a)*(y + 1)*1/(x)^2")])
def test_a_cofactor_has_a_number_in_front(symbols, cofactor):
    """Lyness' map x_{n+1} x_{n-1} = a + x_n for a multiples of the x_n: factors of det dPhi are right up to numbers."""
    file = map_file("x y", "y", "(y + 1)/(a*x)", a=5)
    search = darboux_polynomials(file, 3, symbols=symbols)
    [space] = search.spaces
    assert (space.cofactor, space.verdict, search.reason) == (cofactor, Certainty.PROVED, "")
    assert [len(P) for P in space.polynomials] == [1, 7 if not symbols else 9]
    assert str(space.polynomials[0]) == "x*y"


def test_polynomials_whose_cofactors_differ_by_a_number_come_apart():
    """x + y goes to itself, and x - y to its negative."""
    search = darboux_polynomials(map_file("x y z", "y", "x", "3*z/(1 + z)"), 1)
    spaces = {entry.cofactor: list(map(str, entry.polynomials)) for entry in search.spaces}
    assert spaces["1"] == ["x + y"]
    assert spaces["-1"] == ["x - y"]


def test_a_wrong_number_in_front_is_refuted(monkeypatch):
    right = module.constants_of

    def doubled(*arguments):
        [c] = right(*arguments)
        return [RationalFunction(c.numerator * 2, c.denominator)]

    monkeypatch.setattr(module, "constants_of", doubled)
    search = darboux_polynomials(map_file("x y", "y", "(y + 1)/(5*x)"), 3)
    assert search.spaces == ()
    assert "did not pass as an identity" in search.reason
