"""The normal form in machine numbers: right to the last digits, and the same numbers by whatever kernel.

Specified here: orbits in normal form follow the exact ones, at real roots, complex ones and both; the kinds of block;
which kernel, how many threads, how many orbits together, in what portions and with what records makes no difference, to
the last bit; and each way in which an orbit can end has its status and its step, which the other orbits do not notice.
"""

from itertools import combinations

import numpy as np
import pytest
from flint import acb, arb, fmpq, fmpq_mat, fmpq_poly
from helpers import HENON_HEILES

from kahanmaps.algebra.fields import RR
from kahanmaps.algebra.written.text import parse_polynomial, parse_rational_function
from kahanmaps.errors import InputError
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.draw import draw_generic, draw_with_chi, draw_with_eigenvalues
from kahanmaps.family.planar import normal_form
from kahanmaps.maps.floats.blocks import _doubles, _factors, _sine, _Unclear, planar_blocks
from kahanmaps.maps.floats.fast import FloatEnsemble, FloatOrbit, float_function, to_floats
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.kernels import has_numba
from kahanmaps.maps.orbits.iteration import Orbit, OrbitEnd
from kahanmaps.systems.quadratic import QuadraticSystem

EPS = "1/10"
MEMBERS = {
    "one plane": draw_with_eigenvalues([1], seed=2),
    "three real roots": draw_with_eigenvalues([1, -2, 3], seed=7),
    "six real roots": draw_with_eigenvalues([1, -2, 3, 4, 5, -6], seed=9),
    "a complex pair": draw_with_chi(fmpq_poly([1, 0, 1]), seed=1),
    "real and complex": draw_with_chi(fmpq_poly([-2, 0, 0, 1]), seed=7),
    "two complex pairs": draw_with_chi(fmpq_poly([1, 0, 0, 0, 1]), seed=4),
    "irrational roots": draw_generic(4, seed=3),
}
FORMS = {name: normal_form(member) for name, member in MEMBERS.items()}

LINES, CUBES = (0, 1, 1, 0), (1, 0, 0, 1)  # U V (U + V) and (U^3 + V^3)/3

over_members = pytest.mark.parametrize("name", MEMBERS)
KERNELS = ["numpy", pytest.param("numba", marks=pytest.mark.skipif(not has_numba(), reason="numba is not installed"))]
over_kernels = pytest.mark.parametrize("kernel", KERNELS)


def test_lines_at_right_angles_are_not_parallel():
    """Their product is a ball around exactly 0, whose square is nan in python-flint 0.9.0."""
    for radius in (0, 1e-30):
        one, small = acb(1), acb(arb(0, radius))
        right, parallel = ([one, small], [small, one]), ([one, small], [one, small])
        assert _sine(right, [[one, small], [small, one]]) == pytest.approx(1, abs=1e-15)
        assert _sine(parallel, [[one, small], [small, one]]) == 0
    with pytest.raises(_Unclear):
        _sine(([one, one], [acb(arb(0, 1)), acb(arb(0, 1))]), [[one, one], [one, one]])


def member_of_repeated_factor():
    """chi = t^2 - 1 and planar cubics u^2 v at -1, u^3 at 1, in coordinates of a shear."""
    A = fmpq_mat(4, 4, [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1])
    return FamilyMember(A, parse_polynomial("x1^2*x3 + x2^3", ["x1", "x2", "x3", "x4"]))


def complex_member_of_repeated_factor():
    """chi = t^2 + 1 and the planar cubic u^2 v at i: twice the real part of (x1 + i x2)^2 (x3 - i x4)/2."""
    A = fmpq_mat(4, 4, [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0])
    return FamilyMember(A, parse_polynomial("(x1^2 - x2^2)*x3 + 2*x1*x2*x4", ["x1", "x2", "x3", "x4"]))


def start_of(dim: int, scale: int = 20) -> list[fmpq]:
    return [fmpq((-1) ** k * (k + 2), scale * (k + 1)) for k in range(dim)]


def starts_of(dim: int, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (n, dim))


def ensemble(name: str, starts: np.ndarray, **options: object) -> FloatEnsemble:
    return FloatEnsemble(MEMBERS[name].chosen.system, EPS, starts, form=FORMS[name], **options)


