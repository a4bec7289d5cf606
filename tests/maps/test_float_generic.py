"""Generic float steps, for any quadratic system: against exact ones, and the same numbers by whatever kernel.

Specified here: the elimination agrees with exact steps; kernels, company, portions and records make
no difference; near-singular, singular and overflowing steps are told for each orbit with their index; kernels are
chosen and named as asked.
"""

import numpy as np
import pytest
from helpers import EULER_TOP, FORCED_PLANE, NAMED_SYSTEMS, over_named_systems

from kahanmaps.errors import InputError
from kahanmaps.family.draw import draw_with_eigenvalues
from kahanmaps.maps.floats.doubles import exact
from kahanmaps.maps.floats.fast import FloatEnsemble, FloatOrbit, to_floats
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.kernels import has_numba
from kahanmaps.systems.quadratic import QuadraticSystem

KERNELS = ["numpy", pytest.param("numba", marks=pytest.mark.skipif(not has_numba(), reason="numba is not installed"))]
over_kernels = pytest.mark.parametrize("kernel", KERNELS)

RICCATI = QuadraticSystem.from_text(["x"], ["x^2"])
# Many variables, few terms: x_i' = x_{i+1} x_{i-1} - x_i, with a constant in the first.
CHAIN = QuadraticSystem.from_text(
    [f"x{i}" for i in range(12)],
    [f"x{(i + 1) % 12}*x{i - 1 if i else 11} - x{i}" + (" + 1/2" if i == 0 else "") for i in range(12)],
)
# At eps = 1/50 all elements of the diagonal of I - eps f'(x) are small: rows have to be exchanged.
PIVOTS = QuadraticSystem.from_text(
    ["x", "y", "z"], ["50*x + 30*y + x*z", "20*x + 50*y + 10*z + y^2", "15*y + 40*x + 50*z - x*y"]
)
# The same four times: in a dimension beyond those for which kernels are written out.
MANY_PIVOTS = QuadraticSystem.from_text(
    [f"{name}{k}" for k in range(4) for name in "xyz"],
    [
        text.format(k=k)
        for k in range(4)
        for text in (
            "50*x{k} + 30*y{k} + x{k}*z{k}",
            "20*x{k} + 50*y{k} + 10*z{k} + y{k}^2",
            "15*y{k} + 40*x{k} + 50*z{k} - x{k}*y{k}",
        )
    ],
)
SYSTEMS = {
    **NAMED_SYSTEMS,
    "chain": CHAIN,
    "pivots": PIVOTS,
    "many pivots": MANY_PIVOTS,
    "member": draw_with_eigenvalues([1, -2, 3], seed=7).chosen.system,
}
over_systems = pytest.mark.parametrize("system", SYSTEMS.values(), ids=SYSTEMS.keys())


def starts_of(system: QuadraticSystem, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (n, system.dim))


