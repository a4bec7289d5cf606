"""Symmetries and reversing symmetries: known groups, a brute-force oracle, and the map itself as a witness."""

import itertools
import random
from itertools import islice

import pytest
from check_helpers import system_of as system
from flint import fmpq, fmpq_mat
from helpers import step_or_none
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps import QQ, KahanMap, affine_darboux, commuting_systems, load, parse_polynomial
from kahanmaps.algebra.small_systems import SolutionComponent
from kahanmaps.checks.settings import random_starts
from kahanmaps.laboratory.symmetry.symmetries import is_singular, is_symmetry, linear_symmetries


def apply(S, r, x):
    return tuple(a + b for a, b in zip((S * fmpq_mat(len(r), 1, list(x))).entries(), r, strict=True))


def holds_for_the_map(f, S, r, factor=1):
    """T Phi(., eps) = Phi(., factor eps) T at rational points, exactly."""
    answers = []
    for k, x in enumerate(islice(random_starts(f.dim, 0), 6)):
        phi, other = (KahanMap(f, fmpq(1 + k, 7) * c) for c in (1, factor))
        image, right = step_or_none(phi, x), step_or_none(other, apply(S, r, x))
        if image is not None and right is not None:
            answers.append(apply(S, r, image) == right)
    assert len(answers) >= 3
    return all(answers)


def sign_of(t):
    return -1 if t.reversing else 1


# Signed permutations: the orders are those of groups worked out by hand. volterra_periodic_N: the dihedral group of
# N particles times the reversal -I. The Euler top of the catalogue: J x J with two equal moments up to sign.
@pytest.mark.parametrize(
    ("name", "order"),
    [("volterra_periodic_3", 12), ("lorenz", 2), ("lotka_volterra", 2), ("euler_top", 16), ("three_wave", 64)],
)
def test_groups_of_the_catalogue_and_the_map_obeys_them(name, order):
    f = load(name, {}).system
    symmetries = linear_symmetries(f)
    assert (symmetries.order, len(symmetries.signed), symmetries.complete) == (order, order, True)
    assert all(holds_for_the_map(f, t.S, t.r, sign_of(t)) for t in (*symmetries.generators, *symmetries.others))


@given(st.integers(0, 10**9))
def test_signed_permutations_agree_with_brute_force(seed):
    rng = random.Random(seed)
    n = rng.choice((2, 3))
    names = ["x", "y", "z"][:n]
    terms = [a + b for a in ("", "x", "y", "z")[: n + 1] for b in ("x", "y", "z")[:n]]
    texts = ["*".join(term) for term in terms]
    rhs = ["0" + "".join(f" + {rng.choice((-1, 1))}*{t}" for t in rng.sample(texts, 2)) for _ in range(n)]
    f = system(" ".join(names), *rhs)
    expected = set()
    for order, signs in itertools.product(itertools.permutations(range(n)), itertools.product((1, -1), repeat=n)):
        S = fmpq_mat(n, n)
        for i, (place, s) in enumerate(zip(order, signs, strict=True)):
            S[place, i] = fmpq(s)
        expected |= {(str(S), sign < 0) for sign in (1, -1) if is_symmetry(f, S, [fmpq(0)] * n, sign)}
    symmetries = linear_symmetries(f, effort=2)
    unscaled = [t for t in symmetries.signed if all(abs(e) in (0, 1) for e in t.S.entries())]
    assert {(str(t.S), t.reversing) for t in unscaled if not any(e != 0 for e in t.r)} == expected
    assert all(is_symmetry(f, t.S, t.r, sign_of(t)) for t in symmetries.symmetries + symmetries.reversing)


def test_a_translation_is_found_where_it_is_needed():
    """x' = x^2 + x is even about -1/2: x -> -x - 1 takes the map to its inverse."""
    f = load("riccati", {}).system
    (_, t) = linear_symmetries(f).signed
    assert (t.text, t.reversing, t.is_trivial) == ("(x) -> (-x - 1)", True, False)
    assert holds_for_the_map(f, t.S, t.r, -1)
    symmetries = linear_symmetries(system("x y", "x^2 + x", "y^2 - 3*y"))
    assert [t.text for t in symmetries.reversing] == ["(x, y) -> (-x - 1, -y + 3)"]
    symmetries = linear_symmetries(system("x y", "x*(x + 3*(y - 1))", "(y - 1)*(y - 1 + 3*x)"))
    assert [t.text for t in symmetries.symmetries] == ["(x, y) -> (x, y)", "(x, y) -> (y - 1, x + 1)"]


