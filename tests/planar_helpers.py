"""Planes of the normal form for several test files: starts of every kind, and orbits by single
steps, or by nothing but Python and gcds."""

import random
from collections.abc import Sequence
from functools import lru_cache
from math import gcd
from typing import Any

import numpy as np
import pytest
from flint import fmpq, fmpq_mat, fmpq_poly, fq_default_ctx
from helpers import quick

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.matrices import det
from kahanmaps.algebra.polynomials import linear_combinations, ring
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.cubics import default_variables
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.family.system_normal_form import SystemNormalForm, system_normal_form
from kahanmaps.maps.normal_form.planar_block import PlanarBlock
from kahanmaps.maps.normal_form.planar_integers import IntegerBlock
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

Cubic = tuple[int, int, int, int]
Integers = tuple[int, int, int]

# A cubic and a start (U : V : W) each, found by search; chi is that of tau.py, chi_n = 0 for P_i, P_j, P_k on a
# line, i + j + k = n.
STARTS: dict[str, tuple[Cubic, Integers]] = {
    "three real roots, irrational": ((1, 1, -3, -1), (3, 2, 5)),
    "one real root, irrational": ((1, 2, 0, 5), (-1, 4, 7)),
    "one rational root": ((0, 2, 1, 3), (1, -2, 3)),
    "three rational roots": ((0, 1, -3, 2), (5, 3, 7)),
    "large coefficients": ((10**6 + 3, -(10**6), 271828, 314159), (2, -3, 5)),
    "P_{-1}, P_0, P_1 on a line": ((0, 1, -3, 3), (0, 1, 2)),
    "chi_{-2} = 0": ((-3, -3, -2, 0), (1, 3, 5)),
    "chi_{-1} = 0": ((-3, -3, -3, -2), (1, 0, 4)),
    "chi_1 = 0": ((-3, -3, -3, -2), (-2, 0, 3)),
    "chi_2 = 0": ((-3, -3, 1, 0), (-1, 6, 2)),
    "chi_3 = 0, P_1 a flex": ((3, 0, 0, -2), (2, 1, 3)),
    "chi_4 = 0": ((-1, 1, -2, -2), (5, -1, 8)),
    "chi_5 = 0": ((2, -3, 3, -2), (-4, -3, 2)),
    "chi_6 = 0": ((2, 1, 3, 3), (-1, 3, 9)),
    "chi_7 = 0": ((-2, 12, -9, 1), (1, 5, 3)),
    "chi_9 = 0": ((1, 0, 0, -3), (5, 3, 3)),
    "delta = 1": ((-3, 2, 1, 0), (-9, -1, 8)),
    "delta = 1, irrational vertices": ((1, 3, 2, 0), (-5, 4, 5)),
    "delta = 1, a vertex": ((-3, -2, 3, 2), (-3, 2, 5)),
    "level 0": ((-3, -3, -2, -2), (-5, 5, 2)),
    "a double root": ((1, 0, -3, 2), (2, -3, 5)),
    "a double root, and the factor 1": ((0, 0, 1, -3), (2, 3, 4)),
    "a double root, level 0": ((0, 0, 1, -3), (3, 1, 2)),
    "a triple root": ((1, 3, 3, 1), (2, 5, 3)),
    "a triple root, level 0": ((1, 3, 3, 1), (2, -2, 3)),
    "h = 0": ((0, 0, 0, 0), (1, 2, 3)),
    "the origin": ((1, 2, 0, 5), (0, 0, 1)),
    "no value at the start": ((-3, -3, -3, -2), (-2, 1, 3)),
    "no value at the start, level 0": ((-3, -3, -2, -2), (-1, 1, 5)),
    "a pole at step 2": ((0, 2, 1, 0), (5, -7, 4)),
    "a pole at step 3": ((2, 3, -2, 0), (-1, 1, 9)),
    "a pole at step 4": ((-1, -3, -1, 2), (3, 1, 9)),
    "a pole at step 5": ((-2, 2, 1, 0), (-2, 3, 9)),
    "a pole at step 6": ((1, 11, 2, -8), (1, 0, 9)),
    "period 5 but for a pole": ((0, 2, -1, 2), (-1, -1, 3)),
    "period 6 but for a pole": ((0, -1, -3, -3), (-3, 1, 3)),
    "delta = 1, a pole at step 3": ((-3, -2, 3, 2), (-1, 3, 6)),
    "after a pole": ((0, 2, 1, 0), (-5, 7, 4)),
}

over_starts = pytest.mark.parametrize(("cubic", "start"), STARTS.values(), ids=STARTS.keys())


def integer_block(cubic: Sequence[int], start: Sequence[int]) -> IntegerBlock:
    """The plane with 2 eps = 1, so that (U : V : W) is the start."""
    U, V, W = start
    return IntegerBlock([fmpq(entry) for entry in cubic], fmpq(1, 2), fmpq(U, W), fmpq(V, W))