def same(one: FloatEnsemble, other: FloatEnsemble) -> None:
    """Equal in everything that can be asked, NaN where NaN is."""
    assert np.array_equal(one.x, other.x, equal_nan=True)
    for name in ("status", "failed_at", "near_singular", "near_singular_at"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for left, right in zip(one.drift, other.drift, strict=True):
        assert np.array_equal(left.largest, right.largest), left.name
        assert np.array_equal(left.last, right.last, equal_nan=True), left.name


# Right numbers.


@over_members
def test_an_orbit_in_normal_form_follows_the_exact_one(name):
    system = MEMBERS[name].chosen.system
    start = start_of(system.dim)
    balls = [point.x for point in Orbit(KahanMap(system, EPS, RR(2000)), start, 30)]
    orbit = FloatOrbit(system, EPS, start, 30, form=FORMS[name], kernel="numpy")
    blocks = planar_blocks(FORMS[name], EPS)
    # Roundings in x are magnified by the change of coordinates and back, and by the derivatives of 30 steps, which add
    # errors of their own: along these orbits by less than 1000 in all.
    condition = np.linalg.cond(blocks.into)
    largest = 0.0
    for (step, x), exact in zip(orbit, balls, strict=True):
        expected = np.array([float(entry.mid()) for entry in exact])
        largest = max(largest, abs(expected).max())
        assert abs(x - expected).max() <= 1000 * 2.0**-53 * condition * largest, step
    assert orbit.end.status == "completed"


@over_members
def test_backward_undoes_forward(name):
    system = MEMBERS[name].chosen.system
    start = starts_of(system.dim, 5) / 50
    there = ensemble(name, start, kernel="numpy")
    there.advance(10)
    back = FloatEnsemble(system, EPS, there.x, form=FORMS[name], backward=True, kernel="numpy")
    back.advance(10)
    assert abs(back.x - start).max() < 1e-9  # 20 steps, condition up to 1e4, roundings of 1e-16


# Blocks.


def test_a_real_root_gives_one_real_block_and_a_pair_one_complex_block():
    blocks = planar_blocks(FORMS["real and complex"], EPS)
    assert (blocks.reals, len(blocks.kappa), blocks.rows) == (1, 2, 6)
    assert blocks.labels == ("1.25992", "-0.629961+-1.09112i")


def test_nearly_all_blocks_are_canonical():
    rows = np.concatenate([planar_blocks(form, EPS).coefficients for form in FORMS.values()])
    assert set(map(tuple, rows.tolist())) == {LINES, CUBES}


@over_kernels
def test_repeated_factors_of_h_have_blocks_too(kernel):
    # x1' = x1^2, x3' = -2 x1 x3 at the root -1; x2' = 0, x4' = -3 x2^2 at 1
    member = member_of_repeated_factor()
    form = normal_form(member)
    assert len({LINES, CUBES, *map(tuple, planar_blocks(form, EPS).coefficients.tolist())}) == 4
    system, start = member.chosen.system, ["1/3", "1/2", "1/5", "-1/7"]
    exact = [point.x for point in Orbit(KahanMap(system, EPS), start, 12)]
    orbit = FloatOrbit(system, EPS, start, 12, form=form, kernel=kernel)
    for (_, x), expected in zip(orbit, exact, strict=True):
        assert x == pytest.approx(to_floats(expected), rel=1e-14, abs=1e-14)  # numbers of size 1, a dozen roundings


@over_kernels
def test_a_block_without_h_stands_still(kernel):
    A = fmpq_mat(4, 4, [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1])
    member = FamilyMember(A, parse_polynomial("x1^3 + x3^3", ["x1", "x2", "x3", "x4"]))
    orbit = FloatOrbit(
        member.chosen.system, EPS, ["1/3", "1/2", "1/5", "-1/7"], 50, form=normal_form(member), kernel=kernel
    )
    *_, (_, x) = orbit
    assert x[[1, 3]] == pytest.approx([1 / 2, -1 / 7], rel=4 * 2.0**-53)  # in and out of the rows
    assert abs(x[0] - 1 / 3) > 1e-3


def test_the_normal_form_of_another_system_is_refused():
    with pytest.raises(InputError, match="belongs to another system"):
        FloatEnsemble(HENON_HEILES, EPS, np.zeros((1, 4)), form=FORMS["a complex pair"])


# The same numbers, to the last bit.


@over_members
@pytest.mark.parametrize("threads", [1, 2])
def test_kernels_give_the_same_numbers(name, threads):
    pytest.importorskip("numba")
    starts = starts_of(MEMBERS[name].chosen.system.dim, 600)
    starts[5] *= 1e150  # overflows on the way
    starts[6] *= 1e100
    one = ensemble(name, starts, kernel="numpy", sampled=50)
    other = ensemble(name, starts, kernel="numba", threads=threads, sampled=50)
    for it in (one, other):
        it.advance(300)
    same(one, other)


@pytest.mark.parametrize("name", ["a complex pair", "real and complex", "two complex pairs", "three real roots"])
def test_kernels_give_the_same_numbers_next_to_a_pole_of_one_plane(name):
    """In the coordinates of a block of kind LINES w = 1 - (U^2 + U V + V^2), so U = 1, V = 0 is a pole."""
    pytest.importorskip("numba")
    blocks = planar_blocks(FORMS[name], EPS)
    starts = starts_of(blocks.rows, 300) / 5
    kinds = list(map(tuple, blocks.coefficients.tolist()))
    for r, kind in enumerate(kinds):
        if kind == LINES:
            at, size = (2 * r, 2) if r < blocks.reals else (4 * r - 2 * blocks.reals, 4)
            rows = blocks.into @ starts[20 + r]
            rows[at : at + size] = [1 - 2.0**-43, *[0.0] * (size - 1)]
            starts[20 + r] = blocks.out @ rows
    one, other = (ensemble(name, starts, kernel=kernel, sampled=10) for kernel in ("numpy", "numba"))
    for it in (one, other):
        it.advance(40)
    same(one, other)
    assert (one.near_singular[20 : 20 + len(kinds)] > 0).tolist() == [kind == LINES for kind in kinds]


def the_same_in_any_company(member, form, starts, steps, some, kernel) -> FloatEnsemble:
    """The orbits of all starts, after some of them, each taken alone, have come to the same."""
    together = FloatEnsemble(member.chosen.system, EPS, starts, form=form, kernel=kernel)
    together.advance(steps)
    for orbit in some:
        alone = FloatEnsemble(member.chosen.system, EPS, starts[orbit : orbit + 1], form=form, kernel=kernel)
        alone.advance(steps)
        assert alone.near_singular[0] == together.near_singular[orbit]
        assert np.array_equal(alone.x[0], together.x[orbit], equal_nan=True)
        assert alone.end(0) == together.end(orbit)
    return together


@over_kernels
def test_orbits_of_general_blocks_do_not_depend_on_their_company(kernel):
    member = member_of_repeated_factor()
    form = normal_form(member)
    starts = starts_of(4, 40)
    starts[7] *= 1e200
    starts[8] = [5.0, 0.1, 0.1, 0.1]  # x1~ = x1/(1 - x1/5)
    starts[9, 0] = 5.0 - 2.0**-40
    together = the_same_in_any_company(member, form, starts, 70, (0, 6, 7, 8, 9, 39), kernel)
    assert together.status[7] != "completed"
    assert together.status[8] == "singular"
    assert together.near_singular[9] > 0


@over_kernels
def test_orbits_of_complex_general_blocks_do_not_depend_on_their_company(kernel):
    member = complex_member_of_repeated_factor()
    form = normal_form(member)
    blocks = planar_blocks(form, EPS)
    assert (len(blocks.kappa), blocks.reals) == (1, 0)
    starts = starts_of(4, 300)
    starts[7] *= 1e200
    exact = Orbit(KahanMap(member.chosen.system, EPS), [fmpq(k, 9) for k in (1, -2, 3, 4)], 5)
    *_, (_, x) = FloatOrbit(member.chosen.system, EPS, ["1/9", "-2/9", "3/9", "4/9"], 5, form=form, kernel=kernel)
    *_, last = exact
    assert x == pytest.approx(to_floats(last.x), rel=1e-13)  # numbers of size 1, a few roundings each step
    # In the rows of a block (U, V) U~ = U (1 - b U)/w or alike: at w = 0 to 13 digits the lane is walked alone.
    for k, scale in enumerate(np.linspace(0.5, 20, 40)):
        starts[20 + k] = [scale, 0.0, 0.0, 0.0]
    the_same_in_any_company(member, form, starts, 30, (0, 7, 20, 30, 45, 59, 299), kernel)


@over_kernels
def test_orbits_beyond_the_first_group_are_walked_sampled_and_recorded_as_alone(kernel):
    starts = starts_of(2, 4200)
    starts[4150] *= 1e200  # for its sake the others of its group are taken twice
    together = ensemble("one plane", starts, kernel=kernel, sampled=5)
    alone = ensemble("one plane", starts[4097:], kernel=kernel, sampled=5)
    assert np.array_equal(
        np.concatenate(list(together.records(20, 10)))[:, 4097:],
        np.concatenate(list(alone.records(20, 10))),
        equal_nan=True,
    )
    assert np.array_equal(together.x[4097:], alone.x, equal_nan=True)
    for whole, part in zip(together.drift, alone.drift, strict=True):
        assert np.array_equal(whole.largest[4097:], part.largest)


@over_kernels
@pytest.mark.parametrize("generic", [False, True], ids=["normal form", "elimination"])
@pytest.mark.parametrize("name", ["real and complex"])
def test_hostile_orbits_come_to_the_same_end_in_any_company(name, generic, kernel):
    """Some end, many are near-singular again and again; portions and records change nothing, nor do the others."""
    system, form = MEMBERS[name].chosen.system, None if generic else FORMS[name]
    rng = np.random.default_rng(5)
    starts = starts_of(system.dim, 40) * 10.0 ** rng.uniform(-3, 60, (40, 1))
    starts[30:] = np.round(8 * starts_of(system.dim, 10)) * 10.0 ** rng.integers(0, 250, (10, 1))

    def taken(some, *portions):
        orbits = FloatEnsemble(system, EPS, some, form=form, kernel=kernel, sampled=7)
        return orbits, np.concatenate([x for steps in portions for x in orbits.records(steps, 4)])

    together, points = taken(starts, 100)
    again, same_points = taken(starts, 3, 64, 33)
    same(together, again)
    assert np.array_equal(points, same_points, equal_nan=True)
    assert together.near_singular.max() > 1
    assert generic or len(set(together.status)) > 1
    for orbit in range(40):
        alone, own = taken(starts[orbit : orbit + 1], 100)
        assert np.array_equal(own[:, 0], points[:, orbit], equal_nan=True)
        assert alone.end(0) == together.end(orbit)
        for field in ("near_singular", "near_singular_at"):
            assert getattr(alone, field)[0] == getattr(together, field)[orbit]
        for mine, all_ in zip(alone.drift, together.drift, strict=True):
            assert mine.largest[0] == all_.largest[orbit]


# Ends.

RICCATI_PLANE = FamilyMember(
    fmpq_mat(2, 2, [1, 0, 0, 1]), parse_polynomial("x1*x2*(x1 + x2)", ["x1", "x2"])
)  # in (U, V) = 2 eps x: U~ = U (1 + U + 2 V)/w, w = 1 - (U^2 + U V + V^2)


@over_kernels
def test_a_zero_denominator_is_singular_and_a_small_one_is_counted(kernel):
    # 2 eps = 1, so U = x1 and V = x2 up to the choice of the two factors. On V = 0 the map is U~ = U/(1 - U).
    starts = np.array([[1 / 2, 0.0], [1.0 - 2.0**-42, 0.0], [0.25, 0.0], [1e-3, 1e-3]])
    orbits = FloatEnsemble(RICCATI_PLANE.chosen.system, "1/2", starts, form=normal_form(RICCATI_PLANE), kernel=kernel)
    orbits.advance(2)
    assert orbits.status.tolist() == ["singular", "completed", "completed", "completed"]
    assert orbits.failed_at.tolist() == [2, -1, -1, -1]
    assert orbits.near_singular.tolist() == [0, 1, 0, 0]
    assert orbits.near_singular_at.tolist() == [-1, 0, -1, -1]
    assert np.isnan(orbits.x[0]).all()
    assert orbits.x[2, 0] == pytest.approx(0.5, rel=1e-15)
    assert orbits.end(0).status == "singular"
    assert orbits.end(0).steps == 1


@over_kernels
def test_an_overflow_names_the_step(kernel):
    orbits = ensemble("a complex pair", np.array([[1e200, 0.0, 0.0, 1e200]]), kernel=kernel)
    orbits.advance(5)
    assert orbits.end(0) == OrbitEnd("overflow", 0, "step 1 leaves the range of machine floats")


# Drift.


@over_members
def test_block_integrals_do_not_drift(name):
    starts = starts_of(MEMBERS[name].chosen.system.dim, 20) / 40
    orbits = ensemble(name, starts, kernel="numpy", sampled=20)
    orbits.advance(400)
    assert len(orbits.drift) == len(planar_blocks(FORMS[name], EPS).kappa)
    for drift in orbits.drift:
        # 400 steps of some roundings each are 1e-13. Where an orbit passes near infinity, the numerator and the
        # denominator of the integral are larger than their quotient by the cube and the square of the distance.
        assert (drift.largest <= 1e-8 * (1 + abs(drift.initial))).all()
        assert (drift.last <= drift.largest).all()


def test_block_integrals_are_those_of_the_exact_normal_form():
    form = FORMS["three real roots"]
    start = start_of(6)
    X, Y = form.coordinates(start)
    eps = fmpq(1, 10)
    root = fmpq(-2)
    value = form.h(X, Y)(root) / (1 + eps**2 * form.D(X, Y)(root))
    drift = ensemble("three real roots", [start], kernel="numpy").drift[0]
    assert drift.name == "h/(1 + eps^2 D) at t = -2"
    assert drift.initial[0] == pytest.approx(to_floats([value])[0], rel=1e-11)


@over_kernels
def test_a_function_that_is_no_integral_drifts_and_one_that_is_does_not(kernel):
    names = ["x", "y", "z"]
    top = QuadraticSystem.from_text(names, ["y*z", "-2*z*x", "x*y"])
    integrals = {
        "of the map": float_function(parse_rational_function("(1 - 1/100*y^2)/(1 + 2/100*z^2)", names)),
        "of the flow": float_function(parse_rational_function("x^2 + y^2/2", names)),
    }
    starts = np.array([[1, 1 / 2, 1 / 3], [1 / 2, 1, 1 / 4]])
    orbits = FloatEnsemble(top, EPS, starts, integrals=integrals, kernel=kernel)
    list(orbits.records(2000, 10))
    of_map, of_flow = orbits.drift
    assert (of_map.name, of_flow.name) == ("of the map", "of the flow")
    assert (of_map.largest < 2000 * 4 * 2.0**-53).all()  # four roundings a step, all in one direction at worst
    assert (of_flow.largest > 1e-4).all()  # about eps^2
    orbit = FloatOrbit(top, EPS, ["1", "1/2", "1/3"], 2000, every=10, integrals=integrals, kernel=kernel)
    for _ in orbit:
        pass
    assert orbit.drift[1].largest == of_flow.largest[0]


def test_entries_far_below_the_largest_of_a_row_are_zero():
    row = [arb(1), arb(2) ** -121, arb(2) ** -120, arb(0), arb(-1)]
    assert _doubles(row) == [1.0, 0.0, 2.0**-120, 0.0, -1.0]


LINEAR_FORMS = [(1, 0), (0, 1), (1, -1), (1, 1), (3, 2)]


@pytest.mark.parametrize("lines", list(combinations(LINEAR_FORMS, 3)) + list(combinations(LINEAR_FORMS, 2)), ids=str)
def test_a_form_has_the_factors_it_is_the_product_of(lines):
    """Among them those that vanish at three of the four places where it is looked at first."""
    form = [1]
    for f, g in lines:
        form = [f * a + g * b for a, b in zip([*form, 0], [0, *form], strict=True)]
    found = [(complex(a), complex(b)) for a, b in _factors([acb(c) for c in form])]
    assert len(found) == len(lines)
    for f, g in lines:
        (close,) = [
            line for line in found if abs(line[0] * g - line[1] * f) < 1e-6
        ]  # roots are asked for to half of 53 bits
        assert abs(close[0]) + abs(close[1]) > 0.1
