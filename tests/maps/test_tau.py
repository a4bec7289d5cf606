"""Steps and n-th iterates in a plane over Q or over a number field from one table of two integer sequences.

The points are those of plain gcds, and no number on the way is longer than the result.
"""

import random
from itertools import islice

import pytest
from flint import fmpq, fmpq_poly
from helpers import random_point, refuses
from hypothesis import given, settings
from hypothesis import strategies as st
from planar_helpers import STARTS, before, by_gcds, image, integer_block, over_starts, preimage, reduced

from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.family.random_members import parse_chi, random_member_with_chi
from kahanmaps.family.system_normal_form import system_normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form import planar_integers, tau
from kahanmaps.maps.normal_form.planar_algebra import AlgebraBlock
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, same_point
from kahanmaps.maps.normal_form.planes_point import NormalSteps
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.iteration import Orbit

SMOOTH = [
    name
    for name, case in STARTS.items()
    if not (block := integer_block(*case)).is_constant
    and block.level is not None
    and not block.is_degenerate
    and len(by_gcds(block, 25)) == 26
]


@over_starts
def test_the_points_are_those_of_plain_gcds(cubic, start):
    block = integer_block(cubic, start)
    assert [reduced(triple) for triple in islice(tau.triples(block), 26)] == by_gcds(block, 25)


@pytest.mark.parametrize("name", SMOOTH)
def test_every_point_up_to_60_is_that_of_steps(name):
    block = integer_block(*STARTS[name])
    expected = [reduced(triple) for triple in islice(block.triples(), 61)]
    first = tau.table_near(block).base + 2  # as long as psi_{n-1} would be zero one steps
    assert [reduced(tau.iterate(block, n)) for n in range(first, 61)] == expected[first:]


@pytest.mark.parametrize("steps", [7, 8, 9, 16, 30])
def test_a_pole_is_passed_over(steps):
    # The two neighbours of a pole are the same on every level; from P_{pole + 2} on one can step again.
    cubic, start = STARTS["a pole at step 2"]
    block = integer_block(cubic, before(cubic, start, steps))
    pole = steps + 2
    results = {n: reduced(tau.iterate(block, n)) for n in range(pole - 1, 2 * pole)}
    U, V, W = by_gcds(block, 2 * pole)[-1]
    assert results[pole - 1] == (U, V, W)
    assert same_point(results[pole], (U, V, 0))
    assert results[pole + 1] == reduced((U, V, -W))
    assert reduced(preimage(cubic, results[pole + 2])) == results[pole + 1]
    for n in range(pole + 2, 2 * pole - 1):
        above, below = block.block.level(results[n])
        assert fmpq(above, below) == block.level
        assert reduced(image(cubic, results[n])) == results[n + 1]


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("n", [127, 180])
def test_no_number_is_longer_than_the_result(name, n, monkeypatch):
    lengths = []
    divide = planar_integers.divide_exactly

    def watched(values, divisor):
        lengths.extend(value.bit_length() for value in values)
        return divide(values, divisor)

    monkeypatch.setattr(planar_integers, "divide_exactly", watched)
    result = tau.iterate(integer_block(*STARTS[name]), n)
    # A tenth, for bad primes and the three points around the base.
    assert max(lengths) < 1.1 * max(entry.bit_length() for entry in result)
    assert len(lengths) < 20 * n.bit_length()


@pytest.mark.parametrize("change", [1, -1])
def test_with_another_gamma_divisions_leave_a_remainder(change):
    block = integer_block(*STARTS["one real root, irrational"])
    block.delta += change
    refuses("left a remainder", tau.iterate, block, 100, error=ArithmeticError)


FIELDS = {
    "sqrt 2": [-2, 0, 1],
    "i": [1, 0, 1],
    "class number 8": [41, 0, 1],
    "a long unit": [-46, 0, 1],
    "one real root": [-1, -1, 0, 1],
    "three real roots": [3, -7, 0, 1],
    "degree 4": [-1, -1, 0, 0, 1],
}
CHI = ["t^2 - 10", "t^2 + 41", "t^2 - 1/3*t + 1/7", "t^3 - t - 1", "t^3 - 7*t + 3", "(t - 1)*(t^2 - 3)", "t^4 - t - 1"]
CHI += ["(t^2 - 2)*(t^2 + t + 1)"]

few = settings(max_examples=settings().max_examples // 2)  # of many steps each


def random_block(name: str, seed: int) -> AlgebraBlock:
    algebra, rng = EtaleAlgebra(fmpq_poly(FIELDS[name])), random.Random(seed)
    *cubic, U, V = (algebra.convert(fmpq_poly([rng.randint(-4, 4) for _ in range(algebra.degree)])) for _ in range(6))
    W = algebra.convert(rng.choice([1, 2, 3, 35]))
    return AlgebraBlock(PlanarBlock(*cubic), (U / W, V / W, algebra.one), fmpq(1, 5))


def member_of(text: str, seed: int = 5):
    member = random_member_with_chi(parse_chi(text), seed=seed)
    return system_normal_form(member.chosen.system, member=member), member.chosen.system


@pytest.mark.parametrize("name", FIELDS)
@few
@given(seed=st.integers(0, 10**6))
def test_the_points_are_those_of_steps_in_the_field(name, seed):
    block = random_block(name, seed)
    stepped, result = (list(islice(points, 11)) for points in (block.triples(), tau.triples(block)))
    assert len(result) == len(stepped)
    assert all(same_point(P, Q) for P, Q in zip(result, stepped, strict=True))


@pytest.mark.parametrize("chi", CHI)
@few
@given(seed=st.integers(0, 10**6), eps=st.sampled_from(["1/10", "-7/3", "20957/262577", "1000000000"]))
def test_a_member_moves_as_by_generic_steps(chi, seed, eps):
    normal_form, system = member_of(chi)
    start = random_point(system.dim, seed, height=3)
    generic = [point.value for point in Orbit(KahanMap(system, eps), start, 8, max_digits=None)]
    results = list(islice(NormalSteps(normal_form, fmpq(eps)).points(start), 9))
    assert [IntegerPoint.from_rationals(point.rationals()) for point in results] == generic
    assert [point.lowest_terms() for point in results] == [point.lowest_terms() for point in generic]
    assert all(point.height <= point.bits + point._assembly.extra_bits for point in results)


def test_what_two_conjugate_planes_share_is_taken_out(monkeypatch):
    # That the tests can fail: primes above which two prime ideals divide W are in no list of fixed primes.
    normal_form, system = member_of("t^2 - 10")
    points = list(islice(NormalSteps(normal_form, fmpq(1, 10)).points(random_point(system.dim, 4)), 60))
    expected = [point.lowest_terms() for point in points]
    fraction = AlgebraBlock.fraction
    monkeypatch.setattr(AlgebraBlock, "fraction", lambda self, P: (*fraction(self, P)[:2], fraction(self, P)[1] ** 0))
    points = list(islice(NormalSteps(normal_form, fmpq(1, 10)).points(random_point(system.dim, 4)), 60))
    assert [point.lowest_terms() for point in points] != expected
