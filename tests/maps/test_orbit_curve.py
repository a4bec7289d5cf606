"""The curve of an orbit: models and heights against PARI, level curves and exact orbits, rotation against floats."""

import json
import math
from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq
from helpers import gp, refuses
from planar_helpers import mean_turn

import kahanmaps as km
from kahanmaps.algebra.elliptic_curves import EllipticCurve, canonical_height
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.documents.files import parse_system
from kahanmaps.errors import UnknownCurve
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.orbits.relations.level_curve import is_conserved, level_curve
from kahanmaps.maps.orbits.relations.orbit_curve import _on_singular_cubic, orbit_curve

START, SPATIAL = ["1/3", "2/5"], ["1/3", "2/5", "3/7"]
ORBITS = {
    "mcmillan": (START, None),
    "lyness": (START, None),
    "qrt_symmetric": (START, None),
    "qrt_asymmetric": (START, None),
    "weierstrass": (START, "1/10"),
    "nahm_octahedral": (START, "1/10"),
    "euler_top": (SPATIAL, "1/10"),
    "todd": (SPATIAL, None),
}


@pytest.mark.parametrize("name", ORBITS)
def test_j_invariant_and_height_agree_with_pari(name):
    orbit = km.geometry(name, *ORBITS[name])
    model, point = f"[{orbit.curve.a4},{orbit.curve.a6}]", f"[{orbit.point[0]},{orbit.point[1]}]"
    script = f"E=ellinit({model}); print(ellisoncurve(E,{point})); print(E.j); print(ellheight(E,{point})/2);"
    script += "print(ellminimalmodel(E).disc); print(#ellglobalred(E)[4]~)"
    lines = gp(script)
    assert lines[0] == "1"
    assert fmpq(*map(int, (lines[1] + "/1").split("/")[:2])) == orbit.j
    assert abs(float(lines[2]) - float(orbit.height.mid())) < 1e-12
    assert float(orbit.height.rad()) < 1e-15
    assert [orbit.bad_primes.minimal_discriminant, len(orbit.bad_primes.bad)] == [int(line) for line in lines[3:]]


@pytest.mark.parametrize("start", [START, ["1/2", "-3"]])
def test_the_j_invariant_is_that_of_the_biquadratic_level_curve(start):
    """McMillan's map with a = 1/2 conserves I = x^2 y^2 - x^2 - y^2 + x y: a double cover of the y-line."""
    x, y = (fmpq(*Fraction(entry).as_integer_ratio()) for entry in start)
    level = x * x * y * y - x * x - y * y + x * y
    # (y^2 - 1) x^2 + y x - (y^2 + I): the discriminant is y^2 + 4 (y^2 - 1) (y^2 + I) = a y^4 + c y^2 + e.
    a, c, e = 4, 1 + 4 * level - 4, -4 * level
    I, J = 12 * a * e + c * c, 72 * a * c * e - 2 * c**3  # the invariants of a quartic
    expected = 6912 * I**3 / (4 * I**3 - J * J)
    assert km.geometry("mcmillan", start).j == expected
    assert km.geometry("mcmillan", ["1/8", "2/5"]).j != expected


def test_the_curve_of_a_member_is_its_level_cubic():
    system = km.load("nahm_tetrahedral")
    plane = km.geometry(system, [1, 2], "1/10").planes[0]
    orbit = orbit_curve(system.at("1/10"), [1, 2])
    assert orbit.j == plane.j
    assert abs(float(orbit.height.mid()) - plane.height) < 1e-12
    assert orbit.rotation.overlaps(plane.rotations[0].number)
    assert orbit.height_constant == pytest.approx(km.geometry(system, [1, 2], "1/10").height_constant, rel=1e-12)


@pytest.mark.parametrize("name", [*ORBITS, "hky", "volterra_periodic_4"])
def test_heights_grow_as_the_canonical_height_says(name):
    """Of bits(n) = C n^2 + b n + O(1) the linear part cancels in bits(2n) - 2 bits(n)."""
    start, eps = ORBITS.get(name, ([*SPATIAL, "1/5"], "1/10") if name[0] == "v" else (START, None))
    constant = km.geometry(name, start, eps).height_constant
    n = math.ceil(math.sqrt(10_000 / constant))
    orbit = km.orbit(km.load(name), start, eps or 1, at=[n, 2 * n])
    points = [step.x for step in orbit]
    first, second = (max(max(abs(int(x.p)), int(x.q)).bit_length() for x in point) for point in points)
    measured = (second - 2 * first) / (2 * n * n)
    assert abs(measured / constant - 1) < 1e-3


