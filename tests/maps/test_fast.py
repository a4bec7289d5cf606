"""Float orbits: a second implementation in floating point, tested against the exact one.

Specified here: numbers are rounded once, to the nearest double; short orbits are close to the exact ones; the method
has order 2. On disk a .npy file is complete and readable at every moment, also after the program was killed: an
interrupted or killed run leaves what it had computed. Tolerances say where they come from.
"""

import os
import signal
import subprocess
import sys
import time
from itertools import pairwise
from math import log2, nextafter

import numpy as np
from flint import fmpq
from helpers import EULER_TOP
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.maps.floats.float_orbit import FloatEnsemble, FloatOrbit, to_float
from kahanmaps.systems.quadratic import QuadraticSystem

OSCILLATOR = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])


def last(orbit: FloatOrbit) -> np.ndarray:
    """The last point."""
    *_, (_, x) = orbit
    return x


@given(a=st.integers(-(10**30), 10**30), b=st.integers(1, 10**30))
def test_a_number_is_rounded_to_the_nearest_double(a, b):
    result = to_float(fmpq(a, b))
    error = abs(fmpq(a, b) - exact(result))
    for neighbour in (nextafter(result, -np.inf), nextafter(result, np.inf)):
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
