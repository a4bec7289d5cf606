"""Associated systems f_s = B_s^T f_0, and the theorem for which the family exists: their Kahan maps commute.

Specified here: B_s is the polynomial in A with the sign s_i on the i-th factor of chi, hence an involution; how many
rational ones there are; that the maps commute, for chi split or not, with repeated roots or without, and modulo primes
at which an irreducible chi splits; and the neighbours that do not commute. Source: petrera-suris-2017, Sect. 5.
"""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from flint import fmpq_mat, fmpq_poly
from helpers import random_point

import kahanmaps as km
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import gradient, linear_combinations
from kahanmaps.algebra.written.text import format_polynomial, parse_polynomial
from kahanmaps.errors import HypothesisError, InputError
from kahanmaps.family.associated import FamilyMember, sign_polynomial
from kahanmaps.family.cubics import cubic_space
from kahanmaps.family.draw import draw_generic, draw_with_chi, draw_with_eigenvalues, parse_chi
from kahanmaps.family.skew_hamiltonian import Factor, defects, evaluate_at_matrix
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

t = fmpq_poly([0, 1])

MEMBERS = {
    "m = 2, split": draw_with_eigenvalues([1, -2], 1),
    "m = 3, split": draw_with_eigenvalues([1, "-1/2", 3], 1),
    "m = 4, split": draw_with_eigenvalues([-1, 0, 1, 2], 1),
    "m = 2, irreducible": draw_with_chi(t**2 - 2, 1),
    "m = 3, partly split": draw_with_chi((t - 1) * (t**2 - 2), 1),
    "m = 4, two quadratic factors": draw_with_chi((t**2 + 1) * (t**2 - 2), 1),
    "m = 3, a root twice, diagonalisable": draw_with_eigenvalues([1, 1, 2], 1),
    "m = 3, a root twice, not diagonalisable": draw_with_chi((t - 1) ** 2 * (t + 1), 1),
}
over_members = pytest.mark.parametrize("member", MEMBERS.values(), ids=MEMBERS.keys())


def split(m: int) -> FamilyMember:
    return draw_with_eigenvalues(range(1, m + 1), seed=m)


# The matrices B_s.


@over_members
def test_the_square_of_each_sign_matrix_is_one(member):
    assert all(g.B * g.B == QQ.identity(member.dim) for g in member.associated())


@over_members
def test_each_sign_matrix_commutes_with_a_and_is_skew_hamiltonian(member):
    assert all(g.B * member.A == member.A * g.B and defects(g.B) == [] for g in member.associated())


@over_members
def test_a_sign_matrix_is_the_sign_on_the_part_that_belongs_to_the_factor(member):
    for g in member.associated():
        for factor, sign in zip(member.factors, g.signs, strict=True):
            vanishing = evaluate_at_matrix(factor.polynomial**factor.multiplicity, member.A)
            cofactor = evaluate_at_matrix(chi_without(member, factor), member.A)  # its image is the part
            assert vanishing * cofactor == fmpq_mat(member.dim, member.dim)
            assert g.B * cofactor == sign * cofactor


def chi_without(member: FamilyMember, factor: Factor) -> fmpq_poly:
    rest = fmpq_poly([1])
    for other in member.factors:
        if other.polynomial != factor.polynomial:
            rest *= other.polynomial**other.multiplicity
    return rest


@over_members
def test_the_coefficients_give_the_sign_matrix_and_k(member):
    for g in member.associated():
        assert evaluate_at_matrix(fmpq_poly(list(g.coefficients)), member.A) == g.B
        assert sum((c * H for c, H in zip(g.coefficients, member.chain, strict=True)), 0 * member.H) == g.K


def test_the_polynomial_with_signs_plus_minus_at_one_and_two_is_the_line_through_the_points():
    assert sign_polynomial([Factor(t - 1, 1), Factor(t - 2, 1)], (1, -1)) == 3 - 2 * t


def test_at_a_double_root_the_sign_polynomial_has_a_zero_derivative():
    # t^2 (3 - 2t) is 0 at 0 and 1 at 1, flat at both; so 1 - 2 t^2 (3 - 2t) is 1 at 0 and -1 at 1
    factors = [Factor(t, 2), Factor(t - 1, 2)]
    assert sign_polynomial(factors, (1, -1)) == 1 - 6 * t**2 + 4 * t**3


# How many there are, and which.

