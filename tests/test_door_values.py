"""Values of Python: maps and systems are equal, copied, pickled and shown in short; wrong arguments are named."""

import copy
import json
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from fractions import Fraction

import flint
import numpy as np
import pytest

import kahanmaps as km
from kahanmaps.algebra.duals import DualField
from kahanmaps.door import opened
from kahanmaps.errors import InputError

FISH = "q' = p; p' = q^2 - q"


def test_maps_are_equal_when_their_equations_are():
    phi = km.map(FISH, "1/5")
    assert phi == km.map(FISH, Fraction(1, 5)) == copy.copy(phi)
    assert hash(phi) == hash(km.map(FISH, "1/5"))
    assert phi @ phi == phi**2 != phi
    assert phi**-1 == phi.inverse == km.map(FISH, "-1/5")
    for other in (km.map(FISH, "1/6"), km.map("q' = p; p' = q^2", "1/5"), km.map("x' = y; y' = x^2 - x", "1/5"), 3):
        assert phi != other


@pytest.mark.parametrize("again", [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
def test_systems_maps_and_orbits_are_copied_and_pickled(again):
    for name in ("lorenz", "paper_m3", "lyness", "henon_heiles", "lv(5,1)"):
        file = km.load(name)
        assert again(file) == file
    phi = km.map(FISH, "1/5")
    assert again(phi @ phi) == phi**2
    assert again(phi).field is phi.field
    assert again(km.System(FISH).system) == km.System(FISH).system
    for arithmetic in ("exact", "float", "mod:101", f"mod:{2**127 - 1}", "ball:100"):
        walk = km.orbit(FISH, [1, 2], "1/5", 3, arithmetic=arithmetic)
        assert list(map(repr, again(walk))) == list(map(repr, walk))
    floats = km.ensemble(FISH, [["1/2", "1/3"], [0, "1/4"]], "1/5", 9)
    assert np.array_equal(again(floats).x, floats.x)


@pytest.mark.parametrize("name", [*km.__all__, "map", "plot"])
def test_public_names_are_the_same_after_a_pickle(name):
    value = getattr(km, name)
    again = pickle.loads(pickle.dumps(value))
    assert again is value or (isinstance(value, str) and again == value)
    for _ in range(2):
        assert getattr(km, name) is value


def test_a_public_function_has_the_name_under_which_it_is_used():
    assert km.cycles is km.cycle_census
    assert km.find_density is km.find_densities
    assert (km.map.__module__, km.map.__qualname__, km.map.__name__) == ("kahanmaps", "map", "map")
    assert km.load.__module__ == "kahanmaps.documents.catalog"  # takes a name only, and is not wrapped


def test_functions_and_their_results_go_to_other_processes_and_back():
    """`spawn`, so that the other process imports what it needs by what it is sent."""
    names = ["euler_top", "volterra_periodic_3"]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        reports = list(pool.map(km.check_integrals, names))
        others = [
            pool.submit(km.find_integrals, "euler_top"),
            pool.submit(km.analyze, "riccati"),
            pool.submit(km.degrees, "lyness"),
            pool.submit(km.map, FISH, "1/5"),
            pool.submit(km.parse_polynomial, "x + y/2", ("x", "y")),
        ]
        search, analysis, growth, phi, polynomial = (other.result() for other in others)
    assert [report.to_json()["claims"] for report in reports] == [
        km.check_integrals(n).to_json()["claims"] for n in names
    ]
    assert [found.text for found in search.integrals] == [
        found.text for found in km.find_integrals("euler_top").integrals
    ]
    assert analysis.sections
    assert analysis.parts is km.Analysis.parts
    assert growth.degrees == km.degrees("lyness").degrees
    assert phi == km.map(FISH, "1/5")
    assert polynomial == km.parse_polynomial("x + y/2", ("x", "y"))


@pytest.mark.parametrize("text", ["0", "2", "-1/3", "nan", "inf"])
def test_balls_are_pickled_exactly(text):
    with flint.ctx.workprec(200):
        ball = flint.arb(flint.fmpq(-1, 3)) if "/" in text else flint.arb(text)
        pickled = pickle.dumps([ball, flint.acb(ball, 1)])
    real, number = pickle.loads(pickled)
    assert repr(real) == repr(number.real) == repr(ball)
    assert real.is_nan() or (real.mid() == ball.mid() and real.rad() == ball.rad())


def test_threads_may_share_a_system():
    file = km.load("lorenz")

    def walked(k: int) -> object:
        return km.orbit(file, [1, 1, k], Fraction(1, k + 3), 6)[6].x

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(walked, range(20))) == [walked(k) for k in range(20)]


def test_nothing_is_shown_at_screen_length():
    for value in (
        km.load("euler_top"),
        km.map(FISH, "1/5") ** 9,
        km.orbit(FISH, [1, 2], "1/5", 12)[12],
        km.orbit(FISH, [1, 2], "1/5", 3),
        km.check_integrals("euler_top"),
        km.verify(m=1),
        km.analyze("weierstrass", seconds=2),
        km.singularities("weierstrass", "1/10"),
        km.find_commuting("weierstrass"),
    ):
        assert len(repr(value)) < 300
        assert " object at " not in repr(value)
    assert str(km.System(FISH)).splitlines() == ["inline:", "q' = p", "p' = q^2 - q"]


def test_every_result_is_plain_data():
    member = km.draw_with_eigenvalues([1, -2], seed=3)
    for found in (
        km.analyze("weierstrass", seconds=2),
        km.check_integrals("euler_top"),
        km.cycles(FISH, "1/7", 11),
        km.lyapunov(FISH, [0.5, 0.25], "1/50", 20),
        km.singularities(FISH, "1/10"),
        km.constant_structures(FISH),
        km.orbit_period(km.normal_form(member), "1/10", [1, 0, 1, 1], 10007),
        km.degrees(FISH, max_terms=4),
        km.heights(FISH, "1/5", starts=1, steps=20),
        km.find_symmetry(FISH),
    ):
        data = found.to_json()
        assert json.loads(json.dumps(data))
        assert " object at " not in json.dumps(data)
    assert km.cycles(FISH, "1/7", 11).to_json()["eps"] == "1/7"
    assert km.constant_structures(FISH).to_json()["forms"] == [[["0", "1"], ["-1", "0"]]]


def test_a_map_at_one_eps_has_orbits():
    phi = km.map(FISH, "1/5")
    assert km.orbit(phi, [1, 2], steps=3).points == km.orbit(FISH, [1, 2], "1/5", 3).points
    assert km.orbit(phi @ phi, [1, 2], steps=2)[1].x == phi(*phi(1, 2))
    assert km.orbit(phi, [1, 2], steps=2, backward=True)[2].x == (phi**-2)([1, 2])
    over = km.KahanMap(km.System(FISH).system, "1/5", km.GF(101))
    assert km.orbit(over, [1, 2], steps=3).rows() == km.orbit(FISH, [1, 2], "1/5", 3, arithmetic=km.GF(101)).rows()
    with pytest.raises(InputError, match="has its eps and its numbers"):
        km.orbit(phi, [1, 2], "1/5", 3)
    with pytest.raises(InputError, match="a map at one eps, expected what it was made of"):
        km.degrees(phi)


def test_floats_start_float_orbits_alone():
    start = np.array([0.1, 0.25])
    for kind in ("float", float):
        assert km.orbit(FISH, start, "1/5", 3, arithmetic=kind).rows() == (
            km.orbit(FISH, ["0.1", "1/4"], "1/5", 3, arithmetic="float").rows()
        )
    with pytest.raises(InputError, match="found the machine number"):
        km.orbit(FISH, start, "1/5", 3)
    with pytest.raises(InputError, match="expected finite numbers"):
        km.orbit(FISH, [float("nan"), 0.0], "1/5", 3, arithmetic="float")


def test_starts_are_one_or_many_of_any_kind_of_number():
    once = km.lyapunov(FISH, [0.5, 0.25], "1/50", 20).mean.tolist()
    for starts in (["1/2", "1/4"], "1/2,1/4", [[Fraction(1, 2), 0.25]]):
        assert km.lyapunov(FISH, starts, "1/50", 20).mean.tolist() == once
    assert len(km.heights(FISH, "1/5", starts=["1/2", 0], steps=20).orbits) == 1


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("phi(None)", "expected 2: q, p"),
        ("phi ** 0.5", "expected an integer"),
        ("km.load(None)", "found a NoneType, expected the name"),
        ("km.load(km.System(FISH))", "found a SystemFile"),
        ('km.orbit(FISH, [1, 2], "1/5", 2.5)', r"steps = 2\.5, expected an integer"),
        ('km.orbit(FISH, None, "1/5", 2)', "found the start None"),
        ('km.orbit(FISH, [1, 2], "1/5", 2, arithmetic=complex)', "expected exact, float"),
        ("km.degrees(FISH, max_terms=2.5)", r"max_terms = 2\.5"),
        ('km.degrees(FISH, seconds="5")', "found '5' seconds, expected a positive"),
        ('km.scan(km.System("q\' = p; p\' = c*q^2", c=1), "c", seconds=-1)', "found -1 seconds"),
        ('km.find_poisson(FISH, "2")', "degree = '2'"),
        ('km.lyapunov(FISH, ["a", 1], "1/5", 9)', "found 'a'"),
        ('km.lyapunov(FISH, [[1, 2], [1]], "1/5", 9)', "different lengths"),
        ('km.portrait(FISH, [1, 2], "1/5", 9, axes=(0, 5))', "numbers below 2"),
        ("km.plot.orbit(5)", r"km\.plot\.orbit\(km\.orbit"),
        ("km.report_html(km.degrees(FISH, max_terms=2))", "found DegreeGrowth, expected an Analysis"),
        ("km.normal_form(FISH)", "expected a member of the family"),
        ('km.orbit_period(FISH, "1/10", [1, 0], 101)', "expected a normal form"),
        ('km.period_over_rationals(FISH, "1/10", [1, 0])', "expected a normal form"),
        ("km.flow_and_map(FISH)", "km.find_integrals"),
        ('km.FloatEnsemble(FISH, "1/20", [[1, 2]])', "expected a system or a map"),
        ('km.period("lorenz", [1, 2, 3], "1/10")', "found no normal form"),
        ("km.height(5)", "expected the coordinates"),
    ],
)
def test_wrong_arguments_are_told_in_a_sentence(expression, words):
    with pytest.raises(InputError, match=words):
        eval(expression, {"km": km, "FISH": FISH, "phi": km.map(FISH, "1/5")})


