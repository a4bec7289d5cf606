"""The normal form of a member: one planar system X' = dh/dY, Y' = -dh/dX over the algebra K = Q[t]/chi.

Specified here: x -> (X, Y) carries A^T into multiplication by t, x^T J y into l(X1 Y2 - Y1 X2), H into l(h), the system
into the planar one and its Kahan map into the planar formula, exactly, for every m and for chi split or not; at a
rational root of chi a planar system over Q splits off; and data that are not a normal form are refused.
"""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly
from helpers import random_point

from kahanmaps.algebra.matrices import det
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.written.text import parse_polynomial
from kahanmaps.documents.catalog import load
from kahanmaps.errors import HypothesisError, InexactNumber, InputError, SingularStep
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.cubics import cubic_space, default_variables
from kahanmaps.family.draw import draw_generic, draw_with_chi, draw_with_eigenvalues
from kahanmaps.family.planar import NormalForm, normal_form
from kahanmaps.family.skew_hamiltonian import random_symplectic, symplectic_inverse
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import standard_structure

t = fmpq_poly([0, 1])


def diagonal(eigenvalues, H: str) -> FamilyMember:
    """A = diag(eigenvalues, eigenvalues), H as text in x1, x2, ..."""
    n = 2 * len(eigenvalues)
    A = fmpq_mat(n, n, [eigenvalues[i % len(eigenvalues)] * (i == j) for i in range(n) for j in range(n)])
    return FamilyMember(A, parse_polynomial(H, default_variables(n)))


# No unit vector generates K e1 = K here.
PRODUCT = diagonal([1, 2, 3, 5], "x1^3 + x2*x6^2 + x3^2*x7 - x8^3 + 5*x4*x8^2")
SPLIT = {
    "m = 1": draw_generic(1, 1),
    "m = 2, split": draw_with_eigenvalues([1, -2], 1),
    "m = 3, split, fractions": draw_with_eigenvalues(["1/2", "-2/3", 4], 1),
    "m = 4, split, a product": PRODUCT,
    "m = 5, split": draw_with_eigenvalues([1, -1, 0, 2, 5], 1),
    "m = 3, of the paper": load("paper_m3").member,
}
NOT_SPLIT = {
    "m = 2, irreducible": draw_with_chi(t**2 - 2, 1),
    "m = 3, irreducible": draw_generic(3, 1),
    "m = 3, partly split": draw_with_chi((t - 1) * (t**2 + 1), 1),
    "m = 4, two quadratic factors": draw_with_chi((t**2 + 1) * (t**2 - 2), 1),
    "m = 4, partly split": draw_with_chi((t - 1) * (2 * t - 1) * (t**2 + t + 3), 1),
    "m = 5, irreducible": draw_with_chi(t**5 - t + 1, 1),
}
MINUS = {  # signs pick another system than f_0
    "m = 2, split, +-": replace(SPLIT["m = 2, split"], signs=(1, -1)),
    "m = 3, partly split, -+": replace(NOT_SPLIT["m = 3, partly split"], signs=(-1, 1)),
}
MEMBERS = SPLIT | NOT_SPLIT | MINUS
FORMS = {name: normal_form(member) for name, member in MEMBERS.items()}
over_members = pytest.mark.parametrize(
    ("member", "form"), [(MEMBERS[name], FORMS[name]) for name in MEMBERS], ids=MEMBERS.keys()
)
over_split = pytest.mark.parametrize(
    ("member", "form"), [(SPLIT[name], FORMS[name]) for name in SPLIT], ids=SPLIT.keys()
)


def samples(dim: int, count: int = 3) -> list[tuple[fmpq, ...]]:
    return [random_point(dim, seed) for seed in range(count)]


def norm(form: NormalForm, element: fmpq_poly) -> fmpq:
    """The product of the values at the roots of chi."""
    return form.chi.resultant(element)


