"""The claims of the paper, one by one: how they are registered, that they hold, and what makes them fail.

Every claim is evaluated as it stands on members with every kind of spectrum, at a random point over GF(p), where a
false one holds with probability below 2^-50; sides are compared here, not by the library. Every control that a claim
names has to refute it on every one of these members, but for m = 1, where some hypotheses cannot be broken.
"""

import random
from collections import Counter
from itertools import pairwise

import pytest
from helpers import quick, together
from paper.members import LARGE_SPECTRA, SPECTRA, member, point, values

from kahanmaps.algebra.fields import QQ
from kahanmaps.errors import SingularMatrix, SingularStep
from kahanmaps.family.draw import draw_with_eigenvalues
from kahanmaps.paper import objects_over
from kahanmaps.paper.controls import CONTROLS, broken
from kahanmaps.paper.registry import SECTIONS, Claim, Kind, claim, claims

QUICK = ["m=1", "m=2, irreducible", "m=2, complex", "m=3, split", "m=3, partly split"]
FEW = ["m=1", "m=2, irreducible", "m=3, split"]
LARGER = [name for name in (*SPECTRA, *LARGE_SPECTRA) if name not in QUICK]
CLAIMS = claims()
RIGHT = [found for found in CLAIMS if not found.misprint]
MISPRINTS = [found for found in CLAIMS if found.misprint]


# The list


def those(condition):
    """The keys of the claims for which something is the case."""
    return [found.key for found in CLAIMS if condition(found)]


def test_every_claim_says_what_it_is_and_where_it_stands():
    assert those(lambda claim: not (claim.title and claim.place and claim.formula)) == []


def test_every_claim_stands_in_a_section():
    assert those(lambda claim: claim.section not in SECTIONS) == []


def test_every_claim_names_controls_that_exist_and_each_of_them_once():
    assert those(lambda claim: not set(claim.breaks) <= set(CONTROLS)) == []
    assert those(lambda claim: len(set(claim.breaks)) != len(claim.breaks)) == []


def test_every_claim_that_is_right_names_a_control():
    assert those(lambda claim: not claim.misprint and not claim.breaks) == []


def test_some_control_of_a_claim_applies_to_the_least_m_for_which_it_makes_sense():
    def none_applies(claim):
        least = claim.only_m or claim.least_m
        return not claim.misprint and all(CONTROLS[name].least_m > least for name in claim.breaks)

    assert those(none_applies) == []


def test_a_claim_has_no_more_blocks_in_its_proof_than_the_member_has():
    assert those(lambda claim: any(not 1 <= claim.blocks_for_proof(m) <= m for m in range(1, 9))) == []


def test_keys_are_unique():
    assert [key for key, count in Counter(found.key for found in CLAIMS).items() if count > 1] == []


def test_all_sections_have_claims():
    assert {found.section for found in CLAIMS} == set(SECTIONS) == set(range(1, 11))


def test_claims_come_in_the_order_of_the_sections():
    assert all(first.section <= second.section for first, second in pairwise(CLAIMS))


def test_the_section_of_a_claim_is_that_of_its_file():
    for found in CLAIMS:
        assert found.function.__module__ == f"kahanmaps.paper.claims.{SECTIONS[found.section][1]}"


def test_every_control_is_named_by_a_claim():
    assert {name for found in CLAIMS for name in found.breaks} == set(CONTROLS)


def test_the_misprints_are_those_documented():
    assert {found.key for found in MISPRINTS} == {
        "two-forms-of-the-integral-for-any-cubic",
        "brackets-as-printed",
        "dimension-of-the-cubics-for-any-A",
        "independence-for-non-scalar-A",
        "even-terms-as-printed",
        "last-display-as-printed",
        "linear-system-as-printed",
    }


def test_a_second_claim_of_the_same_name_is_refused():
    existing = CLAIMS[0]
    with pytest.raises(ValueError, match=f"two claims have the name {existing.key}"):
        claim(existing.place, existing.label, existing.formula, breaks=())(existing.function)


def test_a_claim_for_one_m_makes_sense_for_that_m_only():
    only = Claim("key", 1, "place", "label", "formula", lambda o: [], (), only_m=3)
    assert [m for m in range(1, 9) if only.makes_sense(m)] == [3]
    assert only.range_of_m == "m = 3"