COUNTS = [  # chi, number of irreducible factors r, of rational associated systems 2^(r-1)
    ((t - 1) * (t - 2), 2),
    ((t - 1) * (t - 2) * (t - 3), 4),
    (t * (t - 1) * (t - 2) * (t - 3), 8),
    (t**2 - 2, 1),
    (t**3 - 2, 1),
    ((t - 1) * (t**2 - 2), 2),
    ((t - 1) * (t + 1) * (t**2 + 1), 4),
    ((t**2 + 1) * (t**2 - 2), 2),
    ((t - 1) ** 3, 1),
]


@pytest.mark.parametrize(("chi", "count"), COUNTS, ids=str)
def test_there_is_one_rational_associated_system_for_every_choice_of_signs_up_to_all(chi, count):
    systems = [g.system for g in draw_with_chi(chi, 1).associated()]
    assert len(set(systems)) == len(systems) == count


@over_members
def test_the_first_associated_system_is_the_member_itself(member):
    first = next(member.associated())
    assert (first.K, first.B, set(first.signs)) == (member.H, QQ.identity(member.dim), {1})


def test_signs_come_in_the_order_of_the_factors():
    assert [g.label for g in MEMBERS["m = 3, split"].associated()] == ["+++", "++-", "+-+", "+--"]


def test_the_first_sign_belongs_to_the_smallest_rational_root():
    member = MEMBERS["m = 3, partly split"]  # the roots 1, sqrt 2, -sqrt 2
    B = member.associate([-1, 1]).B
    assert B.charpoly() == (t + 1) ** 2 * (t - 1) ** 4


# f_s and K_s.


@over_members
def test_the_gradient_of_k_is_b_times_the_gradient_of_h(member):
    assert all(gradient(g.K) == linear_combinations(g.B, gradient(member.H)) for g in member.associated())


@over_members
def test_an_associated_system_is_b_transposed_times_the_system(member):
    f = CubicHamiltonian(member.H, standard_structure(member.dim)).system
    assert all(g.system == f.transformed(g.B.transpose()) for g in member.associated())


@over_members
def test_the_opposite_signs_give_the_opposite_system(member):
    for g in member.associated():
        assert member.associate([-sign for sign in g.signs]).system == g.system.scaled(-1)


def test_the_system_and_its_associate_are_those_of_the_planar_cubics_with_signs():
    A = fmpq_mat([[1, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]])
    H, K = (parse_polynomial(text, ["x1", "x2", "x3", "x4"]) for text in ("x1^3 + x2^2*x4", "x1^3 - x2^2*x4"))
    assert FamilyMember(A, H).associate([1, -1]).K == K


# Their Kahan maps commute.


def test_the_kahan_map_of_the_opposite_system_is_the_inverse():
    member = MEMBERS["m = 2, split"]
    phi, psi = (KahanMap(member.associate(signs).system, "1/7") for signs in ([1, 1], [-1, -1]))
    x = random_point(4, seed=1)
    assert psi.step(phi.step(x)) == x


# chi = t^2 - 2 is irreducible over Q. Modulo p = 2^61 - 1 its roots are +-2^31, since 2^62 = 2; there
# B = A / 2^31 = 2^30 A has the signs + and -, and K = 2^30 H_1 is associated to H. Modulo 2^31 - 1 it is not.
MERSENNE, OTHER = 2**61 - 1, 2**31 - 1


# Members as values.


def test_without_signs_a_member_is_its_own_choice():
    member = MEMBERS["m = 3, split"]
    assert (member.signs, member.chosen.K) == ((1, 1, 1), member.H)


def test_the_signs_of_a_member_choose_the_associated_system():
    member = MEMBERS["m = 3, split"]
    assert FamilyMember(member.A, member.H, (1, -1, -1)).chosen.K == member.associate([1, -1, -1]).K


@over_members
def test_dimension_and_factors_fit_together(member):
    assert (member.dim, sum(f.degree * f.multiplicity for f in member.factors)) == (2 * member.m, member.m)


@over_members
def test_a_member_is_generic_when_its_factors_are_simple(member):
    assert member.is_generic is all(factor.multiplicity == 1 for factor in member.factors)


def test_equal_members_hash_alike():
    one, two = (draw_generic(2, 5) for _ in range(2))
    assert (one, hash(one)) == (two, hash(two))


