"""Planes over a number field, in integers: the tau functions of an orbit as short elements of Z[t], and back to Q.

Specified here: the points are those of steps in the field; what comes back to Q is in lowest terms; numbers are no
longer than the heights ask for.
"""

import random
from itertools import islice

import pytest
from flint import fmpq, fmpq_poly
from helpers import random_point
from hypothesis import given, settings
from hypothesis import strategies as st

from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.family.random_members import parse_chi, random_member_with_chi
from kahanmaps.family.system_normal_form import system_normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form import tau
from kahanmaps.maps.normal_form.planar_algebra import AlgebraBlock
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, same_point
from kahanmaps.maps.normal_form.planes_point import NormalSteps
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.iteration import Orbit

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

over_fields = pytest.mark.parametrize("name", FIELDS)
few = settings(max_examples=settings().max_examples // 2)  # of many steps each


def block_over(algebra: EtaleAlgebra, cubic, start) -> AlgebraBlock:
    U, V, W = map(algebra.convert, start)
    return AlgebraBlock(PlanarBlock(*map(algebra.convert, cubic)), (U / W, V / W, algebra.one), fmpq(1, 5))


def algebra_of(name: str) -> EtaleAlgebra:
    return EtaleAlgebra(fmpq_poly(FIELDS[name]))


def random_block(name: str, seed: int) -> AlgebraBlock:
    algebra, rng = algebra_of(name), random.Random(seed)
    numbers = [fmpq_poly([rng.randint(-4, 4) for _ in range(algebra.degree)]) for _ in range(6)]
    return block_over(algebra, numbers[:4], (*numbers[4:], rng.choice([1, 2, 3, 35])))


def member_of(text: str, seed: int = 5):
    member = random_member_with_chi(parse_chi(text), seed=seed)
    return system_normal_form(member.chosen.system, member=member), member.chosen.system


@over_fields
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
    assert all(point.height <= point.bits + point._assembly.excess for point in results)


def test_what_two_conjugate_planes_share_is_taken_out(monkeypatch):
    # That the tests can fail: primes above which two prime ideals divide W are in no list of fixed primes.
    normal_form, system = member_of("t^2 - 10")
    points = list(islice(NormalSteps(normal_form, fmpq(1, 10)).points(random_point(system.dim, 4)), 60))
    expected = [point.lowest_terms() for point in points]
    fraction = AlgebraBlock.fraction
    monkeypatch.setattr(AlgebraBlock, "fraction", lambda self, P: (*fraction(self, P)[:2], fraction(self, P)[1] ** 0))
    points = list(islice(NormalSteps(normal_form, fmpq(1, 10)).points(random_point(system.dim, 4)), 60))
    assert [point.lowest_terms() for point in points] != expected
