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
from collections.abc import Iterable
from typing import Any

from flint import fmpq_poly

from kahanmaps.algebra.bounds import Size
from kahanmaps.algebra.chance import random_prime_field, seed_for
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.functions import BudgetExceeded
from kahanmaps.algebra.written.text import format_number
from kahanmaps.checks.claims import Evidence, Report
from kahanmaps.checks.judge import Contradiction
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import BadPrime, InputError, PrecisionLost
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.planar import normal_form
from kahanmaps.family.skew_hamiltonian import chi as chi_of
from kahanmaps.family.skew_hamiltonian import diagnosis, format_univariate
from kahanmaps.maps.convention import CONVENTION
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.paper import objects_over
from kahanmaps.paper.evaluate import UNDEFINED, entries, evaluate, same, witness_of
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.proofs import PROOF_BUDGET, normal_form_proof
from kahanmaps.paper.registry import Claim, Kind
from kahanmaps.paper.verifier import Verifier, VerifyOptions
from kahanmaps.version import __version__

MAX_M = 8
_MAX_INDETERMINATES = 64  # of a proof for one member
NOTE_ON_PROOFS = (
    "proofs in normal form: the claim is an identity of rational functions in indeterminate roots of chi, coefficients "
    "of H, x and eps, multiplied out for so many planar blocks; it holds for every member with distinct roots, being "
    "symplectically similar to a specialization over the splitting field of chi (docs/mathematics.md)"
)


def verify(
    system: SystemLike | None = None,
    settings: Settings | None = None,
    options: VerifyOptions | None = None,
    *,
    m: int | None = None,
    eps: Any = None,
    time_step: Any = None,
) -> Report:
    """Every claim of the paper for a member of the family.

    `settings` gives eps (None: every eps, an indeterminate), the seed and the error bound. Exact but for the claims
    whose verdict is `supported`. Without a file, `m` asks for the member in general, as `verify_universal` does.
    Returns a Report with one Finding a claim, in the order of the paper. Raises InputError where the system is not of
    kind [family].

    Source: petrera-suris-2016, all of it.

    >>> from kahanmaps.family.draw import draw_with_eigenvalues
    >>> file = SystemFile.from_member(draw_with_eigenvalues([1, -2], seed=7), "pair")
    >>> report = verify(file, options=VerifyOptions(sections=(6,)))
    >>> str(report.verdict), report.findings[1].claim
    ('proved', 'Theorem 9: The Kahan maps of associated vector fields commute, all pairs of the class')
    """
    settings = Settings.of(settings, eps, time_step)
    if (system is None) == (m is None):
        raise InputError("expected a member of the family, or m: half the dimension of the one in general")
    if system is None:
        return verify_universal(m or 0, settings, options)
    file, options = as_file(system), options or VerifyOptions()
    member = file.member
    if member is None:
        raise InputError(
            f"{file.name} is of kind [{file.kind}], expected one of kind [family]: the paper is about skew-Hamiltonian "
            "A and the cubics of its space ('kahanmaps family new' makes such files)"
        )
    if member.m > MAX_M:
        raise InputError(f"found a member with m = {member.m}, expected m <= {MAX_M}")
    if -1 in member.signs:
        member = FamilyMember(member.A, member.chosen.K)  # f is the system that the file stands for
    verifier = _MemberVerifier(member, settings, options)
    findings = verifier.findings()
    notes = verifier.notes()
    context = {
        **settings.context([file]),
        "m": member.m,
        "chi": format_univariate(chi_of(member.A)),
        "factors": [str(factor) for factor in member.factors],
        "order": options.order,
        "controls": options.controls,
    }
    return Report("verify", tuple(findings), context, notes)


def verify_universal(m: int, settings: Settings | None = None, options: VerifyOptions | None = None) -> Report:
    """Every claim for the member in general: roots, cubics, symplectic change, x and eps all at random over GF(p).

    The error bound of each claim is on the probability that it is false for the generic member. A claim that could
    also be proved in normal form is `proved`, for every member with distinct roots. Half the dimension is `m`, from 1
    to 8; the claims are for every eps. Returns a Report like `verify`; raises InputError for another m, or an eps.

    Source: petrera-suris-2016, all of it; schwartz-1980 for the bounds.

    >>> report = verify_universal(2, options=VerifyOptions(sections=(6,)))
    >>> str(report.verdict), report.findings[1].also[0].data["error_bound"]
    ('proved', '2^-145')
    """
    settings, options = settings or Settings(), options or VerifyOptions()
    if not 1 <= m <= MAX_M:
        raise InputError(f"found m = {m}, expected 1 <= m <= {MAX_M}")
    if settings.eps is not None:
        raise InputError("found an eps, expected none: universal claims are for every eps")
    verifier = _UniversalVerifier(m, settings, options)
    findings = verifier.findings()
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
    return Report("verify", tuple(findings), context, verifier.notes())


