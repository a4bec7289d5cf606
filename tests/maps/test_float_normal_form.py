"""The normal form in floating point: its blocks, found in balls and rounded once, and their integrals.

Float orbits are rounded once, near the exact ones; a file of one is complete and readable at every moment, also after
the program was killed. Tolerances say where they come from. Lyapunov exponents: linear maps in closed form, exact
derivatives along exact orbits, and the Lorenz map.
"""

import math
import os
import signal
import subprocess
import sys
import time
from fractions import Fraction
from math import nextafter

import numpy as np
import pytest
from flint import acb, arb, fmpq, fmpq_mat, fmpq_poly
from helpers import EULER_TOP
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.documents.catalog import load
from kahanmaps.family.planar import normal_form
from kahanmaps.family.random_members import random_member, random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.maps.floats.float_orbit import FloatEnsemble, FloatOrbit, float_function, to_float
from kahanmaps.maps.floats.lyapunov import lyapunov_exponents
from kahanmaps.maps.floats.planar_blocks import _InsufficientPrecision, _sine_of_angle, planar_blocks
from kahanmaps.maps.floats.starts import starts_in_box
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.kernels import has_numba
from kahanmaps.systems.quadratic import QuadraticSystem

EPS = "1/10"
MEMBERS = {
    "one plane": random_member_with_eigenvalues([1], seed=2),
    "three real roots": random_member_with_eigenvalues([1, -2, 3], seed=7),
    "six real roots": random_member_with_eigenvalues([1, -2, 3, 4, 5, -6], seed=9),
    "a complex pair": random_member_with_chi(fmpq_poly([1, 0, 1]), seed=1),
    "real and complex": random_member_with_chi(fmpq_poly([-2, 0, 0, 1]), seed=7),
    "two complex pairs": random_member_with_chi(fmpq_poly([1, 0, 0, 0, 1]), seed=4),
    "irrational roots": random_member(4, seed=3),
}
FORMS = {name: normal_form(member) for name, member in MEMBERS.items()}


over_members = pytest.mark.parametrize("name", MEMBERS)
KERNELS = ["numpy", pytest.param("numba", marks=pytest.mark.skipif(not has_numba(), reason="numba is not installed"))]
over_kernels = pytest.mark.parametrize("kernel", KERNELS)


def test_lines_at_right_angles_are_not_parallel():
    """Their product is a ball around exactly 0, whose square is nan in python-flint 0.9.0."""
    for radius in (0, 1e-30):
        entry, small = acb(1), acb(arb(0, radius))
        right, parallel = ([entry, small], [small, entry]), ([entry, small], [entry, small])
        assert _sine_of_angle(right, [[entry, small], [small, entry]]) == pytest.approx(1, abs=1e-15)
        assert _sine_of_angle(parallel, [[entry, small], [small, entry]]) == 0
    with pytest.raises(_InsufficientPrecision):
        _sine_of_angle(([entry, entry], [acb(arb(0, 1)), acb(arb(0, 1))]), [[entry, entry], [entry, entry]])


def starts_of(dim: int, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (n, dim))


def ensemble(name: str, starts: np.ndarray, **options: object) -> FloatEnsemble:
    return FloatEnsemble(MEMBERS[name].chosen.system, EPS, starts, form=FORMS[name], **options)


@over_members
def test_block_integrals_do_not_drift(name):
    orbits = ensemble(name, starts_of(MEMBERS[name].chosen.system.dim, 20) / 40, kernel="numpy", sample_interval=20)
    orbits.advance(400)
    assert len(orbits.drift) == len(planar_blocks(FORMS[name], EPS).kappa)
    for drift in orbits.drift:
        # 400 steps of some roundings each are 1e-13. Where an orbit passes near infinity, the numerator and the
        # denominator of the integral are larger than their quotient by the cube and the square of the distance.
        assert (drift.largest <= 1e-8 * (1 + abs(drift.initial))).all()
        assert (drift.last <= drift.largest).all()


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


@given(a=st.integers(-(10**30), 10**30), b=st.integers(1, 10**30))
def test_a_number_is_rounded_to_the_nearest_double(a, b):
    result = to_float(fmpq(a, b))
    error = abs(fmpq(a, b) - exact(result))
    for neighbour in (nextafter(result, -np.inf), nextafter(result, np.inf)):
        assert error <= abs(fmpq(a, b) - exact(neighbour))


def exact(number: float) -> fmpq:
    return fmpq(*number.as_integer_ratio())


START = ["1", "1/2", "1/3"]


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
    expected = np.concatenate(list(FloatEnsemble(EULER_TOP, "1/10", [START], kernel="numpy").records(steps, 50)))
    assert np.array_equal(points, expected[:, 0])


