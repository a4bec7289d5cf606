"""The normal form of a member: one planar system X' = dh/dY, Y' = -dh/dX over the algebra K = Q[t]/chi.

Specified here: x -> (X, Y) carries the Kahan map of the system into the planar formula, exactly, for every m and for
chi split or not; at a rational root of chi a planar system over Q splits off; and data that are not a normal form are
refused.
"""

from dataclasses import replace

import pytest
from family.members import GENERIC, t
from flint import fmpq, fmpq_mat
from helpers import random_point, refuses
from planar_helpers import diagonal

from kahanmaps import FamilyMember, KahanMap, NormalForm, load, normal_form, parse_polynomial
from kahanmaps.errors import HypothesisError, SingularStep
from kahanmaps.family.cubics import default_variables
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues


def split(eigenvalues, H: str) -> FamilyMember:
    """A = diag(eigenvalues, eigenvalues), H as text in x1, x2, ..."""
    return FamilyMember(diagonal(eigenvalues * 2), parse_polynomial(H, default_variables(2 * len(eigenvalues))))


MEMBERS = GENERIC | {
    # No unit vector generates K e1 = K here.
    "m = 4, split, a product": split([1, 2, 3, 5], "x1^3 + x2*x6^2 + x3^2*x7 - x8^3 + 5*x4*x8^2"),
    "m = 3, of the paper": load("paper_m3").member,
    "m = 3, partly split, -+": replace(GENERIC["m = 3, partly split"], signs=(-1, 1)),  # another system than f_0
}


@pytest.mark.parametrize("member", MEMBERS.values(), ids=MEMBERS.keys())
def test_the_planar_step_is_the_kahan_map(member):
    form = normal_form(member)
    for eps in ("1/3", -2):
        phi = KahanMap(member.chosen.system, eps)
        for x in (random_point(member.dim, seed) for seed in range(3)):
            assert form.point(*form.step(*form.coordinates(x), eps)) == phi.step(x)


# h = X^2 Y has D = -4 X^2. A part is singular at eps = 1 where 2 x_i = 1, and so is everything else with it.
SINGULAR = [  # member, point, factor of chi
    (split([3], "x1^2*x2"), ["1/2", 5], "t - 3"),
    (split([3, 4], "x1^2*x3 + x2^2*x4"), ["1/2", 7, 5, 1], "t - 3"),
    (split([3, 4], "x1^2*x3 + x2^2*x4"), [7, "1/2", 5, 1], "t - 4"),
]


@pytest.mark.parametrize(("member", "x", "factor"), SINGULAR, ids=["m = 1", "first part", "second part"])
def test_the_planar_step_is_singular_with_the_kahan_map_and_names_the_factor(member, x, factor):
    form = normal_form(member)
    with pytest.raises(SingularStep):
        KahanMap(member.chosen.system, 1).step(x)
    with pytest.raises(SingularStep, match=rf"have the factor {factor} in common .* eps = 1:") as caught:
        form.step(*form.coordinates(x), 1)
    assert (caught.value.point, caught.value.eps) == (form.coordinates(x), 1)
    form.step(*form.coordinates(x), "1/3")


def changed(form: NormalForm, i: int) -> dict[str, object]:
    """One coefficient of h with t instead."""
    coefficients = list(form.coefficients)
    coefficients[i] += t
    return {"coefficients": tuple(coefficients)}


WRONG = [
    (lambda form: {"A": form.A.transpose()}, "t does not act"),
    (lambda form: {"S": form.S + form.S.transpose()}, "t does not act"),
    (lambda form: {"S": form.S * fmpq(2)}, "not the Gram matrix"),
    (lambda form: {"S": fmpq_mat([row[2:] + row[:2] for row in form.S.tolist()])}, "not the Gram matrix"),  # e2, e1
    (lambda form: {"S": -form.S}, "not l.h"),
    (lambda form: {"H": form.H + parse_polynomial("x1*x2*x3", default_variables(4))}, "not l.h"),
    (lambda form: changed(form, 0), "not l.h"),
    (lambda form: changed(form, 3), "not l.h"),
    (lambda form: {"coefficients": tuple(c + form.chi for c in form.coefficients)}, "not reduced"),
    (lambda form: {"S": fmpq_mat(2, 2)}, "sizes"),
]


@pytest.mark.parametrize("name", ["m = 2, split", "m = 2, irreducible"])
@pytest.mark.parametrize(("wrong", "sentence"), WRONG)
def test_wrong_data_fail_the_verification(name, wrong, sentence):
    form = normal_form(GENERIC[name])
    replace(form).verify()
    refuses(sentence, replace, form, **wrong(form), error=AssertionError)


@pytest.mark.parametrize(
    ("member", "factors"),
    [
        (random_member_with_chi((t**2 + 1) ** 2, 1), r"\(t\^2 \+ 1\), expected"),
        (random_member_with_eigenvalues([1, 1, 2, 2, 3], 1), r"\(t - 1\), \(t - 2\), expected"),
    ],
    ids=["a quadratic factor twice", "two roots twice"],
)
def test_repeated_roots_are_refused_by_their_factors(member, factors):
    refuses(f"chi has the repeated factor.* {factors}", normal_form, member, error=HypothesisError)
