"""Integrals found from the right-hand sides alone: those of the literature, conserved exactly; no others."""

import random

import pytest
from flint import fmpq
from helpers import DIMENSION, quick
from hypothesis import given, settings
from hypothesis import strategies as st
from search_helpers import integrals_of, map_file, random_system, ranks, system, values_on_orbits

from kahanmaps import Budget, Certainty, Laboratory, load, names, parse_rational_function
from kahanmaps.laboratory.preserve.hirota_kimura import Profile
from kahanmaps.laboratory.preserve.integrals import IntegralSearch, find_integrals
from kahanmaps.laboratory.preserve.results import closing_note

PLANE_AND_SPACE = [name for name in names() if DIMENSION[name] <= 4]
SHORT = [name for name in PLANE_AND_SPACE if name not in ("henon_heiles", "paper_m2")]
EPS = ["1/10", "-2/7", "3"]


@pytest.mark.parametrize("name", quick(PLANE_AND_SPACE, SHORT[::2]))
def test_the_integrals_of_the_literature_are_found(name):
    file = load(name)
    integrals = integrals_of(name)
    functions = [integral.function for integral in integrals.integrals]
    assert len(functions) == integrals.codimension == file.catalog["codimension"]
    assert all(integral.verdict is Certainty.PROVED for integral in integrals.integrals)
    assert (integrals.is_complete, integrals.reason, integrals.note) == (True, "", "")
    known = list(file.integrals.values())
    number, of_known, of_all = ranks(functions, known, Laboratory(file).maps[0])
    assert number == of_all == len(functions)  # the known ones are functions of those found
    assert of_known == len(known)


@pytest.mark.parametrize("name", ["euler_top", "nahm_octahedral", "volterra_periodic_4"])
def test_formulas_are_constant_along_exact_orbits(name):
    file = load(name)
    for integral in integrals_of(name).integrals:
        values = values_on_orbits(file, integral.text, EPS)
        assert [len(each) for each in values] == [1] * 9
        assert len(set().union(*values)) >= 3  # and not constants


def test_exact_orbits_refute_a_wrong_formula():
    assert max(len(each) for each in values_on_orbits(load("euler_top"), "x1^2 + x2^2", EPS)) > 3


@pytest.mark.parametrize(("name", "symbols"), [("euler_top", ["a1", "a2", "a3"]), ("weierstrass", ["g2"])])
def test_formulas_with_symbols_are_those_with_numbers(name, symbols):
    general = integrals_of(name, *symbols)
    assert (len(general.integrals), general.symbols) == (load(name).catalog["codimension"], tuple(symbols))
    assert all(integral.verdict is Certainty.PROVED for integral in general.integrals)
    rng = random.Random(name)
    chosen = {symbol: fmpq(rng.randint(1, 9), rng.randint(1, 9)) for symbol in symbols}
    file = load(name, chosen)
    special = [integral.function for integral in find_integrals(file).integrals]
    # as functions of each other: the gradients span the same space
    texts = [parse_rational_function(integral.text, (*file.variables, "eps"), chosen) for integral in general.integrals]
    assert ranks(texts, special, Laboratory(file).maps[0]) == (len(texts),) * 3
    for entry in general.integrals:
        assert {len(each) for each in values_on_orbits(file, entry.text, EPS, starts=1, **chosen)} == {1}


@pytest.mark.parametrize(("dim", "seed"), [(2, 0), (3, 1)])
def test_random_systems_have_none(dim, seed):
    search = find_integrals(random_system(dim, seed), max_degree=4)
    assert (search.integrals, search.codimension, search.reason, search.toml_section()) == ((), 0, "", "")


@pytest.mark.parametrize(
    ("file", "texts", "period"),
    [
        (system("x y", "0", "0"), ["x", "y"], 1),
        (system("x y", "x", "2*y"), [], None),
        (system("x y", "x", "-y"), ["x*y"], None),
        (system("x", "1"), [], None),
        (system("x y", "y", "-x"), ["x^2 + y^2"], None),
    ],
)
def test_simple_systems(file, texts, period):
    search = find_integrals(file)
    assert ([integral.text for integral in search.integrals], search.profile.period) == (texts, period)
    assert search.is_complete
    assert search.profile.complete


