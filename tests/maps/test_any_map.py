"""One map, many evaluators: each kind of map in every arithmetic is what the generic step over its field says."""

from math import prod
from pathlib import Path

import numpy as np
import pytest
from flint import fmpq
from helpers import points, rationals, refuses
from hypothesis import assume, given

import kahanmaps as km
from kahanmaps.algebra.duals import DualField
from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.algebra.matrices import det
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.roots import parse_algebraic_point, parse_root
from kahanmaps.checks.claims import Certainty
from kahanmaps.documents.files import parse_system, read_system
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.maps.algebraic import over_number_field
from kahanmaps.maps.bilinear import bilinear_map
from kahanmaps.maps.composed import composed_map
from kahanmaps.maps.floats.float_orbit import FloatEnsemble, FloatOrbit
from kahanmaps.maps.kahan import KahanFamily, KahanMap
from kahanmaps.maps.orbits.orbit import orbit
from kahanmaps.maps.polarised import polarised_map
from kahanmaps.systems.quadratic import QuadraticSystem

EXAMPLES = Path(__file__).parents[2] / "examples" / "maps"
LOTKA_VOLTERRA = QuadraticSystem.from_text(["x", "y"], ["x*(1 - y)", "y*(x - 1)"])


def cubic(*rhs, degree=3):
    names = ["x", "y", "z"][: len(rhs)]
    return polarised_map([parse_polynomial(text, [*names, "eps"]) for text in rhs], degree)


MAPS = {
    "kahan": KahanFamily(LOTKA_VOLTERRA),
    "adjusted": read_system(EXAMPLES / "rescaled-top.toml").map,
    # odd in eps, so that the inverse is not the map at -eps
    "odd": parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x*y + eps*x^2", "y^2 - eps"]').map,
    "bilinear": read_system(EXAMPLES / "symplectic-euler.toml").map,
    "polarised": read_system(EXAMPLES / "duffing.toml").map,
    "explicit": read_system(EXAMPLES / "mcmillan.toml").map,
    "quartic": cubic("y^4 - x", "x*y + eps", degree=4),
    "henon": parse_system('variables = ["x", "y"]\n[map]\nimage = ["y", "x + eps*y^2"]').map,
}
MAPS["composed"] = composed_map(MAPS["bilinear"], (MAPS["explicit"], -1))
MAPS["word"] = composed_map(MAPS["kahan"], (MAPS["bilinear"], -2), MAPS["odd"])


def has_inverse(map_):
    try:
        return map_.at(1).inverse is not None
    except InputError:
        return False


WITH_INVERSE = [name for name, map_ in MAPS.items() if has_inverse(map_)]
every_map = pytest.mark.parametrize("name", MAPS)


def start_of(map_):
    return [fmpq(k + 2, 2 * k + 3) for k in range(map_.dim)]


def generic_orbit(over, start, steps):
    results = [over.point(start)]
    for _ in range(steps):
        results.append(over.generic_step(results[-1]))
    return results


@every_map
def test_integers_over_one_denominator_step_as_rationals_do(name):
    over = MAPS[name].at("1/10")

    @given(points(over.dim))
    def compare(x):
        try:
            image = over.generic_step(x)
        except SingularStep:
            with pytest.raises(SingularStep):
                over.step(x)
            return
        assert over.step(x) == image
        assert over.determinant(x) == prod(det(stage.denominator_matrix(here)) for stage, here in over.stages(x))

    compare()


@pytest.mark.parametrize("name", WITH_INVERSE)
def test_the_inverse_leads_back_and_forth(name):
    over = MAPS[name].at("1/10")

    @given(points(over.dim))
    def compare(x):
        try:
            image, before = over.step(x), over.inverse_step(x)
            assert over.inverse_step(image) == x
            assert over.step(before) == x
        except SingularStep:
            assume(False)

    compare()


@every_map
def test_the_jacobi_matrix_is_that_of_dual_numbers(name):
    map_ = MAPS[name]
    x, n = start_of(map_), map_.dim
    jacobian = map_.at("1/10").jacobian(x)
    for k in range(n):
        duals = DualField(QQ)
        moved = tuple(duals.dual(entry, fmpq(int(i == k))) for i, entry in enumerate(x))
        image = map_.at("1/10", duals).generic_step(moved)
        assert [entry.slope for entry in image] == [jacobian[i, k] for i in range(n)]


@pytest.mark.parametrize(("name", "backward"), [*((name, False) for name in MAPS), *((n, True) for n in WITH_INVERSE)])
def test_machine_numbers_follow_the_exact_orbit(name, backward):
    map_ = MAPS[name]
    over = map_.at("1/10")
    exact = generic_orbit(over.inverse if backward else over, start_of(map_), 5)
    results = [x for _, x in FloatOrbit(map_, "1/10", start_of(map_), 5, kernel="numpy", backward=backward)]
    expected = [[float(int(e.p) / int(e.q)) for e in x] for x in exact]
    assert np.allclose(results, expected, rtol=1e-9, atol=1e-12)  # a dozen roundings of numbers of size 1, magnified


