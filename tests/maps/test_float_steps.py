"""Float steps of any map and of normal forms: against exact ones, and the same numbers by whatever kernel.

Hostile orbits are among them. Straight-line code solves linear equations of every pattern of zeros. A file of an orbit
is complete and readable at every moment, also after the program was killed. Tolerances say where they come from.
"""

import os
import random
import signal
import subprocess
import sys
import time
from fractions import Fraction
from math import nextafter

import numpy as np
import pytest
from flint import acb, arb, fmpq, fmpq_mat, fmpq_poly
from helpers import EULER_TOP, FORCED_PLANE, NAMED_SYSTEMS, quick, refuses
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import RR
from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import ring
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.planar import normal_form
from kahanmaps.family.random_members import random_member, random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.maps.floats import steps
from kahanmaps.maps.floats.classical import METHODS, MethodEnsemble, composition, separated
from kahanmaps.maps.floats.float_conversion import exact
from kahanmaps.maps.floats.float_orbit import FloatEnsemble, FloatOrbit, float_function, to_float, to_floats
from kahanmaps.maps.floats.planar_blocks import _InsufficientPrecision, _sine_of_angle, planar_blocks
from kahanmaps.maps.floats.straight_line_program import EntryBound, StepChecks, StraightLineProgram, solve
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.kernels import has_numba
from kahanmaps.maps.orbits.iteration import Orbit, OrbitEnd
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

needs_numba = pytest.mark.skipif(not has_numba(), reason="numba is not installed")
KERNELS = ["numpy", pytest.param("numba", marks=needs_numba)]
over_kernels = pytest.mark.parametrize("kernel", KERNELS)

RICCATI = QuadraticSystem.from_text(["x"], ["x^2"])
# Many variables, few terms: x_i' = x_{i+1} x_{i-1} - x_i, with a constant in the first.
CHAIN = QuadraticSystem.from_text(
    [f"x{i}" for i in range(8)],
    [f"x{(i + 1) % 8}*x{i - 1 if i else 7} - x{i}" + (" + 1/2" if i == 0 else "") for i in range(8)],
)
# At eps = 1/50 all elements of the diagonal of I - eps f'(x) are small: rows have to be exchanged.
PIVOTS = QuadraticSystem.from_text(
    ["x", "y", "z"], ["50*x + 30*y + x*z", "20*x + 50*y + 10*z + y^2", "15*y + 40*x + 50*z - x*y"]
)
# chi = t^2 - 1 and planar cubics u^2 v at -1, u^3 at 1, in coordinates of a shear
A = fmpq_mat(4, 4, [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1])
REPEATED = FamilyMember(A, parse_polynomial("x1^2*x3 + x2^3", ["x1", "x2", "x3", "x4"]))
# chi = t^2 + 1 and the planar cubic u^2 v at i: twice the real part of (x1 + i x2)^2 (x3 - i x4)/2
A = fmpq_mat(4, 4, [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0])
COMPLEX_REPEATED = FamilyMember(A, parse_polynomial("(x1^2 - x2^2)*x3 + 2*x1*x2*x4", ["x1", "x2", "x3", "x4"]))
MEMBERS = {
    "one plane": random_member_with_eigenvalues([1], seed=2),
    "three real roots": random_member_with_eigenvalues([1, -2, 3], seed=7),
    "a complex pair": random_member_with_chi(fmpq_poly([1, 0, 1]), seed=1),
    "real and complex": random_member_with_chi(fmpq_poly([-2, 0, 0, 1]), seed=7),
    "two complex pairs": random_member_with_chi(fmpq_poly([1, 0, 0, 0, 1]), seed=4),
    "irrational roots": random_member(4, seed=3),
    "repeated factors": REPEATED,
    "a repeated factor at a complex root": COMPLEX_REPEATED,
}
FORMS = {name: normal_form(member) for name, member in MEMBERS.items()}
GENERIC = {**NAMED_SYSTEMS, "chain": CHAIN, "pivots": PIVOTS, "member": MEMBERS["three real roots"].chosen.system}
CASES = {name: (system, None) for name, system in GENERIC.items()}
CASES |= {f"normal form, {name}": (MEMBERS[name].chosen.system, form) for name, form in FORMS.items()}
over_members = pytest.mark.parametrize("name", MEMBERS)


def starts_of(dim: int, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (n, dim))


def same(ensemble: FloatEnsemble, other: FloatEnsemble, some=slice(None)) -> None:
    """Equal in everything that can be asked, NaN where NaN is."""
    assert np.array_equal(ensemble.x[some], other.x, equal_nan=True)
    for name in ("status", "failed_at", "near_singular", "near_singular_at"):
        assert np.array_equal(getattr(ensemble, name)[some], getattr(other, name)), name
    for left, right in zip(ensemble.drift, other.drift, strict=True):
        assert np.array_equal(left.largest[some], right.largest), left.name
        assert np.array_equal(left.last[some], right.last, equal_nan=True), left.name


