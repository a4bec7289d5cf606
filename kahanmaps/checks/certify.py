"""Certification of identities: by a theorem, by expansion, at random points, and along an exact orbit.

Proof and experiment are independent: if a proved claim fails at a point, this program contains an error, and reports it
as such. A false claim may pass at random points; the evidence bounds the probability of this error. If both sides can
be expanded, the expansion decides: the code that evaluates an identity at points over Q and GF(p) then runs over the
field of rational functions. A budget bounds the number of products of two terms in this computation.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kahanmaps.algebra.functions import DEFAULT_BUDGET, BudgetExceeded, FunctionField
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Witness
from kahanmaps.checks.decide import Decision, Identity, decide, fails_over_Q
from kahanmaps.checks.settings import OrbitRun, Settings, try_along_orbit

METHOD = "expansion"
# In higher dimensions the budget for products of two terms never suffices for an expansion.
MAX_DIMENSION = 6


class Contradiction(AssertionError):
    """A theorem and an exact computation contradict each other: an error in kahanmaps, not in the input."""

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
    certified: Mapping[str, Any] | None = None,
) -> Finding:
    """Certify a claim that is stated as an identity, and return the finding.

    Args:
        claim: the claim as a sentence.
        identity: the claim as an identity of rational functions.
        settings: the seed and the error bound for random points.
        proof: the evidence of a theorem that implies the claim; without it, the identity is expanded if possible.
        orbit: an exact orbit; the identity is also tested at its points.
        formula, source: the formula of the claim and its reference in the literature, both for the report.
        control: whether the claim is a control, i.e. expected to be refuted; a control is not expanded.
        certified: the arguments with which `certificate` writes a proof of the claim.

    Returns:
        The finding: proved by the theorem or by expansion, otherwise supported, refuted (with a witness) or undecided.

    Raises:
        Contradiction: if a proved claim fails at a point; then kahanmaps contains an error.
    """
    decision = decide(identity, settings.seed, settings.error_bits if proof is None else 1)
    also: list[Evidence] = []
    verdict, evidence, witness = decision.verdict, decision.evidence, decision.witness
    if proof is not None:
        if decision.verdict is Certainty.REFUTED:
            raise Contradiction(f"{claim}: {proof.summary}, but it {decision.evidence.summary} {decision.witness}")
        if decision.evidence.data.get("poles_met") and decision.verdict is Certainty.UNDECIDED:
            # If det(I - eps f') = 0 for all x, the map is defined nowhere, and a theorem says nothing about it.
            verdict, evidence = decision.verdict, decision.evidence
            return Finding(claim, verdict, evidence, (), None, formula, source, control, certified=certified or {})
        verdict, evidence, witness = Certainty.PROVED, proof, None
        if decision.verdict is Certainty.SUPPORTED:
            also.append(_without_bound(decision.evidence))
    elif not control:
        expanded_decision = try_expand(identity, decision, settings.seed)
        verdict, evidence, witness = expanded_decision.verdict, expanded_decision.evidence, expanded_decision.witness
        if verdict is Certainty.PROVED:
            also.append(_without_bound(decision.evidence))
    if orbit is not None:
        orbit_evidence, orbit_witness = try_along_orbit(identity, orbit)
        also.append(orbit_evidence)
        if orbit_witness is not None and verdict is not Certainty.REFUTED:
            if verdict is Certainty.PROVED:
                raise Contradiction(f"{claim}: {evidence.summary}, but it {orbit_evidence.summary} {orbit_witness}")
            verdict, evidence, witness = Certainty.REFUTED, orbit_evidence, orbit_witness
    also_tuple = tuple(also)
    return Finding(claim, verdict, evidence, also_tuple, witness, formula, source, control, certified=certified or {})


def _without_bound(evidence: Evidence) -> Evidence:
    """Return the evidence of random points without the probability of error, which does not apply to a proved claim."""
    summary = evidence.summary.partition("; false with probability")[0]
    return Evidence(evidence.method, summary, {k: v for k, v in evidence.data.items() if k != "error_bound"})


class NotEqual(ArithmeticError):
    """The expansions of the two sides of an identity differ."""


def expansion(identity: Identity, budget: int | None = None) -> Evidence | None:
    """Expand both sides of the identity as rational functions; return the evidence that they are equal.

    `budget` bounds the number of products of two terms; its default value is smaller for identities with long
    coefficients. Returns None if the expansion exceeds the budget. Raises NotEqual if the two sides differ.
    """
    if budget is None:
        if identity.dim > MAX_DIMENSION:
            return None
        # Products of long numbers take longer, in particular above 10,000 bits, where numbers exceed the caches.
        bits = identity.bound[0].bits
        budget = int(DEFAULT_BUDGET / max(1.0, bits / 256) / max(1.0, bits / 10_000))
        if identity.scales_with_eps:
            budget *= 2  # dimension 6 needs it: the integrals of paper_m3 take 130 million products
    names = [f"x{i + 1}" for i in range(identity.dim)] + ["eps"]
    modulus = None if identity.root is None else identity.root.polynomial.coeffs()
    if modulus is not None:
        names.append("root")
    field = FunctionField(names, budget, modulus=modulus)
    eps = field.variables[identity.dim] if identity.eps is None else field.convert(identity.eps)
    if identity.scales_with_eps:
        eps = field.one  # eps x is renamed x: one variable fewer
    try:
        sides = identity.at(field, field.variables[: identity.dim], eps)
        if sides is None:
            return None
        left, right = sides
        if len(left) != len(right) or not all(field.equal(a, b) for a, b in zip(left, right, strict=True)):
            raise NotEqual("the two sides, expanded, are different rational functions")
    except BudgetExceeded:
        return None
    scope_text = " of x, multiplied out"
    if identity.has_eps:
        scope_text = f" of {'x and eps' if identity.eps is None else f'x, for eps = {identity.eps}'}, multiplied out"
    return Evidence(
        METHOD,
        f"both sides are the same rational function{f', {identity.scope}' if identity.scope else scope_text}",
        {"products_of_terms": budget - field.budget, "eps": "every" if identity.eps is None else str(identity.eps)},
    )


def try_expand(identity: Identity, decision: Decision, seed: int, budget: int | None = None) -> Decision:
    """Expand an identity that `decision` calls supported; return the new decision, or `decision` if there is none."""
    if decision.verdict is not Certainty.SUPPORTED:
        return decision
    try:
        expansion_evidence = expansion(identity, budget)
    except NotEqual as error:
        return fails_over_Q(identity, seed) or Decision(Certainty.REFUTED, Evidence(METHOD, str(error)))
    return decision if expansion_evidence is None else Decision(Certainty.PROVED, expansion_evidence)