@every_map
def test_kernels_for_machine_numbers_agree_to_the_last_bit(name):
    map_ = MAPS[name]
    starts = np.array([[0.3 + 0.01 * i + 0.1 * k for k in range(map_.dim)] for i in range(100)])
    results = []
    for kernel, count in (("numpy", 100), ("numba", 100), ("numpy", 1), ("numba", 1)):
        ensemble = FloatEnsemble(map_, "1/10", starts[:count], kernel=kernel, threads=1)
        ensemble.advance(5)
        results.append(ensemble.x[:1])
    assert all(np.array_equal(results[0], other, equal_nan=True) for other in results[1:])


@given(points(2), rationals().filter(bool))
def test_kahan_maps_are_bilinear_maps_and_polarised_maps_of_degree_two(x, eps):
    texts = ["X - x - eps*(x + X - x*Y - X*y)", "Y - y - eps*(x*Y + X*y - y - Y)"]
    names = ["x", "y", "X", "Y", "eps"]
    written = bilinear_map(["x", "y"], [parse_polynomial(text, names) for text in texts])
    others = [written, cubic("x*(1 - y)", "y*(x - 1)", degree=2)]
    entry = KahanMap(LOTKA_VOLTERRA, eps)
    for other in others:
        over = other.at(eps)
        assert over.denominator_matrix(x) == entry.denominator_matrix(x)
        assert over.linear_system(x) == entry.linear_system(x)
        assert over.inverse.denominator_matrix(x) == entry.inverse.denominator_matrix(x)
        assert over.numerator_matrix(x, x) == entry.numerator_matrix(x, x)


@given(points(2), rationals().filter(bool))
def test_a_polarised_map_solves_its_defining_equation(x, eps):
    # x' = x^3 + x^2 + eps: (x'' - x)/(4 eps) = x x' x'' + (x x' + x' x'' + x'' x)/3 + eps.
    over = cubic("x^3 + x^2 + eps").at(eps)
    assume(over.determinant(x) != 0)
    a, b = x
    again, c = over.step(x)
    assert again == b
    assert (c - a) / (4 * eps) == a * b * c + (a * b + b * c + c * a) / 3 + eps


@pytest.mark.parametrize("name", ["kahan", "adjusted", "polarised", "explicit", "word"])
@pytest.mark.parametrize("text", ["exact", "mod:1009", "ball:200", "ball:auto", "float"])
def test_the_door_gives_the_orbit_in_every_arithmetic(name, text):
    map_ = MAPS[name]
    walk = orbit(map_, start_of(map_), "1/10" if map_.has_eps else None, steps=3, arithmetic=text)
    results = list(walk)
    assert (walk.end.status, [point.step for point in results]) == ("completed", [0, 1, 2, 3])
    exact = generic_orbit(map_.at("1/10"), start_of(map_), 3)[-1]
    if text == "exact":
        assert results[-1].x == exact
    elif text.startswith("mod"):
        assert results[-1].x == tuple(GF(1009).convert(e) for e in exact)
    else:
        numbers = [float(e) if text == "float" else float(e.mid()) for e in results[-1].x]
        assert np.allclose(numbers, [int(e.p) / int(e.q) for e in exact], rtol=1e-9)


@pytest.mark.parametrize("name", ["euler_top", "paper_m2", "henon_heiles"])
def test_orbits_over_a_number_field_reduce_to_those_modulo_a_prime(name):
    file, root, field = km.load(name), parse_root("root of t^2 - 2"), GF(2**61 - 1)
    point = parse_algebraic_point(",".join(["t"] + ["1"] * (file.dim - 1)), {"t": root}, {})
    map_ = over_number_field(file.map, root)
    exact = list(km.orbit(map_, point.over(root.number_field), "1/3", 3))
    modular = list(km.orbit(map_, point.over(field), "1/3", 3, arithmetic=f"mod:{2**61 - 1}"))
    at_root = root.over(field)
    for item, other in zip(exact, modular, strict=True):
        values = [sum(field.convert(c) * at_root**k for k, c in enumerate(entry.coefficients)) for entry in item.x]
        assert [int(value) for value in values] == [int(entry) for entry in other.x]


def test_a_check_tries_its_claims_along_such_an_orbit():
    root = parse_root("root of t^2 + 1")
    start = parse_algebraic_point("1,t,1", {"t": root}, {}).over(root.number_field)
    settings = km.Settings(eps="1/3", start=start, steps=3)
    held, *_, refuted = km.check_integrals(km.load("euler_top"), settings, {"F1": "F1", "B": "x1*x2"}).findings
    assert (held.verdict, refuted.verdict) == (Certainty.PROVED, Certainty.REFUTED)
    assert "held exactly at 4 points of an orbit" in held.also[-1].summary
    assert "fails at step 0 of an exact orbit" in refuted.also[-1].summary


def test_a_singular_step_names_eps_if_there_is_one():
    refuses("at the point 0,0: the map is", km.load("lyness").map.at(1).step, [0, 0], error=SingularStep)
    refuses("for eps = 1/2: the map is", km.load("riccati").map.at("1/2").step, [fmpq(1, 2)], error=SingularStep)