def system_of(*rhs: str) -> QuadraticSystem:
    return QuadraticSystem.from_text(["x", "y", "z"][: len(rhs)], list(rhs))


def exponent(eps: float, eigenvalue: float) -> float:
    """That of the linear map (1 + eps a)/(1 - eps a), per unit of time."""
    return math.log(abs((1 + eps * eigenvalue) / (1 - eps * eigenvalue))) / (2 * eps)


@pytest.mark.parametrize("eps", ["1/10", "-1/10", "1/3"])
def test_linear_systems_have_the_logarithms_of_their_eigenvalues(eps):
    """Triangular, so that the frame turns into the flag of eigenvectors at a geometric rate."""
    exponents = lyapunov_exponents(system_of("x/2 + y", "-y", "-2*z + x"), [[1.0, 0.5, 0.2]], eps, 400, transient=200)
    value = float(eps.split("/")[0]) / float(eps.split("/")[1])
    expected = sorted((exponent(value, a) for a in (0.5, -1.0, -2.0)), reverse=True)
    assert exponents.mean == pytest.approx(expected, abs=1e-9)
    assert exponents.per_step == pytest.approx(np.array(expected) * 2 * value, abs=1e-9)
    assert exponents.change == pytest.approx([0, 0, 0], abs=1e-9)


@pytest.mark.parametrize("name", ["lorenz", "lotka_volterra", "henon_heiles"])
@pytest.mark.parametrize(("steps", "transient"), [(5, 3), (6, 0), (2, 1)])
def test_the_exponents_are_those_of_the_exact_derivatives_along_the_exact_orbit(name, steps, transient):
    """Q_k R_k = dPhi(x_k) Q_(k-1), Q = I at the start, and the sums of log |R_k| from after the transient on."""
    kahan = KahanMap(load(name).system, "1/50")
    start = x = kahan.point([f"1/{k + 2}" for k in range(kahan.dim)])
    Q, logs, volumes = np.eye(kahan.dim), [], []
    for _ in range(transient + steps):
        rows = fmpq_mat(kahan.jacobian(x)).tolist()
        J = np.array([[float(Fraction(int(entry.p), int(entry.q))) for entry in row] for row in rows])
        Q, R = np.linalg.qr(J @ Q)
        logs.append(np.log(np.abs(np.diagonal(R))))
        volumes.append(math.log(abs(np.linalg.det(J))))
        x = kahan.step(x)
    counted, half = logs[transient:], steps // 2
    exponents, early = sum(counted) / (steps / 25), sum(counted[:half]) / (half / 25)
    order = np.argsort(-exponents)
    point = [int(entry.p) / int(entry.q) for entry in start]
    result = lyapunov_exponents(load(name).system, [point, point], "1/50", steps, transient=transient)
    assert (result.steps, result.transient, result.orbits, result.ended_count, result.is_stopped) == (
        steps,
        transient,
        2,
        0,
        False,
    )
    for lane in (0, 1):
        assert result.exponents[lane] == pytest.approx(exponents[order], abs=1e-9)
        assert result.first_half_exponents[lane] == pytest.approx(early[order], abs=1e-9)
        assert result.log_volume[lane] == pytest.approx(sum(volumes[transient:]) / (steps / 25), abs=1e-9)


@pytest.mark.slow
def test_the_lorenz_map_at_a_small_step():
    """About 0.906 for the flow (s = 10, r = 28, b = 8/3), and the divergence -41/3 for the sum."""
    exponents = lyapunov_exponents(
        load("lorenz").system, starts_in_box(32, 3, 5.0, 0), "1/400", 20_000, transient=4_000
    )
    assert exponents.ended_count == 0
    assert exponents.mean[0] == pytest.approx(0.906, abs=0.06)
    assert abs(exponents.mean[1]) < 0.05
    assert exponents.mean.sum() == pytest.approx(-41 / 3, abs=0.05)


def test_a_time_limit_keeps_the_complete_portions():
    messages = []

    def stop(sentence):
        messages.append(sentence)
        if len(messages) == 4:
            raise TimeLimit

    system, starts = load("lorenz").system, [[1.0, 2.0, 3.0]]
    exponents = lyapunov_exponents(system, starts, "1/100", 5000, progress=stop)
    assert (messages[-1], exponents.is_stopped, exponents.steps) == ("step 1536 of 5000", True, 1536)
    complete = lyapunov_exponents(system, starts, "1/100", 1536)
    assert exponents.exponents == pytest.approx(complete.exponents, abs=1e-9)
    assert np.isnan(exponents.first_half_exponents).all()