# Operations that may be written out: of the chain of variables 237 in a fast step, 1167 in a careful one.
NONE_WRITTEN, FAST_WRITTEN = 1, 300


@pytest.mark.parametrize("kernel", [*KERNELS, NONE_WRITTEN, FAST_WRITTEN])
@pytest.mark.parametrize("system", GENERIC.values(), ids=GENERIC)
def test_a_step_of_an_ensemble_is_that_of_the_exact_map(system, kernel, monkeypatch):
    if isinstance(kernel, int):
        monkeypatch.setattr(steps, "MAX_OPERATIONS", kernel)
        kernel = "numpy"
    starts = starts_of(system.dim, 20) / 4
    orbits = FloatEnsemble(system, "1/50", starts, kernel=kernel)
    orbits.advance(1)
    phi = KahanMap(system, "1/50")
    for start, result in zip(starts, orbits.x, strict=True):
        x = [exact(entry) for entry in start.tolist()]
        expected = to_floats(phi.step(x))
        matrix = to_floats(phi.denominator_matrix(x).entries()).reshape(system.dim, system.dim)
        # some dozen roundings for each entry of the matrix and on the way through the elimination
        assert abs(result - expected).max() <= 100 * 2.0**-53 * np.linalg.cond(matrix) * abs(expected).max()


@over_members
def test_an_orbit_in_normal_form_follows_the_exact_one(name):
    system, form = MEMBERS[name].chosen.system, FORMS[name]
    start = [fmpq((-1) ** k * (k + 2), 20 * (k + 1)) for k in range(system.dim)]
    balls = [point.x for point in Orbit(KahanMap(system, "1/10", RR(2000)), start, 30)]
    orbit = FloatOrbit(system, "1/10", start, 30, form=form, kernel="numpy")
    # Roundings in x are magnified by the change of coordinates and back, and by the derivatives of 30 steps, which add
    # errors of their own: along these orbits by less than 1000 in all.
    condition = np.linalg.cond(planar_blocks(form, "1/10").x_to_state)
    largest = 0.0
    for (step, x), point in zip(orbit, balls, strict=True):
        expected = np.array([float(entry.mid()) for entry in point])
        largest = max(largest, abs(expected).max())
        assert abs(x - expected).max() <= 1000 * 2.0**-53 * condition * largest, step
    assert orbit.end.status == "completed"
    back = FloatEnsemble(system, "1/10", x[None], form=form, backward=True, kernel="numpy")
    back.advance(30)
    assert abs(back.x - to_floats(start)).max() <= 1e5 * 2.0**-53 * condition * largest


# The others are walked alike; machine code of a dense system takes seconds to be compiled.
OFTEN = ["euler_top", "pivots", "normal form, real and complex"]
OFTEN += ["normal form, repeated factors", "normal form, a repeated factor at a complex root"]


@pytest.mark.parametrize("name", quick(CASES, OFTEN))
def test_kernels_threads_company_portions_and_records_make_no_difference(name):
    """Some orbits end, many are near-singular again and again."""
    system, form = CASES[name]
    rng = np.random.default_rng(5)
    starts = starts_of(system.dim, 150)
    starts[40:70] *= 10.0 ** rng.uniform(-3, 60, (30, 1))
    starts[70:80] = np.round(8 * starts_of(system.dim, 10)) * 10.0 ** rng.integers(0, 250, (10, 1))

    def taken(some, *portions, **options):
        orbits = FloatEnsemble(system, "1/3", some, form=form, sample_interval=7, **options)
        return orbits, np.concatenate([x for steps in portions for x in orbits.records(steps, 4)])

    together, points = taken(starts, 60, kernel="numpy")
    assert points.shape == (16, 150, system.dim)
    assert np.array_equal(points[0], starts)
    assert np.array_equal(points[-1], together.x, equal_nan=True)
    for kernel in ("numpy", "numba")[: 1 + has_numba()]:
        for threads in (1, 2)[: 1 + (kernel == "numba")]:
            again, same_points = taken(starts, 3, 40, 17, kernel=kernel, threads=threads)
            same(together, again)
            assert np.array_equal(points, same_points, equal_nan=True)
        for some in ([0], [45], [75], [77], list(range(60, 70)), list(range(41, 80)), [149]):
            part, own = taken(starts[some], 60, kernel=kernel, threads=1)
            same(together, part, some)
            assert np.array_equal(own, points[:, some], equal_nan=True)


