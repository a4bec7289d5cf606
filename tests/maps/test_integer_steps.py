"""Exact steps on integers over one common denominator: they are those of fractions, solved entry by entry.

The thresholds between the ways of solving are put to 0 and to infinity. Common factors are left in long integers where
they are short, and no reader of a point sees them.
"""

import pytest
from flint import fmpq, fmpq_poly, fmpz
from helpers import NAMED_SYSTEMS, points, rationals
from hypothesis import assume, given
from hypothesis import strategies as st
from planar_helpers import planar_system

from kahanmaps.algebra.matrices import det
from kahanmaps.documents.catalog import load
from kahanmaps.errors import SingularStep
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form.planar_block import PlanarBlock
from kahanmaps.maps.orbits import integer_point, integer_steps, short_solution
from kahanmaps.maps.orbits.integer_point import IntegerPoint, UnreducedPoint
from kahanmaps.systems.quadratic import QuadraticSystem

t = fmpq_poly([0, 1])
FAMILY = {
    "m = 2": random_member_with_eigenvalues([1, -2], 1).chosen.system,
    "m = 2, irreducible": random_member_with_chi(t**2 - 2, 1).chosen.system,
    "m = 3": random_member_with_eigenvalues([1, -2, 3], 2).chosen.system,
    "m = 3, irreducible": random_member_with_chi(t**3 - t - 1, 2).chosen.system,
    "m = 4": random_member_with_eigenvalues([1, -2, 3, "1/2"], 3).chosen.system,
}
SNAP = QuadraticSystem.from_text(["x", "y", "z", "w"], ["y", "z", "w", "x^2"])  # a determinant of order 1
STEPS = {"m = 2": 20, "m = 2, irreducible": 20, "m = 3": 16, "m = 3, irreducible": 16, "m = 4": 10}
ORBITS = [
    *(pytest.param(system, "1/10", STEPS[name], id=name) for name, system in FAMILY.items()),
    # most of them are not integrable: digits multiply with every step
    *(pytest.param(system, "1/10", 5, id=name) for name, system in {**NAMED_SYSTEMS, "snap": SNAP}.items()),
]


