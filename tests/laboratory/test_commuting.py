"""Which Kahan maps commute with a given one: the paper's theorem found without its matrix A, and everything else."""

import random
from fractions import Fraction
from itertools import islice
from types import SimpleNamespace

import pytest
from check_helpers import check, commute_at
from check_helpers import system_of as system
from flint import fmpq
from helpers import fraction
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps import QQ, Budget, commuting_systems, load, random_member_with_eigenvalues
from kahanmaps.algebra.bounds import log2
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.small_systems import SolutionComponent
from kahanmaps.checks.settings import Settings, random_starts
from kahanmaps.laboratory.symmetry.commuting_proofs import _family_identity, certify_family, certify_field
from kahanmaps.laboratory.symmetry.commuting_space import (
    bracket_vanishes,
    combination,
    commuting_space,
    field_at,
    system_of,
)

TRIVIAL = ["0", "f", "-f"]


def commute_exactly(f, g, tries=3):
    """Phi_f Phi_g = Phi_g Phi_f at rational points, at as many values of eps."""
    points = (tuple(map(fraction, x)) for x in random_starts(f.dim, 0))
    answers = (commute_at(f, g, Fraction(1 + k, 7), x) for k, x in enumerate(points))
    return all(islice((answer for answer in answers if answer is not None), tries))


# petrera-suris-2016, Theorem 9: 2^m associated fields; where a block is left out the maps commute as well.
@pytest.mark.parametrize("shape", ["linear", "quadratic"])
@pytest.mark.parametrize("eigenvalues", [[1, -2], [2, 1, -1]])
def test_the_associated_fields_of_the_paper_are_found_from_the_equations_alone(eigenvalues, shape):
    member = random_member_with_eigenvalues(eigenvalues, seed=7)
    result = commuting_systems(member.chosen.system, shape)
    m = len(eigenvalues)
    assert (result.dimension, len(result.solutions), result.complete, str(result.verdict)) == (m, 3**m, True, "proved")
    assert not result.families
    assert not result.irrational
    systems = [g.system for g in result.solutions]
    for associate in member.associated():
        assert systems.count(associate.system) == systems.count(associate.system.scaled(-1)) == 1
    if shape == "linear":
        involutions = [str(g.B) for g in result.solutions if g.B * g.B == QQ.identity(2 * m)]
        expected = [str(a.B.transpose() * fmpq(sign)) for a in member.associated() for sign in (1, -1)]
        assert sorted(involutions) == sorted(expected)
        assert all(g.B * g.B * g.B == g.B for g in result.solutions)
    assert all(commute_exactly(systems[0 if k < 3 else k], member.chosen.system, 1) for k in range(2, 3**m, 4))


def test_where_chi_does_not_split_only_rational_fields_are_found_and_the_others_reported():
    systems = commuting_systems(load("paper_m3_irreducible", {}).system)
    assert (systems.dimension, [g.trivial for g in systems.solutions], systems.complete) == (3, TRIVIAL, True)
    assert systems.irrational


@pytest.mark.parametrize("shape", ["linear", "quadratic"])
@pytest.mark.parametrize("name", ["henon_heiles", "lotka_volterra", "volterra_periodic_4"])
def test_most_systems_commute_with_nothing(name, shape):
    systems = commuting_systems(load(name, {}).system, shape)
    assert [g.trivial for g in systems.solutions] == TRIVIAL
    assert (systems.families, systems.complete, str(systems.verdict)) == ([], True, "proved")


def test_moebius_maps_commute_by_their_lemma_where_the_fields_are_proportional():
    f = system("x", "x^2 + 1")
    proof = certify_field(f, system("x", "3*x^2 + 3"), Settings())
    assert proof.evidence.data["theorem"] == "the lemma of Moebius maps"
    # In dimension 2 proportional fields need not commute.
    plane = system("x y", "x^2 + y", "x*y - 1")
    for first, other in ((f, system("x", "x")), (f, system("x", "3*x^2 + 2")), (plane, plane.scaled(3))):
        assert str(certify_field(first, other, Settings()).verdict) == "refuted"


@pytest.mark.parametrize(
    ("f", "shape", "directions"),
    [
        (system("x", "x^2 + x - 1"), "linear", ["x^2 + x - 1"]),  # Moebius maps of dimension 1
        # z' = z^2 with complex z = x + i y: all its complex multiples
        (system("x y", "x^2 - y^2", "2*x*y"), "linear", ["x^2 - y^2, 2*x*y", "2*x*y, -x^2 + y^2"]),
        (system("x y", "y", "-x"), "quadratic", ["y, -x", "x, y"]),  # Cayley transforms of matrices that commute
        (system("x y z", "y*z", "0", "0"), "linear", ["y*z, 0, 0"]),  # a nilpotent field: the map is the flow
    ],
)
def test_whole_linear_families_commute(f, shape, directions):
    systems = commuting_systems(f, shape)
    (family,) = systems.families
    assert [", ".join(g.rhs) for g in family.directions] == directions
    assert (family.base.trivial, str(family.finding.verdict), systems.complete) == ("0", "proved", True)
    assert [g.trivial for g in systems.solutions] == TRIVIAL