@pytest.mark.parametrize(
    "other",
    [
        FamilyMember(MEMBERS["m = 2, split"].A, MEMBERS["m = 2, split"].H, (1, -1)),
        FamilyMember(MEMBERS["m = 2, split"].A, 2 * MEMBERS["m = 2, split"].H),
        FamilyMember(2 * MEMBERS["m = 2, split"].A, MEMBERS["m = 2, split"].H),
        MEMBERS["m = 2, split"].H,
    ],
    ids=["signs", "H", "A", "kind"],
)
def test_members_that_differ_are_different(other):
    assert MEMBERS["m = 2, split"] != other


@pytest.mark.parametrize("signs", [(1,), (1, 1, 1), (1, 0), (2, 1)], ids=str)
def test_signs_that_do_not_fit_the_factors_are_refused_with_the_factors(signs):
    member = MEMBERS["m = 2, split"]
    with pytest.raises(HypothesisError, match=r"expected 2 numbers 1 or -1: .* \(t \+ 2\), \(t - 1\)"):
        FamilyMember(member.A, member.H, signs)


@pytest.mark.parametrize("signs", [(1,), (1, 1, 1), (1, 0), (1, 5)], ids=str)
def test_an_associate_with_signs_that_do_not_fit_is_refused(signs):
    with pytest.raises(InputError, match="signs"):
        MEMBERS["m = 2, split"].associate(signs)


@pytest.mark.parametrize("text", ["x1*x2^2", "x1^3 + x2", "x1^2"])
def test_a_polynomial_outside_the_space_makes_no_member(text):
    with pytest.raises(HypothesisError, match="H "):
        FamilyMember(MEMBERS["m = 2, split"].A, parse_polynomial(text, ["x1", "x2", "x3", "x4"]))


def test_a_matrix_outside_the_family_makes_no_member():
    with pytest.raises(HypothesisError, match="A is not skew-Hamiltonian"):
        FamilyMember(fmpq_mat([[1, 2], [0, 1]]), parse_polynomial("q^3", ["q", "p"]))


def test_the_chain_of_a_member_is_that_of_its_matrix():
    member = MEMBERS["m = 2, irreducible"]
    assert gradient(member.chain[1]) == linear_combinations(member.A, gradient(member.chain[0]))


# over number fields


@pytest.mark.parametrize(
    ("chi", "count"),
    [("t^2 - 2", 1), ("t^2 + t + 1", 1), ("t^3 - t - 1", 1), ("(t - 1)*(t^2 - 2)", 2), ("(t - 1)^2", 0)],
)
def test_associated_systems_over_a_number_field_commute_with_the_member_and_others_do_not(chi, count):
    member = draw_with_chi(parse_chi(chi), seed=3)
    found = list(member.conjugate_associates())
    assert len(found) == count
    for one in found:
        K = one.root.number_field
        powers = [K.convert_matrix(member.A**k) for k in range(member.m)]
        unit = K.identity(member.dim)
        B = sum((P * c for P, c in zip(powers, one.coefficients, strict=True)), unit * 0)
        assert B * B == unit != B
        file = km.SystemFile.from_conjugate(one)
        assert km.parse_system(file.to_toml()) == file
        assert km.check_commute(km.SystemFile.from_member(member), file).holds
    if found:
        # The square of B + 1 is not 1.
        wrong = replace(found[0], coefficients=(found[0].coefficients[0] + 1, *found[0].coefficients[1:]))
        wrong_file = km.SystemFile.from_conjugate(wrong)
        assert km.check_commute(km.SystemFile.from_member(member), wrong_file).verdict is km.Verdict.REFUTED


def test_the_terms_of_a_conjugate_K_stand_in_the_order_of_other_cubics():
    file = km.load("paper_m3_irreducible")
    (one,) = file.member.conjugate_associates()
    monomials = re.findall(r"\)\*([^ ]+)", one.K_text)
    assert len(monomials) == 56
    assert format_polynomial(parse_polynomial(" + ".join(monomials), file.variables)) == " + ".join(monomials)


def test_the_root_has_a_name_that_no_variable_has():
    A = fmpq_mat(4, 4, [0, 2, 0, 0,  1, 0, 0, 0,  0, 0, 0, 1,  0, 0, 2, 0])  # fmt: skip
    H = cubic_space(A, ("t", "u", "v", "t0")).basis[0]
    (one,) = FamilyMember(A, H).conjugate_associates()
    assert one.name == "t1"
    assert km.SystemFile.from_conjugate(one).variables == ("t", "u", "v", "t0")