@pytest.mark.parametrize(("system", "eps", "steps"), ORBITS)
@pytest.mark.parametrize("threshold", [0, 10**9])
def test_an_orbit_on_integers_is_the_orbit_on_fractions(system, eps, steps, threshold, monkeypatch):
    monkeypatch.setattr(integer_steps, "_ELIMINATION_BITS", threshold)
    monkeypatch.setattr(integer_steps, "_CRAMER_BITS", threshold)
    monkeypatch.setattr(integer_point, "_LONG_BITS", threshold // 10**7)
    monkeypatch.setattr(short_solution, "_LEAST_BITS", threshold)
    phi, x = KahanMap(system, eps), tuple(fmpq(1, i + 2) for i in range(system.dim))
    point = IntegerPoint.from_rationals(x)
    for _ in range(steps):
        point, x = phi.integer_steps.step(point), phi.generic_step(x)
        assert point.rationals() == x


def long_orbit(name: str, bits: int) -> list[IntegerPoint]:
    map_over = load(name).map.at("3/11")
    orbit = [IntegerPoint.from_rationals((fmpq(1, 2), fmpq(-1, 3), fmpq(2, 5), fmpq(1))[: map_over.dim])]
    while max(number.bit_length() for number in orbit[-1].integers[0]) < bits:
        orbit.append(map_over.integer_step(orbit[-1]))
    return orbit


@pytest.mark.parametrize(
    ("name", "keeps", "has_long"),
    [
        ("lotka_volterra", 4, False),
        ("lorenz", 2, False),
        ("zander_120", 0, True),
        ("zhukovski_volterra_2", 0, True),
        ("henon_heiles", 0, True),
        ("weierstrass", 0, True),
    ],
)
def test_short_factors_are_kept_and_long_ones_divided_out_and_no_reader_sees_them(name, keeps, has_long):
    orbit = long_orbit(name, 50_000)
    assert sum(point.keeps_factors for point in orbit) >= keeps
    assert (orbit[-2].has_long_factors, any(point.keeps_factors for point in orbit)) == (has_long, keeps > 0)
    for point in orbit:
        fractions = [fmpq(p, q) for p, q in point.lowest_terms()]
        assert [(x.p, x.q) for x in fractions] == point.lowest_terms()  # in lowest terms
        expected = IntegerPoint.from_rationals(fractions)
        assert point == expected == point
        for name in ("numerators", "denominator", "bits"):
            assert getattr(point, name) == getattr(expected, name)
    assert orbit[-1] != orbit[-2]


READERS = {"numerators": lambda x: x.numerators, "terms": lambda x: x.lowest_terms(), "bits": lambda x: x.exceeding(1)}


@pytest.mark.parametrize(("power", "is_long"), [(1, False), (30, True)])
@pytest.mark.parametrize("read_first", READERS.values(), ids=READERS)
def test_a_factor_that_was_left_in_is_found_when_the_point_is_read(power, is_long, read_first):
    factor, a, b, W = fmpz(2**127 - 1) ** power, fmpz(3) ** 9000, fmpz(5) ** 6000, fmpz(7) ** 5000
    previous = IntegerPoint((a, b), W)
    point = UnreducedPoint([-a * factor, b * factor], -W * factor, previous)
    assert point.keeps_factors
    assert point.exceeding(a.bit_length() - 1) == a.bit_length()  # and not the length with the factor
    assert point == IntegerPoint((a, -b), W) != previous
    read_first(point)
    assert (point.numerators, point.denominator) == ((a, -b), W)
    assert point.lowest_terms() == [(a, W), (-b, W)]
    assert point.has_long_factors == is_long
    assert not is_long or not UnreducedPoint([a, b], W, point).keeps_factors


def test_a_composition_with_two_eps_says_where_it_is_not_defined():
    phi, psi = (KahanMap(QuadraticSystem.from_text(["x"], ["x^2"]), eps) for eps in ("1/2", "1/3"))
    for step in (Map((phi, psi), None, ("x",)).step, Map((phi, psi), None, ("x",)).generic_step):
        with pytest.raises(SingularStep, match="at the point 1: the map is not defined there"):
            step([fmpq(1)])


NAMES = ["x", "y", "z", "w"]
LINEAR = ["y", "x + 2*y - w", "3*z + 1", "0", "x - y + z - w"]
QUADRATIC = ["x*y - z^2", "w^2 + x", "x*z - 2*y*w + 1", "y^2 - y"]
small = st.fractions(-5, 5, max_denominator=7).map(lambda q: fmpq(q.numerator, q.denominator))


@st.composite
def partly_linear(draw) -> QuadraticSystem:
    """Systems of dimension 4, one to four of whose equations are linear, in any order."""
    count = draw(st.integers(1, 4))
    lines = [draw(st.sampled_from(LINEAR)) for _ in range(count)]
    lines += [draw(st.sampled_from(QUADRATIC)) for _ in range(4 - count)]
    return QuadraticSystem.from_text(NAMES, draw(st.permutations(lines)))


@given(system=partly_linear(), eps=small, x=st.tuples(small, small, small, small))
def test_a_step_is_that_of_fractions_and_a_pole_is_one(system, eps, x):
    assume(eps != 0)
    over = KahanMap(system, eps)
    image = over.integer_steps.step(IntegerPoint.from_rationals(x))
    try:
        expected = over.generic_step(x)
    except SingularStep:
        assert image is None
    else:
        assert image == IntegerPoint.from_rationals(expected)


@pytest.mark.parametrize(
    "name",
    ["lotka_volterra_symplectic_euler", "somos_4", "qrt_asymmetric", "hky", "todd", "duffing_polarised", "riccati"],
)
@given(data=st.data())
def test_a_step_of_a_map_is_that_of_fractions_and_so_is_its_determinant(name, data):
    map_over = load(name).map.at("3/11")
    x = data.draw(st.tuples(*[small] * map_over.dim))
    image = map_over.integer_step(IntegerPoint.from_rationals(x))
    try:
        expected = map_over.generic_step(x)
    except SingularStep:
        assert image is None
        return
    assert image == IntegerPoint.from_rationals(expected)
    for entry, point in map_over.stages(x):
        assert entry.determinant(point) == det(entry.denominator_matrix(point))


@pytest.mark.parametrize(("ours", "theirs"), [("image", "step"), ("preimage", "inverse_step")])
@given(cubic=points(4, rationals(6)), point=points(2), eps=rationals().filter(bool))
def test_image_and_preimage_are_those_of_the_kahan_map_of_the_plane(ours, theirs, cubic, point, eps):
    U, V, W = getattr(PlanarBlock(*cubic), ours)((2 * eps * point[0], 2 * eps * point[1], fmpq(1)))
    try:
        expected = getattr(KahanMap(planar_system(cubic), eps), theirs)(point)
    except SingularStep:
        expected = None
    assert (None if W == 0 else (U / W / (2 * eps), V / W / (2 * eps))) == expected
