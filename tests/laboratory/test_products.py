"""Integrals and densities that are products of powers: those of the literature at degrees that no search reaches."""

import random
from math import prod

import pytest
from flint import fmpq, fmpz_mat, nmod_poly
from search_helpers import TODD, is_density, random_system, system

from kahanmaps import QQ, Budget, Certainty, find_densities, find_integrals, load, parse_rational_function
from kahanmaps.laboratory.laboratory import Laboratory, verdict_on
from kahanmaps.laboratory.preserve.products import (
    candidates,
    coprime_base,
    multiplicative_relations,
    products_of,
    relations,
)

P = 2**61 - 1


def tree(n, edges, seed):
    """x_i' = x_i sum_j a_ij x_j; rows differ along an edge (i, k) by a x_i + b x_k, which is a Darboux polynomial."""
    rng = random.Random(seed)
    rows = {0: [rng.randint(-3, 3) for _ in range(n)]}
    for i, k in edges:
        rows[k] = list(rows[i])
        rows[k][i] += rng.choice([1, 2, 3, -1, -2])
        rows[k][k] += rng.choice([1, 2, 3, -1, -2])
    names = [f"x{i + 1}" for i in range(n)]
    sums = ["+".join(f"({a})*{y}" for a, y in zip(rows[i], names, strict=True)) for i in range(n)]
    return system(" ".join(names), *(f"{x}*({total})" for x, total in zip(names, sums, strict=True)))


def found_in(file, symbols=(), eps=None):
    laboratory = Laboratory(file, symbols, eps)
    return products_of(laboratory, candidates(laboratory, laboratory.cofactors(), Budget()))


@pytest.mark.parametrize(
    ("file", "phi"),
    [
        (load("lv(7,0)"), "x2^2*x4^2*x6^2"),
        (tree(3, [(0, 1), (1, 2)], "path3"), None),
        (tree(6, [(0, 1), (0, 2), (0, 3), (3, 4), (3, 5)], "two stars"), None),
    ],
)
def test_the_measures_of_lotka_volterra_systems(file, phi):
    entry = found_in(file).density
    assert phi is None or entry.text == phi
    assert all(is_density(file, entry.text, eps) for eps in ("1/10", "-3/7"))
    assert verdict_on(file.map, entry.function, None, is_density=True)[0].holds


def test_numbers_other_than_1_make_integrals_that_depend_on_time():
    file = system("x y z", "x", "-y", "-2*z")
    search = find_integrals(file)
    assert [integral.text for integral in search.integrals] == ["x*y"]
    assert [t.text for t in search.time_dependent] == ["((-eps - 1)/(eps - 1))^-n*x", "((-2*eps + 1)/(2*eps + 1))^-n*z"]
    assert {integral.integral.verdict for integral in search.time_dependent} == {Certainty.PROVED}
    kahan = file.map.at("1/5")
    x = kahan.point([3, 1, 7])
    assert kahan.step(x)[2] == fmpq(1 - fmpq(2, 5)) / (1 + fmpq(2, 5)) * x[2]
    wrong = parse_rational_function("2", ["x", "y", "z", "eps"])
    I = search.time_dependent[0].integral.function
    assert verdict_on(file.map, I, None, is_density=False, factor=wrong)[0] is Certainty.REFUTED


def test_a_map_that_turns_space_over_has_a_measure_without_a_sign():
    # det dPhi = -(3 + y + z)/x^2, while xyz is multiplied by (3 + y + z)/x^2
    search = find_densities(TODD)
    assert (search.anti_invariant.text, search.anti_invariant.verdict) == ("x*y*z", Certainty.PROVED)
    assert search.note == "|dx/phi| is invariant for phi = x*y*z: phi(x~) = -det dPhi(x) phi(x) (proved)"
    map_ = TODD.map.at(1)
    x = map_.point([1, 2, 5])
    assert prod(map_.step(x)) == -map_.jacobian(x).det() * 10
    assert find_densities(load("lotka_volterra")).anti_invariant is None


@pytest.mark.parametrize("file", [random_system(2, 0), load("henon_heiles")])
def test_maps_without_structure_have_no_products(file):
    result = found_in(file)
    assert (result.integrals, result.time_dependent) == ((), ())
    assert result.density is None or file.name == "henon_heiles"  # whose density is det(I - eps f')


@pytest.mark.parametrize("seed", range(2))
def test_relations_are_all_relations(seed):
    assert relations([]) == []
    rng = random.Random(seed)
    rows = [[rng.randint(-3, 3) for _ in range(3)] for _ in range(6)]
    result = relations(rows)
    assert len(result) == 6 - fmpz_mat(rows).rank()
    for k in result:
        assert [sum(a * row[j] for a, row in zip(k, rows, strict=True)) for j in range(3)] == [0] * 3
    # and they span all integer vectors in their span: the elementary divisors are 1
    diagonal = fmpz_mat(result).snf()
    assert all(diagonal[i, i] == 1 for i in range(len(result)))


def test_numbers_that_are_products_of_each_other():
    functions = [parse_rational_function(text, ["a"]) for text in ("12", "18", "2/3", "a/5", "-a", "25")]
    relations = multiplicative_relations(functions)
    assert len(relations) == 6 - 4  # 2, 3, 5, a
    for k in relations:
        assert prod(f.value(QQ, [fmpq(7)]) ** e for f, e in zip(functions, k, strict=True)) == 1


@pytest.mark.parametrize("seed", range(2))
def test_a_coprime_base_makes_the_polynomials_again(seed):
    rng = random.Random(seed)
    primes = [nmod_poly([rng.randrange(P), *([rng.randrange(P)] * (d - 1)), 1], P) for d in (1, 1, 2, 3)]
    given = [prod((q ** rng.randint(0, 3) for q in primes), start=primes[0] ** 0) for _ in range(4)]
    base = coprime_base(given)
    for i, a in enumerate(base):
        assert a.degree() > 0
        assert all(a.gcd(b).degree() == 0 for b in base[:i])
    for entry in given:
        for b in base:
            while True:
                quotient, others = divmod(entry, b)
                if not others.is_zero():
                    break
                entry = quotient
        assert entry.degree() == 0
