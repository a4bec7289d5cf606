"""The normal form in floating point: its blocks, found in balls and rounded once, and their integrals.

Float orbits are rounded once, near the exact ones, and of order 2; a file of one is complete and readable at every
moment, also after the program was killed. Tolerances say where they come from.
"""

import os
import signal
import subprocess
import sys
import time
from itertools import pairwise
from math import log2, nextafter

import numpy as np
import pytest
from flint import acb, arb, fmpq, fmpq_poly
from helpers import EULER_TOP
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.family.planar import normal_form
from kahanmaps.family.random_members import random_member, random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.maps.floats.float_orbit import FloatEnsemble, FloatOrbit, float_function, to_float
from kahanmaps.maps.floats.planar_blocks import _sine, _Unclear, planar_blocks
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
        one, small = acb(1), acb(arb(0, radius))
        right, parallel = ([one, small], [small, one]), ([one, small], [one, small])
        assert _sine(right, [[one, small], [small, one]]) == pytest.approx(1, abs=1e-15)
        assert _sine(parallel, [[one, small], [small, one]]) == 0
    with pytest.raises(_Unclear):
        _sine(([one, one], [acb(arb(0, 1)), acb(arb(0, 1))]), [[one, one], [one, one]])


def starts_of(dim: int, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (n, dim))


def ensemble(name: str, starts: np.ndarray, **options: object) -> FloatEnsemble:
    return FloatEnsemble(MEMBERS[name].chosen.system, EPS, starts, form=FORMS[name], **options)


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


OSCILLATOR = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])


def last(orbit: FloatOrbit) -> np.ndarray:
    """The last point."""
    *_, (_, x) = orbit
    return x


@given(a=st.integers(-(10**30), 10**30), b=st.integers(1, 10**30))
def test_a_number_is_rounded_to_the_nearest_double(a, b):
    found = to_float(fmpq(a, b))
    error = abs(fmpq(a, b) - exact(found))
    for neighbour in (nextafter(found, -np.inf), nextafter(found, np.inf)):
        assert error <= abs(fmpq(a, b) - exact(neighbour))


def exact(number: float) -> fmpq:
    return fmpq(*number.as_integer_ratio())


def test_the_method_has_order_two():
    # The oscillator from (1, 0) after time 1, against (cos 1, -sin 1). The errors, above 1e-7, are far from rounding.
    errors = []
    for k in range(4, 11):
        x = last(FloatOrbit(OSCILLATOR, fmpq(1, 2 ** (k + 1)), [1, 0], 2**k))  # the time step is 2 eps
        errors.append(np.hypot(x[0] - np.cos(1), x[1] + np.sin(1)))
    assert min(errors) > 1e-8
    slopes = [log2(a / b) for a, b in pairwise(errors)]
    assert len(slopes) >= 3
    assert max(abs(slope - 2) for slope in slopes) < 0.01  # the next term of the error is of order 4: h^2 <= 2^-8


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
        told = [int(process.stdout.readline()) for _ in range(2)]
        time.sleep(0.01)
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()
    points = np.load(path)
    assert len(points) >= told[-1] // 50 + 1  # what was told is there, and perhaps a portion more
    steps = 50 * (len(points) - 1)
    expected = np.concatenate(list(FloatEnsemble(EULER_TOP, "1/10", [START], kernel="numpy").records(steps, 50)))
    assert np.array_equal(points, expected[:, 0])