@pytest.mark.parametrize("name", ["a complex pair", "real and complex", "two complex pairs", "three real roots"])
def test_kernels_give_the_same_numbers_next_to_a_pole_of_one_plane(name):
    """In the coordinates of a block U V (U + V), w = 1 - (U^2 + U V + V^2), so U = 1, V = 0 is a pole."""
    pytest.importorskip("numba")
    blocks = planar_blocks(FORMS[name], "1/10")
    starts = starts_of(blocks.rows, 300) / 5
    lines = [row == [0, 1, 1, 0] for row in blocks.coefficients.tolist()]
    for r, has_pole in enumerate(lines):
        if has_pole:
            at, size = (2 * r, 2) if r < blocks.real_count else (4 * r - 2 * blocks.real_count, 4)
            rows = blocks.x_to_state @ starts[20 + r]
            rows[at : at + size] = [1 - 2.0**-43, *[0.0] * (size - 1)]
            starts[20 + r] = blocks.state_to_x @ rows
    system, form = MEMBERS[name].chosen.system, FORMS[name]
    entry, other = (
        FloatEnsemble(system, "1/10", starts, form=form, kernel=k, sample_interval=10) for k in ("numpy", "numba")
    )
    for it in (entry, other):
        it.advance(40)
    same(entry, other)
    assert (entry.near_singular[20 : 20 + len(lines)] > 0).tolist() == lines


@over_kernels
def test_each_way_to_end_has_its_status_and_step(kernel):
    # x~ = x/(1 - x): 1/3, 1/2, 1, and no more; from 1 - 2^-45 the pivot is 2^-45, and the image 2^45
    starts = np.array([[0.25], [1 / 2], [1.0], [1 - 2.0**-45], [-0.5]] + 100 * [[-0.5]])
    orbits = FloatEnsemble(RICCATI, "1/2", starts, kernel=kernel)
    orbits.advance(2)
    assert orbits.status.tolist()[:5] == ["completed", "singular", "singular", "completed", "completed"]
    assert orbits.failed_at.tolist()[:5] == [-1, 2, 1, -1, -1]
    assert orbits.near_singular.tolist()[:5] == [0, 0, 0, 1, 0]
    assert orbits.near_singular_at.tolist()[:5] == [-1, -1, -1, 0, -1]
    assert np.isnan(orbits.x[1:3]).all()
    assert (orbits.status[5:] == "completed").all()


@over_kernels
def test_a_zero_denominator_in_normal_form_is_singular_and_a_small_one_is_counted(kernel):
    # 2 eps = 1, so U = x1 and V = x2 up to the choice of the two factors. On V = 0 the map is U~ = U/(1 - U).
    member = FamilyMember(fmpq_mat(2, 2, [1, 0, 0, 1]), parse_polynomial("x1*x2*(x1 + x2)", ["x1", "x2"]))
    starts = np.array([[1 / 2, 0.0], [1.0 - 2.0**-42, 0.0], [0.25, 0.0], [1e-3, 1e-3]])
    orbits = FloatEnsemble(member.chosen.system, "1/2", starts, form=normal_form(member), kernel=kernel)
    orbits.advance(2)
    assert orbits.status.tolist() == ["singular", "completed", "completed", "completed"]
    assert orbits.near_singular_at.tolist() == [-1, 0, -1, -1]
    assert orbits.x[2, 0] == pytest.approx(0.5, rel=1e-15)
    assert (orbits.end(0).status, orbits.end(0).steps) == ("singular", 1)


@over_kernels
def test_an_overflow_ends_one_orbit_and_leaves_the_others(kernel):
    system = QuadraticSystem.from_text(["x", "y"], ["x", "x*y"])  # x~ = 3 x for eps = 1/2
    orbits = FloatEnsemble(system, "1/2", np.array([[1e300, 0.0]] + [[1e-300, 0.5]] * 200), kernel=kernel)
    orbits.advance(30)
    # 3^17 1e300 = 1.3e308 is in the range, 3^18 1e300 is not
    assert orbits.end(0) == OrbitEnd("overflow", 17, "step 18 leaves the range of floating-point numbers")
    assert (orbits.status[1:] == "completed").all()
    assert np.isnan(orbits.x[0]).all()
    orbits.advance(10)
    assert orbits.failed_at[0] == 18


def test_without_numba_the_default_is_numpy_and_numba_is_refused(monkeypatch):
    monkeypatch.setattr("kahanmaps.maps.kernels.has_numba", lambda: False)
    assert FloatEnsemble(EULER_TOP, "1/10", np.ones((1, 3))).kernel == "numpy generic"
    refuses(r"kahanmaps\[fast\]", FloatEnsemble, EULER_TOP, "1/10", np.ones((1, 3)), kernel="numba")