def test_orbits_go_over_every_field_that_has_numbers_to_print():
    K = km.load("euler_top", a1="root of t^2 - 2").map.root.number_field
    start = [K.generator, 2]
    walk = km.orbit(FISH, start, "1/10", 2, arithmetic=K)
    over = km.System(FISH).map.at("1/10", K)
    assert walk[2].x == over.step(over.step(start))
    assert (str(walk.arithmetic), walk.header()["start"]) == ("exact", ["t", "2"])
    kinds = [(km.QQ, "exact"), (km.GF(101), "mod:101"), (km.RR(64), "ball:64"), (km.CC(64), "ball:64")]
    for field, kind in kinds:
        walk = km.orbit(FISH, [1, 2], "1/10", 2, arithmetic=field)
        assert (str(walk.arithmetic), walk[0].field) == (kind, field)
    for options in ({"at": [2]}, {"steps": 2, "method": "doubling"}):
        with pytest.raises(InputError, match=r"over CC\(64\) orbits go step by step"):
            km.orbit(FISH, [1, 2], "1/10", arithmetic=km.CC(64), **options)
    phi = km.map(FISH, "1/10")
    assert len(km.orbit(phi, [1, 2], steps=2, arithmetic=km.QQ)) == 3
    with pytest.raises(InputError, match="has its eps and its numbers"):
        km.orbit(phi, start, steps=2, arithmetic=K)
    with pytest.raises(InputError, match=r"found the arithmetic DualField\(QQ\), expected exact, .* a field: QQ"):
        km.orbit(FISH, [1, 2], "1/10", 2, arithmetic=DualField(km.QQ))


def test_a_function_without_a_type_cannot_be_opened():
    def untyped(file):
        return file

    with pytest.raises(InputError, match="untyped with file without a type, expected one: SystemFile"):
        opened(untyped)
