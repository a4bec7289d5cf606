"""Verification of all claims of the paper, for one member of the family or for the generic member.

The methods of verification:

* *random points*: the claim is evaluated for the member over GF(p), where p is a random prime of 63 bits, at random x,
  eps and other arguments; if the claim contains the roots of chi, chi splits modulo p. A failure refutes the claim.
  Without a failure it is `supported`, with an error bound computed by evaluating it over degree bounds.
* *normal form*: the claim is evaluated over rational functions, for the normal form with indeterminate roots,
  coefficients, x and eps. This proves the claim for every member with distinct roots: over the splitting field of chi
  such a member is symplectically similar to a specialization (docs/mathematics.md); the hypotheses on a member are
  verified exactly.
* *formal proof*: the facts (5)-(12) about every quadratic system follow from identities of multilinear expressions,
  which are compared without coordinates (formal_proofs.py).
* *symbolic*: if the normal form does not apply, the claim is evaluated for this member with indeterminate x and eps.
* *exact*: claims without x, and claims about dimensions and ranks, are evaluated over Q.

In addition, claims about one block are evaluated exactly over Q[t]/chi, for all roots at once, and, if requested,
over complex balls.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial, reduce
from itertools import count, product
from typing import Any, cast

from flint import fmpq_poly

from kahanmaps.algebra.bounds import BoundField, CoefficientSize, bound_of
from kahanmaps.algebra.chance import derive_seed, random_prime_field
from kahanmaps.algebra.fields import CC, QQ
from kahanmaps.algebra.functions import BudgetExceeded
from kahanmaps.algebra.printing import format_number
from kahanmaps.checks.certify import Contradiction
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report, Witness
from kahanmaps.checks.decide import Decision, Trial, decide
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import BadPrime, InputError, PrecisionLost, counted
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.planar import normal_form
from kahanmaps.family.skew_hamiltonian import chi as chi_of
from kahanmaps.family.skew_hamiltonian import diagnosis, format_univariate
from kahanmaps.maps.convention import CONVENTION
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.paper import specialize
from kahanmaps.paper.controls import CONTROLS, broken
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import (
    SECTION_NAMES,
    SECTIONS,
    UNDEFINED,
    Claim,
    ClaimKind,
    claims,
    entries,
    evaluate,
    outcomes,
    same,
    witness_of,
)
from kahanmaps.version import __version__

MAX_M = 8  # largest m, half the dimension
# Maximal number of products of terms in a proof: enough for all claims up to m = 6; at m = 8 a few claims exceed it.
PROOF_BUDGET = 50_000_000
_MAX_INDETERMINATES = 64  # maximal number of indeterminates in a proof for one member
_MAX_UNDEFINED = 40  # after so many points at which it is undefined, a claim is given up
_POINT_COUNT = 4  # number of points for statements that objects differ or have full rank
_MIN_LARGE_M = 5  # for m >= 5, controls are evaluated over GF(p) first
NOTE_ON_PROOFS = (
    "proofs in normal form: the claim is an identity of rational functions in indeterminate roots of chi, coefficients "
    "of H, x and eps, multiplied out for so many planar blocks; it holds for every member with distinct roots, being "
    "symplectically similar to a specialization over the splitting field of chi (docs/mathematics.md)"
)
NOTE_ON_RANDOM_MEMBERS = (
    "random members: A = S^{-T} diag(L, L) S^T with random roots L and a random symplectic S, H = sum of "
    "random planar cubics, hidden by S; x and eps at random. Bounds are for the generic member"
)


@dataclass(frozen=True)
class VerifyOptions:
    """The options of `verify`: sections (None: all), order of series in eps^2, bits of complex balls, and controls."""

    sections: tuple[int, ...] | None = None
    order: int = 3
    ball_bits: int | None = None
    controls: bool = False  # whether the controls of the claims are evaluated instead of the claims
    beyond: bool = False  # only the statements of section 10 about variations

    def __post_init__(self) -> None:
        if not 1 <= self.order <= 20:
            raise InputError(f"found the order {self.order}, expected 1 to 20")
        if self.ball_bits is not None and not 32 <= self.ball_bits <= 100_000:
            raise InputError(f"found {self.ball_bits} bits for the balls, expected 32 to 100000")
        for section in self.sections or ():
            if section not in SECTIONS:
                names = ", ".join(f"{number}: {name}" for name, number in SECTION_NAMES.items())
                raise InputError(f"found the section {section}, expected 1 to {max(SECTIONS)} ({names})")


def verify(
    system: SystemLike | None = None,
    settings: Settings | None = None,
    options: VerifyOptions | None = None,
    *,
    m: int | None = None,
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
) -> Report:
    """Verify all claims of the paper, for a member of the family or for the generic member.

    Args:
        system: a member of the family, with m at most 8; None for the generic member.
        settings: eps (None: every eps, an indeterminate), the random seed and the error bound.
        options: the sections to be verified, the order of series, complex balls, and whether controls are evaluated.
        m: half the dimension of the generic member, 1 to 8, with random data over GF(p). The error bound is for the
            probability that a claim is false for it; a claim proved in normal form holds if the roots are distinct.
        eps: half the time step, an exact number that replaces the eps of the settings; not for the generic member.
        time_step, h: the time step 2 eps, instead of eps.

    Returns:
        A `Report` with one `Finding` for each claim, in the order of the paper. All verdicts but `supported` are exact.

    Raises:
        InputError: if the system is not of kind [family], and if m is not between 1 and 8.

    Source: petrera-suris-2016; schwartz-1980 for the bounds.

    >>> report = verify(m=2, options=VerifyOptions(sections=(6,)))
    >>> str(report.verdict), report.findings[1].claim
    ('proved', 'Theorem 9: The Kahan maps of any two associated vector fields commute')
    >>> report.findings[1].also[0].data["error_bound"]
    '2^-145'
    """
    settings, options = Settings.of(settings, eps, time_step, h), options or VerifyOptions()
    if (system is None) == (m is None):
        raise InputError("expected a member of the family, or m, half the dimension of the generic member")
    file = None
    if system is None:
        if m is None or not 1 <= m <= MAX_M:
            raise InputError(f"found m = {m}, expected 1 <= m <= {MAX_M}")
        if settings.eps is not None:
            raise InputError("found an eps, expected none: universal claims are for every eps")
        member = None
        context = {
            "version": __version__,
            "system": f"universal, m = {m}",
            "eps": "every",
            "time_step": "every",
            "convention": CONVENTION,
            "arithmetic": "exact",
            "seed": settings.seed,
            "error_bits": settings.error_bits,
            "m": m,
        }
    else:
        file = as_file(system)
        member = file.member
        if member is None:
            raise InputError(
                f"{file.name} is of kind [{file.kind}], expected one of kind [family]: the paper is about "
                "skew-Hamiltonian A and the cubics of its space ('kahanmaps family new' makes such files)"
            )
        if member.m > MAX_M:
            raise InputError(f"found a member with m = {member.m}, expected m <= {MAX_M}")
        if -1 in member.signs:
            member = FamilyMember(member.A, member.chosen.K)  # f_0 is now the system of the file
        context = {
            **settings.context([file]),
            "m": member.m,
            "chi": format_univariate(chi_of(member.A)),
            "factors": [str(factor) for factor in member.factors],
        }
    verifier = Verifier(member, member.m if member is not None else m or 0, settings, options, file)
    findings = verifier.findings()
    context |= {"order": options.order, "controls": options.controls}
    certified = {} if file is None or options.controls or options.beyond else settings.certified(file)
    return Report("verify", tuple(findings), context, verifier.notes(), certified=certified)


class Verifier:
    """Verifies claims at random points over GF(p), by proofs, at points over Q, and with controls.

    `member` is a given member, or None for the generic member; `m` is half the dimension.
    """

    def __init__(
        self,
        member: FamilyMember | None,
        m: int,
        settings: Settings,
        options: VerifyOptions,
        file: SystemFile | None = None,
    ) -> None:
        self.file, self.member, self.m, self.settings, self.options = file, member, m, settings, options
        self.roots = None if member is None else specialize.rational_roots(member)
        self._seed = settings.seed if member is None else derive_seed(settings.seed, member.A, member.H, settings.eps)
        self._points: dict[tuple[bool, int], PaperObjects | None] = {}  # by (must split, number of the random point)

    def findings(self) -> list[Finding]:
        """Return a finding for each claim; with controls, a finding for each control of a claim, and one for all."""
        sections = self.options.sections
        applicable_claims = [c for c in claims() if c.makes_sense(self.m) and bool(c.variation) is self.options.beyond]
        selected_claims = [c for c in applicable_claims if sections is None or c.section in sections]
        findings: list[Finding] = []
        unrefuted_keys: list[str] = []
        for k, claim in enumerate(selected_claims):
            self.settings.progress(f"{claim.place} ({k + 1} of {len(selected_claims)})")
            if self.options.controls:
                controls = self.controls(claim)
                findings += controls
                if self.why_outside(claim) is None and not any(finding.is_as_expected for finding in controls):
                    unrefuted_keys.append(claim.key)
            else:
                findings.append(self.verify_claim(claim))
            for objects in self._points.values():  # free memory: the objects cache the values of each claim
                if objects is not None:
                    objects.forget(("A_to", "B", "lagrange", "projector", "associate"))
        if self.options.controls:
            counts = {"claims": len({finding.place["key"] for finding in findings})}
            text = f"{len(findings)} controls of {counts['claims']} claims, all refuted at exact points"
            if unrefuted_keys or not findings:
                text = f"no control refutes {', '.join(unrefuted_keys)}" if unrefuted_keys else "no claim was tested"
            verdict = Certainty.UNDECIDED if unrefuted_keys or not findings else Certainty.PROVED
            statement = "every claim fails on some input that breaks one of its hypotheses"
            findings.append(Finding(statement, verdict, Evidence("controls", text, counts)))
        return findings

    def point(self, needs_roots: bool, number: int) -> PaperObjects | None:
        """Return random point `number` over GF(p); None if the roots of chi are needed and not found."""
        # All claims use the same points for the generic member, and for a member whose chi splits over Q.
        must_split = needs_roots and self.member is not None and self.roots is None
        key = (must_split, number)
        if key not in self._points:
            self._points[key] = None
            member, order = self.member, self.options.order
            if member is None:
                rng = random.Random(f"universal {self._seed} {number}")
                self._points[key] = specialize.random_objects(self.m, random_prime_field(rng), rng, order)
                return self._points[key]
            rng = random.Random(f"verify {self._seed} {must_split} {number}")
            if must_split and not member.is_generic:
                return None
            roots_in_K: tuple[Any, ...] | None
            while self._points[key] is None:
                with suppress(BadPrime):
                    if must_split:
                        self.settings.progress("looking for a prime at which chi splits")
                        # chi splits modulo 1/m! or more of all primes: the search fails with probability at most e^-40.
                        split_field = specialize.split_prime_field(chi_of(member.A), rng, 40 * math.factorial(self.m))
                        if split_field is None:
                            return None
                        K, roots_in_K = split_field
                    else:
                        K = random_prime_field(rng)
                        roots_in_K = None if self.roots is None else tuple(K.convert(root) for root in self.roots)
                    self._points[key] = specialize.point_over(member, K, roots_in_K, self.settings.eps, rng, order)
        return self._points[key]

    def exact_point(self, needs_roots: bool, number: int) -> PaperObjects | None:
        """Return a random point over Q; None for the generic member, and if roots of chi are needed but irrational."""
        if self.member is None or (needs_roots and self.roots is None):
            return None
        rng = random.Random(f"exact {self._seed} {number}")
        return specialize.point_over(self.member, QQ, self.roots, self.settings.eps, rng, self.options.order)

    def bounds(self) -> PaperObjects:
        """Return the objects with degree bounds in place of numbers."""
        if self.member is None:
            return specialize.universal_bound_objects(self.m, self.options.order)
        return specialize.bound_objects(self.member, self.settings.eps, self.options.order)

    def conjugates(self, needs_roots: bool) -> int:
        """Return a bound for the degree over Q of a field with all coefficients and, if needed, the roots of chi."""
        if self.member is None or not needs_roots or self.roots is not None:
            return 1
        return math.prod(math.factorial(factor.degree) for factor in self.member.factors)

    def why_outside(self, claim: Claim) -> str | None:
        """Return why a claim does not apply to the member; None if it does."""
        if self.member is None or self.member.is_generic:
            return None
        bounds = self.bounds()
        if not claim.distinct_roots and claim.kind in (ClaimKind.EQUAL, ClaimKind.DIFFERENT):
            pairs = sum(1 for _ in claim.function(bounds))
            if not pairs:
                return "there is no associated system but f itself: chi is a power of one irreducible polynomial"
        if claim.distinct_roots or "roots" in bounds.used:
            return f"the statement needs distinct roots. {diagnosis(self.member.A).split(';')[0]}"
        return None

    def what_is_special(self) -> str:
        """Return why a statement for generic A and H may fail for this member."""
        if self.member is None:
            return "its A or H is special"
        if not self.member.is_generic:
            return "its A is not generic"
        form = normal_form(self.member)

        def common_factor(coefficients: Iterable[fmpq_poly]) -> fmpq_poly:
            """Return the factor of chi whose roots are common zeros of these elements of Q[t]/chi."""
            return reduce(fmpq_poly.gcd, coefficients, form.chi)

        factor_of_zeros = common_factor(form.coefficients)
        factor_of_cubes = common_factor(form.D_coefficients) // factor_of_zeros
        reasons = [
            f"{property_text} on the eigenspaces of the roots of {format_univariate(factor)}"
            for factor, property_text in (
                (factor_of_zeros, "H vanishes"),
                (factor_of_cubes, "H is the cube of a linear form"),
            )
            if factor.degree() > 0
        ]
        if all(factor.degree == 1 and abs(factor.polynomial[0]) in (0, 1) for factor in self.member.factors):
            reasons.append("A^3 = A, so that H_1 is associated to H_0 where it is not 0")
        return "; ".join(reasons) or "its A or H is special"

    # one claim

    def verify_claim(self, claim: Claim) -> Finding:
        """Verify one claim and return its finding."""
        reason = self.why_outside(claim)
        if reason is not None:
            return self._finding(claim, Certainty.UNDECIDED, Evidence("outside the hypotheses", reason))
        if claim.kind is not ClaimKind.EQUAL:
            return self._verify_existence(claim)
        statement = ClaimAtPoints(self, claim)
        decision = decide(statement, self.settings.seed, self.settings.error_bits)
        finding = self._finding(claim, decision.verdict, decision.evidence, witness=decision.witness)
        if claim.misprint and decision.verdict is Certainty.SUPPORTED:
            special = Evidence(
                "special member", f"the misprint does not show for this member: {self.what_is_special()}"
            )
            return replace(
                finding, verdict=Certainty.UNDECIDED, evidence=special, also=(finding.evidence,), applies=False
            )
        if claim.misprint or decision.verdict is Certainty.REFUTED:
            return finding
        try:
            proof = self.proof(claim, statement.used_names, *statement.bound)
            if proof is None and claim.theorem:
                proof = Evidence("hypotheses", f"{claim.theorem} applies; its hypotheses hold by construction")
            also = tuple(self.further_evidence(claim))
        except Contradiction as error:
            text = f"{error}, although it {decision.evidence.summary}: the exact computation decides"
            return self._finding(claim, Certainty.REFUTED, Evidence("contradiction", text), witness=error.witness)
        if proof is not None:
            if decision.verdict is Certainty.SUPPORTED:
                return self._finding(claim, Certainty.PROVED, proof, (decision.evidence, *also))
            if decision.evidence.data.get("points") == 0:  # no prime was found for a point, or none large enough
                return self._finding(claim, Certainty.PROVED, proof, also)
        return replace(finding, also=(*finding.also, *also))

    def _verify_existence(self, claim: Claim) -> Finding:
        """Verify a claim that two objects differ, or that a rank is attained: one point is a proof."""
        needs_roots, outcome, point_count = False, None, 0
        for number in range(_MAX_UNDEFINED):
            # Large matrices over Q are expensive; a point over GF(p) suffices if `at_most` is given.
            is_modular = bool(claim.at_most) and self.m > 3
            objects = (None if is_modular else self.exact_point(needs_roots, number)) or self.point(needs_roots, number)
            if objects is None:
                text = "no prime was found at which chi splits into distinct factors"
                return self._finding(claim, Certainty.UNDECIDED, Evidence("random points over GF(p)", text))
            try:
                outcome = evaluate(claim, objects)
            except LookupError:  # the roots of chi are needed but not in this field
                needs_roots = True
                continue
            except UNDEFINED:
                continue
            point_count += 1
            if outcome.holds and outcome.pairs:
                point_text = "an exact rational point" if objects.K is QQ else f"a point over {objects.K.name}"
                method_text = "exact rational point" if objects.K is QQ else "point over GF(p)"
                text = f"{'both sides differ' if claim.kind is ClaimKind.DIFFERENT else 'attained'} at {point_text}"
                if claim.kind is ClaimKind.ATTAINED and claim.at_most:
                    text += f", and it cannot be larger: {claim.at_most}"
                # Modulo p a rank may be smaller than over Q, and an equation may hold only modulo p; never conversely.
                is_proof = claim.kind is ClaimKind.DIFFERENT or bool(claim.at_most) or objects.K is QQ
                verdict = Certainty.PROVED if is_proof else Certainty.SUPPORTED
                return self._finding(claim, verdict, Evidence(method_text, text, {"points": point_count}))
            if point_count >= _POINT_COUNT:
                break
        if outcome is None or not outcome.pairs:
            text = f"the claim is not defined at any of {_MAX_UNDEFINED} random points"
            return self._finding(claim, Certainty.UNDECIDED, Evidence("random points over GF(p)", text))
        text = "both sides agree" if claim.kind is ClaimKind.DIFFERENT else "not attained"
        if claim.in_general:
            special_text = (
                f"stated in general; for this member {text} at {point_count} random points: {self.what_is_special()}"
            )
            evidence = Evidence("special member", special_text, {"points": point_count})
            return replace(self._finding(claim, Certainty.UNDECIDED, evidence), applies=False)
        evidence = Evidence("random points", f"{text} at each of {point_count} random points", {"points": point_count})
        return self._finding(claim, Certainty.REFUTED, evidence, witness=witness_of(outcome))

    def proof(self, claim: Claim, used_names: set[str], size: CoefficientSize, pole_degree: int) -> Evidence | None:
        """Return a proof of a claim; None if there is none within the budget."""
        if claim.formal is not None:
            return formal_proof(claim)
        blocks, order = claim.blocks_for_proof(self.m), self.options.order
        if self.member is None:
            return normal_form_proof(claim.key, blocks, order) if claim.symplectic else None
        if not used_names - {"roots"} and (self.roots is not None or "roots" not in used_names):
            objects = self.exact_point("roots" in used_names, 0)
            with suppress(*UNDEFINED):
                if objects is not None and size.degree == 0 and evaluate(claim, objects).holds:
                    return Evidence("exact", "both sides are the same over Q", {})
        if claim.symplectic and self.member.is_generic:
            evidence = normal_form_proof(claim.key, blocks, order)
            if evidence is not None:
                hypotheses_text = "A^T J = J A, A Hess(H) = Hess(H) A^T, distinct roots: verified"
                data = {**evidence.data, "hypotheses_verified": hypotheses_text}
                return Evidence(evidence.method, f"{evidence.summary}; {hypotheses_text}", data)
        vectors = sorted(used_names - {"roots"})
        if size.degree > 6 or pole_degree > 4 or len(vectors) * self.member.dim > _MAX_INDETERMINATES:
            return None
        if "roots" in used_names and self.roots is None:
            return None
        generic_objects = specialize.member_functions(self.member, vectors, self.settings.eps, PROOF_BUDGET, order)
        try:
            outcome = evaluate(claim, generic_objects)
        except (BudgetExceeded, *UNDEFINED):
            return None
        if not outcome.holds:
            text = f"{claim.place}: {claim.title}: the two sides are different functions for this member"
            raise Contradiction(text, witness_of(outcome))
        scope_text = "x and eps" if self.settings.eps is None else f"x, for eps = {format_number(self.settings.eps)}"
        return Evidence("symbolic", f"both sides are the same function of {scope_text}, multiplied out for this member")

    def further_evidence(self, claim: Claim) -> Iterable[Evidence]:
        """Yield additional evidence for a member with distinct roots: over Q[t]/chi, and over complex balls."""
        if self.member is None or not self.member.is_generic:
            return
        rng = random.Random(f"also {self._seed} {claim.key}")
        if claim.blockwise and claim.symplectic:
            objects = specialize.etale_objects(self.member, rng, self.settings.eps, self.options.order)
            chi = format_univariate(chi_of(self.member.A))
            text = f"held at an exact random point of the normal form over Q[t]/({chi})"
            try:
                if not evaluate(claim, objects).holds:
                    raise Contradiction(f"{claim.place}: {claim.title}: fails over Q[t]/chi, but not over GF(p)")
                yield Evidence("exact over Q[t]/chi", f"{text}, for all roots at once", {"points": 1})
            except UNDEFINED:  # the map is undefined at this point, so there is no evidence
                pass
        if self.options.ball_bits is not None:
            bits = self.options.ball_bits
            objects = specialize.ball_objects(self.member, bits, rng, self.settings.eps, self.options.order)
            largest_log2, pairs = -math.inf, 0
            try:
                with objects.K.working():
                    for left, right in claim.function(objects):
                        pairs += 1
                        if not same(objects.K, left, right):
                            raise Contradiction(f"{claim.place}: {claim.title}: two balls that must overlap do not")
                        for a, b in zip(entries(left), entries(right), strict=True):
                            distance = abs(objects.K.convert(a) - objects.K.convert(b)).abs_upper()
                            if distance != 0:
                                largest_log2 = max(largest_log2, float(distance.log().mid()) / math.log(2))
            except (PrecisionLost, *UNDEFINED):
                yield Evidence("complex balls", f"balls of {bits} bits are too wide to compare", {"bits": bits})
                return
            text = f"over complex balls of {bits} bits the sides overlap"
            if largest_log2 > -math.inf:
                text += f", to within 2^{math.ceil(largest_log2)}"
            yield Evidence("complex balls", text, {"bits": bits, "pairs": pairs})

    def notes(self) -> list[str]:
        """Return the notes below the table of findings."""
        if self.member is None:
            return [NOTE_ON_RANDOM_MEMBERS]
        notes = [diagnosis(self.member.A)]
        if self.member.is_generic and not self.options.controls:
            notes.append(NOTE_ON_PROOFS)
        if self.options.ball_bits is not None and self.member.is_generic:
            with CC(self.options.ball_bits).working():
                roots = specialize.complex_roots(self.member, self.options.ball_bits)
                enclosures = [str(root.str(20)) for root in roots]
            notes.append(f"roots of chi in balls of {self.options.ball_bits} bits: {', '.join(enclosures)}")
        return notes

    def controls(self, claim: Claim) -> list[Finding]:
        """Return a finding for each control of a claim: the claim should be refuted for the objects of the control."""
        if claim.misprint:
            return [self.verify_claim(claim)]
        # One point refutes an equation (a rational point unless m is large). A claim that two objects differ, that an
        # object exists or that it has a certain rank counts as refuted if several points do not show it. For m >= 5
        # points modulo p come first: over Q a rank or a step of a control takes minutes, since nothing cancels.
        is_equation = claim.kind is ClaimKind.EQUAL
        is_rational_first = is_equation and self.m < _MIN_LARGE_M
        sources = (self.exact_point, self.point) if is_rational_first else (self.point, self.exact_point)
        choices = list(product((False, True), sources, range(_POINT_COUNT)))
        controls = []
        for name in claim.controls:
            if self.m < CONTROLS[name].least_m or self.why_outside(claim) is not None:
                continue
            outcome, failures = None, 0
            points = (point(needs_roots, number) for needs_roots, point, number in choices)
            for outcome in outcomes(claim, points, partial(broken, name)):
                failures += not outcome.holds
                if (outcome.holds and not is_equation) or failures >= (1 if is_equation else _POINT_COUNT):
                    break
            if outcome is None:
                verdict, outcome_text = Certainty.UNDECIDED, "not defined, or no roots of chi"
            elif outcome.holds or not outcome.pairs:
                verdict, outcome_text = Certainty.SUPPORTED, "the claim holds all the same"
            else:
                verdict, outcome_text = Certainty.REFUTED, f"fails at an exact point over {outcome.objects.K.name}"
            evidence = Evidence("control", f"control {name}: {CONTROLS[name].violation}; {outcome_text}")
            finding = self._finding(claim, verdict, evidence, witness=witness_of(outcome) if outcome else None)
            place = {**finding.place, "violated_hypothesis": name, "violation": CONTROLS[name].violation}
            controls.append(replace(finding, control=True, place=place, certified={}))
        # In low dimension some hypotheses always hold (for m = 1 every A is scalar): their controls are skipped.
        return [finding for finding in controls if finding.is_as_expected] or controls

    def _finding(
        self,
        claim: Claim,
        verdict: Certainty,
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
        source = "" if claim.section in SECTION_NAMES.values() else f"petrera-suris-2016, {claim.place}"
        if claim.label:
            source += f" [{claim.label}]"
        certified: dict[str, Any] = {}
        if self.file is not None and claim.certified:
            names = [name.format(k) for name in claim.certified.split() for k in range(self.m if "{}" in name else 1)]
            arguments = {"commute": "associates"} if names == ["associates"] else {"claims": names}
            certified = self.settings.certified(self.file, **arguments)
        is_misprint = bool(claim.misprint)
        return Finding(
            title, verdict, evidence, also, witness, claim.formula, source, is_misprint, place, certified=certified
        )


class ClaimAtPoints:
    """A claim at the points of a verifier, in the form required by `decide`."""

    name = "claim"
    undefined_reason = "a denominator seems to vanish identically"
    max_failures = _MAX_UNDEFINED

    def __init__(self, verifier: Verifier, claim: Claim) -> None:
        self._verifier, self._claim = verifier, claim
        bounds = verifier.bounds()
        self.bound = bound_of(cast(BoundField, bounds.K), claim.function(bounds))
        self.used_names = bounds.used
        self._needs_roots = "roots" in self.used_names
        self.conjugates = verifier.conjugates(self._needs_roots)

    @property
    def where(self) -> str:
        """The assumption on the random primes, as text; empty if there is none."""
        if self.conjugates == 1:
            return ""
        return " at which chi splits (of which at least half as many are assumed as Chebotarev's density gives)"

    def trials(self, seed: int) -> Iterator[Trial]:
        """Yield the result of the claim at each random point."""
        for number in count():
            objects = self._verifier.point(self._needs_roots, number)
            if objects is None:
                return
            try:
                outcome = evaluate(self._claim, objects)
            except UNDEFINED:
                yield Trial()
                continue
            if not outcome.holds:
                reason = "chi splits" if self._needs_roots else "all denominators are units, so it fails over Q"
                text = f"fails at a point over {outcome.objects.K.name}, where {reason}"
                evidence = Evidence("point over GF(p)", text)
                # If the claim also fails at a rational point, report this point, which is easier to read.
                points = (self._verifier.exact_point(self._needs_roots, k) for k in range(12))
                if failure := next((result for result in outcomes(self._claim, points) if not result.holds), None):
                    outcome = failure
                    evidence = Evidence("exact rational point", "fails at a rational point, exactly")
                yield Trial(decision=Decision(Certainty.REFUTED, evidence, witness_of(outcome)))
            elif not outcome.pairs:
                text = "it does not apply to this member: there is nothing to compare"
                yield Trial(decision=Decision(Certainty.UNDECIDED, Evidence("outside the hypotheses", text)))
            else:
                yield Trial(objects.K.characteristic)

    def data(self, undefined: int) -> dict[str, Any]:
        """Return the data of the evidence, except the bounds; `undefined` is the number of points without a value."""
        return {"splitting_field_degree_bound": self.conjugates, "undefined_at": undefined}


def formal_proof(claim: Claim) -> Evidence | None:
    """Prove a claim about every system by comparing the two sides of identities of multilinear expressions.

    Raises Contradiction if the two sides of an identity differ.
    """
    assert claim.formal is not None
    count = 0
    for left, right in claim.formal():
        count += 1
        if left != right:
            raise Contradiction(f"{claim.place}: {claim.title}: identity {count} of its formal proof fails")
    count_text = "one identity" if count == 1 else f"{count} identities"
    text = f"follows, in every dimension, from {count_text} without coordinates (docs/mathematics.md, Formal proofs)"
    return Evidence("formal proof", text, {"identities": count})


@lru_cache(maxsize=4096)
def normal_form_proof(key: str, blocks: int, order: int) -> Evidence | None:
    """Prove a claim in normal form with this number of blocks; return None if the budget is exceeded.

    Raises Contradiction if the two sides are different rational functions.
    """
    claim = next(claim_ for claim_ in claims() if claim_.key == key)
    bounds = specialize.universal_bound_objects(blocks, order)
    for _ in claim.function(bounds):  # the evaluation records the names of the vectors used
        pass
    vectors = sorted(bounds.used - {"roots"})
    try:
        objects = specialize.normal_form_objects(blocks, vectors, PROOF_BUDGET, order)
        outcome = evaluate(claim, objects)
    except (BudgetExceeded, *UNDEFINED):
        return None
    K: Any = objects.K
    if not outcome.holds:
        text = f"{claim.place}: {claim.title}: the two sides are different rational functions in normal form"
        raise Contradiction(text, witness_of(outcome))
    if not outcome.pairs:
        return None
    blocks_text = counted(blocks, "block")
    return Evidence(
        "symbolic, normal form",
        f"multiplied out in normal form, {blocks_text}, all data indeterminate",
        {"blocks": blocks, "indeterminates": len(K.variables), "products_of_terms": PROOF_BUDGET - K.budget},
    )