@pytest.mark.parametrize(
    ("file", "eps", "period"), [(system("x y", "y", "-x + x^2"), 1, 4), (system("x", "1 + x^2"), "1/2", 4)]
)
def test_maps_that_are_periodic_at_an_eps(file, eps, period):
    search = find_integrals(file, eps=eps)
    assert (search.profile.period, len(search.integrals)) == (period, file.system.dim)
    assert search.note == closing_note(period, search.eps, file.map)
    assert "nothing follows for other eps" in search.to_json()["note"]
    for entry in search.integrals:
        assert entry.evidence.summary.endswith(f"for eps = {eps}")
        # constant at this eps; at another one they are not all
        assert {len(each) for each in values_on_orbits(file, entry.text, [eps])} == {1}
    others = [len(each) for integral in search.integrals for each in values_on_orbits(file, integral.text, ["1/7"])]
    assert max(others) > 1


@pytest.mark.parametrize("name", ["euler_top", "volterra_periodic_4", "lotka_volterra", "lyness"])
def test_a_search_finds_all_or_says_that_its_budget_was_spent(name):
    file = load(name)
    complete = find_integrals(file).to_json()
    ended = 0
    for units in (100, 3000, 10_000, 30_000, 100_000, 10_000_000):
        search = find_integrals(file, effort=Budget(units))
        messages = "work limit reached" in search.reason
        assert messages or search.to_json() == complete
        ended += messages
    assert 3 <= ended < 6


@settings(max_examples=5)
@given(st.tuples(*[st.integers(-3, 3)] * 10))
def test_hamiltonian_planes_always_have_one(coefficients):
    """H any cubic in the plane: the integral of cmoq-2013 is found, or H is so simple that there is more."""
    monomials = ["x^3", "x^2*y", "x*y^2", "y^3", "x^2", "x*y", "y^2", "x", "y", "1"]
    H = "+".join(f"({c})*{m}" for c, m in zip(coefficients, monomials, strict=True))
    polynomial = parse_rational_function(H, ["x", "y"]).numerator
    file = system("x y", str(polynomial.derivative(1)), str(-polynomial.derivative(0)))
    search = find_integrals(file)
    assert search.integrals
    assert search.is_complete
    for integral in search.integrals:
        assert {len(each) for each in values_on_orbits(file, integral.text, ["1/9"], starts=1, steps=2)} == {1}


@pytest.mark.parametrize("seed", range(2))
def test_spaces_that_are_conjugate_over_an_extension_do_no_harm(seed):
    """At eps = 1, y + sqrt(-3) x and its conjugate have constant cofactors: spaces modulo one prime in two only."""
    search = find_integrals(system("x y", "y", "-3*x"), eps=1, seed=seed)
    assert [integral.text for integral in search.integrals] == ["3*x^2 + y^2", "x*(x^2 - y^2)"]
    assert all(integral.verdict is Certainty.PROVED for integral in search.integrals)


