"""The verdict on the integrability of a map, with its evidence.

Degrees, singularities, integrals and heights are computed independently, each with its own work limit. The verdict uses
all proved results. If two measured results contradict each other, the verdict uses neither.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from kahanmaps.algebra.fields import QQ
from kahanmaps.checks.claims import Certainty
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import counted
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.analysis_result import AnalysisResult
from kahanmaps.laboratory.growth.curves import Ended
from kahanmaps.laboratory.preserve.poisson.pencil import GROWTH_ON
from kahanmaps.laboratory.singular.outcomes import CONFINED

_POLYNOMIAL_GROWTHS = (Growth.LINEAR, Growth.QUADRATIC, Growth.POLYNOMIAL)
_CURVE_TEXTS = {None: "curves", 0: "rational curves", 1: "elliptic curves, of genus 1"}


@dataclass(frozen=True)
class Conclusion(ResultPart):
    """The verdict on a map.

    `kind` is "linear", "linearisable", "integrable", "not integrable", "singular" (nowhere defined) or "undecided".
    `sense` is the precise sense of the verdict: "superintegrable" (one integral less than the dimension, proved),
    "Liouville integrable" (proved), "integrable in the sense of zero algebraic entropy", "not integrable", "confining
    and not integrable" (all singularities are confined), or the same as `kind`. `ground` is the certainty: "proved",
    "derived" (from the measured singularity patterns), "measured" or "estimated"; it is empty if `kind` is "undecided".
    `integrals` is the number of independent integrals, or a lower bound of it; `growth` is the growth of the degrees.
    """

    kind: str
    integrals: int
    growth: str
    sentence: str
    sense: str
    ground: str


class _Verdict(NamedTuple):
    kind: str
    sentence: str
    sense: str = ""
    ground: Certainty | None = Certainty.MEASURED


class _Facts:
    """The results of the analysis, and phrases about them that several rules use."""

    def __init__(self, result: AnalysisResult) -> None:
        degrees = result.degrees
        self.result, self.degrees, self.count = result, degrees, result.integral_count
        self.growth = degrees.growth if degrees is not None else Growth.UNKNOWN
        self.growth_certainty = degrees.known if degrees is not None else Certainty.MEASURED
        self.growth_text = degrees.kind_text if degrees is not None else "degrees not measured"
        self.basis_text = f" ({degrees.basis})" if degrees is not None and degrees.recurrence is not None else ""
        # The phrase that states the number of integrals, or a lower bound of this number.
        suffix = f" in dimension {result.dim}"
        count_text = counted(self.count, "independent integral") if self.count else "no integral"
        self.integrals_text = count_text + suffix if result.count_is_exact else f"at least {count_text}{suffix}"
        if not result.integrals_were_counted:
            self.integrals_text = "the integrals were not counted"
        elif not self.count and result.integrals is not None and not result.count_is_exact:
            degree = result.integrals.profile.degree
            self.integrals_text = f"no integral{suffix} up to degree {degree} (relations along orbits)"
        period = result.integrals.profile.period if result.integrals is not None else None
        self.closing_text = "" if period is None else f"orbits close after {counted(period, 'step')} (measured)"
        self.is_linear = result.file.is_quadratic and result.file.system.degree <= 1
        self.liouville = ""  # the reason why the map is Liouville integrable; empty without a proof
        if result.dim > 2 and not self.is_linear:
            for tensor in reversed(result.poisson.tensors if result.poisson is not None else ()):
                verdicts = (tensor.verdict, tensor.jacobi, tensor.involution)
                if tensor.is_liouville_integrable and all(verdict is Certainty.PROVED for verdict in verdicts):
                    self.liouville = f"with the Poisson tensor {tensor.name}"
            if isinstance(result.normal_form, SystemNormalForm):
                self.liouville = "as a member of the commuting family"


def conclude(result: AnalysisResult) -> Conclusion:
    """Return the verdict of the first rule in `_RULES` that applies; if no rule applies, return "undecided"."""
    facts = _Facts(result)
    undecided = f"The growth is undecided: {facts.growth_text}; {facts.integrals_text}."
    verdict = next(filter(None, (rule(facts) for rule in _RULES)), _Verdict("undecided", undecided, ground=None))
    sentence = verdict.sentence
    if result.eps is not None:
        sentence += f" All this holds at eps = {result.eps}; other eps may differ."
    if result.symbols:
        formulas_text = "integrals" if result.densities is None else "integrals and densities"
        sentence += f" The {formulas_text} hold for every {', '.join(result.symbols)}, all else for the given values."
    if facts.liouville:
        sentence += f" It is Liouville integrable, {facts.liouville} (proved)."
    sense, ground, growth = (
        verdict.sense or verdict.kind,
        "" if verdict.ground is None else str(verdict.ground),
        facts.growth,
    )
    if verdict.kind == "not integrable":
        growth = Growth.EXPONENTIAL  # even if exponential growth is only estimated
    return Conclusion(verdict.kind, facts.count, str(growth), sentence, sense, ground)


def _if_nowhere_defined(facts: _Facts) -> _Verdict | None:
    degrees = facts.degrees
    if degrees is None or degrees.ended != Ended.SINGULAR or len(degrees.degrees) > 1:
        return None
    return _Verdict("singular", f"The map is nowhere defined: {degrees.message}.")


def _if_linear(facts: _Facts) -> _Verdict | None:
    if not facts.is_linear:
        return None
    eps, B = facts.result.eps, facts.result.file.system.B
    if eps is not None and (QQ.identity(B.nrows()) - B * eps).det() == 0:
        return _Verdict("singular", "The map is nowhere defined: det(I - eps f') = 0.", ground=Certainty.PROVED)
    proof = None if facts.degrees is None else facts.degrees.proof
    period_text = facts.closing_text and f"; {facts.closing_text}"
    if proof is not None and proof.is_identity:
        period_text = f"; {proof.reason} (proved)"
    sentence = f"The system is linear, and so is its Kahan map; {facts.integrals_text}{period_text}."
    return _Verdict("linear", sentence, ground=Certainty.PROVED)


def _if_inconsistent(facts: _Facts) -> _Verdict | None:
    """Return "undecided" if results contradict each other, or if the map is not birational.

    For a map that is not birational, degrees and periodic orbits are no evidence of integrability.
    """
    if sentences := contradictions(facts.result):
        sentence = f"The results contradict each other: {'; '.join(sentences)}. {_capitalize(facts.integrals_text)}."
    elif facts.result.defect and facts.growth is not Growth.ZERO:
        sentence = f"{_capitalize(facts.result.defect)}; {facts.growth_text}."
    else:
        return None
    return _Verdict("undecided", sentence, ground=None)


def _if_linearisable(facts: _Facts) -> _Verdict | None:
    """Return the verdict on a map that is periodic, has a constant iterate, or has bounded degrees."""
    proof = facts.degrees.proof if facts.degrees is not None else None
    if proof is not None and proof.is_identity:
        sentence = f"The map is periodic: {proof.reason} (proved); {facts.integrals_text}."
        return _Verdict("linearisable", sentence, ground=Certainty.PROVED)
    if facts.closing_text:
        return _Verdict(
            "linearisable", f"{_capitalize(facts.closing_text)}: the map is periodic there; {facts.growth_text}."
        )
    if facts.growth is Growth.ZERO:
        return _Verdict("linearisable", "An iterate of the map is a constant map (measured): orbits end in one point.")
    if facts.growth is not Growth.BOUNDED:
        return None
    bounded_text = f"The degrees of the iterates are bounded{facts.basis_text}"
    sentence = f"{bounded_text}: the map is linearisable in the sense of bounded degrees; {facts.integrals_text}."
    return _Verdict("linearisable", sentence, ground=facts.growth_certainty)


def _if_entropy_positive(facts: _Facts) -> _Verdict | None:
    """Return the verdict on a map whose dynamical degree is proved to exceed 1."""
    result = facts.result
    if facts.degrees is None or facts.degrees.dynamical_degree_bounds is None:
        return None
    bound_text = f"the dynamical degree is at least {facts.degrees.dynamical_degree_bounds.lower}"
    eps_text = "" if result.eps is not None or not result.file.map.has_eps else ", for all but finitely many eps"
    sentence = (
        f"Not integrable (proved): {bound_text}{eps_text}, so that the algebraic entropy is positive and no rational "
        f"function is an integral; {facts.growth_text}{facts.basis_text}."
    )
    return _Verdict("not integrable", sentence, _sense_if_not_integrable(result), Certainty.PROVED)


def _if_orbits_on_curves(facts: _Facts) -> _Verdict | None:
    """Return the verdict on a map with orbits on curves; if the growth is known, only proved integrals count."""
    result, proved_count = facts.result, 0  # the number of independent integrals that are proved
    if result.integrals is not None:
        proved_count = sum(verdict is Certainty.PROVED for _, verdict in result.integrals.formulas)
        proved_count = max(proved_count, 0 if result.integrals.symbols else result.integrals.by_theorems)
    if result.dim > 1 and proved_count >= result.dim - 1:
        sense = "superintegrable" if result.dim > 2 else "integrable"
        genus = result.pencil.genus if result.pencil is not None else None
        if genus is None and result.dim == 2:  # the genus was not computed; the growth determines whether it is 0 or 1
            genus = next((g for g, kind in GROWTH_ON.items() if kind is facts.growth), None)
        clause = f"so that orbits lie on {_CURVE_TEXTS.get(genus, f'curves of genus {genus}')}"
        sentence = (
            f"{sense.capitalize()} (proved): {facts.integrals_text}, {clause}; {facts.growth_text}{facts.basis_text}."
        )
        return _Verdict("integrable", sentence, sense, Certainty.PROVED)
    is_on_curves = orbits_lie_on_curves(result)
    if facts.growth is not Growth.UNKNOWN or not (facts.liouville or is_on_curves):
        return None
    curves_phrase = ", so that orbits lie on curves" if is_on_curves else ""
    sentence = f"Integrable: {facts.integrals_text}{curves_phrase}; degrees: {facts.growth_text}."
    return _Verdict("integrable", sentence, *_sense_and_ground(facts.liouville))


def _verdict_by_growth(facts: _Facts) -> _Verdict | None:
    """Return the verdict that follows from exponential or polynomial growth of the degrees."""
    count, integrals = facts.count, facts.integrals_text
    is_exponential = facts.growth is Growth.EXPONENTIAL  # if False, the growth may still look exponential
    if is_exponential or (facts.degrees is not None and facts.degrees.looks_exponential):
        clause = f", although there {'is' if count == 1 else 'are'} {integrals}" if count else f"; {integrals}"
        growth = f"{facts.growth_text}{facts.basis_text if is_exponential else ''}"
        sentence = f"Not integrable in the sense of zero algebraic entropy: {growth}{clause}."
        ground = facts.growth_certainty if is_exponential else Certainty.ESTIMATED
        return _Verdict("not integrable", sentence, _sense_if_not_integrable(facts.result), ground)
    if facts.growth in _POLYNOMIAL_GROWTHS:
        sentence = (
            f"Integrable in the sense of zero algebraic entropy: {facts.growth_text}{facts.basis_text}; {integrals}."
        )
        return _Verdict("integrable", sentence, *_sense_and_ground(facts.liouville, facts.growth_certainty))
    return None


# The order matters: the first rule that applies decides; proved results precede measured ones.
_RULES: tuple[Callable[[_Facts], _Verdict | None], ...] = (
    *(_if_nowhere_defined, _if_linear, _if_inconsistent, _if_linearisable, _if_entropy_positive),
    *(_if_orbits_on_curves, _verdict_by_growth),
)


def _sense_and_ground(liouville: str, ground: Certainty | None = Certainty.MEASURED) -> tuple[str, Certainty | None]:
    if liouville:
        return "Liouville integrable", Certainty.PROVED
    return "integrable in the sense of zero algebraic entropy", ground


def _sense_if_not_integrable(result: AnalysisResult) -> str:
    """Return "confining and not integrable" if all singularities are confined, otherwise "not integrable"."""
    is_confined = {run.verdict for run in result.singularities} == {CONFINED}
    return "confining and not integrable" if is_confined else "not integrable"


def _capitalize(sentence: str) -> str:
    return sentence[0].upper() + sentence[1:]


def orbits_lie_on_curves(result: AnalysisResult) -> bool:
    """Return whether dim - 1 independent integrals are proved or supported; then degrees grow at most quadratically.

    The map acts on the level curves of these integrals, and an automorphism of infinite order implies genus 0 or 1.
    """
    return result.integrals is not None and len(result.integrals.integrals) >= result.dim - 1 >= 1


def contradictions(result: AnalysisResult) -> list[str]:
    """Return a sentence for each contradiction between integrals, periodic orbits and the growth of degrees."""
    growth = result.degrees.growth if result.degrees is not None else Growth.UNKNOWN
    period = result.integrals.profile.period if result.integrals is not None else None
    sentences = []
    if growth is Growth.EXPONENTIAL and orbits_lie_on_curves(result):
        sentences.append(
            "the degrees seem to grow exponentially, which they cannot if integrals confine orbits to curves"
        )
    elif growth is Growth.EXPONENTIAL and isinstance(result.normal_form, SystemNormalForm):
        sentences.append(
            "the degrees seem to grow exponentially, which they cannot for a member of the commuting family"
        )
    bounds = None if result.degrees is None else result.degrees.dynamical_degree_bounds
    if bounds is not None and orbits_lie_on_curves(result):
        sentences.append("positive algebraic entropy is proved, which excludes an integral")
    if result.pencil is not None and (contradiction := result.pencil.contradiction(growth)):
        sentences.append(contradiction)
    if period is not None and growth in (Growth.EXPONENTIAL, *_POLYNOMIAL_GROWTHS):
        sentences.append(f"orbits close after {counted(period, 'step')}, but the degrees seem to grow")
    return sentences


def doubt_of_heights(result: AnalysisResult) -> str:
    """Return why the measured growth of heights is inconclusive, e.g. since the degrees contradict it; otherwise ""."""
    if result.heights is None or result.degrees is None:
        return ""
    kind, growth = result.heights.kind, result.degrees.growth
    is_bounded = growth in (Growth.ZERO, Growth.BOUNDED)
    if is_bounded and kind in (Growth.QUADRATIC, Growth.EXPONENTIAL):
        reason = "the degrees are bounded"
    elif growth in _POLYNOMIAL_GROWTHS and kind is Growth.EXPONENTIAL:
        reason = f"the degrees grow {'linearly' if growth is Growth.LINEAR else 'polynomially'}"
    elif growth is Growth.EXPONENTIAL and kind not in (Growth.EXPONENTIAL, Growth.UNDECIDED):
        reason = "the degrees grow exponentially"
    else:
        reason = ""
    steps = max(len(orbit.growth.heights) for orbit in result.heights.orbits) - 1
    longest = max(result.degrees.patterns.lengths, default=0) if result.degrees.patterns is not None else 0
    if kind is not Growth.UNDECIDED and longest > steps // 2:
        length_text = (
            f"orbits of {counted(steps, 'step')} are too short, singularity patterns settle only at step {longest}"
        )
        return f"{reason}: {length_text}" if reason else length_text
    return reason