class _MemberVerifier(Verifier):
    """A given member."""

    def __init__(self, member: FamilyMember, settings: Settings, options: VerifyOptions) -> None:
        super().__init__(settings, options)
        self.member = member
        self._seed = seed_for(settings.seed, member.A, member.H, settings.eps)
        self.m = member.m
        self.roots = objects_over.rational_roots(member)

    def point(self, roots: bool, number: int) -> PaperObjects | None:
        # Where chi splits over Q one pool of points serves all claims.
        needs_split = roots and self.roots is None
        key = (needs_split, number)
        if key not in self._points:
            self._points[key] = self._new_point(needs_split, number)
        return self._points[key]

    def _new_point(self, needs_split: bool, number: int) -> PaperObjects | None:
        rng = random.Random(f"verify {self._seed} {needs_split} {number}")
        if needs_split and not self.member.is_generic:
            return None
        while True:
            try:
                if needs_split:
                    chi = chi_of(self.member.A)
                    self.settings.progress("looking for a prime at which chi splits")
                    # One prime in m! splits at worst, so that this fails with probability e^-40.
                    found = objects_over.split_prime_field(chi, rng, 40 * math.factorial(self.m))
                    if found is None:
                        return None
                    K, mod_roots = found
                    roots: tuple[Any, ...] | None = mod_roots
                else:
                    K = random_prime_field(rng)
                    roots = None if self.roots is None else tuple(K.convert(root) for root in self.roots)
                return objects_over.point_over(self.member, K, roots, self.settings.eps, rng, self.options.order)
            except BadPrime:
                continue

    def exact_point(self, roots: bool, number: int) -> PaperObjects | None:
        if roots and self.roots is None:
            return None
        rng = random.Random(f"exact {self._seed} {number}")
        return objects_over.point_over(self.member, QQ, self.roots, self.settings.eps, rng, self.options.order)

    def bounds(self) -> PaperObjects:
        return objects_over.bound_objects(self.member, self.settings.eps, self.options.order)

    def conjugates(self, roots: bool) -> int:
        if not roots or self.roots is not None:
            return 1
        return math.prod(math.factorial(factor.degree) for factor in self.member.factors)

    def outside(self, claim: Claim) -> str | None:
        if self.member.is_generic:
            return None
        bounds = self.bounds()
        if not claim.distinct_roots and claim.kind in (Kind.EQUAL, Kind.DIFFERENT):
            pairs = sum(1 for _ in claim.function(bounds))
            if not pairs:
                return "there is no associated system but f itself: chi is a power of one irreducible polynomial"
        if claim.distinct_roots or "roots" in bounds.used:
            return f"the statement needs distinct roots. {diagnosis(self.member.A).split(';')[0]}"
        return None

    def what_is_special(self) -> str:
        if not self.member.is_generic:
            return "its A is not generic"
        reasons = []
        form = normal_form(self.member)
        chi = form.chi
        vanishing = _common_factor(chi, form.coefficients)
        if vanishing.degree() > 0:
            reasons.append(f"H vanishes on the eigenspaces of the roots of {format_univariate(vanishing)}")
        flat = _common_factor(chi, form.D_coefficients) // vanishing
        if flat.degree() > 0:
            reasons.append(
                f"H is the cube of a linear form on the eigenspaces of the roots of {format_univariate(flat)}"
            )
        if all(factor.degree == 1 and abs(factor.polynomial[0]) in (0, 1) for factor in self.member.factors):
            reasons.append("A^3 = A, so that H_1 is associated to H_0 where it is not 0")
        return "; ".join(reasons) or "its A or H is special"

    def proof(self, claim: Claim, needs: set[str], equation: Size, poles: int) -> Evidence | None:
        if not needs - {"roots"} and (self.roots is not None or "roots" not in needs):
            objects = self.exact_point("roots" in needs, 0)
            if objects is not None and equation.degree == 0 and _holds(claim, objects):
                return Evidence("exact", "both sides are the same over Q", {})
        if claim.symplectic and self.member.is_generic:
            evidence = normal_form_proof(claim.key, claim.blocks_for_proof(self.m), self.options.order)
            if evidence is not None:
                verified = "A^T J = J A, A Hess(H) = Hess(H) A^T, distinct roots: verified"
                data = {**evidence.data, "hypotheses_verified": verified}
                return Evidence(evidence.method, f"{evidence.summary}; {verified}", data)
        if equation.degree <= 6 and poles <= 4:
            return self._symbolic(claim, needs)
        return None

    def _symbolic(self, claim: Claim, needs: set[str]) -> Evidence | None:
        vectors = needs - {"roots"}
        if ("roots" in needs and self.roots is None) or len(vectors) * self.member.dim > _MAX_INDETERMINATES:
            return None
        objects = objects_over.member_functions(
            self.member, sorted(needs - {"roots"}), self.settings.eps, PROOF_BUDGET, self.options.order
        )
        try:
            outcome = evaluate(claim, objects)
        except (BudgetExceeded, *UNDEFINED):
            return None
        if not outcome.holds:
            text = f"{claim.place}: {claim.title}: the two sides are different functions for this member"
            raise Contradiction(text, witness_of(outcome))
        scope = "x and eps" if self.settings.eps is None else f"x, for eps = {format_number(self.settings.eps)}"
        return Evidence("symbolic", f"both sides are the same function of {scope}, multiplied out for this member")

    def also(self, claim: Claim) -> Iterable[Evidence]:
        rng = random.Random(f"also {self._seed} {claim.key}")
        if claim.blockwise and claim.symplectic and self.member.is_generic:
            objects = objects_over.etale_objects(self.member, rng, self.settings.eps, self.options.order)
            chi = format_univariate(chi_of(self.member.A))
            text = f"held at an exact random point of the normal form over Q[t]/({chi})"
            try:
                if not evaluate(claim, objects).holds:
                    raise Contradiction(f"{claim.place}: {claim.title}: fails over Q[t]/chi, but not over GF(p)")
                yield Evidence("exact over Q[t]/chi", f"{text}, for all roots at once", {"points": 1})
            except UNDEFINED:  # a point where the map has no value: no evidence, and none is claimed
                pass
        if self.options.ball_bits is not None and self.member.is_generic:
            yield self._by_balls(claim, self.options.ball_bits, rng)

    def _by_balls(self, claim: Claim, bits: int, rng: random.Random) -> Evidence:
        objects = objects_over.ball_objects(self.member, bits, rng, self.settings.eps, self.options.order)
        widest, pairs = -math.inf, 0
        try:
            with objects.K.working():
                for left, right in claim.function(objects):
                    pairs += 1
                    if not same(objects.K, left, right):
                        raise Contradiction(f"{claim.place}: {claim.title}: two balls that must overlap do not")
                    for a, b in zip(entries(left), entries(right), strict=True):
                        widest = max(widest, _log2_radius(objects.K.convert(a) - objects.K.convert(b)))
        except (PrecisionLost, *UNDEFINED):
            return Evidence("complex balls", f"balls of {bits} bits are too wide to compare", {"bits": bits})
        text = f"over complex balls of {bits} bits the sides overlap"
        if widest > -math.inf:
            text += f", to within 2^{math.ceil(widest)}"
        return Evidence("complex balls", text, {"bits": bits, "pairs": pairs})

    def notes(self) -> list[str]:
        """What holds for the whole table."""
        found = [diagnosis(self.member.A)]
        if self.member.is_generic and not self.options.controls:
            found.append(NOTE_ON_PROOFS)
        if self.options.ball_bits is not None and self.member.is_generic:
            enclosures = objects_over.root_enclosures(self.member, self.options.ball_bits)
            found.append(f"roots of chi in balls of {self.options.ball_bits} bits: {', '.join(enclosures)}")
        return found