def test_what_another_eps_does_not_repeat_is_no_integral(monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.preserve.search.repeat_search", lambda *_: None)
    search = find_integrals(load("euler_top"))
    assert (search.integrals, search.codimension) == ((), 2)
    assert search.reason == "the polynomials found at one eps do not exist at another"


UP_TO_2 = "relations of degree up to 2 along orbits"
COUNTS = [  # dimension, codimensions by degree, period, with the known ones, by theorems, formulas; what is concluded
    (3, (0, 2), None, 0, 0, 0, (2, True, False), f"there are 2 in all (measured: {UP_TO_2} show 2)"),
    (3, (0, 1), None, 0, 1, 1, (1, False, True),
     f"there is at least 1 in all (1 by theorems: T; measured: {UP_TO_2} show no more)"),
    (3, (0, 1), None, 0, 0, 2, (2, True, True), f"there are 2 in all (measured: {UP_TO_2} show 1; 2 have formulas)"),
    (4, (0, 1), None, 2, 0, 1, (2, False, False), f"there are at least 2 in all (measured: {UP_TO_2} show 2)"),
    (3, (0, 0), None, 0, 0, 0, (0, False, True), f"none shows in {UP_TO_2} (measured)"),
    (1, (0, 0), None, 0, 0, 0, (0, True, True), f"there is no integral (measured, {UP_TO_2})"),
    (3, (), None, 0, 0, 0, (0, False, True), "orbits were not measured"),
    (3, (), None, 0, 3, 3, (3, True, True), "there are 3 in all (3 by theorems: T)"),
    (2, (1, 1), 4, 0, 0, 0, (1, False, False), f"there is at least 1 in all (measured: {UP_TO_2} show 1)"),
]  # fmt: skip


@pytest.mark.parametrize(("dim", "codimensions", "period", "known", "proved", "formulas", "properties", "text"), COUNTS)
def test_integrals_are_counted_by_theorems_orbits_and_formulas(
    dim, codimensions, period, known, proved, formulas, properties, text
):
    profile = Profile(dim, codimensions, codimensions, period, True, True, known)
    search = IntegralSearch(load("riccati"), (), None, 0, (), (None,) * formulas, profile, "", proved, "T")
    assert (search.codimension, search.is_exact, search.is_complete) == properties
    assert search.count_text == text


def test_formulas_with_symbols_that_depend_at_the_values_of_the_file_say_so():
    said = "at a1 = 0, a2 = 0, a3 = 1 only 1 of the 2 formulas is independent"  # x2 and x3 are both constant there
    symbols = ["a1", "a2", "a3"]
    assert said in find_integrals(load("euler_top", {"a1": 0, "a2": 0}), symbols=symbols).reason
    assert integrals_of("euler_top", *symbols).reason == ""


NAMES = "abcdefg"


def of_sums(order):
    """x_{n+N} = 3/(x_{n+1} ... x_{n+N-1}) - x_n - ... - x_{n+N-1}; (P - 3) S is kept, P the product and S the sum.

    With x' = 3/Q - S, Q the product without x_n, P' = Q x' and S' = S - x_n + x': (P' - 3) S' = (P - 3) S.
    """
    x = NAMES[:order]
    return x, f"3/({'*'.join(x[1:])}) - {' - '.join(x)}", [f"({'*'.join(x)} - 3)*({' + '.join(x)})"]


def lyness(order):
    """x_{n+N} = (3 + x_{n+1} + ... + x_{n+N-1})/x_n, and an integral: (3 + S) times all (1 + x_i)/x_i."""
    x = NAMES[:order]
    ones = "*".join(f"({c} + 1)" for c in x)
    return x, f"(3 + {' + '.join(x[1:])})/{x[0]}", [f"(3 + {' + '.join(x)})*{ones}/({'*'.join(x)})"]


def image_of(names, last, scales, order):
    """The map (x_1, ..., x_N) -> (x_2, ..., x_N, last) for y_i = x_i/D_i, the variables in another order."""
    x = {name: f"({scale}*{name})" for name, scale in zip(names, scales, strict=True)}
    text = "".join(x.get(c, c) for c in last)
    images = [f"{x[after]}/({scale})" for after, scale in zip(names[1:], scales, strict=False)]
    images.append(f"({text})/({scales[-1]})")
    return map_file(" ".join(names[k] for k in order), *(images[k] for k in order))


@pytest.mark.parametrize(
    ("case", "count", "scales", "order"),
    [
        (of_sums(4), 2, [1, 1, 1, 1], [0, 1, 2, 3]),
        (of_sums(4), 2, [10**6, "1/3", 7, "2/999983"], [2, 0, 3, 1]),
        (of_sums(5), 3, [1, 1, 1, 1, 1], [0, 1, 2, 3, 4]),
        (lyness(3), 2, [2, "1/5", 10**5], [1, 2, 0]),
        (lyness(4), 2, [1, 1, 1, 1], [0, 1, 2, 3]),
        (("abcd", "(1 + a + b + c + d)/a", []), 0, [1, 1, 1, 1], [0, 1, 2, 3]),
    ],
)
def test_all_integrals_of_recurrences_are_found(case, count, scales, order):
    names, last, known = case
    file = image_of(names, last, scales, order)
    search = find_integrals(file)
    assert (len(search.integrals), search.codimension, search.reason) == (count, count, "")
    assert all(integral.verdict is Certainty.PROVED for integral in search.integrals)
    texts = ["".join(f"({scales[names.index(c)]}*{c})" if c in names else c for c in text) for text in known]
    functions = [parse_rational_function(text, [*file.variables, "eps"]) for text in texts]
    number, _, of_all = ranks([integral.function for integral in search.integrals], functions, Laboratory(file).maps[0])
    assert number == of_all == count  # the known ones are functions of those found