def image(cubic: Sequence[int], triple: Sequence[int]) -> Integers:
    """(U W + h_V : V W - h_U : W^2 + det(Hess h)/4), spelled out."""
    (a, b, c, d), (U, V, W) = cubic, triple
    h_U, h_V = 3 * a * U * U + 2 * b * U * V + c * V * V, b * U * U + 2 * c * U * V + 3 * d * V * V
    h_UU, h_UV, h_VV = 6 * a * U + 2 * b * V, 2 * b * U + 2 * c * V, 2 * c * U + 6 * d * V
    return U * W + h_V, V * W - h_U, W * W + (h_UU * h_VV - h_UV * h_UV) // 4


def preimage(cubic: Sequence[int], triple: Sequence[int]) -> Integers:
    """The inverse step: that with -eps."""
    U, V, W = image(cubic, (triple[0], triple[1], -triple[2]))
    return -U, -V, W


def reduced(triple: Sequence[Any]) -> Integers:
    """A primitive triple of Python integers with W >= 0."""
    U, V, W = (int(entry) for entry in triple)
    common = gcd(U, V, W) * (-1 if W < 0 else 1)
    return U // common, V // common, W // common


def by_gcds(block: IntegerBlock, steps: int) -> list[Integers]:
    """P_0, ..., P_steps, or up to the last before a pole, each image divided by its gcd."""
    h = block.block
    cubic = tuple(int(entry) for entry in (h.a, h.b, h.c, h.d))
    points = [reduced(block.start)]
    for _ in range(steps):
        triple = image(cubic, points[-1])
        if triple[2] == 0:
            break
        points.append(reduced(triple))
    return points


def before(cubic: Sequence[int], start: Sequence[int], steps: int) -> Integers:
    """The point from which `steps` steps lead to the start."""
    for _ in range(steps):
        start = reduced(preimage(cubic, start))
    return reduced(start)


class Finite:
    """A field of q elements, with random ones."""

    def __init__(self, prime: int, degree: int = 1) -> None:
        self.prime, self.degree, self.q = prime, degree, prime**degree
        self.context = None if degree == 1 else fq_default_ctx(prime, degree)

    def random(self, rng):
        if self.context is None:
            return GF(self.prime).convert(rng.randrange(self.prime))
        t, total = self.context.gen(), self.context(0)
        for _ in range(self.degree):
            total = total * t + rng.randrange(self.prime)
        return total

    def convert(self, number):
        element = GF(self.prime).convert(number)
        return element if self.context is None else self.context(int(element))

    def __repr__(self) -> str:
        return f"GF({self.prime}^{self.degree})"


def planes_over(field: Finite, rng: random.Random, count: int):
    """Random cubics and points, with more of the degenerate ones than chance gives."""
    for number in range(count):
        a, b, c, d = (field.random(rng) for _ in range(4))
        u, v = field.random(rng), field.random(rng)
        nought = 0 * a
        match number % 12:
            case 8:  # a double root
                a, b, c, d = a * a * c, a * (a * d + 2 * b * c), b * (2 * a * d + b * c), b * b * d
            case 9:  # a triple one
                a, b, c, d = a * a * a, 3 * a * a * b, 3 * a * b * b, b * b * b
            case 10:  # a point of the level 0
                d = nought if v == 0 else -(a * u * u * u + b * u * u * v + c * u * v * v) / (v * v * v)
            case 11 if rng.random() < 0.3:
                a = b = c = d = nought
            case 11 if rng.random() < 0.3:
                u = v = nought
        yield PlanarBlock(a, b, c, d), (u, v, nought + 1)


def planar_system(cubic: Sequence[Any]) -> QuadraticSystem:
    """u' = h_v, v' = -h_u."""
    a, b, c, d = (fmpq(entry) for entry in cubic)
    u, v = ring(["u", "v"]).gens()
    return CubicHamiltonian(a * u**3 + b * u**2 * v + c * u * v**2 + d * v**3, standard_structure(2)).system


def moved(hamiltonian: CubicHamiltonian, R: fmpq_mat) -> CubicHamiltonian:
    """The same system in the coordinates R x; J becomes R J R^T."""
    context = ring(hamiltonian.variables)
    H = hamiltonian.H.compose(*linear_combinations(R.inv(), context.gens()), ctx=context)
    return CubicHamiltonian(H, R * hamiltonian.J * R.transpose())


@lru_cache
def invertible(n: int, seed: int) -> fmpq_mat:
    """A random invertible integer matrix, far from symplectic."""
    rng = random.Random(seed)
    while True:
        R = fmpq_mat(n, n, [rng.randint(-2, 2) for _ in range(n * n)])
        if det(R) != 0:
            return R


def structure_and_system(name: str) -> tuple[Any, QuadraticSystem]:
    """The structure of a member of the table below and its system."""
    system, hamiltonian = MEMBERS[name]
    normal_form = system_normal_form(system, hamiltonian)
    assert isinstance(normal_form, SystemNormalForm)
    return normal_form, system


