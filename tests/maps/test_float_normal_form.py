"""The normal form in floating point: its blocks, found in balls and rounded once, and their integrals."""

import numpy as np
import pytest
from flint import acb, arb, fmpq_poly

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.family.planar import normal_form
from kahanmaps.family.random_members import random_member, random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.maps.floats.float_orbit import FloatEnsemble, FloatOrbit, float_function
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
        entry, small = acb(1), acb(arb(0, radius))
        right, parallel = ([entry, small], [small, entry]), ([entry, small], [entry, small])
        assert _sine(right, [[entry, small], [small, entry]]) == pytest.approx(1, abs=1e-15)
        assert _sine(parallel, [[entry, small], [small, entry]]) == 0
    with pytest.raises(_Unclear):
        _sine(([entry, entry], [acb(arb(0, 1)), acb(arb(0, 1))]), [[entry, entry], [entry, entry]])


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
