"""Putting every claim of the paper to the test, for one member of the family or for the member in general.

How a claim is decided, and what the verdict then says:

* *random points*: the claim is evaluated on the member over GF(p), p random of 63 bits, at random x, eps and whatever
  else it speaks of; p is one at which chi splits, if the claim needs its roots. A failure refutes. Success makes the
  claim `supported`, with a bound for the error that is derived by running the claim over bounds.
* *normal form*: the same claim is run over rational functions, for the normal form with indeterminate roots,
  coefficients, x and eps. This proves it for every member with distinct roots: such a member is, over the splitting
  field of chi, symplectically similar to a specialization (docs/mathematics.md); its hypotheses are verified exactly.
* *symbolic*: where the normal form does not apply, the claim is run for this member with indeterminate x and eps.
* *exact*: claims without x, and those about dimensions and ranks, are evaluated over Q.

Beside that, claims about one block at a time are evaluated exactly over Q[t]/chi, where all roots are one, and, if
asked for, over complex balls.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.functions import BudgetExceeded
from kahanmaps.algebra.text import format_number
from kahanmaps.checks.claims import Evidence, Finding, Report, Verdict, Witness
from kahanmaps.checks.decide import log2_error, random_prime_field
from kahanmaps.checks.judge import Contradiction
from kahanmaps.checks.settings import CONVENTION, Settings
from kahanmaps.errors import BadPrime, InputError, PrecisionLost, SingularMatrix, SingularStep
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.skew_hamiltonian import chi as chi_of
from kahanmaps.family.skew_hamiltonian import diagnosis, format_univariate
from kahanmaps.invariants.sizes import Size
from kahanmaps.paper import realise
from kahanmaps.paper.controls import CONTROLS, broken
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import SECTIONS, Claim, Kind, claims
from kahanmaps.systems.files import SystemFile
from kahanmaps.version import __version__

MAX_M = 8
# Beyond, only claims about one or two blocks are proved in normal form: the others have too many indeterminates.
MAX_BLOCKS_IN_A_PROOF = 6
PROOF_BUDGET = 100_000_000
# chi splits modulo one prime in m! at worst: beyond this m the search is not begun.
MAX_M_FOR_SPLIT_PRIMES = 6
_POLES = 40
_POINTS = 4  # for statements that something differs, or has full rank
_UNDEFINED = (SingularStep, SingularMatrix, ZeroDivisionError)


@dataclass(frozen=True)
class Options:
    """What to verify: sections (None: all), the order of the series, bits for complex balls, controls instead."""

    sections: tuple[int, ...] | None = None
    order: int = 3
    ball_bits: int | None = None
    controls: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.order <= 20:
            raise InputError(f"found the order {self.order}, expected 1 to 20")
        if self.ball_bits is not None and not 32 <= self.ball_bits <= 100_000:
            raise InputError(f"found {self.ball_bits} bits for the balls, expected 32 to 100000")
        for section in self.sections or ():
            if section not in SECTIONS:
                raise InputError(f"found the section {section}, expected 1 to {max(SECTIONS)} ({max(SECTIONS)}: beyond)")


def verify(file: SystemFile, settings: Settings | None = None, options: Options | None = None) -> Report:
    """Every claim of the paper for a member of the family.

    `settings` gives eps (None: every eps, an indeterminate), the seed and the error bound. Exact but for the claims
    whose verdict is `supported`. Returns a Report with one Finding a claim, in the order of the paper. Raises
    InputError where the system is not of kind [family].

    Source: petrera-suris-2016, all of it.

    >>> from kahanmaps.family.draw import draw_with_eigenvalues
    >>> file = SystemFile.from_member(draw_with_eigenvalues([1, -2], seed=7), "pair")
    >>> report = verify(file, options=Options(sections=(6,)))
    >>> str(report.verdict), report.findings[1].claim
    ('proved', 'Theorem 9: The Kahan maps of associated vector fields commute, all pairs of the class')
    """
    settings, options = settings or Settings(), options or Options()
    member = file.member
    if member is None:
        raise InputError(
            f"{file.name} is of kind [{file.kind}], expected one of kind [family]: the paper is about skew-Hamiltonian A "
            "and the cubics of its space ('kahanmaps family new' makes such files)"
        )
    if member.m > MAX_M:
        raise InputError(f"found a member with m = {member.m}, expected m <= {MAX_M}")
    examiner = _MemberExaminer(member, settings, options)
    findings = examiner.findings()
    notes = examiner.notes()
    context = {
        **settings.context([file]),
        "m": member.m,
        "chi": format_univariate(chi_of(member.A)),
        "factors": [str(factor) for factor in member.factors],
        "order": options.order,
        "controls": options.controls,
    }
    return Report("verify", tuple(findings), context, notes)


def verify_universal(m: int, settings: Settings | None = None, options: Options | None = None) -> Report:
    """Every claim for the member in general: roots, cubics, symplectic change, x and eps all at random over GF(p).

    The error bound of each claim is on the probability that it is false for the generic member. A claim that could
    also be proved in normal form is `proved`, for every member with distinct roots.
    """
    settings, options = settings or Settings(), options or Options()
    if not 1 <= m <= MAX_M:
        raise InputError(f"found m = {m}, expected 1 <= m <= {MAX_M}")
    if settings.eps is not None:
        raise InputError("found an eps, expected none: universal claims are for every eps")
    examiner = _UniversalExaminer(m, settings, options)
    findings = examiner.findings()
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
        "order": options.order,
        "controls": options.controls,
    }
    return Report("verify", tuple(findings), context, examiner.notes())


# ---- pairs ----------------------------------------------------------------------------------------------------------------


def _entries(value: Any) -> list[Any]:
    return list(value.entries()) if hasattr(value, "entries") else [value]


def _same(K: Field, left: Any, right: Any) -> bool:
    if isinstance(left, int):
        return bool(left == right)
    a, b = _entries(left), _entries(right)
    return len(a) == len(b) and all(K.equal(x, y) for x, y in zip(a, b, strict=True))


@dataclass(frozen=True)
class _Outcome:
    """What a claim came to on certain objects: how many pairs, and the first that is not as claimed."""

    objects: PaperObjects
    pairs: int
    failure: tuple[Any, Any] | None

    @property
    def holds(self) -> bool:
        return self.failure is None


def _evaluate(claim: Claim, o: PaperObjects) -> _Outcome:
    """Run a claim. May raise SingularStep and the like where something is not defined."""
    pairs = 0
    with o.K.working():
        for left, right in claim.function(o):
            pairs += 1
            if _same(o.K, left, right) != (claim.kind is not Kind.DIFFERENT):
                return _Outcome(o, pairs, (left, right))
    return _Outcome(o, pairs, None)


def _witness(outcome: _Outcome) -> Witness | None:
    """The point at which a claim failed, with both sides; of matrices the first entry that differs."""
    if outcome.failure is None:
        return None
    o = outcome.objects
    left, right = outcome.failure
    labels = ("left side", "right side")
    if isinstance(left, int):
        sides = (str(left), str(right))
    else:
        a, b = _entries(left), _entries(right)
        k = next((k for k, (x, y) in enumerate(zip(a, b, strict=True)) if not o.K.equal(x, y)), 0)
        if len(a) > 1:
            columns = left.ncols()
            labels = tuple(f"{side}, entry ({k // columns + 1},{k % columns + 1})" for side in labels)  # type: ignore[assignment]
        sides = (o.K.format(a[k]), o.K.format(b[k]))
    drawn = {name: o.vector(name) for name in sorted(o.used - {"roots"}) if not name.startswith("break")}
    text = {name: tuple(o.K.format(entry) for entry in vector.entries()) for name, vector in drawn.items()}
    point = text.pop("x", ())
    return Witness(point, o.K.format(o.eps), (sides[0],), (sides[1],), *labels, o.K.name, text)


# ---- proofs ---------------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=4096)
def normal_form_proof(key: str, blocks: int, order: int) -> Evidence | None:
    """The proof of a claim in normal form with so many blocks; None where it grows beyond the budget.

    Raises Contradiction where the two sides are different rational functions.
    """
    claim = next(found for found in claims() if found.key == key)
    bounds = realise.universal_bound_objects(blocks, order)
    for _ in claim.function(bounds):
        pass
    vectors = sorted(bounds.used - {"roots"})
    objects = realise.normal_form_objects(blocks, vectors, PROOF_BUDGET, order)
    K: Any = objects.K
    try:
        outcome = _evaluate(claim, objects)
    except BudgetExceeded:
        return None
    if not outcome.holds:
        raise Contradiction(f"{claim.place}: {claim.title}: the two sides differ in normal form")
    if not outcome.pairs:
        return None
    what = "one block" if blocks == 1 else f"{blocks} blocks"
    return Evidence(
        "normal form",
        f"an identity of rational functions, multiplied out for {what} of the normal form with indeterminate roots, "
        "coefficients, x and eps",
        {"blocks": blocks, "indeterminates": len(K.variables), "products_of_terms": PROOF_BUDGET - K.budget},
    )


# ---- examiners ------------------------------------------------------------------------------------------------------------


class _Examiner:
    """What is common to a given member and to the universal one."""

    m: int

    def __init__(self, settings: Settings, options: Options) -> None:
        self.settings = settings
        self.options = options
        self._points: dict[tuple[bool, int], PaperObjects | None] = {}

    def selected(self) -> list[Claim]:
        """The claims to look at."""
        wanted = self.options.sections
        return [c for c in claims() if c.makes_sense(self.m) and (wanted is None or c.section in wanted)]

    def findings(self) -> list[Finding]:
        """One finding a claim, or one a claim and control."""
        found: list[Finding] = []
        selected = self.selected()
        for k, claim in enumerate(selected):
            self.settings.progress(f"{claim.place} ({k + 1} of {len(selected)})")
            if self.options.controls:
                found += self.controls(claim)
            else:
                found.append(self.examine(claim))
        return found

    # what the two kinds of examiners fill in

    def point(self, roots: bool, number: int) -> PaperObjects | None:
        """The number-th random point over GF(p); with the roots of chi, if need be, or None where they are not had."""
        raise NotImplementedError

    def exact_point(self, roots: bool, number: int) -> PaperObjects | None:
        """A random point over Q, or None where the roots of chi are not rational."""
        raise NotImplementedError

    def bounds(self) -> PaperObjects:
        """The objects as bounds."""
        raise NotImplementedError

    def conjugates(self, roots: bool) -> int:
        """A bound for the degree of the field that the coefficients lie in."""
        return 1

    def outside(self, claim: Claim) -> str | None:
        """Why a claim does not apply, if it does not."""
        return None

    def proof(self, claim: Claim, needs: set[str], equation: Size, poles: int) -> Evidence | None:
        """A proof, if there is one."""
        raise NotImplementedError

    def also(self, claim: Claim) -> Iterable[Evidence]:
        """Further evidence."""
        return ()

    # the examination

    def examine(self, claim: Claim) -> Finding:
        """The finding on one claim."""
        reason = self.outside(claim)
        if reason is not None:
            return self._finding(claim, Verdict.UNDECIDED, Evidence("outside the hypotheses", reason))
        if claim.kind is not Kind.EQUAL:
            return self._examine_existence(claim)
        needs, equation, poles = self._size(claim)
        roots = "roots" in needs
        decision, witness = self._at_points(claim, roots, equation, poles)
        if claim.misprint or decision.verdict is Verdict.REFUTED:
            return decision
        proof = self.proof(claim, needs, equation, poles)
        if proof is not None:
            if decision.verdict is Verdict.SUPPORTED:
                return self._finding(claim, Verdict.PROVED, proof, (decision.evidence, *self.also(claim)))
            if decision.evidence.data.get("points") == 0 and roots:  # no prime was found at which chi splits
                return self._finding(claim, Verdict.PROVED, proof, tuple(self.also(claim)))
        return decision.with_also(*self.also(claim))

    def _at_points(self, claim: Claim, roots: bool, equation: Size, poles: int) -> tuple[Finding, Witness | None]:
        per_trial = log2_error(equation, poles, self.conjugates(roots))
        if per_trial >= -1:
            text = f"the degree bound {equation.degree} is too large for primes of 63 bits to decide anything"
            return self._finding(claim, Verdict.UNDECIDED, Evidence("random points over GF(p)", text)), None
        trials = max(1, math.ceil(self.settings.error_bits / -per_trial))
        primes, undefined = [], 0
        number = 0
        while len(primes) < trials:
            objects = self.point(roots, number)
            number += 1
            if objects is None:
                text = "the roots of chi are not rational, and no prime was looked for at which chi splits"
                return self._finding(
                    claim, Verdict.UNDECIDED, Evidence("random points over GF(p)", text, {"points": 0})
                ), None
            try:
                outcome = _evaluate(claim, objects)
            except _UNDEFINED:
                undefined += 1
                if undefined > _POLES:
                    text = f"the claim is not defined at any of {undefined} random points over GF(p)"
                    return self._finding(claim, Verdict.UNDECIDED, Evidence("random points over GF(p)", text)), None
                continue
            if not outcome.holds:
                finding = self._refuted(claim, roots, outcome)
                return finding, finding.witness
            if not outcome.pairs:
                text = "it does not apply to this member: there is nothing to compare"
                return self._finding(claim, Verdict.UNDECIDED, Evidence("outside the hypotheses", text)), None
            primes.append(objects.K.characteristic)
        bound = math.floor(-per_trial * trials)
        assumed = ", the roots of chi among them" if roots and self.conjugates(True) > 1 else ""
        evidence = Evidence(
            "random points over GF(p)",
            f"held at {trials} random point{'s' * (trials > 1)} over GF(p), p random of 63 bits{assumed}; "
            f"false with probability below 2^-{bound}",
            {
                "points": trials,
                "error_bound": f"2^-{bound}",
                "degree_bound": equation.degree,
                "coefficient_bits_bound": math.ceil(equation.bits),
                "pole_degree_bound": poles,
                "splitting_field_degree_bound": self.conjugates(roots),
                "undefined_at": undefined,
                "primes": [str(prime) for prime in primes],
            },
        )
        return self._finding(claim, Verdict.SUPPORTED, evidence), None

    def _examine_existence(self, claim: Claim) -> Finding:
        """Claims that something differs somewhere, or has a certain rank: one point that shows it is a proof."""
        roots, outcome, tried = False, None, 0
        for number in range(_POLES):
            exact = claim.kind is Kind.ATTAINED and self.exact_point(roots, number)
            objects = exact or self.point(roots, number)
            if objects is None:
                text = "the roots of chi are not rational, and no prime was looked for at which chi splits"
                return self._finding(claim, Verdict.UNDECIDED, Evidence("random points over GF(p)", text))
            try:
                outcome = _evaluate(claim, objects)
            except LookupError:  # the roots of chi are needed, and this field does not have them
                roots = True
                continue
            except _UNDEFINED:
                continue
            tried += 1
            if outcome.holds and outcome.pairs:
                where = "an exact rational point" if objects.K is QQ else f"a point over {objects.K.name}"
                what = "both sides differ" if claim.kind is Kind.DIFFERENT else "attained"
                method = "exact rational point" if objects.K is QQ else "point over GF(p)"
                return self._finding(claim, Verdict.PROVED, Evidence(method, f"{what} at {where}", {"points": tried}))
            if tried >= _POINTS:
                break
        if outcome is None or not outcome.pairs:
            text = f"the claim is not defined at any of {_POLES} random points"
            return self._finding(claim, Verdict.UNDECIDED, Evidence("random points over GF(p)", text))
        text = "both sides agree" if claim.kind is Kind.DIFFERENT else "not attained"
        evidence = Evidence("random points", f"{text} at each of {tried} random points", {"points": tried})
        return self._finding(claim, Verdict.REFUTED, evidence, witness=_witness(outcome))

    def _size(self, claim: Claim) -> tuple[set[str], Size, int]:
        """What a claim uses, a bound for the equation it amounts to, and the degree of all its denominators."""
        bounds = self.bounds()
        equation, poles = Size(0, 0.0), 0
        for left, right in claim.function(bounds):
            sides = [value.entry if hasattr(value, "entry") else bounds.K.convert(value) for value in (left, right)]
            difference = sides[0] - sides[1]
            equation = equation | difference.above
            poles = max(poles, difference.pole_degree)
        return bounds.used, equation, poles

    def _refuted(self, claim: Claim, roots: bool, outcome: _Outcome) -> Finding:
        for number in range(12):
            objects = self.exact_point(roots, number)
            if objects is None:
                break
            try:
                exact = _evaluate(claim, objects)
            except (*_UNDEFINED, LookupError):
                continue
            if not exact.holds:
                text = "fails at a rational point, exactly"
                evidence = Evidence("exact rational point", text)
                return self._finding(claim, Verdict.REFUTED, evidence, witness=_witness(exact))
        text = f"fails at a point over {outcome.objects.K.name}, where all denominators are units, so it fails over Q"
        if roots:
            text = f"fails at a point over {outcome.objects.K.name}, where chi splits"
        evidence = Evidence("point over GF(p)", text)
        return self._finding(claim, Verdict.REFUTED, evidence, witness=_witness(outcome))

    def controls(self, claim: Claim) -> list[Finding]:
        """The claim on broken input, one finding for every control that it names: each is expected to be refuted."""
        if claim.misprint:
            return [self.examine(claim)]
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
                verdict, evidence = Verdict.REFUTED, Evidence("control", f"{text}; fails at an exact point")
            finding = self._finding(claim, verdict, evidence, witness=_witness(outcome) if outcome else None)
            place = {**finding.place, "breaks": name}
            found.append(replace(finding, control=True, place=place))
        return found

    def _broken(self, claim: Claim, name: str) -> _Outcome | None:
        """The claim on input broken by a control: the first point at which it fails, or else the last one tried."""
        outcome = None
        for roots in (False, True):
            for number in range(_POINTS):
                for find in (self.exact_point, self.point):
                    objects = find(roots, number)
                    if objects is None:
                        continue
                    try:
                        outcome = _evaluate(claim, broken(name, objects))
                    except (*_UNDEFINED, LookupError):
                        continue
                    if not outcome.holds:
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


class _MemberExaminer(_Examiner):
    """A given member."""

    def __init__(self, member: FamilyMember, settings: Settings, options: Options) -> None:
        super().__init__(settings, options)
        self.member = member
        self.m = member.m
        self.roots = realise.rational_roots(member)

    def point(self, roots: bool, number: int) -> PaperObjects | None:
        # Where chi splits over Q one pool of points serves all claims.
        needs_split = roots and self.roots is None
        key = (needs_split, number)
        if key not in self._points:
            self._points[key] = self._new_point(needs_split, number)
        return self._points[key]

    def _new_point(self, needs_split: bool, number: int) -> PaperObjects | None:
        rng = random.Random(f"verify {self.settings.seed} {needs_split} {number}")
        if needs_split and (self.m > MAX_M_FOR_SPLIT_PRIMES or not self.member.is_generic):
            return None
        while True:
            try:
                if needs_split:
                    chi = chi_of(self.member.A)
                    self.settings.progress("looking for a prime at which chi splits")
                    found = realise.split_prime_field(chi, rng, 40 * math.factorial(self.m) + 400)
                    if found is None:
                        return None
                    K, mod_roots = found
                    roots: tuple[Any, ...] | None = mod_roots
                else:
                    K = random_prime_field(rng)
                    roots = None if self.roots is None else tuple(K.convert(root) for root in self.roots)
                return realise.point_over(self.member, K, roots, self.settings.eps, rng, self.options.order)
            except BadPrime:
                continue

    def exact_point(self, roots: bool, number: int) -> PaperObjects | None:
        if roots and self.roots is None:
            return None
        rng = random.Random(f"exact {self.settings.seed} {number}")
        return realise.point_over(self.member, QQ, self.roots, self.settings.eps, rng, self.options.order)

    def bounds(self) -> PaperObjects:
        return realise.bound_objects(self.member, self.settings.eps, self.options.order)

    def conjugates(self, roots: bool) -> int:
        if not roots or self.roots is not None:
            return 1
        return math.prod(math.factorial(factor.degree) for factor in self.member.factors)

    def outside(self, claim: Claim) -> str | None:
        if self.member.is_generic:
            return None
        needs = claim.distinct_roots
        if not needs:
            bounds = self.bounds()
            if claim.kind is Kind.EQUAL:
                for _ in claim.function(bounds):
                    pass
                needs = "roots" in bounds.used
            else:
                needs = bool(claim.breaks) and "repeated" in claim.breaks
        return f"outside the hypotheses: {diagnosis(self.member.A).split(';')[0]}" if needs else None

    def proof(self, claim: Claim, needs: set[str], equation: Size, poles: int) -> Evidence | None:
        if not needs - {"roots"} and (self.roots is not None or "roots" not in needs):
            objects = self.exact_point("roots" in needs, 0)
            if objects is not None and not needs & {"x"} and _evaluate(claim, objects).holds and equation.degree == 0:
                return Evidence("exact", "both sides are the same over Q", {})
        if claim.symplectic and self.member.is_generic:
            blocks = claim.blocks_for_proof(self.m)
            if blocks <= MAX_BLOCKS_IN_A_PROOF:
                evidence = normal_form_proof(claim.key, blocks, self.options.order)
                if evidence is not None:
                    verified = "A^T J = J A, A Hess(H) = Hess(H) A^T, chi without repeated roots: verified exactly"
                    return Evidence(evidence.method, f"{evidence.summary}; {verified}", {**evidence.data, "hypotheses_verified": verified})
        if equation.degree <= 6 and poles <= 4:
            return self._symbolic(claim, needs)
        return None

    def _symbolic(self, claim: Claim, needs: set[str]) -> Evidence | None:
        if "roots" in needs and self.roots is None:
            return None
        objects = realise.member_functions(
            self.member, sorted(needs - {"roots"}), self.settings.eps, PROOF_BUDGET, self.options.order
        )
        try:
            outcome = _evaluate(claim, objects)
        except BudgetExceeded:
            return None
        if not outcome.holds:
            raise Contradiction(f"{claim.place}: {claim.title}: held at random points, but the two sides differ")
        scope = "x and eps" if self.settings.eps is None else f"x, for eps = {format_number(self.settings.eps)}"
        return Evidence("symbolic", f"both sides are the same function of {scope}, multiplied out for this member")

    def also(self, claim: Claim) -> Iterable[Evidence]:
        rng = random.Random(f"also {self.settings.seed} {claim.key}")
        if claim.blockwise and claim.symplectic and self.member.is_generic:
            objects = realise.etale_objects(self.member, rng, self.settings.eps, self.options.order)
            text = f"held at an exact random point of the normal form over Q[t]/({format_univariate(chi_of(self.member.A))})"
            try:
                if not _evaluate(claim, objects).holds:
                    raise Contradiction(f"{claim.place}: {claim.title}: fails over Q[t]/chi, but not over GF(p)")
                yield Evidence("exact over Q[t]/chi", f"{text}, for all roots at once", {"points": 1})
            except _UNDEFINED:
                pass
        if self.options.ball_bits is not None and self.member.is_generic:
            yield self._by_balls(claim, self.options.ball_bits, rng)

    def _by_balls(self, claim: Claim, bits: int, rng: random.Random) -> Evidence:
        objects = realise.ball_objects(self.member, bits, rng, self.settings.eps, self.options.order)
        widest, pairs = -math.inf, 0
        try:
            with objects.K.working():
                for left, right in claim.function(objects):
                    pairs += 1
                    if not _same(objects.K, left, right):
                        raise Contradiction(f"{claim.place}: {claim.title}: two balls that must overlap do not")
                    for a, b in zip(_entries(left), _entries(right), strict=True):
                        widest = max(widest, _log2_radius(objects.K.convert(a) - objects.K.convert(b)))
        except (PrecisionLost, *_UNDEFINED):
            return Evidence("complex balls", f"balls of {bits} bits are too wide to compare", {"bits": bits})
        text = f"over complex balls of {bits} bits the sides overlap"
        if widest > -math.inf:
            text += f", to within 2^{math.ceil(widest)}"
        return Evidence("complex balls", text, {"bits": bits, "pairs": pairs})

    def notes(self) -> list[str]:
        """What holds for the whole table."""
        found = [diagnosis(self.member.A)]
        if self.roots is None and self.m > MAX_M_FOR_SPLIT_PRIMES:
            found.append(f"for m > {MAX_M_FOR_SPLIT_PRIMES} no primes are looked for at which an irreducible chi splits")
        return found


class _UniversalExaminer(_Examiner):
    """The member in general."""

    def __init__(self, m: int, settings: Settings, options: Options) -> None:
        super().__init__(settings, options)
        self.m = m

    def point(self, roots: bool, number: int) -> PaperObjects | None:
        key = (False, number)
        if key not in self._points:
            rng = random.Random(f"universal {self.settings.seed} {number}")
            field = random_prime_field(rng)
            self._points[key] = realise.random_objects(self.m, field, rng, self.options.order)
        return self._points[key]

    def exact_point(self, roots: bool, number: int) -> PaperObjects | None:
        return None

    def bounds(self) -> PaperObjects:
        return realise.universal_bound_objects(self.m, self.options.order)

    def proof(self, claim: Claim, needs: set[str], equation: Size, poles: int) -> Evidence | None:
        blocks = claim.blocks_for_proof(self.m)
        if not claim.symplectic or blocks > MAX_BLOCKS_IN_A_PROOF:
            return None
        return normal_form_proof(claim.key, blocks, self.options.order)

    def notes(self) -> list[str]:
        """What holds for the whole table."""
        return [
            "random members: A = S^{-T} diag(L, L) S^T with random roots L and a random symplectic S, H = sum of random "
            "planar cubics, hidden by S; x and eps at random. Bounds are for the generic member"
        ]


def sections() -> Sequence[tuple[int, str]]:
    """Numbers and titles of the sections."""
    return [(number, title) for number, (title, _) in SECTIONS.items()]


def _log2_radius(ball: Any) -> float:
    """log2 of an upper bound for |ball|."""
    bound = abs(ball).abs_upper()
    return -math.inf if bound == 0 else float(bound.log().mid()) / math.log(2)


def default_eps() -> fmpq:
    """The eps of exact points where none is given."""
    return fmpq(1, 10)