def discriminant(a, b, c, d):
    """The discriminant of a u^3 + b u^2 v + c u v^2 + d v^3; a linear change of variables multiplies it by det^6."""
    return b * b * c * c - 4 * a * c**3 - 4 * b**3 * d - 27 * a * a * d * d + 18 * a * b * c * d


# The coordinates.


@over_members
def test_points_and_pairs_of_elements_correspond(member, form):
    for x in samples(member.dim):
        X, Y = form.coordinates(x)
        assert max(X.degree(), Y.degree()) < member.m
        assert form.point(X, Y) == x
        assert form.coordinates(form.point(X + 5 * form.chi, Y)) == (X, Y)


@over_members
def test_the_transpose_of_a_is_multiplication_by_t(member, form):
    for x in samples(member.dim):
        X, Y = form.coordinates(x)
        image = (member.A.transpose() * fmpq_mat(member.dim, 1, list(x))).entries()
        assert form.coordinates(image) == (t * X % form.chi, t * Y % form.chi)


@over_members
def test_the_symplectic_form_is_the_functional_of_the_determinant(member, form):
    x, y = samples(member.dim, 2)
    (X1, Y1), (X2, Y2) = form.coordinates(x), form.coordinates(y)
    rows, column = fmpq_mat(1, member.dim, list(x)), fmpq_mat(member.dim, 1, list(y))
    value = (rows * standard_structure(member.dim) * column)[0, 0]
    assert value == form.functional(X1 * Y2 - Y1 * X2) != 0


def test_the_functional_is_the_coefficient_of_the_highest_power():
    form = FORMS["m = 2, irreducible"]  # t^2 = 2
    assert [form.functional(a) for a in (1, t, 3 * t - 7, t**2, t**3)] == [0, 1, 3, 0, 2]


@over_split
def test_the_functional_is_a_weighted_sum_over_the_roots(member, form):
    for k in range(2 * member.m):
        assert form.functional(t**k) == sum((part.weight * part.root**k for part in form.parts), fmpq(0))


@over_members
def test_the_inverse_of_s_is_its_inverse(member, form):
    identity = fmpq_mat(member.dim, member.dim, [int(i == j) for i in range(member.dim) for j in range(member.dim)])
    assert form.S * form.S_inverse == identity


@pytest.mark.parametrize("x", [[1, 2], [1] * 6, "1,2,3,4"], ids=str)
def test_a_point_of_another_length_is_refused(x):
    with pytest.raises(InputError, match="expected a sequence of 4 numbers"):
        FORMS["m = 2, split"].coordinates(x)


def test_machine_floats_are_refused():
    form = FORMS["m = 2, split"]
    with pytest.raises(InexactNumber):
        form.coordinates([1, 2, 3, 0.5])
    with pytest.raises(InexactNumber):
        form.step(t, 1, 0.1)


# The system.


@over_members
def test_the_hamiltonian_is_the_functional_of_h(member, form):
    for x in samples(member.dim):
        assert member.chosen.K(*x) == form.functional(form.h(*form.coordinates(x)))


@over_members
def test_the_system_is_the_planar_one(member, form):
    phi = KahanMap(member.chosen.system, 1)
    for x in samples(member.dim):
        assert form.point(*form.vector_field(*form.coordinates(x))) == phi.vector_field(x)


@over_members
def test_the_square_of_the_jacobi_matrix_is_minus_d(member, form):
    x, y = samples(member.dim, 2)
    derivative = KahanMap(member.chosen.system, 1).vector_field_jacobian(x)
    twice = (derivative * derivative * fmpq_mat(member.dim, 1, list(y))).entries()
    D = form.D(*form.coordinates(x))
    assert form.coordinates(twice) == tuple(-D * element % form.chi for element in form.coordinates(y))


@over_members
def test_the_determinant_is_the_norm_of_the_denominator(member, form):
    for eps in (fmpq(1), fmpq(-2, 7)):
        phi = KahanMap(member.chosen.system, eps)
        for x in samples(member.dim, 2):
            assert det(phi.denominator_matrix(x)) == norm(form, 1 + eps * eps * form.D(*form.coordinates(x)))


