"""One claim from start to end: proof where there is one, random points, an exact orbit, and that they agree.

Proof and experiment are independent ways to the same answer, so each guards the other: a proved claim that fails at
a point is a bug here, and is reported as one. A false claim may pass at random points, with the probability that the
bound states; where both sides can be multiplied out, what comes out decides.
"""

from __future__ import annotations

from kahanmaps.checks.claims import Evidence, Finding, Verdict, Witness
from kahanmaps.checks.decide import Identity, decide, fails_over_Q
from kahanmaps.checks.expand import NotEqual, expansion
from kahanmaps.checks.settings import OrbitRun, Settings, along


class Contradiction(AssertionError):
    """A theorem and an exact computation disagree: an error in kahanmaps, never in the input."""

    def __init__(self, message: str, witness: Witness | None = None) -> None:
        super().__init__(message)
        self.witness = witness


def judge(
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
        if decision.verdict is Verdict.REFUTED:
            raise Contradiction(f"{claim}: {proof.summary}, but it {decision.evidence.summary} {decision.witness}")
        if decision.evidence.data.get("poles_met") and decision.verdict is Verdict.UNDECIDED:
            # A theorem on a map that has no value anywhere, det(I - eps f') being zero for all x, says nothing.
            return Finding(claim, decision.verdict, decision.evidence, (), None, formula, source, control)
        verdict, evidence, witness = Verdict.PROVED, proof, None
        if decision.verdict is Verdict.SUPPORTED:
            also.append(decision.evidence)
    elif decision.verdict is Verdict.SUPPORTED and not control:
        try:
            expanded = expansion(identity)
        except NotEqual as error:
            refutation = fails_over_Q(identity, settings.seed)
            verdict, evidence = Verdict.REFUTED, Evidence("expansion", str(error))
            if refutation is not None:
                evidence, witness = refutation.evidence, refutation.witness
        else:
            if expanded is not None:
                verdict, evidence = Verdict.PROVED, expanded
                also.append(decision.evidence)
    if orbit is not None:
        experience, failure = along(identity, orbit)
        also.append(experience)
        if failure is not None and verdict is not Verdict.REFUTED:
            if verdict is Verdict.PROVED:
                raise Contradiction(f"{claim}: {evidence.summary}, but it {experience.summary} {failure}")
            verdict, evidence, witness = Verdict.REFUTED, experience, failure
    return Finding(claim, verdict, evidence, tuple(also), witness, formula, source, control)
