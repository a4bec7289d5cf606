"""Geometry of the level sets: j-invariants, rotation numbers and heights, each against an independent computation."""

import itertools
import math
import random
from fractions import Fraction

import numpy as np
import pytest
from flint import arb, fmpq, fmpq_poly, fmpz
from helpers import gp
from planar_helpers import mean_turn

from kahanmaps import FloatEnsemble, QuadraticSystem, geometry, load, orbit
from kahanmaps.algebra.elliptic_curves import canonical_height as height_on
from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import RR
from kahanmaps.algebra.reduction import bad_primes_of_plane
from kahanmaps.family.random_members import random_member_with_chi
from kahanmaps.maps.normal_form.closure import closure, excluded_relations, separating_prime
from kahanmaps.maps.normal_form.division import PeriodicLevels
from kahanmaps.maps.normal_form.geometry import geometry_of, rotations_of
from kahanmaps.maps.normal_form.level_curves import Jacobian
from kahanmaps.maps.normal_form.periods import PeriodKind, classify
from kahanmaps.maps.normal_form.planar_block import PlanarBlock
from kahanmaps.maps.normal_form.plane_heights import plane_height

POINT = PlanarBlock(fmpq(1), fmpq(0), fmpq(0), fmpq(1)), (fmpq(1), fmpq(0), fmpq(1))  # disc = -27, h = 1


def canonical_height(gamma):
    """That of T on its Jacobian."""
    curve = Jacobian(gamma)
    return float(height_on(curve, curve.T).mid())


def hamiltonian_flow(a, b, c, d):
    """x' = h_y, y' = -h_x for h = a x^3 + b x^2 y + c x y^2 + d y^3."""
    return QuadraticSystem.from_text(
        ["x", "y"], [f"{b}*x^2 + {2 * c}*x*y + {3 * d}*y^2", f"-{3 * a}*x^2 - {2 * b}*x*y - ({c})*y^2"]
    )


def planar_orbit(cubic, start, eps, steps):
    """Points of Kahan's map in floats, by Cramer's rule."""
    a, b, c, d = cubic
    eps, (x, y) = float(Fraction(eps)), (float(Fraction(entry)) for entry in start)
    points = [(x, y)]
    for _ in range(steps):
        p, q, r = eps * (2 * b * x + 2 * c * y), eps * (2 * c * x + 6 * d * y), eps * (6 * a * x + 2 * b * y)
        det = 1 - p * p + q * r
        x, y = ((1 + p) * x + q * y) / det, ((1 - p) * y - r * x) / det
        points.append((x, y))
    return np.array(points)


@pytest.mark.parametrize(
    ("cubic", "start", "eps"),
    [
        ((1, 0, 0, 1), ["1", "2"], "1/100"),
        ((1, 0, -1, 0), ["1", "3/10"], "1/50"),
        ((1, 2, 0, -3), ["1/2", "1"], "1/100"),
    ],
)
def test_the_rotation_number_is_that_of_a_float_orbit(cubic, start, eps):
    """Every line through the origin meets the level curve in one point near the cubic of the flow."""
    (rotation,) = geometry(hamiltonian_flow(*cubic), start, eps).planes[0].rotations
    points = planar_orbit(cubic, start, eps, 40_000)
    measured = mean_turn(np.arctan2(points[:, 1], points[:, 0]), math.pi)
    assert rotation.steps == 1
    assert abs(measured - float(rotation.number)) < 1e-10
    assert abs(measured - float(rotation.flow)) > 1e-8  # which the flow does not have
    assert abs(float(rotation.flow / rotation.number) - 1) < 0.01


def test_two_real_components_are_exchanged_and_the_second_iterate_turns():
    cubic, start, eps = (1, 0, -1, 0), ["2", "1/10"], "7/10"
    plane = geometry(hamiltonian_flow(*cubic), start, eps).planes[0]
    assert plane.delta > 1
    (rotation,) = plane.rotations
    assert (rotation.steps, rotation.component, rotation.phase_error) == (2, "unbounded", None)
    image = list(orbit(hamiltonian_flow(*cubic), start, eps, 1))[-1].x
    assert geometry(hamiltonian_flow(*cubic), image, eps).planes[0].rotations[0].component == "oval"
    oval = planar_orbit(cubic, start, eps, 40_000)[1::2]  # the component that is bounded here
    measured = mean_turn(np.arctan2(*(oval - np.median(oval, axis=0)).T[::-1]), 2 * math.pi)
    assert abs(measured - float(rotation.number)) < 1e-8