@pytest.mark.parametrize(
    ("starts", "options", "sentence"),
    [
        (np.ones((1, 3)), {"kernel": "fortran"}, "found the kernel 'fortran', expected numpy or numba"),
        (np.ones((1, 3)), {"threads": 0}, "found 0 threads"),
        (np.ones((1, 3)), {"sample_interval": 0}, "sample every 0 steps"),
        (np.ones((1, 3)), {"form": FORMS["a complex pair"]}, "belongs to another system"),
        (np.ones(3), {}, "one row for each point, with columns x1, x2, x3"),
        (np.ones((2, 2)), {}, "one row for each point"),
        (np.ones((0, 3)), {}, "one row for each point"),
        ([[1, 2]], {}, "one row for each point"),
        (np.array([[1.0, np.nan, 0.0]]), {}, "a coordinate that is not finite"),
    ],
)
def test_wrong_use_is_refused(starts, options, sentence):
    refuses(sentence, FloatEnsemble, EULER_TOP, "1/10", starts, **options)


def test_an_interrupted_ensemble_stops_between_portions_and_can_go_on():
    orbits = FloatEnsemble(FORCED_PLANE, "1/100", starts_of(2, 30) / 10, kernel="numpy")
    seen = []

    def progress(step: int) -> None:
        seen.append(step)
        orbits.interrupt()

    orbits.advance(10**6, progress=progress)
    assert seen == [orbits.step]
    assert 0 < orbits.step < 10**6
    reached = orbits.step
    orbits.advance(3)
    assert orbits.step == reached + 3
    orbits.interrupt()  # before the first portion
    orbits.advance(10**6)
    assert 3 < orbits.step - reached < 10**6


def walk(system, eps, start, steps, method):
    ensemble = MethodEnsemble(system, eps, [start], method, kernel="numpy")
    points = np.concatenate([x[:, 0] for x in ensemble.records(steps, 1)])
    return points[np.isfinite(points).all(axis=1)], ensemble.end(0)


def test_a_midpoint_equation_without_solution_ends_the_orbit():
    # y = x + y^2/2 with x = 10 has no real solution.
    x, end = walk(RICCATI, "1/2", [10], 100, "midpoint")
    assert (end.status, end.steps, len(x)) == ("singular", 0, 1)
    assert "equations of midpoint" in end.message


def butcher(f, h, x):
    """The step of the classical Runge-Kutta method, in fractions."""
    a = f(x)
    b = f([p + h / 2 * q for p, q in zip(x, a, strict=True)])
    c = f([p + h / 2 * q for p, q in zip(x, b, strict=True)])
    d = f([p + h * q for p, q in zip(x, c, strict=True)])
    return [p + h / 6 * (q + 2 * r + 2 * s + t) for p, q, r, s, t in zip(x, a, b, c, d, strict=True)]


def test_a_step_of_rk4_is_that_of_the_formula():
    system = QuadraticSystem.from_text(["x", "y"], ["x^2 - 3*x*y + 2*y - 1", "5*y^2 + x*y - x + 1/2"])

    def field(p):
        return [p[0] ** 2 - 3 * p[0] * p[1] + 2 * p[1] - 1, 5 * p[1] ** 2 + p[0] * p[1] - p[0] + Fraction(1, 2)]

    x, _ = walk(system, "1/20", ["1/3", "-2/5"], 1, "rk4")
    expected = butcher(field, Fraction(1, 10), [Fraction(1, 3), Fraction(-2, 5)])
    assert x[1].tolist() == pytest.approx([float(entry) for entry in expected], rel=1e-14)


# With h/2 = 1/2 the matrix I - A/2 has zeros where Gauss would divide: rows have to be exchanged.
CAYLEY = [
    [[2, 1], [1, 0]],
    [[2, 2, 0], [0, 2, 2], [2, 0, 2]],
    [[2, 1, 3], [4, 2, 1], [1, 5, 1]],
    [[2, 0, 1, 0], [1, 3, 0, 2], [0, 4, 2, 1], [5, 0, 0, 1]],
    [[0, 1, 0], [0, 0, 1], [1, 1, 0]],
]


@pytest.mark.parametrize("rows", [*CAYLEY, [[3]], [[1, 2, 3], [4, 5, 6], [7, 8, 10]]])
def test_midpoint_of_linear_equations_is_their_cayley_transform(rows):
    n = len(rows)
    names = ["x", "y", "z", "w"][:n]
    rhs = [" + ".join(f"{a}*{name}" for a, name in zip(row, names, strict=True)) for row in rows]
    entry, A = fmpq_mat(n, n, [int(i == j) for i in range(n) for j in range(n)]), fmpq_mat(rows)
    start = fmpq_mat(n, 1, [1, -2, 3, 5][:n])
    expected = (entry - A / 2).solve((entry + A / 2) * start)
    x, end = walk(QuadraticSystem.from_text(names, rhs), "1/2", [str(e) for e in start.entries()], 1, "midpoint")
    assert end.status == "completed"
    assert x[1].tolist() == pytest.approx([float(e.p) / float(e.q) for e in expected.entries()], rel=1e-12)