class _UniversalVerifier(Verifier):
    """The member in general."""

    def __init__(self, m: int, settings: Settings, options: VerifyOptions) -> None:
        super().__init__(settings, options)
        self.m = m

    def point(self, roots: bool, number: int) -> PaperObjects | None:
        key = (False, number)
        if key not in self._points:
            rng = random.Random(f"universal {self.settings.seed} {number}")
            field = random_prime_field(rng)
            self._points[key] = objects_over.random_objects(self.m, field, rng, self.options.order)
        return self._points[key]

    def exact_point(self, roots: bool, number: int) -> PaperObjects | None:
        return None

    def bounds(self) -> PaperObjects:
        return objects_over.universal_bound_objects(self.m, self.options.order)

    def proof(self, claim: Claim, needs: set[str], equation: Size, poles: int) -> Evidence | None:
        if not claim.symplectic:
            return None
        return normal_form_proof(claim.key, claim.blocks_for_proof(self.m), self.options.order)

    def notes(self) -> list[str]:
        """What holds for the whole table."""
        return [
            "random members: A = S^{-T} diag(L, L) S^T with random roots L and a random symplectic S, H = sum of "
            "random planar cubics, hidden by S; x and eps at random. Bounds are for the generic member"
        ]


def _common_factor(chi: fmpq_poly, coefficients: Iterable[fmpq_poly]) -> fmpq_poly:
    """The monic gcd of chi and these elements of Q[t]/chi: the roots at which all of them vanish."""
    common = chi
    for coefficient in coefficients:
        common = common.gcd(coefficient)
    return common


def _holds(claim: Claim, objects: PaperObjects) -> bool:
    """Whether a claim is defined and holds."""
    try:
        return evaluate(claim, objects).holds
    except UNDEFINED:
        return False


def _log2_radius(ball: Any) -> float:
    """log2 of an upper bound for |ball|."""
    bound = abs(ball).abs_upper()
    return -math.inf if bound == 0 else float(bound.log().mid()) / math.log(2)