@pytest.mark.parametrize("digits", [60, 200])
def test_levels_that_are_almost_singular_have_the_rotation_numbers_of_the_limits(digits):
    """At gamma = 0 the rotation number is 1/6, or 1/3 for the second iterate, up to 1/log; at gamma = 1 it is 0.

    There it is proportional to the sixth root of delta, and at gamma = infinity it is 1/4.
    """
    tiny = fmpq(1, 10**digits)

    def rho(gamma):
        (rotation,) = rotations_of(gamma, *POINT, "t = 0")
        assert float(rotation.number.rad()) < 1e-15
        return float(rotation.number)

    assert abs(rho(tiny) - 1 / 6) < 0.1 / digits
    assert abs(rho(-tiny) - 1 / 3) < 0.3 / digits
    assert rho(1 / tiny) == pytest.approx(1 / 4, abs=1e-15)
    for sign in (1, -1):
        assert rho(1 - sign * tiny) / rho(1 - sign * tiny / 10**6) == pytest.approx(10, rel=1e-8)


@pytest.mark.parametrize("name", ["nahm_tetrahedral", "paper_m3_irreducible"])
def test_for_very_small_eps_the_rotation_number_is_that_of_the_flow(name):
    start = [1, 2, 3, 4, 5, 6][: load(name).dim]
    for plane in geometry(load(name), start, fmpq(1, 10**50)).planes:
        for rotation in plane.rotations:
            if rotation.flow is not None:
                assert float((rotation.number / rotation.flow - 1).mid()) == pytest.approx(0, abs=1e-15)


def test_at_complex_roots_the_orbit_returns_when_multiples_of_the_translation_are_small():
    system = random_member_with_chi(fmpq_poly([1, 0, 1]), seed=1).chosen.system
    start, eps = ["1/3", "1/2", "-1/5", "1/7"], "1/20"
    (rotation,) = geometry(system, start, eps).planes[0].rotations
    ensemble = FloatEnsemble(system, eps, np.array([[float(Fraction(x)) for x in start]]))
    points = np.concatenate([portion[:, 0] for portion in ensemble.records(20_000, 1)])
    moved = np.abs(points[1:] - points[0]).max(axis=1)
    close = np.quantile(moved, 0.002)

    def returns(shift):
        """Whether the orbit is close to its start after those numbers of steps for which this shift returns best."""
        multiples = np.arange(1, 20_001)[:, None] * shift
        return bool((moved[np.abs(multiples - np.round(multiples)).max(axis=1).argsort()[:4]] < close).all())

    shift = np.array([float(x) for x in rotation.numbers])
    assert len(shift) == 2
    assert returns(shift)
    assert not returns(shift * [1.001, 1])
    assert not returns(shift * [1, 1.001])


HEIGHTS = [("nahm_tetrahedral", 1), ("paper_m2", 1), ("paper_m3_irreducible", 3)]
HEIGHTS += [([-2, 0, 1], 2), ([1, 0, 1], 2), ([1, -3, 0, 1], 3)]  # chi