def test_a_vanishing_bracket_is_not_enough():
    """f = (x, y, 2 z) and g = (0, 0, x y): the flows commute, the maps do not: (1+e)^2/(1-e)^2 is not (1+2e)/(1-2e)."""
    f, g = system("x y z", "x", "y", "2*z"), system("x y z", "0", "0", "x*y")
    assert bracket_vanishes(f, g)
    assert not commute_exactly(f, g)
    assert str(certify_field(f, g, Settings()).verdict) == "refuted"
    systems = commuting_systems(f, "quadratic")
    assert all(d.system.is_homogeneous is False for family in systems.families for d in family.directions)
    assert systems.complete
    assert systems.dimension == 8


def test_multiples_are_refuted_as_a_family():
    f = load("euler_top", {}).system
    space = commuting_space(f, "linear")
    t = ring(["t"]).gens()[0]
    assert str(certify_family(f, space, SolutionComponent((t,)), Settings()).verdict) == "refuted"


@given(st.lists(st.integers(-2, 2), min_size=12, max_size=12))
def test_everything_found_commutes_exactly(numbers):
    f = system_of(("x", "y"), [[fmpq(n) for n in numbers[:6]], [fmpq(n) for n in numbers[6:]]])
    systems = commuting_systems(f, "quadratic", effort=-2)
    rng = random.Random(str(numbers))
    for solution in systems.solutions:
        assert commute_exactly(f, solution.system, 2)
    for family in systems.families:
        weights = [fmpq(1), *(fmpq(rng.randint(-5, 5), 3) for _ in family.directions)]
        fields = [family.base.system, *(d.system for d in family.directions)]
        assert commute_exactly(f, system_of(f.variables, combination(fields, weights, fmpq(0))), 2)


@pytest.mark.parametrize("names", ["x", "x y"])
def test_the_zero_system(names):
    zero = system(names, *["0"] * len(names.split()))
    linear, quadratic = commuting_systems(zero, "linear"), commuting_systems(zero, "quadratic")
    assert ([g.trivial for g in linear.solutions], linear.complete, linear.every_g_commutes) == (["0"], True, False)
    assert linear.order == 2  # no equations at eps^4 and beyond are needed
    assert (quadratic.every_g_commutes, quadratic.dimension) == (True, [0, 3, 12][len(names.split())])


def test_no_budget_is_undecided_and_never_complete():
    member = random_member_with_eigenvalues([1, -2, 3], seed=7)
    systems = commuting_systems(member.chosen.system, effort=Budget(0))
    assert not systems.complete
    assert [g.trivial for g in systems.solutions[:3]] == TRIVIAL


def test_curved_families_are_reported_as_equations():
    """x' = x^2, y' = x y: the solutions fill a quadric cone, of which only some planes are linear families."""
    f = system("x y", "x^2", "x*y")
    systems = commuting_systems(f, "quadratic")
    assert (systems.complete, str(systems.verdict), systems.dimension) == (False, "undecided", 4)
    (sentence,) = systems.undecided
    assert sentence.endswith("b2*b3 - b1*b4 = 0")
    # The equation is right: a point of the cone in none of the families commutes, a point off it does not.
    on, off = ([fmpq(n) for n in weights] for weights in ((2, 3, 4, 6), (2, 3, 4, 7)))
    space = commuting_space(f, "quadratic")
    assert str(certify_field(f, field_at(space, on), Settings()).verdict) == "proved"
    assert str(certify_field(f, field_at(space, off), Settings()).verdict) == "refuted"


@pytest.mark.parametrize("below", [1, 2**20 + 7])
@pytest.mark.parametrize(
    ("f", "g"),
    [(["x*y", "-x^2"], ["y^2", "x"]), (["y", "x"], ["10^20*x", "10^20*y + x^2"]), (["y", "x"], ["10^20", "10^20*x*y"])],
)
def test_the_identity_of_a_family_is_bounded(f, g, below):
    family = SolutionComponent((ring(["b"]).gens()[0] / below,))
    space = SimpleNamespace(fields=[system("x y", *g)])
    equation, _ = check(_family_identity(system("x y", *f), space, family), differs=True)
    assert equation.bits >= log2(below)


def test_too_large_is_undecided_with_a_reason():
    large, middle, small = (
        commuting_systems(system(" ".join("abcdefghijkl"[:n]), "a^2", *["0"] * (n - 1)), "quadratic")
        for n in (12, 6, 4)
    )
    assert (large.complete, str(large.verdict), [g.trivial for g in large.solutions]) == (False, "undecided", TRIVIAL)
    assert "unknown coefficients" in large.undecided[0]
    assert (middle.dimension, len(middle.basis), middle.complete) == (None, 1, False)
    assert (small.dimension, small.complete) == (31, False)


def test_where_little_work_does_not_find_all_quadratic_fields_the_linear_ones_are_given_and_it_is_said(monkeypatch):
    f = system("x y", "x^2", "y^2")
    assert (commuting_systems(f).shape, commuting_systems(f).note) == ("quadratic", "")
    monkeypatch.setattr("kahanmaps.laboratory.symmetry.commuting.QUICK_UNITS", 1)
    systems = commuting_systems(f)
    assert (systems.shape, systems.complete) == ("linear", True)
    assert "were tried first" in systems.note
