"""Bounds for the letters and the claims of the paper: never below the truth.

A bound is compared with the numerator, in lowest terms, of what it is a bound of: letters, and whole claims on broken
input, where the two sides differ, written out as rational functions of x and eps.
"""

from bound_helpers import lowest, true_size
from helpers import together
from paper.members import member, verifier_of

from kahanmaps.paper import specialize
from kahanmaps.paper.controls import broken
from kahanmaps.paper.registry import ClaimKind, claims
from kahanmaps.paper.verify import ClaimAtPoints

# Claims


def is_short(claim):
    """Whether it speaks of x and two more vectors at most: equations for systems of many letters are too long here."""
    bounds = specialize.bound_objects(member("m=1"), None, 3)
    for _ in claim.function(bounds):
        pass
    return len(bounds.used - {"roots"}) <= 3


BROKEN = [
    (claim, control)
    for claim in claims()
    if claim.kind is ClaimKind.EQUAL and claim.makes_sense(1) and is_short(claim)
    for control in claim.breaks
    if control in ("eps", "map", "B")
]


def difference_sizes(claim, o):
    """The numerators and denominators in lowest terms of the differences of all pairs of a claim."""
    results = []
    for left, right in claim.function(o):
        difference = left - right
        entries = difference.entries() if hasattr(difference, "entries") else [difference]
        results += [lowest(entry) for entry in entries if not entry.numerator.is_zero()]
    return results


@together("claim, control", BROKEN)
def test_the_equation_that_a_broken_claim_amounts_to_is_bounded(claim, control, monkeypatch):
    result = member("m=1")
    examined = verifier_of(result)
    bounds = broken(control, specialize.bound_objects(result, None, 3))
    monkeypatch.setattr(examined, "bounds", lambda: bounds)
    statement = ClaimAtPoints(examined, claim)
    needs, (equation, poles) = statement.needs, statement.bound
    functions = specialize.member_functions(result, sorted(needs - {"roots"}), None, 10**9, 3)
    sizes = difference_sizes(claim, broken(control, functions))
    for above, below in sizes:
        assert true_size(above)[0] <= equation.degree
        # A denominator that occurs to some power must not be zero once.
        assert sum(true_size(factor)[0] for factor, _ in below.factor_squarefree()[1]) <= poles
        assert true_size(above)[1] <= equation.bits
