"""Parameters that are algebraic numbers: exact over Q[t]/g, modulo primes where g has a root, rounded for floats."""

import pytest
from helpers import refuses

import kahanmaps as km
from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.roots import parse_root
from kahanmaps.checks.claims import Certainty
from kahanmaps.errors import BadPrime

TOP = "x' = a*y*z; y' = -x*z; z' = x*y"
ROOT = "root of t^2 - 2 near 1.4"


@pytest.mark.parametrize(
    ("integral", "expected"),
    [
        ("(y^2 + z^2)/(1 + eps^2*x^2)", Certainty.PROVED),
        ("(1 + eps^2*x^2)/(1 - a*eps^2*y^2)", Certainty.PROVED),
        ("(1 + eps^2*x^2)/(1 - 2/a*eps^2*y^2)", Certainty.PROVED),  # for a^2 = 2 only
        ("(1 + eps^2*x^2)/(1 + a*eps^2*y^2)", Certainty.REFUTED),  # that of the conjugate system
        ("(1 + eps^2*x^2)/(1 - 2*eps^2*y^2)", Certainty.REFUTED),
    ],
)
def test_claims_are_proved_or_refuted_over_the_number_field(integral, expected):
    assert km.check_integrals(km.System(TOP, a=ROOT), integral).verdict is expected


def test_a_density_that_is_zero_at_the_root_is_refused():
    file = km.System("x' = a*y; y' = -x", a=ROOT)
    assert km.check_measure(file, "a^2 + 2").verdict is Certainty.PROVED
    for phi in ("a^2 - 2", "(a^4 - 4)*x"):
        refuses("identically 0 at a root of t", km.check_measure, file, phi)


def test_whether_a_map_is_one_and_its_inverse_right_is_asked_at_the_root():
    def explicit(image: str, inverse: str) -> str:
        sides = f"image = ['y', '{image}']" + (f"\ninverse = ['{inverse}', 'x']" if inverse else "")
        return f"variables = ['x', 'y']\n[parameters]\na = '{ROOT}'\n[map]\n{sides}"

    map_ = km.parse_system(explicit("a*x", "a*y/2")).map.at(1)  # 1/a = a/2 for this root
    assert map_.inverse.step(map_.step([3, 5])) == (3, 5)
    for image, inverse, mistake in (
        ("a*x", "a*y/3", "is not the inverse of the map"),
        ("(a^2 - 2)*x + y^2", "", "the map is not dominant"),
    ):
        refuses(mistake, km.parse_system, explicit(image, inverse))


def test_a_refutation_has_a_witness_over_the_number_field():
    over_root, over_q = km.System(TOP, a=ROOT), km.System(TOP, a=2)
    report = km.check_commute(over_root, over_q)
    witness = report.findings[0].witness
    assert (report.verdict, witness.field) == (Certainty.REFUTED, "QQ[t]/(t^2 - 2)")
    assert witness.left != witness.right
    # The orbit is one over Q, the identity one over the number field.
    assert km.check_commute(over_q, over_root).verdict is Certainty.REFUTED


def test_maps_with_the_root_commute_with_their_own_multiples_only_where_they_should():
    linear = "x' = a*y; y' = -x"
    system = km.System(linear, a=ROOT)
    assert km.check_commute(system, km.System("x' = 3*a*y; y' = -3*x", a=ROOT)).verdict is Certainty.PROVED
    assert km.check_commute(system, km.System("x' = 3*y; y' = -3*x")).verdict is Certainty.REFUTED
    for other in ("root of t^2 - 3", "root of t^2 - 2 near -1.4", "root of t^2 - 2"):
        refuses("the same algebraic number", km.check_commute, system, km.System(linear, a=other))
    assert km.check_commute(system, km.System(linear, a="root of t^2 - 2 near 1.5")).holds


def test_the_points_of_an_orbit_agree_in_all_arithmetics():
    file = km.load("euler_top", {"a1": ROOT})
    exact = [point.x for point in km.orbit(file, [1, 2, 3], "1/10", steps=3)][-1]
    near = float(parse_root(ROOT).real_approximation())
    values = [sum(float(c) * near**k for k, c in enumerate(entry.coefficients)) for entry in exact]
    floats = [point.x for point in km.orbit(file, [1, 2, 3], "1/10", steps=3, arithmetic="float")][-1]
    assert list(floats) == pytest.approx(values, rel=1e-13)  # a few roundings of numbers of size 1
    field = GF(17)
    residues = [point.x for point in km.orbit(file, [1, 2, 3], "1/10", steps=3, arithmetic="mod:17")][-1]
    t = parse_root(ROOT).over(field)
    assert t * t == 2
    pairs = (map(field.convert, entry.coefficients) for entry in exact)
    assert list(residues) == [a + b * t for a, b in pairs]


def test_what_needs_rational_numbers_refuses_in_a_sentence():
    file = km.System(TOP, a=ROOT)
    for function in (km.find_poisson, km.find_symmetry, km.commuting_systems):
        refuses("found a parameter that is a root of", function, file)
    refuses("found a parameter that is a root of", km.check_poisson, km.load("henon_heiles", {"c": ROOT}))
    family = 'parameters.a = "root of t^2 - 2"\n[family]\nA = [["a","0"],["0","a"]]\nH = "x1^3"'
    refuses(r"found an algebraic number in a \[family\]", km.parse_system, family)
    refuses("a second algebraic parameter", km.load, "euler_top", {"a1": ROOT, "a2": "root of t^2 - 3"})
    refuses("no root modulo 13", km.orbit, file, [1, 2, 3], "1/10", steps=1, arithmetic="mod:13", error=BadPrime)
