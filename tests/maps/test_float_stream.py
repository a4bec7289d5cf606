"""Float orbits on disk: a .npy file that is complete and readable at every moment, also after the program was killed.

Specified here: the points in the file are those of the orbit; the file grows by portions; an interrupted or killed run
leaves what it had computed; an orbit that ends early leaves the points before that.
"""

import os
import signal
import subprocess
import sys
import time

import numpy as np
from helpers import EULER_TOP

from kahanmaps.maps.floats.fast import FloatEnsemble, FloatOrbit, stream_orbit

START = ["1", "1/2", "1/3"]


def test_an_interrupted_orbit_leaves_a_whole_file(tmp_path):
    orbit = FloatOrbit(EULER_TOP, "1/10", START, None, every=100, kernel="numpy")
    seen = []

    def progress(step: int) -> None:
        seen.append(step)
        if len(seen) == 2:
            orbit.interrupt()

    end = stream_orbit(orbit, tmp_path / "x.npy", progress=progress)
    assert (end.status, end.steps) == ("interrupted", seen[-1])
    assert len(np.load(tmp_path / "x.npy")) == seen[-1] // 100 + 1


ENDLESS = """
from kahanmaps.maps.floats.fast import FloatOrbit, stream_orbit
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