def _plain(cubics: Sequence[Sequence[int]]) -> tuple[QuadraticSystem, CubicHamiltonian]:
    """Several planes beside one another: every coordinate belongs to one plane."""
    m = len(cubics)
    x = ring(default_variables(2 * m)).gens()
    H = sum(
        (a * x[i] ** 3 + b * x[i] ** 2 * x[m + i] + c * x[i] * x[m + i] ** 2 + d * x[m + i] ** 3)
        for i, (a, b, c, d) in enumerate(cubics)
    )
    hamiltonian = CubicHamiltonian(H, standard_structure(2 * m))
    return hamiltonian.system, hamiltonian


def _drawn(member: Any, R: fmpq_mat | None = None) -> tuple[QuadraticSystem, CubicHamiltonian]:
    hamiltonian = CubicHamiltonian(member.H, standard_structure(member.dim))
    if R is not None:
        hamiltonian = moved(hamiltonian, R)
    return hamiltonian.system, hamiltonian


_t = fmpq_poly([0, 1])
SPLIT: dict[str, tuple[QuadraticSystem, CubicHamiltonian]] = {
    "m = 1": _drawn(random_member_with_eigenvalues([2], 3)),
    "m = 2": _drawn(random_member_with_eigenvalues([1, -2], 7)),
    "m = 3": _drawn(random_member_with_eigenvalues([1, -2, 3], 7)),
    "m = 3, fractions": _drawn(random_member_with_eigenvalues(["1/2", "-2/3", 4], 1)),
    "m = 2, another J": _drawn(random_member_with_eigenvalues([1, -2], 5), invertible(4, 3)),
    "m = 3, another J": _drawn(random_member_with_eigenvalues([1, -2, 3], 2), invertible(6, 4)),
    "m = 2, undisguised": _plain([(1, 2, 0, 5), (0, 2, 1, 3)]),
    "m = 3, undisguised": _plain([(1, 2, 0, 5), (0, 2, 1, 0), (0, 1, -3, 2)]),
    "m = 3, one plane at rest, one double root": _plain([(1, 1, -3, -1), (1, 0, -3, 2), (1, 0, 0, 0)]),
}
UNSPLIT: dict[str, tuple[QuadraticSystem, CubicHamiltonian]] = {
    "m = 2, sqrt 2": _drawn(random_member_with_chi(_t**2 - 2, 1)),
    "m = 2, i": _drawn(random_member_with_chi(_t**2 + 1, 1)),
    "m = 3, partly split": _drawn(random_member_with_chi((_t - 1) * (_t**2 + 1), 1)),
    "m = 3, a cubic field": _drawn(random_member_with_chi(_t**3 - _t - 1, 2)),
    "m = 2, sqrt 2, another J": _drawn(random_member_with_chi(_t**2 - 2, 4), invertible(4, 8)),
}
MEMBERS = {**SPLIT, **UNSPLIT}
DAILY = ["m = 1", "m = 2", "m = 2, another J", "m = 3, undisguised", "m = 3, one plane at rest, one double root"]
DAILY += ["m = 2, sqrt 2", "m = 2, i", "m = 3, partly split", "m = 2, sqrt 2, another J"]
over_members = pytest.mark.parametrize("name", quick(MEMBERS, DAILY))


@lru_cache
def side_by_side(*names: str) -> tuple[QuadraticSystem, SystemNormalForm, tuple[fmpq, ...]]:
    """A system made of the planes of these starts, its structure, and the start for eps = 1/2."""
    system, hamiltonian = _plain([STARTS[name][0] for name in names])
    member = FamilyMember(diagonal([*range(1, len(names) + 1)] * 2), hamiltonian.H)
    normal_form = system_normal_form(system, member=member)
    assert isinstance(normal_form, SystemNormalForm)
    triples = [STARTS[name][1] for name in names]
    start = [fmpq(U, W) for U, _, W in triples] + [fmpq(V, W) for _, V, W in triples]
    return system, normal_form, tuple(start)


def diagonal(entries: Sequence[Any]) -> fmpq_mat:
    """The diagonal matrix with these entries."""
    n = len(entries)
    return fmpq_mat(n, n, [fmpq(entries[i]) if i == j else fmpq(0) for i in range(n) for j in range(n)])


def mean_turn(angles, turn):
    """The rotation number of a sequence of angles modulo `turn`, as Laskar's weighted average of their differences."""
    differences = np.diff(angles)
    usual = np.median(differences % turn)
    differences = (differences - usual + turn / 2) % turn - turn / 2 + usual
    t = (np.arange(len(differences)) + 0.5) / len(differences)
    weights = np.exp(-1 / (t * (1 - t)))
    mean = float((differences * weights).sum() / weights.sum() / turn)
    return min(mean, 1 - mean)
