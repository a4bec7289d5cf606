"""Float orbits: a second implementation in machine numbers, tested against the exact one.

Specified here: numbers are rounded once, to the nearest double; short orbits are close to the exact ones; the method
has order 2; and each way to end has its status. Tolerances say where they come from.
"""

from itertools import pairwise
from math import log2, nextafter

import numpy as np
import pytest
from flint import fmpq
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.errors import InputError
from kahanmaps.maps.floats.fast import FloatOrbit, to_float
from kahanmaps.maps.orbits.iteration import OrbitEnd
from kahanmaps.systems.quadratic import QuadraticSystem

UNIT = 2.0**-53  # the relative error of one rounding to nearest

RICCATI = QuadraticSystem.from_text(["x"], ["x^2"])
OSCILLATOR = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])


def last(orbit: FloatOrbit) -> np.ndarray:
    """The last point."""
    *_, (_, x) = orbit
    return x


# From exact numbers to machine numbers.


@given(a=st.integers(-(10**30), 10**30), b=st.integers(1, 10**30))
def test_a_number_is_rounded_to_the_nearest_double(a, b):
    found = to_float(fmpq(a, b))
    error = abs(fmpq(a, b) - exact(found))
    for neighbour in (nextafter(found, -np.inf), nextafter(found, np.inf)):
        assert error <= abs(fmpq(a, b) - exact(neighbour))


def exact(number: float) -> fmpq:
    return fmpq(*number.as_integer_ratio())


# One step.


@pytest.mark.parametrize("eps", ["0", "1e-400"])
def test_an_eps_that_rounds_to_zero_is_refused(eps):
    with pytest.raises(InputError, match="eps is 0 in machine numbers"):
        FloatOrbit(RICCATI, eps, [1], 1)


# Orbits.


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


# Ends.


def test_an_orbit_ends_before_one_coordinate_leaves_the_range_of_doubles():
    # x~ = 3 x, from 1: 3^646 is the last power below 1.8e308; the other coordinate stays put
    orbit = FloatOrbit(QuadraticSystem.from_text(["x", "y"], ["x", "0"]), "1/2", [1, 5], 1000)
    delivered = [x for _, x in orbit]
    assert (orbit.end.status, orbit.end.steps, len(delivered)) == ("overflow", 646, 647)
    assert delivered[-1] == pytest.approx([float(3**646), 5.0], rel=646 * UNIT)  # one rounding a step


def test_an_interrupted_orbit_ends_after_the_point_in_hand():
    orbit = FloatOrbit(OSCILLATOR, "1/10", [1, 0], None)
    for step, _ in orbit:
        if step == 5:
            orbit.interrupt()
    assert orbit.end == OrbitEnd("interrupted", 5, "interrupted after step 5")
