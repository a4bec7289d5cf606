"""The claims of the paper, one by one: how they are registered, that they hold, and what makes them fail.

Every claim is evaluated as it stands on members with every kind of spectrum, at a random point over GF(p), where a
false one holds with probability below 2^-50; sides are compared here, not by the library. Every control that a claim
names has to refute it on every one of these members, but for m = 1, where some hypotheses cannot be broken.
Letters for which the library has code of its own are what the formulas of the paper give.
"""

import random

import pytest
from flint import fmpq
from helpers import together
from paper.members import LARGE_SPECTRA, SPECTRA, member, point, values

from kahanmaps.algebra.fields import QQ
from kahanmaps.errors import SingularMatrix, SingularStep
from kahanmaps.paper import specialize
from kahanmaps.paper.controls import CONTROLS, broken
from kahanmaps.paper.registry import ClaimKind, claims

QUICK = ["m=1", "m=2, irreducible", "m=3, split"]
LARGER = [name for name in (*SPECTRA, *LARGE_SPECTRA) if name not in QUICK]
CLAIMS = claims()
RIGHT = [claim for claim in CLAIMS if not claim.misprint]
MISPRINTS = [claim for claim in CLAIMS if claim.misprint]


def test_every_claim_names_a_control_that_applies_to_the_least_m_for_which_it_makes_sense():
    def applies(claim):
        return any(CONTROLS[name].least_m <= (claim.only_m or claim.least_m) for name in claim.controls)

    assert [claim.key for claim in RIGHT if not applies(claim)] == []


def test_every_control_is_named_by_a_claim():
    assert {name for claim in CLAIMS for name in claim.controls} == set(CONTROLS)


def test_the_misprints_are_those_documented():
    assert {entry.key for entry in MISPRINTS} == {
        "two-forms-of-the-integral-for-any-cubic",
        "brackets-as-printed",
        "dimension-of-the-cubics-for-any-A",
        "independence-for-non-scalar-A",
        "even-terms-as-printed",
        "last-display-as-printed",
        "linear-system-as-printed",
    }


def compared(claim, o):
    """For every pair of a claim, whether its sides are equal; compared entry by entry."""
    pairs = [(values(left), values(right)) for left, right in claim.function(o)]
    assert all(len(a) == len(b) for a, b in pairs)
    return [a == b for a, b in pairs]


def members_of(claim, spectra):
    return [name for name in spectra if claim.makes_sense(member(name).m)]


def failing(claim, spectra):
    """The members on which a claim does not do what it says, and those for which it says nothing."""
    names = members_of(claim, spectra)
    expected = claim.kind is not ClaimKind.DIFFERENT
    outcomes = [(name, compared(claim, point(name))) for name in names]
    return [name for name, equal in outcomes if not equal or not all(one is expected for one in equal)]


spectra = pytest.mark.parametrize("spectra", [QUICK, pytest.param(LARGER, marks=pytest.mark.slow)], ids=len)


@spectra
@together("claim", RIGHT)
def test_a_claim_holds_for_every_kind_of_spectrum(claim, spectra):
    assert members_of(claim, spectra) or spectra is LARGER
    assert failing(claim, spectra) == []


@together("claim", MISPRINTS)
def test_a_misprint_fails_as_printed(claim):
    names = members_of(claim, SPECTRA)
    assert names
    assert failing(claim, SPECTRA) == names


def outcome(claim, name, control):
    """Whether a claim "fails" or "holds" at a point of a member that a control has broken; None where undefined."""
    for number in range(3):
        try:
            result = compared(claim, broken(control, point(name, number)))
        except (SingularStep, SingularMatrix, ZeroDivisionError):
            continue
        expected = claim.kind is not ClaimKind.DIFFERENT
        return "holds" if all(equal is expected for equal in result) else "fails"
    return None


def idle_controls(claim, spectra, first_alone):
    """The controls that a claim names and that do not refute it: on the first member that can show it, or on all."""
    results = []
    for control in claim.controls:
        least = max(2, CONTROLS[control].least_m)
        able = [name for name in members_of(claim, spectra) if member(name).m >= least or claim.only_m]
        names = able[: 1 if first_alone else None]
        results += [(name, control) for name in names if outcome(claim, name, control) != "fails"]
    return results


@spectra
@together("claim", RIGHT)
def test_every_control_that_a_claim_names_refutes_it(claim, spectra):
    members = QUICK if spectra is QUICK else (*QUICK, *LARGER)
    assert idle_controls(claim, members, first_alone=spectra is QUICK) == []


@together("claim", [entry for entry in RIGHT if entry.makes_sense(1)])
def test_some_control_refutes_a_claim_for_m_1(claim):
    applicable = [control for control in claim.controls if CONTROLS[control].least_m == 1]
    assert "fails" in [outcome(claim, "m=1", control) for control in applicable]


def test_a_control_leaves_the_unbroken_objects_as_they_were():
    o = point("m=2, split")
    before = (o.A, o.J, o.d3H, o.eps, o.roots, o.step_eps, o.B_at_root, o.method)
    for control in CONTROLS:
        broken(control, o)
    assert (o.A, o.J, o.d3H, o.eps, o.roots, o.step_eps, o.B_at_root, o.method) == before


# Letter -> what gives it, for every index i of a root.
LETTERS = {
    "H_i": lambda o, i: o.H(o.x, i),
    "nabla H_i": lambda o, i: o.gradient_of_chain(i, o.x),
    "f_i": lambda o, i: o.value(o.f_i(i), o.x),
    "f_i'": lambda o, i: o.jac(o.f_i(i), o.x),
    "B_i": lambda o, i: o.B(i),
    "B_s": lambda o, i: o.B_signs([-1 if j <= i else 1 for j in o.each]),
    "x~": lambda o, i: o.step(o.f, o.x, times=i + 1),
    "dPhi": lambda o, i: o.jacobian_of_step(o.f_i(i), o.x),
    "H~": lambda o, i: o.H_tilde(o.x),
    "K~_i": lambda o, i: o.integral(o.g_i(i), o.x),
    "modified H": lambda o, i: o.modified_H(o.x),
    "Pi": lambda o, i: o.Pi(o.x),
}


@pytest.mark.parametrize("name", ["m=2, split", "m=3, split"])
@pytest.mark.parametrize("letter", LETTERS)
def test_a_letter_of_the_library_is_that_of_the_formulas(name, letter):
    result = member(name)
    roots = specialize.rational_roots(result)
    library = specialize.point_over(result, QQ, roots, fmpq(1, 7), random.Random(name), 3)
    formulas = library.replace(base=None, known_chi=None, draw=library.vector)
    other = formulas.replace(d3H=library.d3H * fmpq(2), roots=roots[::-1], draw=library.vector)
    ours, theirs, wrong = ([values(LETTERS[letter](o, i)) for i in o.each] for o in (library, formulas, other))
    assert ours == theirs
    assert ours != wrong