@pytest.mark.parametrize(
    ("rhs", "actions"),
    [
        (["x^2", "4*y^2"], ["(x, y) -> (x, y)", "(x, y) -> (4*y, x/4)"]),
        (["y^2", "2*x^2"], ["(x, y) -> (x, y)"]),  # (a y, b x) with b^2 = 2 a, b = 2 a^2: a^3 = 1/2
        (["y^2", "8*x^2"], ["(x, y) -> (x, y)", "(x, y) -> (y/2, 2*x)"]),
        (["x^2 + 6000000*x*y", "2000000*y^2 + 3*x*y"], ["(x, y) -> (x, y)", "(x, y) -> (2000000*y, x/2000000)"]),
        (["x^2 + 6000000*x*y", "2000000*y^2 + 3*x*y + y"], ["(x, y) -> (x, y)"]),
    ],
)
def test_permutations_of_scaled_variables(rhs, actions):
    """With and without a rational scale; the last one is spoiled by a linear term."""
    assert {t.text for t in linear_symmetries(system("x y", *rhs)).signed if not t.reversing} == set(actions)


def test_matrices_that_are_no_signed_permutations():
    """Conjugate a system with the group of order 12 of the triangle by a shear: the matrices are still found."""
    f = load("zander_111", {}).system
    symmetries = linear_symmetries(f)
    # Of those with a sign 2 are of scaled variables.
    assert (len(symmetries.signed), len(symmetries.others), symmetries.complete) == (4, 8, True)
    assert (symmetries.group_text, len(symmetries.generators)) == ("12 rational matrices, 6 of them reversing", 2)
    assert all(holds_for_the_map(f, t.S, t.r, sign_of(t)) for t in symmetries.others)


def test_infinitesimal_symmetries_are_those_of_the_three_wave_system():
    """Two independent phase rotations, whose phases add up to nothing (petrera-pfadler-suris-2011)."""
    f = load("three_wave", {}).system
    symmetries = linear_symmetries(f)
    assert [x.rhs for x in symmetries.infinitesimal] == [
        ["v1", "-v2", "0", "-u1", "u2", "0"],
        ["v1", "0", "-v3", "-u1", "0", "u3"],
    ]
    # A rotation by a rational angle: cos = 3/5, sin = 4/5, of z1 and backwards of z2.
    c, s = fmpq(3, 5), fmpq(4, 5)
    S = QQ.identity(6)
    for k, sign in ((0, 1), (1, -1)):
        S[k, k] = S[k + 3, k + 3] = c
        S[k, k + 3], S[k + 3, k] = s * sign, -s * sign
    assert is_symmetry(f, S, [fmpq(0)] * 6, 1)
    assert holds_for_the_map(f, S, [fmpq(0)] * 6)


def test_scalings_change_eps():
    """x' = y, y' = x^2 has the weights 2 and 3: (x, y) -> (c^2 x, c^3 y) takes the map at eps to that at eps/c."""
    f = system("x y", "y", "x^2")
    assert linear_symmetries(f).scaling.rhs == ["2*x", "3*y"]
    assert holds_for_the_map(f, fmpq_mat([[4, 0], [0, 8]]), [fmpq(0)] * 2, fmpq(1, 2))
    assert linear_symmetries(load("lorenz", {}).system).scaling is None
    assert linear_symmetries(load("euler_top", {}).system).scaling.rhs == ["x1", "x2", "x3"]


def squares(names):
    return system(" ".join(names), *(f"{name}^2" for name in names))


def test_too_large_is_undecided_with_a_reason():
    many = linear_symmetries(squares([*"abcdefg"]))
    assert (many.order, many.complete) == (None, False)
    assert "not all signed permutations were tried" in many.undecided[0]
    large = linear_symmetries(squares([f"x{i}" for i in range(17)]))
    assert [text.split(" are ")[0] for text in large.undecided] == ["infinitesimal symmetries", "signed permutations"]
    assert large.symmetries == []


@pytest.mark.parametrize(
    ("entries", "singular"),
    [
        (["0", "a", "b", "-a", "0", "c", "-b", "-c", "0"], True),  # skew, of odd size
        (["a", "0", "0", "0", "b", "0", "0", "0", "c"], False),
        (["a", "b", "c", "b", "c", "a", "a + b", "b + c", "a + c"], True),  # the third row is the sum of the others
        (["a", "b", "c", "b", "c", "a", "c", "a", "b"], False),
    ],
)
def test_a_family_of_three_by_three_matrices_is_singular_where_its_determinant_is_zero(entries, singular):
    part = SolutionComponent(tuple(parse_polynomial(entry, ["a", "b", "c"]) for entry in entries))
    assert is_singular(part, 3) is singular


def test_equations_with_long_coefficients_are_not_set_up_and_nothing_is_called_complete():
    long = f"{10**2100 + 1}/{7**2600}"
    f = system("x y", f"{long}*x^2 + y^2", "x*y + x^2")
    symmetries, commuting, darboux = linear_symmetries(f), commuting_systems(f), affine_darboux(f)
    assert symmetries.undecided == ["other matrices are searched for coefficients of up to 2000 digits only"]
    assert commuting.undecided == ["other g are searched for coefficients of up to 2000 digits only"]
    assert (symmetries.complete, commuting.complete, darboux.complete) == (False, False, False)
    assert [solution.trivial for solution in commuting.solutions] == ["0", "f", "-f"]