PATTERNS = {
    "one equation": ["*"],
    "diagonal": ["*..", ".*.", "..*"],
    "triangular": ["*..", "**.", "***"],
    "triangular from the right": ["***", ".**", "..*"],
    "exchanged": [".*.", "..*", "*.."],
    "two equations": ["**", "**"],
    "no diagonal": [".*", "*."],
    "blocks": ["**...", "**...", "..***", "..***", "..***"],
    "a block behind others": ["**..", "**..", "*.**", ".***"],
    "an arrow": ["****", "**..", "*.*.", "*..*"],
    "dense": ["****"] * 4,
    "no diagonal, dense": [".***", "*.**", "**.*", "***."],
    "a cycle": ["**...", ".**..", "..**.", "...**", "*...*"],
}


def code_of(pattern, careful):
    """The solution of M y = r as code of the entries of M that are not 0, row by row, and of r."""
    n = len(pattern)
    code, requested = StraightLineProgram(sum(row.count("*") for row in pattern) + n), StepChecks(careful)
    entries = iter(code.arguments)
    rows = [[next(entries) if mark == "*" else 0.0 for mark in row] for row in pattern]
    rows = [[*row, right] for row, right in zip(rows, entries, strict=True)]
    size = code.arguments[0]
    for x in code.arguments[1:]:
        size = size.code.emit("max", abs(size), abs(x))
    code.outputs = [*solve(rows, EntryBound(64.0, lambda: abs(size) <= 64.0), requested), *requested.outputs()]
    return code


@pytest.mark.parametrize("pattern", PATTERNS.values(), ids=PATTERNS)
@pytest.mark.parametrize("small", [False, True], ids=["large diagonal", "any pivots"])
def test_equations_of_any_pattern_have_the_exact_solution(pattern, small):
    rng, n = random.Random(3), len(pattern)
    fast, careful = (code_of(pattern, kind) for kind in (False, True))
    contented = 0
    for _ in range(20):
        M = [[fmpq(rng.randint(1, 64), 64) if mark == "*" else fmpq(0) for mark in row] for row in pattern]
        for i in range(n):
            M[i][i] *= 1 if small else 8
        if fmpq_mat(M).det() == 0:
            continue
        right = [fmpq(rng.randint(-64, 64), 64) for _ in range(n)]
        expected = [to_float(x) for x in fmpq_mat(M).solve(fmpq_mat(n, 1, right)).entries()]
        given = [to_float(M[i][j]) for i in range(n) for j in range(n) if pattern[i][j] == "*"]
        given += [to_float(x) for x in right]
        *result, near, singular, overflow = careful.function(float)(*given)
        assert (bool(near), bool(singular), bool(overflow)) == (False, False, False)
        condition = np.linalg.cond([[to_float(x) for x in row] for row in M])
        # some dozen roundings, and rows subtracted up to 8 times from others
        assert result == pytest.approx(expected, rel=1e-13 * condition, abs=1e-13 * condition)
        *quick, good = fast.function(float)(*given)
        if good:
            contented += 1
            assert quick == result
        arrays = careful.function(np.ndarray)(*(np.array([x]) for x in given))
        assert [float(x[0]) for x in arrays[:n]] == result
    assert small or contented > 10


SINGULAR = [["..", "**"], [".*", ".*"], ["**.", "**.", "**."], ["***", "*..", "*.."]]


STIFF = QuadraticSystem.from_text(  # at eps = 1/50, M has constants near 2000
    ["x", "y", "z"], ["100000*x + y*z - 90000*y", "70000*y + x*z + 10000*z", "80000*z + x*y - 30000*x"]
)
COLUMN = QuadraticSystem.from_text(  # near y = 50 the first column of M is almost 0
    ["x", "y", "z"], ["x*y + z^2", "x*z/10000000000000000 + y*z", "x*y/10000000000000000 + y^2 - z"]
)
LINEAR = QuadraticSystem.from_text(["x", "y", "z"], ["y - 2*z + x", "x + 3*z", "x + y - z"])
ELIMINATED = {
    "top": EULER_TOP,
    "rows exchanged": PIVOTS,
    "chain": CHAIN,
    "stiff": STIFF,
    "column": COLUMN,
    "linear": LINEAR,
}


