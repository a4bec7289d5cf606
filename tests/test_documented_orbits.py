"""What the documentation says of orbits of x' = x (1 - y), y' = y (x - 1), with H = x + y - log(xy)."""

import math

import pytest
from flint import arb, ctx

import kahanmaps as km


def H(point) -> float:
    x, y = map(float, point)
    return x + y - math.log(x * y)


@pytest.mark.parametrize("y", [1.5, 2.5, 4])
def test_the_orbits_of_the_picture_stay_on_rings_and_those_of_euler_do_not(y):
    orbit = km.orbit("lotka_volterra", start=[1, y], eps="1/20", steps=400, arithmetic="float")
    kahan = [H(point.x) for point in orbit]
    x, z = 1.0, y
    for _ in range(400):
        x, z = x + x * (1 - z) / 10, z + z * (x - 1) / 10
    width, start = H((1, y)) - 2, H((1, y))  # 2 is the minimum of H
    assert max(abs(value - start) for value in kahan) < width / 10
    assert x < 0 or z < 0 or H((x, z)) - start > width / 2


def test_the_orbit_of_5_1_leaves_the_positive_quadrant_at_step_139(monkeypatch):
    # Balls of 2,000 bits, for the digits of exact points double at every step.
    monkeypatch.setattr(ctx, "prec", 2000)
    x, y, e = arb(5), arb(1), arb(1) / 5
    step = 0
    while x > 0 and y > 0 and step < 200:
        step += 1
        # (I - eps f') (x~ - x) = 2 eps f by Cramer's rule
        a, b, c, d = 1 - e * (1 - y), e * x, -e * y, 1 - e * (x - 1)
        f, g, det = 2 * e * x * (1 - y), 2 * e * y * (x - 1), a * d - b * c
        x, y = x + (f * d - b * g) / det, y + (a * g - c * f) / det
    assert step == 139
    assert x < 0 or y < 0
