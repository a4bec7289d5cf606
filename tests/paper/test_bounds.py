"""Bounds for the letters and the claims of the paper: never below the truth.

A bound is compared with the numerator, in lowest terms, of what it is a bound of: letters, and whole claims on broken
input, where the two sides differ, written out as rational functions of x and eps.
"""

from bound_helpers import covers, lowest, true_size
from helpers import together
from paper.members import member, verifier_of

from kahanmaps.paper import objects_over
from kahanmaps.paper.controls import broken
from kahanmaps.paper.registry import Kind, claims
from kahanmaps.paper.verify import ClaimAtPoints

# The letters of the paper

LETTERS = {
    "f": lambda o: o.fx,
    "f'": lambda o: o.df,
    "x~": lambda o: o.x_tilde,
    "f'(x~)": lambda o: o.jac(o.f, o.x_tilde),
    "Phi(Phi(x))": lambda o: o.step(o.f, o.x_tilde),
    "dPhi": lambda o: o.jacobian_of_step(o.f, o.x),
    "det": lambda o: o.det(o.minus_eps_jac(o.f, o.x)),
    "H": lambda o: o.H(o.x),
    "H_1": lambda o: o.H_tilde_(1, o.x),
    "H~": lambda o: o.H_tilde(o.x),
    "modified H": lambda o: o.modified_H(o.x),
    "Pi": lambda o: o.Pi(o.x),
    "Pi^-1": lambda o: o.inverse(o.Pi(o.x)),
    "p_0": lambda o: o.p0(o.x),
    "q_1": lambda o: o.q(0, o.x),
    "s_1": lambda o: o.s(0, o.x),
    "P_0": lambda o: o.P0(o.x),
    "Q_1": lambda o: o.Q(0, o.x),
    "K~_1": lambda o: o.integral(o.g_(0), o.x),
    "slope of H~": lambda o: o.slope(lambda o, x: o.H_tilde(x), o.x, o.vector("v")),
    "inhomogeneous x~": lambda o: o.inhomogeneous().step(o.inhomogeneous().f, o.x),
}
SMALL = LETTERS.keys() - {"Phi(Phi(x))", "Pi^-1", "inhomogeneous x~", "slope of H~", "dPhi"}


def both(name, letter):
    """A letter over rational functions and over bounds."""
    found = member(name)
    bounds = objects_over.bound_objects(found, None, 3)
    bound = letter(bounds)
    functions = objects_over.member_functions(found, sorted(bounds.used - {"roots"}), None, 10**9, 3)
    value = letter(functions)
    return (bound.entry if hasattr(bound, "entry") else bound), (
        value.entries() if hasattr(value, "entries") else [value]
    )


@together("letter, name", [*((letter, "m=1") for letter in LETTERS), *((letter, "m=2, split") for letter in SMALL)])
def test_a_letter_is_bounded(letter, name):
    bound, entries = both(name, LETTERS[letter])
    assert all(covers(bound, entry) for entry in entries)


def test_the_bound_of_a_letter_is_not_far_from_the_truth():
    bound, entries = both("m=1", LETTERS["x~"])
    degrees = [true_size(lowest(entry)[0])[0] for entry in entries]
    assert max(degrees) <= bound.above.degree <= 3 * max(degrees)


# Claims


def is_short(claim):
    """Whether it speaks of x and two more vectors at most: equations for systems of many letters are too long here."""
    bounds = objects_over.bound_objects(member("m=1"), None, 3)
    for _ in claim.function(bounds):
        pass
    return len(bounds.used - {"roots"}) <= 3


BROKEN = [
    (claim, control)
    for claim in claims()
    if claim.kind is Kind.EQUAL and claim.makes_sense(1) and is_short(claim)
    for control in claim.breaks
    if control in ("eps", "map", "B")
]


def difference_sizes(claim, o):
    """The numerators and denominators in lowest terms of the differences of all pairs of a claim."""
    found = []
    for left, right in claim.function(o):
        difference = left - right
        entries = difference.entries() if hasattr(difference, "entries") else [difference]
        found += [lowest(entry) for entry in entries if not entry.above.is_zero()]
    return found


@together("claim, control", BROKEN)
def test_the_equation_that_a_broken_claim_amounts_to_is_bounded(claim, control, monkeypatch):
    found = member("m=1")
    examined = verifier_of(found)
    bounds = broken(control, objects_over.bound_objects(found, None, 3))
    monkeypatch.setattr(examined, "bounds", lambda: bounds)
    statement = ClaimAtPoints(examined, claim)
    needs, (equation, poles) = statement.needs, statement.bound
    functions = objects_over.member_functions(found, sorted(needs - {"roots"}), None, 10**9, 3)
    sizes = difference_sizes(claim, broken(control, functions))
    for above, below in sizes:
        assert true_size(above)[0] <= equation.degree
        # A denominator that occurs to some power must not be zero once.
        assert sum(true_size(factor)[0] for factor, _ in below.factor_squarefree()[1]) <= poles
        assert true_size(above)[1] <= equation.bits