@pytest.mark.parametrize("system", ELIMINATED.values(), ids=ELIMINATED)
def test_a_valid_fast_step_is_the_careful_one_which_has_nothing_to_report(system):
    """Next to det M = 0 and at numbers of any size; at ordinary points the fast step is valid."""
    step, rng = steps.map_step(KahanMap(system, "1/50").factors), np.random.default_rng(1)
    directions = rng.uniform(0.5, 1, (60, system.dim)) * rng.choice([-1, 1], (60, system.dim))
    points = [size * u for u in directions for size in (1e-3, 1, 10, 100, 1e3, 1e6, 1e100, 1e160, 1e300, 1.7e308)]
    ordinary = [index for index in range(len(points)) if index % 10 < 2]
    forms = np.array([[[to_float(entry) for entry in row] for row in form.tolist()] for form in system.Q])
    linear = np.array([[to_float(entry) for entry in row] for row in system.B.table()])
    for u in directions if system is not LINEAR else ():
        roots = np.linalg.eigvals(np.linalg.solve(50 * np.eye(system.dim) - linear, 2 * forms @ u))
        for root in roots.real[(roots.imag == 0) & (abs(roots) > 1e-6)]:  # det M(u / root) = 0
            points += [u / root * (1 + error) for error in (0, 1e-15, 1e-14, 1e-13, 1e-12, 1e-10, 1e-8, 1e-4)]
    with np.errstate(all="ignore"):
        *image, valid = step.fast(*np.array(points).T)
        *expected, near, singular, overflow = step.careful(*np.array(points).T)
    valid = np.broadcast_to(valid, len(points))
    assert not (valid & (near | singular | overflow)).any()
    assert np.isfinite(np.array(expected)[:, valid]).all()
    assert (np.array(image)[:, valid] == np.array(expected)[:, valid]).all()
    assert system is PIVOTS or np.mean(valid[ordinary]) > 0.9
    assert system is LINEAR or np.sum(near | singular) > 50


T = "1/1" + "0" * 100
EXTREME = {
    "products beyond the doubles": (
        QuadraticSystem.from_text(
            ["x", "y", "z"], [f"x + 2*y - z + {T}*y*z", f"y - x + 3*z + {T}*x*z", f"z + x + y + {T}*x*y"]
        ),
        fmpq(10**140),
        [1e98, 2e98, -1e98],
    ),
    "long constants": (
        QuadraticSystem.from_text(["x", "y", "z"], ["x + y*z - y", "y + x*z + z", "z + x*y - x"]),
        fmpq(10**160),
        [1.0, 0.5, 0.25],
    ),
    "tiny eps": (EULER_TOP, fmpq(1, 10**306), [1.0, 2.0, 3.0]),
    "tinier eps": (EULER_TOP, fmpq(1, 10**310), [1.0, 2.0, 3.0]),
    "large numbers": (EULER_TOP, fmpq(1, 10), [1e155, 2e155, 3e155]),
}


@over_kernels
@pytest.mark.parametrize("copies", [1, 20])
@pytest.mark.parametrize(("system", "eps", "start"), EXTREME.values(), ids=EXTREME)
def test_numbers_of_any_size_are_right_or_an_overflow(system, eps, start, copies, kernel):
    ensemble = FloatEnsemble(system, eps, np.array([start] * copies), kernel=kernel)
    ensemble.advance(1)
    expected = KahanMap(system, eps).step([fmpq(*x.as_integer_ratio()) for x in start])
    for image, status in zip(ensemble.x, ensemble.status, strict=True):
        assert status == "overflow" or image == pytest.approx([to_float(x) for x in expected], rel=1e-6)
        assert status == "completed" or eps > fmpq(1, 100)


x, y, z, _, _ = ring(["x", "y", "z", "w", "eps"]).gens()
ONE = x.context().constant(1)
HIDDEN = [  # at x = 1e200, y = 0: entries that are inf * 0, in a row that no later pivot sees; rows of (M | -r)
    ((2 * ONE, ONE, z, 0 * ONE, -z), (ONE, 3 * ONE, 0 * ONE, x**2 * y, -ONE)),
    ((2 * ONE, ONE, x**2 * y, 0 * ONE, -z), (ONE, 3 * ONE, 0 * ONE, z, -ONE)),
]
LOWER = ((0 * ONE, 0 * ONE, 2 * ONE, ONE, -ONE), (0 * ONE, 0 * ONE, ONE, 2 * ONE, -2 * ONE))


@over_kernels
@pytest.mark.parametrize("copies", [1, 20])
@pytest.mark.parametrize("upper", HIDDEN, ids=["second row", "first row"])
def test_no_orbit_is_completed_with_a_number_that_is_none(upper, copies, kernel):
    map_ = ImplicitMap(("x", "y", "z", "w"), (*upper, *LOWER), "t")
    ensemble = FloatEnsemble(map_, "1/2", np.array([[1e200, 0, 1.5, 1]] * copies), kernel=kernel)
    ensemble.advance(1)
    for image, status in zip(ensemble.x, ensemble.status, strict=True):
        assert status != "completed" or np.isfinite(image).all()


