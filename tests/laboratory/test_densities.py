"""Invariant measures found from the right-hand sides alone: those of the literature up to integrals, and no others."""

from __future__ import annotations

import random
from fractions import Fraction
from functools import cache, partial
from itertools import islice
from types import SimpleNamespace

import pytest
from flint import fmpq, fmpq_mat
from helpers import quick
from search_helpers import at_residues, random_system, specialised, system, value_of

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.written.text import parse_rational_function
from kahanmaps.checks.claims import Verdict
from kahanmaps.checks.settings import random_starts
from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.inline import System
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import rank
from kahanmaps.laboratory.preserve import densities as module
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.laboratory.preserve.identities import verdict_on
from kahanmaps.maps.kahan import KahanMap

density_verdict = partial(verdict_on, is_density=True)

# lorenz and kirchhoff_generic: searched as far as dimension and time allow, nothing found
WITHOUT = ("lorenz", "kirchhoff_generic")
SMALL_ONES = [name for name in names() if load(name).system.dim <= 4 and name not in WITHOUT]
KNOWN = [name for name in SMALL_ONES if load(name).density is not None]


@cache
def searched(name):
    return find_densities(load(name))


def holds_exactly(file, formula, eps, starts=2, **more):
    """phi(x~) = det dPhi(x) phi(x) at rational points, the derivative of the map computed from its definition."""
    kahan = KahanMap(file.system, eps)
    tried = 0
    for x in islice(random_starts(file.system.dim, 3), 4 * starts):
        try:
            image = kahan.step(x)
            slope = Fraction(str(fmpq_mat(kahan.jacobian(x)).det()))
            after = value_of(formula, file.variables, image, eps, **more)
            before = value_of(formula, file.variables, x, eps, **more)
        except (SingularStep, ZeroDivisionError):
            continue
        tried += 1
        if after != slope * before:
            return False
    return tried >= starts


@pytest.mark.parametrize("name", quick(SMALL_ONES, SMALL_ONES[::2]))
def test_densities_satisfy_the_definition_exactly(name):
    file = load(name)
    found = searched(name)
    assert found.densities
    assert found.reason == found.note == ""
    for one in found.densities:
        assert one.verdict is Verdict.PROVED
        assert all(holds_exactly(file, one.text, eps) for eps in ("1/10", "-2/3"))


@pytest.mark.parametrize("name", KNOWN)
def test_the_density_of_the_literature_is_found_up_to_an_integral(name):
    file = load(name)
    known = file.density
    map_ = Laboratory(file).maps[0]
    for one in searched(name).densities:
        for x, image in map_.pairs(3):
            a, b = (at_residues(known, map_, point) for point in (x, image))
            c, d = (at_residues(one.function, map_, point) for point in (x, image))
            assert (a * d - b * c) % map_.prime == 0


def test_the_least_degree_comes_first():
    # six of degree 4: the products of 1 - eps^2 a_j a_k x_i^2
    found = find_densities(load("euler_top"))
    assert (len(found.densities), found.degree) == (6, 4)
    map_ = Laboratory(load("euler_top")).maps[0]
    points = [map_.random_point() for _ in range(8)]
    rows = [[at_residues(one.function, map_, x) for x in points] for one in found.densities]
    assert rank(rows, map_.prime) == 6


def test_of_hamiltonian_systems_the_determinant_is_taken():
    found = find_densities(load("henon_heiles"))
    assert [(one.text, one.evidence.method) for one in found.densities] == [
        ("4*q1^2*eps^4 + 4*q2^2*eps^4 - eps^4 - 2*eps^2 - 1", "theorem")
    ]
    assert found.degree == 2  # in the variables
    # a factor that depends on eps alone is left out
    assert [one.text for one in find_densities(load("harmonic")).densities] == ["1"]
    # not where a smaller degree was asked for
    assert find_densities(load("henon_heiles"), max_degree=1).densities == ()


def test_quotients():
    # x, y, z are multiplied by m, 1/m, 1/m: det dPhi = 1/m, so that 1/x is a density as y and z are
    file = system("x y z", "x", "-y", "-z")
    assert {one.text for one in find_densities(file).densities} == {"y", "z"}
    for text, verdict in (("1/x", Verdict.PROVED), ("y", Verdict.PROVED), ("x", Verdict.REFUTED)):
        function = parse_rational_function(text, ["x", "y", "z", "eps"])
        assert density_verdict(with_symbols(file), function, None)[0] is verdict


