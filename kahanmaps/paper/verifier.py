"""How one claim is verified: random points over GF(p), proof, exact points, and its controls.

What is common to a given member and to the member in general; `verify.py` has the two.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any, cast

from kahanmaps.algebra.bounds import BoundField, Size, bound_of
from kahanmaps.algebra.fields import QQ
from kahanmaps.checks.claims import Evidence, Finding, Verdict, Witness
from kahanmaps.checks.decide import Decision, Trial, decide
from kahanmaps.checks.judge import Contradiction
from kahanmaps.checks.settings import Settings
from kahanmaps.errors import InputError
from kahanmaps.paper.controls import CONTROLS, broken
from kahanmaps.paper.evaluate import UNDEFINED, Outcome, evaluate, witness_of
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import SECTIONS, Claim, Kind, claims

_POLES = 40
_POINTS = 4  # for statements that something differs, or has full rank
_LARGE = 5  # from this m on, controls are looked at over GF(p) first


@dataclass(frozen=True)
class VerifyOptions:
    """What to verify: sections (None: all), the order of the series, bits for complex balls, controls instead."""

    sections: tuple[int, ...] | None = None
    order: int = 3
    ball_bits: int | None = None
    controls: bool = False
    beyond: bool = False  # the statements of section 10 that are asked of variations, and no others

    def __post_init__(self) -> None:
        if not 1 <= self.order <= 20:
            raise InputError(f"found the order {self.order}, expected 1 to 20")
        if self.ball_bits is not None and not 32 <= self.ball_bits <= 100_000:
            raise InputError(f"found {self.ball_bits} bits for the balls, expected 32 to 100000")
        for section in self.sections or ():
            if section not in SECTIONS:
                raise InputError(
                    f"found the section {section}, expected 1 to {max(SECTIONS)} ({max(SECTIONS)}: beyond)"
                )


class Verifier(ABC):
    """What is common to a given member and to the universal one."""

    m: int

    def __init__(self, settings: Settings, options: VerifyOptions) -> None:
        self.settings = settings
        self.options = options
        self._points: dict[tuple[bool, int], PaperObjects | None] = {}

    def selected(self) -> list[Claim]:
        """The claims to look at."""
        wanted = self.options.sections
        made = [c for c in claims() if c.makes_sense(self.m) and bool(c.variation) is self.options.beyond]
        return [c for c in made if wanted is None or c.section in wanted]

    def findings(self) -> list[Finding]:
        """One finding a claim, or one a claim and control and a last one on all controls together."""
        found: list[Finding] = []
        without: list[str] = []
        selected = self.selected()
        for k, claim in enumerate(selected):
            self.settings.progress(f"{claim.place} ({k + 1} of {len(selected)})")
            if self.options.controls:
                controls = self.controls(claim)
                found += controls
                if self.outside(claim) is None and not any(finding.is_as_expected for finding in controls):
                    without.append(claim.key)
            else:
                found.append(self.verify_claim(claim))
            for objects in self._points.values():  # or they would remember the values of all claims
                if objects is not None:
                    objects.forget(("A_to", "B", "lagrange", "projector", "associate"))
        if self.options.controls:
            found.append(_last_word(found, without))
        return found

    # what the two kinds of verifiers fill in

    @abstractmethod
    def point(self, roots: bool, number: int) -> PaperObjects | None:
        """The number-th random point over GF(p); with the roots of chi, if need be, or None where they are not had."""

    @abstractmethod
    def exact_point(self, roots: bool, number: int) -> PaperObjects | None:
        """A random point over Q, or None where the roots of chi are not rational."""

    @abstractmethod
    def bounds(self) -> PaperObjects:
        """The objects as bounds."""

    def conjugates(self, roots: bool) -> int:
        """A bound for the degree of the field that the coefficients lie in."""
        return 1

    def outside(self, claim: Claim) -> str | None:
        """Why a claim does not apply, if it does not."""
        return None

    @abstractmethod
    def proof(self, claim: Claim, needs: set[str], equation: Size, poles: int) -> Evidence | None:
        """A proof, if there is one."""

    def also(self, claim: Claim) -> Iterable[Evidence]:
        """Further evidence."""
        return ()

    def what_is_special(self) -> str:
        """Why a statement for generic A and H may fail here."""
        return "its A or H is special"

    # one claim

    def verify_claim(self, claim: Claim) -> Finding:
        """The finding on one claim."""
        reason = self.outside(claim)
        if reason is not None:
            return self._finding(claim, Verdict.UNDECIDED, Evidence("outside the hypotheses", reason))
        if claim.kind is not Kind.EQUAL:
            return self._verify_existence(claim)
        statement = ClaimAtPoints(self, claim)
        decision = decide(statement, self.settings.seed, self.settings.error_bits)
        found = self._finding(claim, decision.verdict, decision.evidence, witness=decision.witness)
        if claim.misprint and decision.verdict is Verdict.SUPPORTED:
            silent = Evidence("special member", f"the misprint does not show for this member: {self.what_is_special()}")
            return replace(found, verdict=Verdict.UNDECIDED, evidence=silent, also=(found.evidence,), applies=False)
        if claim.misprint or decision.verdict is Verdict.REFUTED:
            return found
        try:
            proof = self.proof(claim, statement.needs, *statement.bound)
            if proof is None and claim.theorem:
                proof = Evidence("hypotheses", f"{claim.theorem} applies; its hypotheses hold by construction")
            also = tuple(self.also(claim))
        except Contradiction as error:
            text = f"{error}, although it {decision.evidence.summary}: the exact computation decides"
            return self._finding(claim, Verdict.REFUTED, Evidence("contradiction", text), witness=error.witness)
        if proof is not None:
            if decision.verdict is Verdict.SUPPORTED:
                return self._finding(claim, Verdict.PROVED, proof, (decision.evidence, *also))
            if decision.evidence.data.get("points") == 0:  # no prime, or none large enough, for a point
                return self._finding(claim, Verdict.PROVED, proof, also)
        return replace(found, also=(*found.also, *also))

    def _verify_existence(self, claim: Claim) -> Finding:
        """Claims that something differs somewhere, or has a certain rank: one point that shows it is a proof."""
        roots, outcome, tried = False, None, 0
        for number in range(_POLES):
            # Large matrices over Q are dear, and where there is a reason for the other side a point over GF(p) will do.
            modular = bool(claim.at_most) and self.m > 3
            objects = (None if modular else self.exact_point(roots, number)) or self.point(roots, number)
            if objects is None:
                text = "no prime was found at which chi splits into distinct factors"
                return self._finding(claim, Verdict.UNDECIDED, Evidence("random points over GF(p)", text))
            try:
                outcome = evaluate(claim, objects)
            except LookupError:  # the roots of chi are needed, and this field does not have them
                roots = True
                continue
            except UNDEFINED:
                continue
            tried += 1
            if outcome.holds and outcome.pairs:
                where = "an exact rational point" if objects.K is QQ else f"a point over {objects.K.name}"
                method = "exact rational point" if objects.K is QQ else "point over GF(p)"
                text = f"{'both sides differ' if claim.kind is Kind.DIFFERENT else 'attained'} at {where}"
                if claim.kind is Kind.ATTAINED and claim.at_most:
                    text += f", and it cannot be larger: {claim.at_most}"
                # Modulo p a rank may be smaller and an equation hold that does not hold over Q, but not conversely.
                is_proof = claim.kind is Kind.DIFFERENT or bool(claim.at_most) or objects.K is QQ
                verdict = Verdict.PROVED if is_proof else Verdict.SUPPORTED
                return self._finding(claim, verdict, Evidence(method, text, {"points": tried}))
            if tried >= _POINTS:
                break
        if outcome is None or not outcome.pairs:
            text = f"the claim is not defined at any of {_POLES} random points"
            return self._finding(claim, Verdict.UNDECIDED, Evidence("random points over GF(p)", text))
        text = "both sides agree" if claim.kind is Kind.DIFFERENT else "not attained"
        if claim.in_general:
            special = f"stated in general; for this member {text} at {tried} random points: {self.what_is_special()}"
            evidence = Evidence("special member", special, {"points": tried})
            return replace(self._finding(claim, Verdict.UNDECIDED, evidence), applies=False)
        evidence = Evidence("random points", f"{text} at each of {tried} random points", {"points": tried})
        return self._finding(claim, Verdict.REFUTED, evidence, witness=witness_of(outcome))

    def controls(self, claim: Claim) -> list[Finding]:
        """The claim on broken input, one finding for every control that it names: each is expected to be refuted."""
        if claim.misprint:
            return [self.verify_claim(claim)]
        found = []
        for name in claim.breaks:
            if self.m < CONTROLS[name].least_m or self.outside(claim) is not None:
                continue
            outcome = self._broken(claim, name)
            text = f"control {name}: {CONTROLS[name].breaks}"
            if outcome is None:
                verdict, evidence = Verdict.UNDECIDED, Evidence("control", f"{text}; not defined, or no roots of chi")
            elif outcome.holds or not outcome.pairs:
                verdict, evidence = Verdict.SUPPORTED, Evidence("control", f"{text}; the claim holds all the same")
            else:
                field = outcome.objects.K.name
                verdict, evidence = (
                    Verdict.REFUTED,
                    Evidence("control", f"{text}; fails at an exact point over {field}"),
                )
            finding = self._finding(claim, verdict, evidence, witness=witness_of(outcome) if outcome else None)
            place = {**finding.place, "breaks": name, "broken": CONTROLS[name].breaks}
            found.append(replace(finding, control=True, place=place))
        # In low dimension some hypotheses always hold (for m = 1 every A is scalar), and their controls are idle.
        return [finding for finding in found if finding.is_as_expected] or found

    def _broken(self, claim: Claim, name: str) -> Outcome | None:
        """The claim on input broken by a control, at a point at which it fails; else the last outcome.

        One point refutes an equation, a rational one unless m is large; that something differs, exists or has a certain
        rank is refuted where several points in a row do not show it. Over Q ranks and steps of broken maps, where
        nothing cancels, take minutes from m = 5 on.
        """
        at_one = claim.kind is Kind.EQUAL
        needed = 1 if at_one else _POINTS
        finds = (self.exact_point, self.point) if at_one and self.m < _LARGE else (self.point, self.exact_point)
        outcome, failed = None, 0
        for roots in (False, True):
            for find in finds:
                for number in range(_POINTS):
                    objects = find(roots, number)
                    if objects is None:
                        continue
                    try:
                        outcome = evaluate(claim, broken(name, objects))
                    except (*UNDEFINED, LookupError):
                        continue
                    if outcome.holds:
                        if claim.kind is not Kind.EQUAL:
                            return outcome
                        continue
                    failed += 1
                    if failed >= needed:
                        return outcome
        return outcome

    def _finding(
        self,
        claim: Claim,
        verdict: Verdict,
        evidence: Evidence,
        also: tuple[Evidence, ...] = (),
        witness: Witness | None = None,
    ) -> Finding:
        place = {
            "key": claim.key,
            "section": claim.section,
            "section_title": SECTIONS[claim.section][0],
            "place": claim.place,
            "label": claim.label,
            "makes_sense_for": claim.range_of_m,
            **({"misprint": claim.misprint} if claim.misprint else {}),
        }
        title = f"{claim.place}: {claim.title}" + (" (misprint)" if claim.misprint else "")
        source = "" if claim.section == 10 else f"petrera-suris-2016, {claim.place}"
        if claim.label:
            source += f" [{claim.label}]"
        return Finding(title, verdict, evidence, also, witness, claim.formula, source, bool(claim.misprint), place)


class ClaimAtPoints:
    """A claim as `decide` takes it: at the points of an verifier."""

    name = "claim"
    no_value = "a denominator seems to vanish identically"
    patience = _POLES

    def __init__(self, verifier: Verifier, claim: Claim) -> None:
        self._verifier, self._claim = verifier, claim
        bounds = verifier.bounds()
        self.bound = bound_of(cast(BoundField, bounds.K), claim.function(bounds))
        self.needs = bounds.used
        self._roots = "roots" in self.needs
        self.conjugates = verifier.conjugates(self._roots)

    @property
    def where(self) -> str:
        """What is assumed of the primes."""
        if self.conjugates == 1:
            return ""
        return " at which chi splits (of which at least half as many are assumed as Chebotarev's density gives)"

    def trials(self, seed: int) -> Iterator[Trial]:
        """The claim at one random point after the other."""
        for number in count():
            objects = self._verifier.point(self._roots, number)
            if objects is None:
                return
            try:
                outcome = evaluate(self._claim, objects)
            except UNDEFINED:
                yield Trial()
                continue
            if not outcome.holds:
                yield Trial(decision=self._refutation(outcome))
            elif not outcome.pairs:
                text = "it does not apply to this member: there is nothing to compare"
                yield Trial(decision=Decision(Verdict.UNDECIDED, Evidence("outside the hypotheses", text)))
            else:
                yield Trial(objects.K.characteristic)

    def data(self, undefined: int) -> dict[str, Any]:
        """What evidence says beside the bounds."""
        return {"splitting_field_degree_bound": self.conjugates, "undefined_at": undefined}

    def _refutation(self, outcome: Outcome) -> Decision:
        for number in range(12):
            objects = self._verifier.exact_point(self._roots, number)
            if objects is None:
                break
            try:
                exact = evaluate(self._claim, objects)
            except (*UNDEFINED, LookupError):
                continue
            if not exact.holds:
                evidence = Evidence("exact rational point", "fails at a rational point, exactly")
                return Decision(Verdict.REFUTED, evidence, witness_of(exact))
        text = f"fails at a point over {outcome.objects.K.name}, where all denominators are units, so it fails over Q"
        if self._roots:
            text = f"fails at a point over {outcome.objects.K.name}, where chi splits"
        return Decision(Verdict.REFUTED, Evidence("point over GF(p)", text), witness_of(outcome))


def _last_word(found: Sequence[Finding], without: Sequence[str]) -> Finding:
    """Whether every claim that was looked at was refuted by some control."""
    claims_tried = len({finding.place["key"] for finding in found})
    claim = "every claim fails on some input that breaks one of its hypotheses"
    if without or not found:
        text = f"no control refutes {', '.join(without)}" if without else "no claim was looked at"
        return Finding(claim, Verdict.UNDECIDED, Evidence("controls", text, {"claims": claims_tried}))
    text = f"{len(found)} controls of {claims_tried} claims, all refuted at exact points"
    return Finding(claim, Verdict.PROVED, Evidence("controls", text, {"claims": claims_tried}))