@over_kernels
@pytest.mark.parametrize("copies", [1, 20])
def test_an_infinite_pivot_is_an_overflow(copies, kernel):
    """Its inverse is 0, and the image would look like a point."""
    names = ["x", "y", "z"]
    x, *_ = ring([*names, "eps"]).gens()
    c = x.context().constant
    rows = (
        (x**2 * fmpq(1, 10**306) + 1, c(1), c(2), c(-1)),
        (c(1), c(3), c(1), c(-2)),
        (c(2), c(1), c(5), c(-3)),
    )
    ensemble = FloatEnsemble(
        ImplicitMap(tuple(names), rows, "t"), "1/2", np.array([[1e200, 1, 1]] * copies), kernel=kernel
    )
    ensemble.advance(1)
    assert set(ensemble.status) == {"overflow"}


@over_kernels
@pytest.mark.parametrize("copies", [1, 20])
@pytest.mark.parametrize("column", ["x and y", "x"])
def test_a_pivot_0_is_seen_though_later_pivots_do_not_depend_on_it(column, copies, kernel):
    """At x = 0 the fast step divides by 0, the second pivot is NaN, the others are ordinary."""
    names = ["x", "y", "z", "v", "w"]
    x, y, *_ = ring([*names, "eps"]).gens()
    c = x.context().constant
    rows = (
        (x, y, c(0), c(0), c(0), c(-1)),
        (y if column == "x and y" else x, 3 * y, y, c(0), c(0), c(-2)),
        (c(0), c(0), 5 * y, y, y, c(-3)),
        (c(0), c(0), y, 4 * y, y, c(-1)),
        (c(0), c(0), y, y, 6 * y, c(-2)),
    )
    map_ = ImplicitMap(tuple(names), rows, "t")
    ensemble = FloatEnsemble(map_, "1/2", np.array([[0, 1, 1, 1, 1.0]] * copies), kernel=kernel)
    ensemble.advance(1)
    assert set(ensemble.status) == {"completed" if column == "x and y" else "singular"}
    if column == "x":
        return
    expected = [to_float(entry) for entry in map_.at("1/2").step([0, 1, 1, 1, 1])]
    assert ensemble.x == pytest.approx(np.array([expected] * copies), rel=1e-12)


def test_large_steps_check_that_their_numbers_are_finite():
    """In few rows a valid fast elimination cannot overflow; in many this is not proved."""
    for dim, is_checked in ((3, False), (12, False), (14, True)):
        names = [f"x{i}" for i in range(dim)]
        total = " + ".join(names)
        system = QuadraticSystem.from_text(names, [f"({total})*({total} + {name})" for name in names])
        operations = steps.map_step(KahanMap(system, "1/50").factors).fast_code.operations
        assert any(largest == steps.LARGEST_DOUBLE for _, (*_, largest) in operations) == is_checked


@pytest.mark.parametrize("pattern", SINGULAR, ids=str)
def test_a_matrix_that_its_zeros_make_singular_is_reported(pattern):
    assert code_of(pattern, careful=True).outputs[-2] is True
    assert code_of(pattern, careful=False).outputs[-1] is False


@pytest.mark.parametrize("method", ["yoshida4", "suzuki4", "yoshida6"])
def test_a_composition_satisfies_the_conditions_of_its_order(method):
    shares = composition(method)
    assert sum(shares, fmpq(0)) == 1
    assert shares == shares[::-1]
    # A symmetric composition has the order 4 if the cubes add up to 0, the order 6 only if the fifth powers do, too;
    # the shares are rounded to 80 bits and more.
    powers = (3, 5) if METHODS[method].order == 6 else (3,)
    assert all(abs(sum(share**power for share in shares)) < fmpq(1, 2**70) for power in powers)
    assert abs(sum(share**5 for share in shares)) > fmpq(1, 100) or method == "yoshida6"


@pytest.mark.parametrize("method", ["kahan", "midpoint", "gauss4", "stormer-verlet", "yoshida6"])
def test_symmetric_methods_are_inverted_by_minus_eps_and_euler_is_not(method):
    system = QuadraticSystem.from_text(["q", "p"], ["p", "-q - q^2"])
    halves = (frozenset({0}), frozenset({1}))
    for name, is_symmetric in ((method, True), ("euler", False), ("symplectic-euler", False)):
        forth = MethodEnsemble(system, "1/20", [["1/3", "1/4"]], name, halves=halves, kernel="numpy")
        forth.advance(10)
        back = MethodEnsemble(system, "-1/20", forth.x, name, halves=halves, kernel="numpy")
        back.advance(10)
        assert (abs(back.x - [1 / 3, 1 / 4]).max() < 1e-13) == is_symmetric


def test_positions_and_momenta_are_found_in_any_order_and_scale_and_reasons_are_given():
    def of(H, J=None, names=("q", "p")):
        hamiltonian = CubicHamiltonian(parse_polynomial(H, names), J or standard_structure(2))
        return separated(hamiltonian.system, hamiltonian)

    assert of("p^2/2 + q^3") == (frozenset({0}), frozenset({1}))
    assert of("p^2/2 + q^3", fmpq_mat([[0, 3], [-3, 0]]), ("p", "q")) == (frozenset({0}), frozenset({1}))
    assert of("p*q + q^3") == "H is not of the form T(p) + V(q): p would be a position and a momentum"
    assert "no Hamiltonian form" in separated(RICCATI, None)