@over_members
def test_the_planar_step_is_the_kahan_map(member, form):
    for eps in ("1/3", -2):
        phi = KahanMap(member.chosen.system, eps)
        for x in samples(member.dim):
            assert form.point(*form.step(*form.coordinates(x), eps)) == phi.step(x)


@over_members
def test_the_step_with_minus_eps_leads_back(member, form):
    for x in samples(member.dim):
        start = form.coordinates(x)
        image = form.step(*start, "3/7")
        assert image != start
        assert form.step(*image, "-3/7") == start


# h = X^2 Y has D = -4 X^2. A part is singular at eps = 1 where 2 x_i = 1, and so is everything else with it.
SINGULAR = [  # member, point, factor of chi
    (diagonal([3], "x1^2*x2"), ["1/2", 5], "t - 3"),
    (diagonal([3, 4], "x1^2*x3 + x2^2*x4"), ["1/2", 7, 5, 1], "t - 3"),
    (diagonal([3, 4], "x1^2*x3 + x2^2*x4"), [7, "1/2", 5, 1], "t - 4"),
]


@pytest.mark.parametrize(("member", "x", "factor"), SINGULAR, ids=["m = 1", "first part", "second part"])
def test_where_the_kahan_map_is_singular_the_planar_step_is_and_tells_the_factor(member, x, factor):
    form = normal_form(member)
    with pytest.raises(SingularStep):
        KahanMap(member.chosen.system, 1).step(x)
    with pytest.raises(SingularStep, match=rf"have the factor {factor} in common .* eps = 1:") as caught:
        form.step(*form.coordinates(x), 1)
    assert (caught.value.point, caught.value.eps) == (form.coordinates(x), 1)
    form.step(*form.coordinates(x), "1/3")


def test_signs_multiply_h_by_the_polynomial_of_the_signs():
    member, plain = MINUS["m = 2, split, +-"], FORMS["m = 2, split"]
    sign = fmpq_poly(list(member.chosen.coefficients))  # 1 at t = -2, and -1 at t = 1
    form = NormalForm(member.A, member.chosen.K, plain.S, tuple(sign * c % plain.chi for c in plain.coefficients))
    assert form.D_coefficients == plain.D_coefficients


# Known answers: h is determined up to SL_2(K), so that its discriminant is determined.


def test_the_discriminant_over_an_irreducible_chi():
    # X = x1 + x2 t and Y = x4 + x3 t with t^2 = 2; H is the coefficient of t in X^3 + Y^3, of discriminant -27
    A = fmpq_mat([[0, 1, 0, 0], [2, 0, 0, 0], [0, 0, 0, 2], [0, 0, 1, 0]])
    H = parse_polynomial("3*x1^2*x2 + 2*x2^3 + 3*x4^2*x3 + 2*x3^3", default_variables(4))
    form = normal_form(FamilyMember(A, H))
    assert discriminant(*form.coefficients) % form.chi == -27


def test_the_discriminants_of_a_product():
    # dx1 dx3 = du dv / chi'(1), chi'(1) = -3: h is -3 (x1^3 + x3^3) in u, v, its discriminant -27 (-3)^4 / (-3)^6
    form = normal_form(diagonal([1, 4], "x1^3 + x3^3 + 2*x2^3 + x4^3"))
    assert [part.weight for part in form.parts] == [fmpq(-1, 3), fmpq(1, 3)]
    discriminants = discriminant(*form.coefficients)
    assert [discriminants(part.root) for part in form.parts] == [-3, -12]


# The parts at rational roots.


@over_split
def test_where_chi_splits_there_are_m_planar_parts(member, form):
    assert [part.root for part in form.parts] == sorted(factor.root for factor in member.factors)


ROOTS = {"m = 3, partly split": [1], "m = 4, partly split": [fmpq(1, 2), 1], "m = 2, irreducible": []}