@pytest.mark.parametrize(
    ("name", "axes", "center"),
    [
        ("mcmillan", (0, 1), (0, 0)),
        ("lyness", (0, 1), None),
        ("weierstrass", (0, 1), None),
        ("euler_top", (1, 2), (0, 0)),
    ],
)
def test_the_rotation_number_is_that_of_a_float_orbit(name, axes, center):
    start, eps = (["-1/2", "1/10"], "1/10") if name == "weierstrass" else ORBITS[name]
    start = ["3", "1/7", "1/5"] if name == "euler_top" else start
    orbit = km.geometry(name, start, eps)
    ensemble = FloatEnsemble(km.load(name), eps or 1, np.array([[float(Fraction(x)) for x in start]]))
    points = np.concatenate([portion[:, 0] for portion in ensemble.records(60_000, 1)])[:, axes]
    points = points - (np.mean(points, axis=0) if center is None else center)
    measured = mean_turn(np.arctan2(points[:, 1], points[:, 0]), 2 * math.pi)
    assert (orbit.iterate, orbit.steps) == (1, 1)
    assert abs(measured - float(orbit.rotation)) < 1e-10
    assert abs(measured - float(km.geometry(name, [*start[:-1], "1/6"], eps).rotation)) > 1e-6


def test_a_rational_curve_has_a_multiplier():
    """Kahan's map of x' = y, y' = -x is the rotation by the angle 2 arctan eps."""
    orbit = km.geometry("harmonic", [1, 2], "1/10")
    assert (orbit.genus, orbit.trace) == (0, fmpq(2 * 99, 101))
    assert float(orbit.rotation) == pytest.approx(math.atan(0.1) / math.pi, abs=1e-15)
    parabolic = km.geometry(km.System("x' = 1; y' = x"), [1, 2], "1/10")
    assert (parabolic.genus, parabolic.trace, parabolic.rotation) == (0, 2, None)


@pytest.mark.parametrize(
    ("image", "start", "trace"),
    [
        (["x + 1", "y + x^2"], [1, 2], 2),
        (["2*x", "8*y"], [1, 3], fmpq(5, 2)),
        (["(3*x - 4)/(4*x + 3)", "625*y/(4*x + 3)^4"], [1, 3], fmpq(-14, 25)),
        (["2*x", "3*y"], [1, 3], None),
    ],
)
def test_rational_curves_with_a_coordinate_as_parameter_are_found(image, start, trace):
    """Three curves like y = x^3, y = 3 x^3 and y = 3 (1 + x^2)^2/4; y = 3 x^(log 3/log 2) is not algebraic."""
    map_over = parse_system(f'variables = ["x", "y"]\n[map]\nimage = {json.dumps(image)}').map.at(fmpq(1), QQ)
    if trace is None:
        with pytest.raises(UnknownCurve, match="rational curves of degree at most 6"):
            orbit_curve(map_over, start)
    else:
        orbit = orbit_curve(map_over, start)
        assert (orbit.genus, orbit.trace, orbit.is_dense) == (0, trace, abs(trace) < 2)


@pytest.mark.parametrize("t", [fmpq(3), fmpq(2, 5), fmpq(-7, 2)])
def test_on_a_nodal_cubic_the_translation_is_a_multiplication(t):
    """On Y^2 = x^2 (x + 1) the point with Y = t x has kappa = (t + 1)/(t - 1)."""
    x = t * t - 1
    kappa = (t + 1) / (t - 1)
    assert _on_singular_cubic(EllipticCurve(fmpq(1), fmpq(0), fmpq(0)), (x, t * x), 1).trace == kappa + 1 / kappa
    cusp = _on_singular_cubic(EllipticCurve(fmpq(3), fmpq(3), fmpq(1)), (t * t - 1, t**3), 1)
    assert cusp.trace == 2


def test_heights_of_multiples_are_quadratic_and_torsion_has_height_0():
    E, P = EllipticCurve(fmpq(1, 3), fmpq(-7, 4), fmpq(2)), (fmpq(1, 2), fmpq(0))
    E = EllipticCurve(E.a2, E.a4, -(P[0] ** 3 + E.a2 * P[0] ** 2 + E.a4 * P[0]) + 1)
    P = (P[0], fmpq(1))
    height = canonical_height(E, P)
    assert (canonical_height(E, E.multiple(5, P)) - 25 * height).contains(0)
    assert not (canonical_height(E, E.multiple(5, P)) - 24 * height).contains(0)
    torsion = EllipticCurve(fmpq(0), fmpq(0), fmpq(1)), (fmpq(2), fmpq(3))
    assert torsion[0].order(torsion[1]) == 6
    assert canonical_height(*torsion).contains(0)