def same(one: FloatEnsemble, other: FloatEnsemble) -> None:
    assert np.array_equal(one.x, other.x, equal_nan=True)
    for name in ("status", "failed_at", "near_singular", "near_singular_at"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


# Right numbers.


@over_kernels
@over_systems
def test_a_step_of_an_ensemble_is_that_of_the_exact_map(system, kernel):
    starts = starts_of(system, 20) / 4
    orbits = FloatEnsemble(system, "1/50", starts, kernel=kernel)
    orbits.advance(1)
    phi = KahanMap(system, "1/50")
    for start, found in zip(starts, orbits.x, strict=True):
        x = [exact(entry) for entry in start.tolist()]
        expected = to_floats(phi.step(x))
        matrix = to_floats(phi.denominator_matrix(x).entries()).reshape(system.dim, system.dim)
        # some dozen roundings for each entry of the matrix and on the way through the elimination
        assert abs(found - expected).max() <= 100 * 2.0**-53 * np.linalg.cond(matrix) * abs(expected).max()


# The same numbers, to the last bit.


@over_systems
@pytest.mark.parametrize("threads", [1, 2])
def test_kernels_give_the_same_numbers(system, threads):
    pytest.importorskip("numba")
    starts = starts_of(system, 300)
    starts[5] *= 1e160
    one = FloatEnsemble(system, "1/3", starts, kernel="numpy")
    other = FloatEnsemble(system, "1/3", starts, kernel="numba", threads=threads)
    for it in (one, other):
        it.advance(25)
    same(one, other)


@over_kernels
@over_systems
def test_orbits_do_not_depend_on_their_company(system, kernel):
    starts = starts_of(system, 150)
    together = FloatEnsemble(system, "1/3", starts, kernel=kernel)
    together.advance(20)
    for orbit in (0, 127, 149):
        alone = FloatEnsemble(system, "1/3", starts[orbit : orbit + 1], kernel=kernel)
        alone.advance(20)
        assert np.array_equal(alone.x[0], together.x[orbit], equal_nan=True)


@over_kernels
@over_named_systems
def test_portions_and_records_do_not_change_the_numbers(system, kernel):
    starts = starts_of(system, 20)
    whole = FloatEnsemble(system, "1/20", starts, kernel=kernel)
    portions = FloatEnsemble(system, "1/20", starts, kernel=kernel)
    recorded = FloatEnsemble(system, "1/20", starts, kernel=kernel)
    whole.advance(60)
    for steps in (7, 1, 52):
        portions.advance(steps)
    points = np.concatenate(list(recorded.records(60, 4)))
    same(whole, portions)
    same(whole, recorded)
    assert points.shape == (16, 20, system.dim)
    assert np.array_equal(points[0], starts)
    assert np.array_equal(points[-1], whole.x, equal_nan=True)


# Ends.


@over_kernels
def test_each_way_to_end_has_its_status_and_step(kernel):
    # x~ = x/(1 - x): 1/3, 1/2, 1, and no more; from 1 - 2^-45 the pivot is 2^-45, and the image 2^45
    starts = np.array([[0.25], [1 / 2], [1.0], [1 - 2.0**-45], [-0.5]])
    orbits = FloatEnsemble(RICCATI, "1/2", starts, kernel=kernel)
    orbits.advance(2)
    assert orbits.status.tolist() == ["completed", "singular", "singular", "completed", "completed"]
    assert orbits.failed_at.tolist() == [-1, 2, 1, -1, -1]
    assert orbits.near_singular.tolist() == [0, 0, 0, 1, 0]
    assert np.isnan(orbits.x[1:3]).all()


@over_kernels
def test_a_pivot_is_small_beside_its_own_row_only(kernel):
    # I - eps f' = diag(1 - x, 1 - y/2) for eps = 1/2: large numbers in one row take no bits from another
    system = QuadraticSystem.from_text(["x", "y"], ["x^2", "y^2/2"])
    orbits = FloatEnsemble(system, "1/2", np.array([[2.0**60, 1.0], [2.0**60, 2 - 2.0**-45]]), kernel=kernel)
    orbits.advance(1)
    assert orbits.near_singular.tolist() == [0, 1]


@over_kernels
def test_an_overflow_ends_one_orbit_and_leaves_the_others(kernel):
    system = QuadraticSystem.from_text(["x", "y"], ["x", "x*y"])  # x~ = 3 x for eps = 1/2
    starts = np.array([[1e300, 0.0]] + [[1e-300, 0.5]] * 200)
    orbits = FloatEnsemble(system, "1/2", starts, kernel=kernel)
    orbits.advance(30)
    # 3^17 1e300 = 1.3e308 is in the range, 3^18 1e300 is not
    assert (orbits.status[0], orbits.failed_at[0], orbits.end(0).steps) == ("overflow", 18, 17)
    assert (orbits.status[1:] == "completed").all()
    assert np.isnan(orbits.x[0]).all()
    orbits.advance(10)
    assert orbits.failed_at[0] == 18


# Choices and refusals.


def test_the_kernel_is_named():
    assert FloatEnsemble(EULER_TOP, "1/10", np.ones((1, 3)), kernel="numpy").kernel == "numpy generic"
    assert FloatOrbit(EULER_TOP, "1/10", [1, 1, 1], 10).kernel == "numpy generic"  # too short to be worth compiling


def test_the_compiled_kernel_is_named_with_its_threads():
    pytest.importorskip("numba")
    assert FloatEnsemble(EULER_TOP, "1/10", np.ones((1, 3)), threads=2).kernel == "numba generic, 2 threads"
    assert FloatOrbit(EULER_TOP, "1/10", [1, 1, 1], None).kernel == "numba generic, 1 thread"


def test_without_numba_the_default_is_numpy_and_numba_is_refused(monkeypatch):
    monkeypatch.setattr("kahanmaps.maps.kernels.has_numba", lambda: False)
    assert FloatEnsemble(EULER_TOP, "1/10", np.ones((1, 3))).kernel == "numpy generic"
    with pytest.raises(InputError, match=r"kahanmaps\[fast\]"):
        FloatEnsemble(EULER_TOP, "1/10", np.ones((1, 3)), kernel="numba")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"kernel": "fortran"}, "found the kernel 'fortran', expected numpy or numba"),
        ({"threads": 0}, "found 0 threads"),
        ({"sampled": 0}, "sample every 0 steps"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, sentence):
    with pytest.raises(InputError, match=sentence):
        FloatEnsemble(EULER_TOP, "1/10", np.ones((1, 3)), **options)


@pytest.mark.parametrize("starts", [np.ones(3), np.ones((2, 2)), np.ones((0, 3)), [[1, 2]]], ids=str)
def test_starts_of_another_shape_are_refused(starts):
    with pytest.raises(InputError, match="one row for each start, with columns x1, x2, x3"):
        FloatEnsemble(EULER_TOP, "1/10", starts)


def test_a_start_that_is_no_number_is_refused():
    with pytest.raises(InputError, match="no finite number"):
        FloatEnsemble(EULER_TOP, "1/10", np.array([[1.0, np.nan, 0.0]]))


def test_records_at_no_interval_are_refused():
    with pytest.raises(InputError, match="every 0 steps"):
        np.concatenate(list(FloatEnsemble(EULER_TOP, "1/10", np.ones((1, 3)), kernel="numpy").records(10, 0)))


def test_an_interrupted_ensemble_stops_between_portions_and_can_go_on():
    orbits = FloatEnsemble(FORCED_PLANE, "1/100", starts_of(FORCED_PLANE, 30) / 10, kernel="numpy")
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