@pytest.mark.parametrize(
    ("name", "symbols"),
    [("euler_top", ["a1", "a2", "a3"]), ("dressing_chain_3", ["b1", "b2", "b3"]), ("weierstrass", ["g2"])],
)
def test_formulas_with_symbols_are_those_with_numbers(name, symbols):
    general = find_densities(load(name), symbols=symbols)
    rng = random.Random(name)
    chosen = {symbol: fmpq(rng.randint(1, 9), rng.randint(1, 9)) for symbol in symbols}
    file = load(name, chosen)
    special = find_densities(file)
    assert len(general.densities) == len(special.densities) > 0
    map_ = Laboratory(file).maps[0]
    field = GF(map_.prime)
    points = [[field.convert(c) for c in (*map_.random_point(), map_.eps)] for _ in range(9)]
    rows = [[int(specialised(one.function, chosen, field, p)) for p in points] for one in general.densities]
    more = [[int(one.function.value(field, p)) for p in points] for one in special.densities]
    assert rank(rows, map_.prime) == rank([*rows, *more], map_.prime) == len(rows)
    for one in general.densities:
        assert one.verdict is Verdict.PROVED
        assert holds_exactly(file, one.text, "1/7", **chosen)


@pytest.mark.parametrize(("dim", "seed"), [(2, 0), (2, 1), (3, 0), (3, 1)])
def test_random_systems_have_none(dim, seed):
    found = find_densities(random_system(dim, seed), max_degree=5)
    assert (found.densities, found.degree, found.toml_section()) == ((), 5, "")
    assert found.reason == "no polynomial of degree at most 5, and no product of powers of known ones, is a density"


def test_lorenz_has_none():
    assert find_densities(load("lorenz"), max_degree=6).densities == ()


@pytest.mark.parametrize(
    ("text", "verdict"), [("x*y", "proved"), ("x*y + x", "refuted"), ("x*y*(1 + eps^7)", "proved")]
)
def test_identities_of_lotka_volterra(text, verdict):
    function = parse_rational_function(text, ["x", "y", "eps"])
    assert str(density_verdict(with_symbols(load("lotka_volterra")), function, None)[0]) == verdict


def test_a_perturbed_system_loses_its_density():
    assert find_densities(system("x y", "x*(1 - y) + y^2/9", "y*(x - 1)"), max_degree=5).densities == ()


def test_maps_that_are_not_invertible_have_no_density():
    # all images are the origin: phi(x~) det(I - eps f') = phi det(I + eps f'(x~)) says 0 = 0 for phi = x
    file = system("x y", "-x", "-y")
    found = find_densities(file, eps=1)
    assert (found.densities, "not invertible" in found.reason) == ((), True)
    function = parse_rational_function("x", ["x", "y", "eps"])
    assert density_verdict(with_symbols(file), function, fmpq(1))[0] is Verdict.UNDECIDED
    assert "no value anywhere" in find_densities(system("x y", "x", "3*y"), eps=1).reason


@pytest.mark.parametrize(
    ("file", "texts"),
    [
        (system("x y", "0", "0"), ["1"]),
        (system("x", "0"), ["1"]),
        (system("x", "1"), ["1"]),
        (system("x", "x"), ["x"]),
        (system("x", "x^2"), ["x^2"]),
        (system("x", "1 + x^2"), ["x^2 + 1"]),
        (system("x y", "x", "2*y"), ["x*y"]),
        (system("x y", "1", "2"), ["1"]),
        (system("x y z", "y", "-x", "1"), ["1"]),
    ],
)
def test_simple_systems(file, texts):
    assert [one.text for one in find_densities(file).densities] == texts


def test_maps_that_are_periodic_at_an_eps_are_told():
    found = find_densities(load("henon_heiles"), eps=1)
    assert (found.period, found.to_json()["period"]) == (4, 4)
    assert found.note.endswith("at eps = 1 the map is periodic (measured); nothing follows for other eps")
    assert found.toml_section().startswith("# for eps = 1 only")
    assert find_densities(load("henon_heiles"), eps="1/2").note == ""


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"eps": 0}, "found eps = 0"),
        ({"symbols": ["eps"], "eps": 1}, "found eps both"),
        ({"symbols": ["b"]}, "found the symbol 'b'"),
        ({"seconds": 0}, "found 0 seconds"),
        ({"max_degree": -1}, "found the largest degree -1"),
    ],
)
def test_wrong_use(options, words):
    with pytest.raises(InputError) as caught:
        find_densities(load("euler_top"), **options)
    assert words in str(caught.value)