@pytest.mark.parametrize("name", ROOTS)
def test_otherwise_there_is_a_part_for_each_rational_root(name):
    assert [part.root for part in FORMS[name].parts] == ROOTS[name]


@over_split
def test_the_hamiltonian_is_the_weighted_sum_of_the_parts(member, form):
    for x in samples(member.dim):
        X, Y = form.coordinates(x)
        total = sum((part.weight * part.h(X(part.root), Y(part.root)) for part in form.parts), fmpq(0))
        assert member.chosen.K(*x) == total


@over_members
def test_each_part_moves_by_itself_as_a_planar_kahan_map(member, form):
    for x in samples(member.dim):
        X, Y = form.coordinates(x)
        image = form.step(X, Y, "1/3")
        for part in form.parts:
            phi = KahanMap(part.hamiltonian.system, "1/3")
            assert phi.step((X(part.root), Y(part.root))) == tuple(element(part.root) for element in image)


# The choice of S.


@over_members
def test_the_same_member_gets_the_same_normal_form(member, form):
    again = normal_form(FamilyMember(member.A, member.H, member.signs))
    assert (again.S, again.coefficients) == (form.S, form.coefficients)


def test_unit_vectors_whose_sums_lose_a_root_are_no_obstacle():
    # From e5 on, whatever unit vector brings a new root in cancels another one in the sum, but not with a factor.
    S = random_symplectic(4, random.Random(926), rounds=1)
    roots = fmpq_mat(8, 8, [(i == j) * (i % 4) for i in range(8) for j in range(8)])
    A = symplectic_inverse(S).transpose() * roots * S.transpose()
    assert [part.root for part in normal_form(FamilyMember(A, cubic_space(A).basis[0])).parts] == [0, 1, 2, 3]


@pytest.mark.parametrize("m", [2, 3, 4, 5, 6])
def test_s_keeps_small_integers_small(m):
    # drawn with a symplectic matrix of integers, so that an S of integers exists; up to 100 leaves some freedom
    form = normal_form(draw_generic(m, 1))
    assert max(abs(entry) for entry in form.S.entries()) <= 100
    assert {entry.q for entry in form.S.entries()} <= {1, 2}


# What is not a normal form.


def swapped(S: fmpq_mat) -> fmpq_mat:
    """e2, e1 for e1, e2: W(e1, e2) = -1."""
    m = S.nrows() // 2
    return fmpq_mat([[*row[m:], *row[:m]] for row in S.tolist()])


def changed(form: NormalForm, i: int) -> dict[str, object]:
    """One coefficient of h with t instead."""
    coefficients = list(form.coefficients)
    coefficients[i] += t
    return {"coefficients": tuple(coefficients)}


x1, x2, x3, x4 = ring(default_variables(4)).gens()
WRONG = [
    (lambda form: {"A": form.A.transpose()}, "t does not act"),
    (lambda form: {"A": form.A * fmpq(2)}, "t does not act"),
    (lambda form: {"S": form.S + form.S.transpose()}, "t does not act"),
    (lambda form: {"S": form.S * fmpq(2)}, "not the Gram matrix"),
    (lambda form: {"S": fmpq_mat(4, 4)}, "not the Gram matrix"),
    (lambda form: {"S": swapped(form.S)}, "not the Gram matrix"),
    (lambda form: {"S": -form.S}, "not l.h"),
    (lambda form: {"S": form.A.transpose() * form.S}, "not the Gram matrix"),
    (lambda form: {"H": 2 * form.H}, "not l.h"),
    (lambda form: {"H": form.H + x1 * x2 * x3}, "not l.h"),
    (lambda form: changed(form, 0), "not l.h"),
    (lambda form: changed(form, 1), "not l.h"),
    (lambda form: changed(form, 2), "not l.h"),
    (lambda form: changed(form, 3), "not l.h"),
    (lambda form: {"coefficients": tuple(c + form.chi for c in form.coefficients)}, "not reduced"),
    (lambda form: {"S": fmpq_mat(2, 2)}, "sizes"),
    (lambda form: {"H": parse_polynomial("q^3", ["q", "p"])}, "sizes"),
]


