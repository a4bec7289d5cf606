"""Exact steps on integers over one common denominator.

Specified here: the steps are those of fractions solved entry by entry, whichever way the linear systems are solved (the
thresholds between the ways are put to 0 and to infinity); long numbers of members are found by elimination
(test_elimination.py); rows of the equation that do not depend on x are taken out, explicit maps are solved by
substitution on fractions, and the steps stay the same.
"""

from math import prod

import pytest
from flint import fmpq, fmpq_poly, fmpz, fmpz_mat
from helpers import NAMED_SYSTEMS, rationals, systems_with_points
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import det
from kahanmaps.documents.catalog import load
from kahanmaps.errors import SingularStep
from kahanmaps.family.draw import draw_with_chi, draw_with_eigenvalues
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits import integer_steps
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.substitution import forward_substitution
from kahanmaps.systems.quadratic import QuadraticSystem

t = fmpq_poly([0, 1])

FAMILY = {
    "m = 2": draw_with_eigenvalues([1, -2], 1).chosen.system,
    "m = 2, irreducible": draw_with_chi(t**2 - 2, 1).chosen.system,
    "m = 3": draw_with_eigenvalues([1, -2, 3], 2).chosen.system,
    "m = 3, irreducible": draw_with_chi(t**3 - t - 1, 2).chosen.system,
    "m = 4": draw_with_eigenvalues([1, -2, 3, "1/2"], 3).chosen.system,
}
STEPS = {"m = 2": 20, "m = 2, irreducible": 20, "m = 3": 16, "m = 3, irreducible": 16, "m = 4": 10}
ORBITS = [
    *(pytest.param(system, "1/10", STEPS[name], id=name) for name, system in FAMILY.items()),
    # not integrable: digits multiply with every step
    *(pytest.param(system, "1/10", 5, id=name) for name, system in NAMED_SYSTEMS.items()),
]


def start(dim: int) -> tuple[fmpq, ...]:
    return tuple(fmpq(1, i + 2) for i in range(dim))


def rational_step(system: QuadraticSystem, eps: fmpq, x: tuple[fmpq, ...]) -> tuple[fmpq, ...]:
    """(I - eps f'(x)) x~ = (I + eps B) x + 2 eps c, with rational entries, by FLINT."""
    column, one = QQ.column(x), QQ.identity(system.dim)
    right = column + system.B * column * eps + QQ.column(system.c) * (2 * eps)
    return tuple((one - system.over(QQ).jacobian(x) * eps).solve(right).entries())


def walk(system: QuadraticSystem, eps: str, steps: int) -> list[IntegerPoint]:
    stepper, point = KahanMap(system, QQ.convert(eps)).integer_steps, IntegerPoint.from_rationals(start(system.dim))
    found = [point]
    for _ in range(steps):
        found.append(stepper.step(found[-1]))
    return found


# Points.


def composite_integers(primes=(2, 3, 2**61 - 1), exponent: int = 12):
    """Integers made of few primes, in powers, so that they share much."""
    powers = [st.integers(0, exponent).map(lambda e, p=p: p**e) for p in primes]
    return st.tuples(st.sampled_from([1, -1, 5, -7, 0]), *powers).map(lambda factors: fmpz(prod(factors)))


@given(numerators=st.lists(composite_integers(), min_size=1, max_size=5), denominator=composite_integers())
def test_coordinates_in_lowest_terms_are_those_of_the_fractions(numerators, denominator):
    point = IntegerPoint(tuple(numerators), abs(denominator) or fmpz(1))
    assert point.lowest_terms() == [(entry.p, entry.q) for entry in point.rationals()]


# Steps.


@given(pair=systems_with_points(dims=(1, 2, 3, 4)), eps=rationals().filter(bool))
def test_a_step_on_integers_is_the_step_on_fractions(pair, eps):
    system, x = pair
    image = KahanMap(system, eps).integer_steps.step(IntegerPoint.from_rationals(x))
    try:
        expected = rational_step(system, eps, x)
    except ZeroDivisionError:
        expected = None
    assert (None if image is None else image.rationals()) == expected


@pytest.mark.parametrize(("system", "eps", "steps"), ORBITS)
@pytest.mark.parametrize("threshold", [0, 10**9])
def test_an_orbit_on_integers_is_the_orbit_on_fractions(system, eps, steps, threshold, monkeypatch):
    monkeypatch.setattr(integer_steps, "_ELIMINATION_BITS", threshold)
    x = start(system.dim)
    for point in walk(system, eps, steps)[1:]:
        x = rational_step(system, QQ.convert(eps), x)
        assert point.rationals() == x


@pytest.mark.parametrize("name", ["m = 3", "m = 3, irreducible"])
def test_for_the_family_the_elimination_itself_finds_every_step(name, monkeypatch):
    # It relies on rank 2 modulo the denominator; were that wrong, FLINT's solver would silently do all the work.
    found: list[IntegerPoint | None] = []
    eliminate = integer_steps.solve_fraction_free
    monkeypatch.setattr(integer_steps, "_ELIMINATION_BITS", 0)
    monkeypatch.setattr(integer_steps, "solve_fraction_free", lambda *a: found.append(eliminate(*a)) or found[-1])
    assert walk(FAMILY[name], "1/10", 12)[1:] == found


# Rows of the equation that do not depend on x are taken out.


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


def test_dependent_rows_leave_no_value_anywhere():
    singular = KahanMap(QuadraticSystem.from_text(NAMES, ["x", "y^2", "x*z", "w"]), 1)
    assert singular.integer_steps.step(IntegerPoint.from_rationals((fmpq(1),) * 4)) is None


# Equations that are solved unknown by unknown, with powers of W that rows share taken out.


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
    for one, point in map_over.stages(x):
        assert one.determinant(point) == det(one.denominator_matrix(point))


def equations(uses: list[list[bool]]):
    n = len(uses)
    return forward_substitution(
        [(0,) * n + (1,)], fmpz_mat([[entry] for row in uses for entry in [*map(int, row), 1]]), n
    )


def test_rows_and_unknowns_are_put_in_order():
    rows = equations([[False, True], [True, True]])._rows
    assert [(row.unknown, row.known) for row in rows] == [(1, ()), (0, (1,))]
    assert equations([[True, True], [True, True]]) is None
    assert equations([[True, False], [True, False]]) is None


def test_where_a_coordinate_that_divides_a_whole_row_is_0_there_is_no_value():
    twice = integer_steps.IntegerSteps([(1, 0)], [[((0, fmpq(1)),), ((0, fmpq(-2)),)]])  # x x~ = 2 x
    assert twice.step(IntegerPoint.from_rationals((fmpq(3, 7),))) == IntegerPoint.from_rationals((fmpq(2),))
    assert twice.step(IntegerPoint.from_rationals((fmpq(0),))) is None


def test_in_dimension_1_a_side_that_is_0_gives_0():
    nothing = integer_steps.IntegerSteps([(1, 0)], [[((0, fmpq(1)),), ()]])  # x x~ = 0
    assert nothing.step(IntegerPoint.from_rationals((fmpq(3, 7),))) == IntegerPoint.from_rationals((fmpq(0),))
    assert nothing.step(IntegerPoint.from_rationals((fmpq(0),))) is None
