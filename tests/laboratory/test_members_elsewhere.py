"""Members of the commuting family in other coordinates: affine changes hide them from `find_family_structure_of`.

Specified here: `analyze` finds A, T and the centre, says what the theorems give, and what it says holds at exact points
in the coordinates of the system; a Hamiltonian that is no member is not taken for one.
"""

from dataclasses import replace
from functools import cache

import pytest
from flint import fmpq, fmpq_poly
from planar_helpers import invertible, moved

from kahanmaps import QuadraticSystem, SystemFile, analyze, constant_structures, degree_growth, load, parse_polynomial
from kahanmaps.family.cubics import belongs, default_variables
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.family.recognition import find_family_structure_of
from kahanmaps.laboratory.analyses.table import ANALYSES
from kahanmaps.laboratory.conclusion import contradictions
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

t = fmpq_poly([0, 1])
MEMBERS = {
    "m = 2, split": random_member_with_eigenvalues(["1/2", -7], 3),
    "m = 3, partly split": random_member_with_chi((t - 1) * (t**2 + 1), 1),
}
over_members = pytest.mark.parametrize("name", MEMBERS)
STRUCTURE = [
    step for step in ANALYSES if step.name in ("Hamiltonian structure", "the commuting family", "a larger algebra")
]


def elsewhere(H, seed: int) -> QuadraticSystem:
    """The system of H and the standard J after a random affine change of variables, of which nothing is kept."""
    n = H.context().nvars()
    R = invertible(n, seed) * fmpq(2, 3)
    return moved(CubicHamiltonian(H, standard_structure(n)), R).about([fmpq(k + 1, 2) for k in range(n)]).system


def analysed(system: QuadraticSystem, analyses=STRUCTURE):
    return analyze(SystemFile.from_system(system), effort=-6, analyses=analyses)


@cache
def moved_member(name: str):
    """A member in other coordinates, and what is found of it."""
    system = elsewhere(MEMBERS[name].H, 5)
    return system, analysed(system, ANALYSES)


def proved(result) -> list[str]:
    return [line.text for _, lines in result.sections for line in lines if line.status == "proved"]


@over_members
def test_a_member_in_other_coordinates_is_recognised_with_what_follows(name):
    member = MEMBERS[name]
    system, result = moved_member(name)
    assert find_family_structure_of(system) is None  # not as long as these coordinates are kept
    m = member.m
    lines = proved(result)
    (line,) = (line for line in lines if line.startswith("belongs to the commuting family: a recognised member"))
    assert line.endswith(" + T y")
    assert f"{m} independent integrals, as a member of the commuting family" in lines
    ending = f"{m} integrals in involution, as a member of the commuting family"
    assert f"J - eps^2 f'(x)^2 J is an invariant Poisson tensor, with {ending}" in lines
    split = all(factor.degree == 1 for factor in member.factors)
    associated = f"the Kahan maps of its {2 ** (m - 1)} associated systems, f itself among them, commute"
    assert associated + ("" if split else " over the splitting field of chi") in lines
    assert result.integral_count >= m
    assert result.conclusion.kind == "integrable"
    assert "It is Liouville integrable, as a member of the commuting family (proved)." in result.conclusion.sentence


@over_members
def test_the_matrices_that_are_given_are_those_of_the_system(name):
    system, result = moved_member(name)
    record = result.to_json()
    hamiltonian = constant_structures(system).hamiltonian
    A, T, J = result.normal_form.A, result.normal_form.T, hamiltonian.J
    assert J == T * standard_structure(system.dim) * T.transpose()
    assert A.transpose() * J == J * A
    about = hamiltonian.about(result.centre)
    assert belongs(A, about.H)
    assert not belongs(A + A.transpose(), about.H)
    assert record["member"]["A"] == [[str(entry) for entry in row] for row in A.tolist()]
    assert record["member"]["centre"] == [str(c) for c in result.centre]
    assert (record["member"]["integrals_in_involution"], record["member"]["associated_maps"]) == (
        system.dim // 2,
        2 ** (system.dim // 2 - 1),
    )


def test_a_cubic_that_is_no_member_is_not_taken_for_one():
    text = "x1^3 + 2*x2^3 + 3*x3^3 + 4*x4^3 + x1*x2*x3 + x1^2*x4"
    analysis = analysed(elsewhere(parse_polynomial(text, default_variables(4)), 1))
    assert analysis.normal_form.reason.startswith("only the multiples of I satisfy")
    assert analysis.to_json()["member"] is analysis.to_json()["family"] is None
    assert not any("commuting family" in line for line in proved(analysis))
    assert "Liouville" not in analysis.conclusion.sentence


def test_a_member_with_a_repeated_root_is_said_to_be_one_and_no_more():
    analysis = analysed(elsewhere(parse_polynomial("x1^2*x2", default_variables(4)), 3))
    lines = [line for line in proved(analysis) if "commuting family" in line]
    assert [line.split(", in coordinates")[0] for line in lines] == [
        "belongs to the commuting family: a recognised member of the family, chi = (t - 1)^2"
    ]
    assert analysis.to_json()["member"] is None


def test_degrees_that_seem_exponential_do_not_go_with_a_member():
    _, known = moved_member("m = 2, split")
    result = replace(known, degrees=degree_growth(load("lotka_volterra").system, max_terms=12))
    assert contradictions(result) == [
        "the degrees seem to grow exponentially, which they cannot for a member of the commuting family"
    ]
    assert result.conclusion.kind == "undecided"
    assert contradictions(replace(result, normal_form=None)) == []