@pytest.mark.parametrize("name", ["m = 2, split", "m = 2, irreducible"])
@pytest.mark.parametrize(("wrong", "sentence"), WRONG)
def test_wrong_data_fail_the_verification(name, wrong, sentence):
    form = FORMS[name]
    replace(form).verify()
    with pytest.raises(AssertionError, match=sentence):
        replace(form, **wrong(form))


@pytest.mark.parametrize(
    ("member", "factors"),
    [
        (draw_with_eigenvalues([1, 1, 2], 1), r"\(t - 1\), expected"),
        (draw_with_chi((t - 1) ** 2, 1), r"\(t - 1\), expected"),
        (draw_with_chi((t**2 + 1) ** 2, 1), r"\(t\^2 \+ 1\), expected"),
        (draw_with_eigenvalues([1, 1, 2, 2, 3], 1), r"\(t - 1\), \(t - 2\), expected"),
    ],
    ids=["diagonalisable", "not diagonalisable", "a quadratic factor twice", "two roots twice"],
)
def test_repeated_roots_are_refused_by_their_factors(member, factors):
    with pytest.raises(HypothesisError, match=f"chi has the repeated factor.* {factors}"):
        normal_form(member)


# Text.

TEXTS = [  # coefficients over t^2 = 2, h, D
    ([1, 0, 0, -1], "X^3 - Y^3", "-36*X*Y"),
    ([0, t, t - 1, 0], "t*X^2*Y + (t - 1)*X*Y^2", "-8*X^2 + (4*t - 8)*X*Y + (8*t - 12)*Y^2"),
    ([fmpq(-1, 2) * t, 0, 0, -t - 1], "-1/2*t*X^3 - (t + 1)*Y^3", "(18*t + 36)*X*Y"),
    ([1 - t, 0, 0, 0], "(-t + 1)*X^3", "0"),
    ([0, 0, 0, 0], "0", "0"),
]


@pytest.mark.parametrize(("coefficients", "h", "D"), TEXTS)
def test_forms_are_written_as_people_do(coefficients, h, D):
    plain = FORMS["m = 2, irreducible"]
    a, b, c, d = (fmpq_poly([0]) + coefficient for coefficient in coefficients)
    linear = [
        sum((e * x for e, x in zip(row, (x1, x2, x3, x4), strict=True)), 0 * x1) for row in plain.S_inverse.tolist()
    ]
    X, Y = linear[:2], linear[2:]
    H = functional_of(times(a, X, X, X), times(b, X, X, Y), times(c, X, Y, Y), times(d, Y, Y, Y))
    form = NormalForm(plain.A, H, plain.S, (a, b, c, d))
    assert (form.chi_text, form.h_text, form.D_text) == ("t^2 - 2", h, D)


def times(element: fmpq_poly, *factors):
    """The product over t^2 = 2 of an element and of pairs of polynomials."""
    low, high = element[0] + 0 * x1, element[1] + 0 * x1
    for first, second in factors:
        low, high = low * first + 2 * high * second, low * second + high * first
    return low, high


def functional_of(*elements):
    return sum((high for _, high in elements), 0 * x1)


def test_every_part_conserves_h_over_one_plus_eps_squared_D():
    eps = fmpq(1, 7)
    for part in normal_form(draw_with_eigenvalues([1, -2, 3], seed=5)).parts:
        phi, point = KahanMap(part.hamiltonian.system, eps), (fmpq(1, 3), fmpq(-2, 5))
        image = phi.step(point)
        before, after = (part.h(*x) / (1 + eps * eps * part.D(*x)) for x in (point, image))
        assert before == after
        assert part.h(*point) / (1 + part.D(*point)) != part.h(*image) / (1 + part.D(*image))  # a wrong eps
