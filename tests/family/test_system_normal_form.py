"""The normal form of a system, declared or found.

Specified here: a declared structure is used unchanged, otherwise it is searched for; the structure steps like the
system, also for another J; and if there is none, the reason is given.
"""

import pytest
from flint import fmpq_poly
from helpers import EULER_TOP, HENON_HEILES, LORENZ, LOTKA_VOLTERRA, random_point
from planar_helpers import invertible, moved, over_members, structure_and_system

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.family.cubics import default_variables
from kahanmaps.family.random_members import random_member_with_eigenvalues
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm, system_normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

t = fmpq_poly([0, 1])


def hamiltonian(text: str, n: int) -> CubicHamiltonian:
    return CubicHamiltonian(parse_polynomial(text, default_variables(n)), standard_structure(n))


def steps_like(normal_form: SystemNormalForm, system: QuadraticSystem) -> bool:
    """Whether one step in the planes is a step of the system."""
    splitting, x = Splitting(normal_form.form, QQ, "1/10", normal_form.T), random_point(system.dim, 8)
    images = [plane.block.image(P) for plane, P in zip(splitting.planes, splitting.triples(x), strict=True)]
    return splitting.point(images) == KahanMap(system, "1/10").step(x)


# Found.


def test_a_declared_member_keeps_its_a():
    member = random_member_with_eigenvalues(["1/2", -7], 3)
    normal_form = system_normal_form(member.chosen.system, member=member)
    assert (normal_form.declared, normal_form.T) == (True, None)
    assert normal_form.form.A == member.A
    assert normal_form.text == "a member of the family, chi = (t + 7)*(t - 1/2)"


@over_members
def test_the_structure_steps_like_the_system(name):
    normal_form, system = structure_and_system(name)
    assert steps_like(normal_form, system)
    assert not normal_form.declared


@pytest.mark.parametrize("n", [2, 4, 6])
def test_with_another_J_there_is_a_change_of_coordinates(n):
    member = random_member_with_eigenvalues([1, -2, 3][: n // 2], 2)
    other = moved(CubicHamiltonian(member.H, standard_structure(n)), invertible(n, 5))
    normal_form = system_normal_form(other.system, other)
    assert normal_form.T * standard_structure(n) * normal_form.T.transpose() == other.J
    assert steps_like(normal_form, other.system)
    # x = S z alone, without T, are other coordinates
    assert not steps_like(SystemNormalForm(normal_form.form, None, False, ""), other.system)


# None, with the reason.

REASONS = [
    (HENON_HEILES, "H is not a homogeneous cubic"),
    (LORENZ, "x' is not J grad H"),
    (EULER_TOP, "x' is not J grad H"),
    (LOTKA_VOLTERRA, "x' is not J grad H"),
    (hamiltonian("x1^3 + x2^3 + x3^3 + x4^3 + x1*x2*x3", 4).system, "only the multiples of I satisfy"),
    (QuadraticSystem.from_text(["x", "y"], ["x", "-y"]), "H is not a homogeneous cubic"),
]


@pytest.mark.parametrize(("system", "reason"), REASONS)
def test_without_a_structure_the_reason_is_said(system, reason):
    normal_form = system_normal_form(system)
    assert isinstance(normal_form, NoNormalForm)
    assert normal_form.reason.startswith(reason)