@pytest.mark.parametrize(("system", "degree"), HEIGHTS, ids=str)
def test_heights_agree_with_exact_orbits(system, degree):
    """C of bits(n) = C n^2 + b n + O(1), from two points."""
    if isinstance(system, list):
        system = random_member_with_chi(fmpq_poly(system), seed=3).chosen.system
    else:
        system = load(system).system
    start = {2: [1, 2], 4: [3, 1, "2/3", "3/2"], 6: [1, 2, 3, 4, 5, 6]}[system.dim]
    result, lengths = geometry(system, start, "1/10"), []
    for step in orbit(system, start, "1/10", at=[60, 120], max_digits=1_000_000):
        denominator = math.lcm(*(int(x.q) for x in step.x))
        lengths.append(max(abs(int(x.p) * denominator // int(x.q)).bit_length() for x in step.x))
    assert all(plane.degree == degree for plane in result.planes)
    assert result.rank == len(start) // 2
    assert all(plane.height_error <= 1e-3 * plane.height for plane in result.planes)
    assert abs((lengths[1] - 2 * lengths[0]) / (2 * 60 * 60) / result.height_constant - 1) < 1e-3


def test_the_height_is_absolute():
    """Over Q(sqrt 2) the height of a point over Q is the same, also where the model has to be reduced by sqrt 2."""
    K = EtaleAlgebra(fmpq_poly([-2, 0, 1]))
    for unit in (K.one, K.generator, K.generator + 1):
        block = PlanarBlock(*(unit * c for c in (1, 2, 0, -3)))
        height = plane_height(block, (K.convert(fmpq(1, 2)), K.convert(3), unit))
        level = PlanarBlock(fmpq(1), fmpq(2), fmpq(0), fmpq(-3))
        _, gamma = classify(level, (fmpq(1, 2), fmpq(3), fmpq(1)))
        assert abs(float(height.mid()) - canonical_height(gamma)) < 1e-12
    other = plane_height(block, (K.convert(fmpq(1, 2)), K.convert(3), 2 * unit))
    assert not other.overlaps(height)


@pytest.mark.parametrize("multiples", [24, 1])
def test_a_height_without_a_good_multiple_has_a_proved_error(monkeypatch, multiples):
    """One multiple is not enough for nonsingular reduction here; the wide ball contains the narrow one."""
    K = EtaleAlgebra(fmpq_poly([-2, 0, 1]))
    block = PlanarBlock(*(K.convert(c) for c in (1, 2, 0, -3)))
    point = K.convert(fmpq(1, 2)), K.generator, K.one
    narrow = plane_height(block, point)
    monkeypatch.setattr("kahanmaps.maps.normal_form.plane_heights._MULTIPLES", multiples)
    wide = plane_height(block, point)
    assert wide.overlaps(narrow)
    assert (float(wide.rad()) < 1e-12) is (multiples == 24)
    assert float(wide.rad()) < 1e-2


@pytest.mark.parametrize("gamma", [fmpq(3), fmpq(48412, 46225), fmpq(-70, 11)])
def test_j_invariant_and_height_agree_with_pari(gamma):
    delta = 1 - gamma
    j = 27 * delta * (delta + 8) ** 3 / (delta - 1) ** 3
    script = f"g={gamma}; E=ellinit([0,9+3*g,0,48*g,64*g^2]); print(E.j); print(ellheight(E,[0,8*g])/2)"
    lines = gp(script)
    assert fmpq(*map(int, (lines[0] + "/1").split("/")[:2])) == j
    assert abs(float(lines[1]) - canonical_height(gamma)) < 1e-11


def test_the_height_of_a_long_gamma_is_the_limit_of_heights_of_multiples():
    gamma = 1 - fmpq(1, 10**60 + 7)
    curve = Jacobian(gamma)
    x, _ = curve.multiple(128, curve.T)
    bits = max(abs(int(x.p)), int(x.q)).bit_length()
    assert abs(bits * math.log(2) / 2 / 128**2 - canonical_height(gamma)) < 0.02


def test_a_level_of_three_lines_and_a_fixed_point_have_no_curve():
    planes = geometry(load("paper_m2"), [1, 2, 3, 4], "1/10").planes
    assert planes[0].kind is PeriodKind.TRIANGLE
    assert planes[0].j is None
    assert planes[1].kind is PeriodKind.SMOOTH
    assert {plane.kind for plane in geometry(load("paper_m2"), [0, 0, 0, 0], "1/10").planes} == {PeriodKind.FIXED}


@pytest.mark.parametrize("name", ["paper_m2", "paper_m3_irreducible"])
def test_the_translation_lies_on_the_printed_curve_which_has_the_printed_discriminant(name):
    start = [fmpq(1, 2), fmpq(-1, 3), fmpq(2, 5), fmpq(1), fmpq(3, 4), fmpq(-2, 7)][: load(name).dim]
    for plane in geometry(name, start, eps="1/10").planes:
        a2, a4, a6 = 9 + 3 * plane.gamma, 48 * plane.gamma, 64 * plane.gamma**2
        x, y = plane.point
        assert y**2 == x**3 + a2 * x**2 + a4 * x + a6
        assert plane.discriminant == 16 * (a2**2 * a4**2 - 4 * a4**3 - 4 * a2**3 * a6 + 18 * a2 * a4 * a6 - 27 * a6**2)


def test_the_curves_over_a_number_field_are_conjugate_and_tend_to_j_0():
    large, small = (
        geometry(load("paper_m3_irreducible"), [1, 2, 3, 4, 5, 6], eps).planes[0] for eps in ("1/10", "1/10000")
    )
    assert len(large.rotations) == 2  # one real root, one pair of complex roots
    assert small.j.field.degree == 3
    assert all(abs(float(arb(c))) < 1e-6 for c in small.j.coefficients)
    assert not all(abs(float(arb(c))) < 1e-6 for c in large.j.coefficients)


@pytest.mark.parametrize("eps", [fmpq(1, 1000), fmpq(1, 10**40)])
def test_the_phase_error_is_of_order_two(eps):
    """Per turn, that is relative to the rotation number of the flow, it is proportional to eps^2."""

    def errors(eps):
        rotations = [plane.rotations[0] for plane in geometry(load("paper_m2"), [1, 2, 3, 5], eps).planes]
        return [float(rotation.phase_error / rotation.flow) for rotation in rotations]

    for large, small in zip(errors(eps), errors(eps / 2), strict=True):
        assert math.log2(large / small) == pytest.approx(2, abs=0.05)


def test_the_phase_error_is_that_of_a_float_orbit_against_the_period_of_the_flow():
    """On u^3 + v^3 = b the flow has the period B(1/3, 1/3) b^(-1/3)/3, the integral of du/(3 v^2)."""
    cubic, start, eps = (1, 0, 0, 1), ["1/9", "1"], "1/50"
    (rotation,) = geometry(hamiltonian_flow(*cubic), start, eps).planes[0].rotations
    points = planar_orbit(cubic, start, eps, 40_000)
    measured = mean_turn(np.arctan2(points[:, 1], points[:, 0]), math.pi)
    period = math.gamma(1 / 3) ** 2 / math.gamma(2 / 3) / 3 * (1 + 1 / 9**3) ** (-1 / 3)
    assert measured - 2 / 50 / period == pytest.approx(float(rotation.phase_error), abs=1e-10)
    assert abs(float(rotation.phase_error)) > 1e-6


def test_beyond_a_singular_level_there_is_no_phase_error():
    """delta grows from 0 to infinity with eps; beyond 1 there are two components, beyond the pole no deformation."""
    errors = [
        geometry(hamiltonian_flow(1, 0, -1, 0), ["2", "1/10"], eps).planes[0].rotations[0].phase_error is None
        for eps in ("1/10", "7/10", "10")
    ]
    assert errors == [False, True, True]


def test_the_orbit_is_dense_or_not_or_nobody_knows():
    circle = geometry(load("nahm_tetrahedral"), [1, 2], "1/10").closure
    assert (circle.is_dense, circle.status) == (True, "proved")
    torus = geometry(load("paper_m2"), [1, 2, 3, 5], "1/10").closure
    assert (torus.is_dense, torus.status) == (None, "supported")
    assert torus.bound > 1000
    assert torus.to_json()["zariski_dense"] is True
    numbers = [arb(2).sqrt(), arb(3).sqrt()]
    assert closure([fmpq(3), fmpq(3)], [None, None], numbers).is_dense is False
    assert closure([fmpq(3), fmpq(32, 27)], [None, 5], numbers).is_dense is False
    K = EtaleAlgebra(fmpq_poly([-2, 0, 1]))
    assert closure([K.convert(3)], [None], numbers).is_dense is False
    assert closure([K.generator], [None], numbers).is_dense is None
    assert closure([K.generator], [None], [numbers[0], numbers[0] * 3]).status == "undecided"
    assert geometry(load("paper_m2"), [1, 2, 3, 4], "1/10").closure is None  # a level of three lines


def test_a_prime_that_separates_curves_is_confirmed_by_pari():
    gammas = [fmpq(3), fmpq(5, 2), fmpq(-4, 7)]
    prime = separating_prime(fmpq_poly([-3, 1]) * fmpq_poly([fmpq(-5, 2), 1]) * fmpq_poly([fmpq(4, 7), 1]))
    script = "".join(f"print(ellap(ellinit([0,9+3*({g}),0,48*({g}),64*({g})^2]),{prime}))\n" for g in gammas)
    lines = gp(script)
    discriminants = [int(line) ** 2 - 4 * prime for line in lines]
    assert all(math.isqrt(x * y) ** 2 != x * y for x, y in itertools.combinations(discriminants, 2))


def test_isomorphic_curves_are_not_separated():
    """k -> (k + 2)/(k - 1) is an isomorphism of Hesse cubics: k = 2 and 4 have k^3 = 8 and 64, and the same j."""
    assert separating_prime(fmpq_poly([7, 1]) * fmpq_poly([63, 1])) is None
    assert separating_prime(fmpq_poly([7, 1]) * fmpq_poly([64, 1])) is not None


@pytest.mark.parametrize(("third", "coefficient"), [(0, None), (7, 7), (5, 5)])
def test_relations_are_excluded_only_below_the_first_one(third, coefficient):
    """sqrt 2 and sqrt 3, and a number with the relation n x = sqrt 2 + sqrt 3."""
    with RR(128).working():
        numbers = [arb(2).sqrt(), arb(3).sqrt()]
        numbers.append((numbers[0] + numbers[1]) / third if third else arb(5).sqrt())
    bound = excluded_relations(numbers)
    assert bound < coefficient if coefficient else bound > 300


@pytest.mark.parametrize("modulus", [[-2, 0, 1], [-5, 0, 1], [1, -3, 0, 1], [-25, 0, 0, 1]], ids=str)
def test_bad_primes_over_number_fields_agree_with_pari(modulus):
    """Sixth powers in delta do not matter; ramified primes may be undecided, and 2 and 3 are."""
    K = EtaleAlgebra(fmpq_poly(modulus))
    rng = random.Random(5)
    gammas, script = [], f"nf=nfinit({str(K.chi).replace('x', 't')});"
    for _ in range(12):
        delta = K.convert(fmpq_poly([fmpq(rng.randint(-9, 9), rng.choice((1, 2, 5))) for _ in modulus[1:]]))
        delta *= rng.choice((1, 5**6, 7**6, 25)) * K.generator ** rng.choice((0, 3, 6))
        if delta not in (K.zero, K.one):
            gammas.append(1 - delta)
            script += f"g=Mod({str(gammas[-1].polynomial).replace('x', 't')},nf.pol);"
            script += "E=ellinit([0,9+3*g,0,48*g,64*g^2],nf);print(idealnorm(nf,ellglobalred(E)[1]));"
    conductors = gp(script.replace(";", ";\n"))
    assert len(conductors) == len(gammas) > 8
    for gamma, conductor in zip(gammas, conductors, strict=True):
        primes = {int(p) for p, _ in fmpz(int(conductor)).factor()} if conductor != "1" else set()
        result = bad_primes_of_plane(gamma)
        assert set(result.bad) <= primes <= {*result.bad, *result.undecided}
        assert all(p < 5 or K.chi.discriminant().p % p == 0 for p in result.undecided)


def test_the_planes_are_those_of_the_declared_matrix():
    """A recognized member may have another A, with the same planes at other roots."""
    declared, start = load("paper_m3"), [1, 2, 3, 4, 5, 6]
    named = {plane.name: plane.j for plane in geometry(declared, start, "1/300").planes}
    by_command = geometry_of(declared.normal_form, "1/300", start)
    recognized = geometry(declared.system, start, "1/300")
    assert named == {plane.name: plane.j for plane in by_command.planes}
    assert sorted(named.values()) == sorted(plane.j for plane in recognized.planes)


@pytest.mark.parametrize(
    ("cubic", "start", "order"),
    [
        ((-2, -1, -2, 0), ["-1/3", "1/3"], 5),
        ((-2, -2, -2, 0), ["-1/3", "1/6"], 6),
        ((-2, 0, 2, 0), ["-1/6", "0"], 12),
    ],
)
def test_torsion_levels_are_those_of_the_division_polynomials(cubic, start, order):
    """For eps = 1/2 the coordinates are (U, V); the rotation number is a multiple of 1/N, of 2/N for two components."""
    result = geometry(hamiltonian_flow(*cubic), start, "1/2")
    (plane,) = result.planes
    assert (plane.order, plane.height) == (order, 0)
    assert plane.gamma in PeriodicLevels(order).gammas
    (rotation,) = plane.rotations
    multiple = order * rotation.number / rotation.steps
    assert (multiple - round(float(multiple.mid()))).contains(0)
    assert result.closure.is_dense is False
    shifted = geometry(hamiltonian_flow(*cubic), [start[0], "1/7"], "1/2").planes[0]
    other = order * shifted.rotations[0].number / shifted.rotations[0].steps
    assert shifted.order is None
    assert not (other - round(float(other.mid()))).contains(0)
