"""Lyapunov exponents: linear maps in closed form, exact derivatives along exact orbits, and the Lorenz map."""

import math
from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq_mat

from kahanmaps.documents.catalog import load
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.maps.floats.lyapunov import lyapunov_exponents
from kahanmaps.maps.floats.starts import starts_in_box
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem


@pytest.mark.parametrize("eps", ["1/10", "-1/10", "1/3"])
def test_linear_systems_have_the_logarithms_of_their_eigenvalues(eps):
    """Triangular, so that the frame turns into the flag of eigenvectors at a geometric rate."""
    system = QuadraticSystem.from_text(["x", "y", "z"], ["x/2 + y", "-y", "-2*z + x"])
    exponents = lyapunov_exponents(system, [[1.0, 0.5, 0.2]], eps, 400, transient=200)
    value = float(Fraction(eps))
    images = [(1 + value * a) / (1 - value * a) for a in (0.5, -1.0, -2.0)]  # of eigenvectors
    expected = sorted((math.log(abs(image)) / (2 * value) for image in images), reverse=True)
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
    assert (result.steps, result.transient) == (steps, transient)
    assert (result.orbits, result.ended_count, result.is_stopped) == (2, 0, False)
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
