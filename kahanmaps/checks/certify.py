"""One claim from start to end: proof where there is one, random points, an exact orbit, and that they agree.

Proof and experiment are independent ways to the same answer, so each guards the other: a proved claim that fails at
a point is a bug here, and is reported as one. A false claim may pass at random points, with the probability that the
bound states; where both sides can be multiplied out, what comes out decides: the code that evaluates an identity at
points over Q and GF(p) runs over the field of rational functions, as far as a budget on products of terms goes.
"""

from __future__ import annotations

from kahanmaps.algebra.functions import DEFAULT_BUDGET, BudgetExceeded, FunctionField
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Witness
from kahanmaps.checks.decide import Decision, Identity, decide, fails_over_Q
from kahanmaps.checks.settings import OrbitRun, Settings, along

METHOD = "expansion"
# Beyond this dimension the budget would only be spent in vain.
MAX_DIMENSION = 6


class Contradiction(AssertionError):
    """A theorem and an exact computation disagree: an error in kahanmaps, never in the input."""

    def __init__(self, message: str, witness: Witness | None = None) -> None:
        super().__init__(message)
        self.witness = witness


def certify(
    claim: str,
    identity: Identity,
    settings: Settings,
    proof: Evidence | None = None,
    orbit: OrbitRun | None = None,
    *,
    formula: str = "",
    source: str = "",
    control: bool = False,
) -> Finding:
    """The finding on one claim: proved by `proof` or by expansion, or decided at random points; tried along `orbit`."""
    decision = decide(identity, settings.seed, settings.error_bits if proof is None else 1)
    also: list[Evidence] = []
    verdict, evidence, witness = decision.verdict, decision.evidence, decision.witness
    if proof is not None:
        if decision.verdict is Certainty.REFUTED:
            raise Contradiction(f"{claim}: {proof.summary}, but it {decision.evidence.summary} {decision.witness}")
        if decision.evidence.data.get("poles_met") and decision.verdict is Certainty.UNDECIDED:
            # A theorem on a map that has no value anywhere, det(I - eps f') being zero for all x, says nothing.
            return Finding(claim, decision.verdict, decision.evidence, (), None, formula, source, control)
        verdict, evidence, witness = Certainty.PROVED, proof, None
        if decision.verdict is Certainty.SUPPORTED:
            also.append(_without_bound(decision.evidence))
    elif not control:
        settled = try_expand(identity, decision, settings.seed)
        verdict, evidence, witness = settled.verdict, settled.evidence, settled.witness
        if verdict is Certainty.PROVED:
            also.append(_without_bound(decision.evidence))
    if orbit is not None:
        experience, failure = along(identity, orbit)
        also.append(experience)
        if failure is not None and verdict is not Certainty.REFUTED:
            if verdict is Certainty.PROVED:
                raise Contradiction(f"{claim}: {evidence.summary}, but it {experience.summary} {failure}")
            verdict, evidence, witness = Certainty.REFUTED, experience, failure
    return Finding(claim, verdict, evidence, tuple(also), witness, formula, source, control)


def _without_bound(evidence: Evidence) -> Evidence:
    """Points at which a proved claim was tried as well: what is proved is not false with any probability."""
    held = evidence.summary.partition("; false with probability")[0]
    return Evidence(evidence.method, held, {k: v for k, v in evidence.data.items() if k != "error_bound"})


class NotEqual(ArithmeticError):
    """Both sides were expanded and differ."""


def expansion(identity: Identity, budget: int | None = None) -> Evidence | None:
    """The evidence that both sides are equal as rational functions; None where the budget is exceeded.

    `budget` bounds the products of terms; the default is smaller where coefficients are long.
    Raises NotEqual where both sides were expanded and differ.
    """
    if budget is None:
        if identity.dim > MAX_DIMENSION:
            return None
        # A product takes longer than in proportion to its bits once it has left the innermost caches.
        bits = identity.bound[0].bits
        budget = int(DEFAULT_BUDGET / max(1.0, bits / 256) / max(1.0, bits / 10_000))
    names = [f"x{i + 1}" for i in range(identity.dim)] + ["eps"]
    modulus = None if identity.root is None else identity.root.polynomial.coeffs()
    if modulus is not None:
        names.append("root")
    field = FunctionField(names, budget, modulus=modulus)
    eps = field.variables[identity.dim] if identity.eps is None else field.convert(identity.eps)
    try:
        sides = identity.at(field, field.variables[: identity.dim], eps)
        if sides is None:
            return None
        left, right = sides
        if len(left) != len(right) or not all(field.equal(a, b) for a, b in zip(left, right, strict=True)):
            raise NotEqual("the two sides, expanded, are different rational functions")
    except BudgetExceeded:
        return None
    scope = " of x, multiplied out"
    if identity.has_eps:
        scope = f" of {'x and eps' if identity.eps is None else f'x, for eps = {identity.eps}'}, multiplied out"
    return Evidence(
        METHOD,
        f"both sides are the same rational function{f', {identity.scope}' if identity.scope else scope}",
        {"products_of_terms": budget - field.budget, "eps": "every" if identity.eps is None else str(identity.eps)},
    )


def try_expand(identity: Identity, decision: Decision, seed: int, budget: int | None = None) -> Decision:
    """The decision at random points or, where these support a claim and both sides can be multiplied out, that."""
    if decision.verdict is not Certainty.SUPPORTED:
        return decision
    try:
        expanded = expansion(identity, budget)
    except NotEqual as error:
        return fails_over_Q(identity, seed) or Decision(Certainty.REFUTED, Evidence(METHOD, str(error)))
    return decision if expanded is None else Decision(Certainty.PROVED, expanded)