def test_too_little_time_is_told():
    found = find_densities(load("lorenz"), seconds=1e-9)
    assert (found.densities, found.reason) == ((), "the time was over at degree 0")


def test_the_same_seed_gives_the_same():
    documents = [find_densities(load("zhukovski_volterra_1"), seed=seed).to_json() for seed in (3, 3)]
    assert documents[0] == documents[1]


def test_sizes_are_limited(monkeypatch):
    monkeypatch.setattr(module, "_MAX_UNKNOWNS", 30)
    assert find_densities(load("lorenz"), max_degree=8).degree == 3  # 35 monomials of degree 4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["clebsch_first_flow", "so4_euler_manakov", "volterra_periodic_5"])
def test_dimensions_five_and_six(name):
    file = load(name)
    found = find_densities(file)
    assert found.densities
    assert all(one.verdict.holds for one in found.densities)
    assert all(holds_exactly(file, one.text, "1/10", starts=1) for one in found.densities)


def test_the_check_by_definition_tells_a_wrong_density():
    assert not holds_exactly(load("lotka_volterra"), "x*y + x", "1/10")


def test_the_theorem_needs_a_determinant_that_is_a_polynomial_and_not_0(monkeypatch):
    saddle = system("x y", "x", "-y")  # det(I - eps f') = 1 - eps^2
    assert module._theorem(Laboratory(saddle, (), fmpq(1))) is None
    found = module._theorem(Laboratory(load("henon_heiles"), (), fmpq(1, 2)))
    assert (found.verdict, found.function.denominator) == (Verdict.PROVED, 1)
    point = (fmpq(3), fmpq(-2), fmpq(5), fmpq(7))
    determinants = [KahanMap(load("henon_heiles").system, "1/2").determinant(x) for x in (point, (fmpq(0),) * 4)]
    values = [found.function.numerator(*x, fmpq(1, 2)) for x in (point, (fmpq(0),) * 4)]
    assert values[0] * determinants[1] == values[1] * determinants[0] != 0
    assert module._theorem(Laboratory(load("lorenz"), (), fmpq(1, 2))) is None
    monkeypatch.setattr(module, "determinant_polynomial", lambda _: None)
    assert module._theorem(Laboratory(load("henon_heiles"), (), fmpq(1, 2))) is None


def test_the_theorem_leaves_out_factors_without_variables_and_wants_numbers_in_few_dimensions(monkeypatch):
    file = system("x y z w", "x", "-y", "w", "z^2")  # det(I - eps f') = (1 - eps^2) (1 - 2 eps^2 z)
    found = module._theorem(Laboratory(file, ()))
    assert found.function == parse_rational_function("2*eps^2*z - 1", ["x", "y", "z", "w", "eps"])
    with_symbol = system("x y", "a*x", "-a*y + x^2", a="2")
    assert module._theorem(Laboratory(with_symbol, ())) is not None
    assert module._theorem(Laboratory(with_symbol, ("a",))) is None
    monkeypatch.setattr(module, "MAX_DIMENSION", 4)
    assert module._theorem(Laboratory(file, ())) is not None
    monkeypatch.setattr(module, "MAX_DIMENSION", 3)
    assert module._theorem(Laboratory(file, ())) is None


def test_a_density_without_a_closed_form_is_told():
    laboratory = SimpleNamespace(formulas=lambda *_: SimpleNamespace(bases=None, reason="too long"))
    assert module._formulas(laboratory, None, 3, 0.0) == (
        [],
        "there is a density of degree 3 modulo primes, but no closed form: too long",
    )


def test_factors_of_integrals_make_a_density_of_a_degree_that_is_not_searched():
    tops = System("x' = 2*y*z; y' = -x*z; z' = -x*y; u' = v*w; v' = -3*u*w; w' = 2*u*v")
    found = find_densities(tops)
    assert [(one.degree(6), one.verdict) for one in found.densities] == [(8, Verdict.PROVED)]
    assert found.degree == 8
    assert find_densities(tops, integrals=()).densities == ()


def test_a_proved_density_comes_before_supported_ones_of_less_degree():
    found = find_densities(load("lv(5,1)")).densities
    assert [(one.text, str(one.verdict)) for one in found[:1]] == [("x1*x2*x3*x4*x5", "proved")]
    assert [str(one.verdict) for one in find_densities(load("lv(5,1)"), max_degree=4).densities] == ["supported"]