def test_for_very_small_eps_the_rotation_number_is_proportional_to_eps():
    for name, start in (("harmonic", [1, 2]), ("weierstrass", START)):
        first, second = (km.geometry(name, start, fmpq(1, 10**k)).rotation for k in (30, 31))
        assert float(first / second) == pytest.approx(10, rel=1e-15)
        assert first > 0


def test_coefficients_that_are_too_long_are_undecided_with_a_hint(monkeypatch):
    monkeypatch.setattr("kahanmaps.maps.orbits.relations.orbit_curve._MAX_BITS", 1000)
    with pytest.raises(UnknownCurve, match=r"seems to lie on an elliptic curve.*fewer digits"):
        km.geometry("euler_top", SPATIAL, "1/1000003")


PLANAR = ["mcmillan", "lyness", "qrt_symmetric", "weierstrass", "discrete_painleve_1", "somos_4", "somos_5"]


@pytest.mark.parametrize("name", [*PLANAR, "zander_111", "planar_cubic_hamiltonian"])
def test_the_level_curve_of_an_integral_is_the_curve_of_the_orbit(name):
    """Two ways to the same curve: by the sequences of the orbit, and by a projection of the level curve."""
    file, eps = km.load(name), fmpq(1, 10)
    map_over = file.at(eps) if file.map.has_eps else file.at()
    start = [fmpq(1, 3), fmpq(2, 5)]
    orbit = orbit_curve(map_over, start)
    (integral,) = file.integrals.values()
    points = [tuple(start)]
    for _ in range(5):
        points.append(map_over.step(points[-1]))
    found, point, F = level_curve(integral, map_over.eps, points)
    curve, point = found.short_model(point)
    assert is_conserved(file.map, map_over.eps, integral)
    assert (curve.a4, curve.a6, point[0]) == (orbit.curve.a4, orbit.curve.a6, orbit.point[0])
    degree = max(map(int, F.degrees())) if file.kind == "map" else int(F.total_degree())
    assert degree == pytest.approx(orbit.height_constant * math.log(2) / float(orbit.height), rel=1e-12)


def test_a_function_that_is_not_conserved_is_no_integral():
    file = km.load("mcmillan")
    assert is_conserved(file.map, fmpq(1), file.integrals["I"])
    assert not is_conserved(file.map, fmpq(1), parse_rational_function("x^2*y^2 - x^2 - y^2", ["x", "y", "eps"]))


@pytest.mark.parametrize(("parameters", "start", "order"), [({"a": 1}, START, 5), ({}, ["1", "2"], None)])
def test_periodic_and_special_orbits_have_a_curve(parameters, start, order):
    """For a = 1 all orbits of Lyness' map have period 5; the sequence U of the orbit of (1, 2) has a zero."""
    system = km.load("lyness").subs(**parameters)
    orbit = km.geometry(system, start)
    assert (orbit.genus, orbit.iterate, orbit.order, orbit.is_dense) == (1, 1, order, order is None)
    if order:
        assert (order * orbit.rotation - 1).contains(0)
        assert orbit.height_constant is None
        refuses("the orbit has period 5", orbit_curve, system.at(), [fmpq(1, 3), fmpq(2, 5)])


def test_a_finite_orbit_without_an_integral_and_a_map_with_algebraic_parameters_are_refused():
    refuses("the orbit has period 4", km.geometry, "harmonic", [1, 2], 1)
    system = km.load("euler_top").subs(a1="sqrt(2)")
    refuses("expected rational parameters", km.geometry, system, [1, 2, 3], "1/10")
    refuses("expected rational parameters", km.plot.rotation, system, [1, 2, 3], [2, 2, 3], eps="1/10")


@pytest.mark.parametrize("start", [["1/3", "2/5"], [2, 3], ["1/5", -7]])
def test_the_printed_discriminant_and_components_are_those_of_the_printed_cubic(start):
    curve = km.geometry("mcmillan", start)
    data = curve.to_json()
    A, B = Fraction(data["A"]), Fraction(data["B"])
    discriminant = -16 * (4 * A**3 + 27 * B**2)
    assert Fraction(data["discriminant"]) == discriminant
    assert f"discriminant\t{discriminant}," in str(curve)
    largest = float(max(abs(A) ** Fraction(1, 2), abs(B) ** Fraction(1, 3)))  # so that roots are of size 1
    roots = np.roots([1, 0, float(A) / largest**2, float(B) / largest**3])
    assert data["components"] == (2 if np.sum(np.abs(roots.imag) < 1e-9) == 3 else 1)
