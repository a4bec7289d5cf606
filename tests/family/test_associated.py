"""Associated systems f_s = B_s^T f_0.

Specified here: B_s is the polynomial in A with the sign s_i on the i-th factor of chi; how many rational ones there
are; over number fields, that their maps commute, and that of others do not. Source: petrera-suris-2017, Sect. 5.
"""

from dataclasses import replace
from math import prod

import pytest
from family.members import over_members, t
from flint import fmpq_mat, fmpq_poly

import kahanmaps as km
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.random_members import parse_chi, random_member_with_chi
from kahanmaps.family.skew_hamiltonian import Factor, evaluate_at_matrix

# The matrices B_s.


@over_members
def test_a_sign_matrix_is_the_sign_on_the_part_that_belongs_to_the_factor(member):
    for g in member.associated():
        for factor, sign in zip(member.factors, g.signs, strict=True):
            vanishing = evaluate_at_matrix(factor.polynomial**factor.multiplicity, member.A)
            cofactor = evaluate_at_matrix(chi_without(member, factor), member.A)  # its image is the part
            assert vanishing * cofactor == fmpq_mat(member.dim, member.dim)
            assert g.B * cofactor == sign * cofactor


def chi_without(member: FamilyMember, factor: Factor) -> fmpq_poly:
    others = (f.polynomial**f.multiplicity for f in member.factors if f.polynomial != factor.polynomial)
    return prod(others, start=fmpq_poly([1]))


COUNTS = [  # chi, number of irreducible factors r, of rational associated systems 2^(r-1)
    ((t - 1) * (t - 2) * (t - 3), 4),
    (t * (t - 1) * (t - 2) * (t - 3), 8),
    (t**2 - 2, 1),
    ((t - 1) * (t**2 - 2), 2),
    ((t - 1) * (t + 1) * (t**2 + 1), 4),
    ((t - 1) ** 3, 1),
]


@pytest.mark.parametrize(("chi", "count"), COUNTS, ids=str)
def test_there_is_one_rational_associated_system_for_every_choice_of_signs_up_to_all(chi, count):
    systems = [g.system for g in random_member_with_chi(chi, 1).associated()]
    assert len(set(systems)) == len(systems) == count


@pytest.mark.parametrize(
    ("chi", "count"),
    [("t^2 - 2", 1), ("t^2 + t + 1", 1), ("t^3 - t - 1", 1), ("(t - 1)*(t^2 - 2)", 2), ("(t - 1)^2", 0)],
)
def test_associated_systems_over_a_number_field_commute_with_the_member_and_others_do_not(chi, count):
    member = random_member_with_chi(parse_chi(chi), seed=3)
    results = list(member.conjugate_associates())
    assert len(results) == count
    for result in results:
        K = result.root.number_field
        powers = [K.convert_matrix(member.A**k) for k in range(member.m)]
        unit = K.identity(member.dim)
        B = sum((P * c for P, c in zip(powers, result.coefficients, strict=True)), unit * 0)
        assert B * B == unit != B
        file = km.SystemFile.from_conjugate(result)
        assert km.parse_system(file.to_toml()) == file
        assert km.check_commute(km.SystemFile.from_member(member), file).holds
    if results:
        # The square of B + 1 is not 1.
        wrong = replace(results[0], coefficients=(results[0].coefficients[0] + 1, *results[0].coefficients[1:]))
        wrong_file = km.SystemFile.from_conjugate(wrong)
        assert km.check_commute(km.SystemFile.from_member(member), wrong_file).verdict is km.Certainty.REFUTED
