"""The measured commutator: against exact arithmetic, its order in eps, and orbits that end."""

import pytest
from flint import fmpq

from kahanmaps.documents.catalog import load
from kahanmaps.documents.inline import System, as_file
from kahanmaps.maps.floats.commutator import commutator

EPS = fmpq(1, 10)


def test_sizes_are_those_of_exact_arithmetic():
    f, g, x = load("euler_top").map, load("lorenz").map, [fmpq(1), fmpq(1, 2), fmpq(1, 3)]
    result = commutator(f, g, EPS, x, 4)
    phi, psi = f.at(EPS), g.at(EPS)
    for n, size in result.by_step:
        point, image = x, psi.step(x)
        for _ in range(n):
            point, image = phi.step(point), phi.step(image)
        exact = max(abs(a - b) for a, b in zip(psi.step(point), image, strict=True))
        exact /= max(fmpq(1), *map(abs, point), *map(abs, image))
        assert size == pytest.approx(int(exact.p) / int(exact.q), rel=1e-10)
    assert [n for n, _ in result.by_step] == [1, 2, 4]
    assert result.largest >= max(size for _, size in result.by_step)


def test_the_order_in_eps_tells_commuting_flows_from_others_and_commuting_maps_have_none():
    # The flows of H_0 and H_1 commute, and their Kahan maps do not.
    first, second = (as_file(hamiltonian).map for hamiltonian in load("paper_m2").member.hamiltonians)
    start = ["1/20", "-1/30", "1/25", "1/40"]
    of_flows = commutator(first, second, "1/2", start, 5)
    assert of_flows.slope == pytest.approx(4, abs=0.1)
    of_others = commutator(load("harmonic").map, System("x' = y; y' = -2*x").map, EPS, [1, 0], 5)
    assert of_others.slope == pytest.approx(2, abs=0.1)
    same = commutator(first, first, "1/2", start, 5)
    assert (same.slope, same.largest < 1e-14) == (None, True)


def test_a_pole_ends_the_orbit_with_a_message():
    square = System("x' = x^2").map
    result = commutator(square, System("x' = x").map, "1/2", ["1/2"], 10)
    assert [n for n, _ in result.by_step] == [1]
    assert "singular" in result.message
    assert "not defined at the initial point" in commutator(square, square, "1/2", [1], 3).message