def test_lines_at_right_angles_are_not_parallel():
    """Their product is a ball around exactly 0, whose square is nan in python-flint 0.9.0."""
    for radius in (0, 1e-30):
        entry, small = acb(1), acb(arb(0, radius))
        right, parallel = ([entry, small], [small, entry]), ([entry, small], [entry, small])
        assert _sine_of_angle(right, [[entry, small], [small, entry]]) == pytest.approx(1, abs=1e-15)
        assert _sine_of_angle(parallel, [[entry, small], [small, entry]]) == 0
    with pytest.raises(_InsufficientPrecision):
        _sine_of_angle(([entry, entry], [acb(arb(0, 1)), acb(arb(0, 1))]), [[entry, entry], [entry, entry]])


@over_members
def test_block_integrals_do_not_drift(name):
    system = MEMBERS[name].chosen.system
    starts = starts_of(system.dim, 20) / 40
    orbits = FloatEnsemble(system, "1/10", starts, form=FORMS[name], kernel="numpy", sample_interval=20)
    orbits.advance(400)
    assert len(orbits.drift) == len(planar_blocks(FORMS[name], "1/10").kappa)
    for drift in orbits.drift:
        # 400 steps of some roundings each are 1e-13. Where an orbit passes near infinity, the numerator and the
        # denominator of the integral are larger than their quotient by the cube and the square of the distance.
        assert (drift.largest <= 1e-8 * (1 + abs(drift.initial))).all()
        assert (drift.last <= drift.largest).all()


@over_kernels
def test_a_function_that_is_no_integral_drifts_and_one_that_is_does_not(kernel):
    names = EULER_TOP.variables
    integrals = {
        "of the map": float_function(parse_rational_function("(1 - 1/100*x2^2)/(1 + 2/100*x3^2)", names)),
        "of the flow": float_function(parse_rational_function("x1^2 + x2^2/2", names)),
    }
    starts = np.array([[1, 1 / 2, 1 / 3], [1 / 2, 1, 1 / 4]])
    orbits = FloatEnsemble(EULER_TOP, "1/10", starts, integrals=integrals, kernel=kernel)
    list(orbits.records(2000, 10))
    of_map, of_flow = orbits.drift
    assert (of_map.name, of_flow.name) == ("of the map", "of the flow")
    assert (of_map.largest < 2000 * 4 * 2.0**-53).all()  # four roundings a step, all in one direction at worst
    assert (of_flow.largest > 1e-4).all()  # about eps^2
    orbit = FloatOrbit(EULER_TOP, "1/10", ["1", "1/2", "1/3"], 2000, every=10, integrals=integrals, kernel=kernel)
    for _ in orbit:
        pass
    assert orbit.drift[1].largest == of_flow.largest[0]


@given(a=st.integers(-(10**30), 10**30), b=st.integers(1, 10**30))
def test_a_number_is_rounded_to_the_nearest_double(a, b):
    result = to_float(fmpq(a, b))
    error = abs(fmpq(a, b) - exact(result))
    for neighbour in (nextafter(result, -np.inf), nextafter(result, np.inf)):
        assert error <= abs(fmpq(a, b) - exact(neighbour))


ENDLESS = """
from kahanmaps.maps.floats.float_orbit import FloatOrbit, stream_orbit
from kahanmaps.systems.quadratic import QuadraticSystem
top = QuadraticSystem.from_text(["x1", "x2", "x3"], ["x2*x3", "-2*x3*x1", "x1*x2"])
orbit = FloatOrbit(top, "1/10", ["1", "1/2", "1/3"], None, every=50, kernel="numpy")
stream_orbit(orbit, {path!r}, progress=lambda step: print(step, flush=True))
"""


def test_a_killed_run_leaves_a_readable_file(tmp_path):
    path = tmp_path / "x.npy"
    process = subprocess.Popen(
        [sys.executable, "-c", ENDLESS.format(path=str(path))], stdout=subprocess.PIPE, text=True
    )
    try:
        messages = [int(process.stdout.readline()) for _ in range(2)]
        time.sleep(0.01)
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()
    points = np.load(path)
    assert len(points) >= messages[-1] // 50 + 1  # what was told is there, and perhaps a portion more
    steps = 50 * (len(points) - 1)
    expected = np.concatenate(
        list(FloatEnsemble(EULER_TOP, "1/10", [["1", "1/2", "1/3"]], kernel="numpy").records(steps, 50))
    )
    assert np.array_equal(points, expected[:, 0])