def test_a_claim_for_large_m_makes_sense_from_there_on():
    large = Claim("key", 1, "place", "label", "formula", lambda o: [], (), least_m=2)
    assert [m for m in range(1, 5) if large.makes_sense(m)] == [2, 3, 4]
    assert large.range_of_m == "m >= 2"


# Claims hold


def compared(claim, o):
    """For every pair of a claim, whether its sides are equal; compared entry by entry."""
    found = []
    for left, right in claim.function(o):
        a, b = values(left), values(right)
        assert len(a) == len(b)
        found.append(a == b)
    return found


def members_of(claim, spectra):
    return [name for name in spectra if claim.makes_sense(member(name).m)]


def failing(claim, spectra):
    """The members on which a claim does not do what it says, and those for which it says nothing."""
    names = members_of(claim, spectra)
    wanted = claim.kind is not Kind.DIFFERENT
    outcomes = {name: compared(claim, point(name)) for name in names}
    return [name for name, found in outcomes.items() if not found or any(equal is not wanted for equal in found)]


@together("claim", RIGHT)
def test_a_claim_holds_for_every_kind_of_spectrum(claim):
    assert members_of(claim, QUICK)
    assert failing(claim, QUICK) == []


@pytest.mark.slow
@pytest.mark.thorough
@together("claim", RIGHT)
def test_a_claim_holds_for_further_members(claim):
    assert failing(claim, LARGER) == []


@together("claim", MISPRINTS)
def test_a_misprint_fails_as_printed(claim):
    names = members_of(claim, SPECTRA)
    assert names
    assert failing(claim, SPECTRA) == names


# Negative controls


def outcome(claim, name, control):
    """Whether a claim "fails" or "holds" at a point of a member that a control has broken; None where undefined."""
    for number in range(3):
        try:
            found = compared(claim, broken(control, point(name, number)))
        except (SingularStep, SingularMatrix, ZeroDivisionError):
            continue
        wanted = claim.kind is not Kind.DIFFERENT
        return "holds" if all(equal is wanted for equal in found) else "fails"
    return None


@pytest.mark.parametrize("spectra", quick((FEW, QUICK, LARGER), (FEW,)), ids=["few", "some", "further"])
@together("claim", RIGHT)
def test_every_control_that_a_claim_names_refutes_it(claim, spectra):
    idle = [
        (name, control, found)
        for name in members_of(claim, spectra)
        for control in claim.breaks
        if member(name).m >= max(2, CONTROLS[control].least_m) or claim.only_m
        if (found := outcome(claim, name, control)) != "fails"
    ]
    assert idle == []


@together("claim", [found for found in RIGHT if found.makes_sense(1)])
def test_some_control_refutes_a_claim_for_m_1(claim):
    applicable = [control for control in claim.breaks if CONTROLS[control].least_m == 1]
    assert "fails" in [outcome(claim, "m=1", control) for control in applicable]


def test_what_a_control_changes_is_not_what_the_point_is():
    for control in CONTROLS:
        o = broken(control, point("m=3, split"))
        assert o.x == point("m=3, split").x
        assert o.eps == point("m=3, split").eps


def test_a_control_leaves_the_unbroken_objects_as_they_were():
    o = point("m=2, split")
    before = (o.A, o.J, o.third, o.eps, o.roots, o.step_eps, o.minus, o.method)
    for control in CONTROLS:
        broken(control, o)
    assert (o.A, o.J, o.third, o.eps, o.roots, o.step_eps, o.minus, o.method) == before


@pytest.mark.parametrize(
    ("key", "values_"),
    [
        ("brackets-as-printed", [(0, 1), (0, 1), (1, 1)]),  # {p0,q0} = {q0,q0} = 0 and one that is as printed
        ("independence-for-non-scalar-A", [(2, 3)]),  # the gradients for A = B_1, whose minimal polynomial has degree 2
        (
            "dimension-of-the-cubics-for-any-A",
            [(24, 12)],
        ),  # two equal roots of three: 20 cubics in four variables and 4
    ],
)
def test_misprints_fail_by_these_numbers(key, values_):
    drawn = draw_with_eigenvalues([1, -2, 3], seed=7)
    roots = objects_over.rational_roots(drawn)
    for seed in range(2):
        objects = objects_over.point_over(drawn, QQ, roots, None, random.Random(seed), 3)
        (misprint,) = [claim for claim in claims() if claim.key == key]
        assert list(misprint.function(objects)) == values_
