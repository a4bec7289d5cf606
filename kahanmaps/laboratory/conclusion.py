"""The verdict on a map: what all that was found says of its integrability, and what this rests on."""

from __future__ import annotations

from dataclasses import dataclass

from kahanmaps.checks.claims import Verdict
from kahanmaps.errors import counted
from kahanmaps.family.structure import Structure
from kahanmaps.laboratory.consistency import contradictions, orbits_lie_on_curves
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.growth.curves import Ended
from kahanmaps.laboratory.growth.recurrences import GrowthClass
from kahanmaps.laboratory.known import Known
from kahanmaps.laboratory.preserve.poisson.pencil import GROWTH_ON
from kahanmaps.laboratory.singular.outcomes import CONFINED

_CURVES = {0: "rational curves", 1: "elliptic curves, of genus 1"}


@dataclass(frozen=True)
class Conclusion:
    """The verdict in words; `kind` is "linear", "linearisable", "integrable", "not integrable", "singular" (nowhere
    defined) or "undecided".

    `sense` says more exactly what is meant: "superintegrable" (one integral less than the dimension, proved),
    "Liouville integrable" (proved), "integrable in the sense of complexity", "not integrable", "confining and not
    integrable", else the kind. `ground` is what the verdict rests on: "proved", "explained" (by the patterns of
    singularities), "measured" or "estimated"; empty where there is no verdict. `integrals` is the number of independent
    integrals known or shown by orbits, `growth` the kind of degree growth.
    """

    kind: str
    integrals: int
    growth: str
    sentence: str
    sense: str
    ground: str


def conclude(found: Findings) -> Conclusion:
    """The verdict on what was found."""
    count, degrees = found.integral_count, found.degrees
    growth = degrees.growth if degrees is not None else GrowthClass.UNKNOWN
    phrase = degrees.kind_text if degrees is not None else "degrees not measured"
    basis = degrees.basis if degrees is not None else ""
    known = f" ({basis})" if basis else ""
    integrals = _count_text(found) if found.integrals_were_counted else "the integrals were not counted"
    period = found.integrals.profile.period if found.integrals is not None else None
    suffix = f" All this at eps = {found.eps} only: other eps may differ." if found.eps is not None else ""
    if found.symbols:
        parts = "integrals" if found.densities is None else "integrals and densities"
        suffix += f" The {parts} are for every {', '.join(found.symbols)}, all else is for the given values."
    linear = found.file.is_quadratic and found.file.system.degree <= 1
    liouville = "" if linear else _liouville(found)
    if liouville:
        suffix += f" It is Liouville integrable, {liouville} (proved)."

    def verdict(kind: str, sentence: str, sense: str = "", ground: Known | None = Known.MEASURED) -> Conclusion:
        return Conclusion(kind, count, str(growth), sentence + suffix, sense or kind, str(ground or ""))

    grown = degrees.known if degrees is not None else Known.MEASURED
    if degrees is not None and degrees.ended == Ended.SINGULAR and len(degrees.degrees) == 1:
        return verdict("singular", f"The map is nowhere defined: {degrees.message}.")
    if linear:
        closes = "" if period is None else f"; orbits close after {counted(period, 'step')} (measured)"
        return verdict(
            "linear", f"The system is linear, and so is its Kahan map; {integrals}{closes}.", ground=Known.PROVED
        )
    if said := contradictions(found):
        return verdict(
            "undecided",
            f"The findings do not agree: {'; '.join(said)}. {integrals[0].upper()}{integrals[1:]}.",
            ground=None,
        )
    if period is not None:
        closes = f"Orbits close after {counted(period, 'step')} (measured)"
        return verdict("linearisable", f"{closes}: the map is periodic there; {phrase}.")
    if growth is GrowthClass.ZERO:
        return verdict("linearisable", "An iterate of the map is a constant map (measured): orbits end in one point.")
    if growth is GrowthClass.BOUNDED:
        sentence = f"The degrees of the iterates are bounded{known}: the map is linearisable in the sense of complexity"
        return verdict("linearisable", f"{sentence}; {integrals}.", ground=grown)
    if degrees is not None and degrees.enclosure is not None:
        bound = f"the dynamical degree is at least {degrees.enclosure.lower}"
        where = "" if found.eps is not None or not found.file.map.has_eps else ", for all eps but countably many"
        return verdict(
            "not integrable",
            f"Not integrable (proved): {bound}{where}, so that the algebraic entropy is positive and no rational "
            f"function is an integral; {phrase}{known if growth is GrowthClass.EXPONENTIAL else ''}.",
            _confining(found),
            Known.PROVED,
        )
    if _orbits_on_curves_proved(found):
        sense = "superintegrable" if found.dim > 2 else "integrable"
        where = f"so that orbits lie on {_curves(found, growth)}"
        sentence = f"{sense.capitalize()} (proved): {integrals}, {where}; {phrase}{known}."
        return verdict("integrable", sentence, sense, Known.PROVED)
    if growth is GrowthClass.UNKNOWN and (liouville or orbits_lie_on_curves(found)):
        curves = ", so that orbits lie on curves" if orbits_lie_on_curves(found) else ""
        sentence = f"Integrable: {integrals}{curves}; of the degrees: {phrase}."
        return verdict("integrable", sentence, *_sense(liouville))
    if growth is GrowthClass.EXPONENTIAL or (degrees is not None and degrees.looks_exponential):
        exact = growth is GrowthClass.EXPONENTIAL  # else the phrase says that it is estimated
        growth = GrowthClass.EXPONENTIAL
        although = f", although there {'is' if count == 1 else 'are'} {integrals}" if count else f"; {integrals}"
        return verdict(
            "not integrable",
            f"Not integrable in the sense of complexity: {phrase}{known if exact else ''}{although}.",
            _confining(found),
            grown if exact else Known.ESTIMATED,
        )
    if growth in (GrowthClass.LINEAR, GrowthClass.QUADRATIC, GrowthClass.POLYNOMIAL):
        sentence = f"Integrable in the sense of complexity: {phrase}{known}; {integrals}."
        return verdict("integrable", sentence, *_sense(liouville, grown))
    return verdict("undecided", f"The growth is undecided: {phrase}; {integrals}.", ground=None)


def _sense(liouville: str, ground: Known | None = Known.MEASURED) -> tuple[str, Known | None]:
    if liouville:
        return "Liouville integrable", Known.PROVED
    return "integrable in the sense of complexity", ground


def _confining(found: Findings) -> str:
    """In which sense a map is not integrable: confinement is no proof of integrability."""
    confined = {run.verdict for run in found.singularities} == {CONFINED}
    return "confining and not integrable" if confined else "not integrable"


def _orbits_on_curves_proved(found: Findings) -> bool:
    """Whether one integral less than the dimension is proved, independent of each other."""
    search = found.integrals
    if search is None or found.dim < 2:
        return False
    proved = sum(verdict is Verdict.PROVED for _, verdict in search.formulas)
    return max(proved, 0 if search.symbols else search.by_theorems) >= found.dim - 1


def _curves(found: Findings, growth: GrowthClass) -> str:
    """The curves of integrals: in the plane with their genus, which the growth tells where it was not computed."""
    genus = found.pencil.genus if found.pencil is not None else None
    if genus is None and found.dim == 2:
        genus = next((g for g, kind in GROWTH_ON.items() if kind is growth), None)
    return "curves" if genus is None else _CURVES.get(genus, f"curves of genus {genus}")


def _liouville(found: Findings) -> str:
    """By what the map is Liouville integrable, proved; empty where that is not known."""
    if isinstance(found.structure, Structure) and found.dim > 2:
        return "as a member of the commuting family"
    for one in found.poisson.tensors if found.poisson is not None and found.dim > 2 else ():
        proved = (one.verdict, one.jacobi, one.involution)
        if one.is_liouville_integrable and all(verdict is Verdict.PROVED for verdict in proved):
            return f"with the Poisson tensor {one.name}"
    return ""


def _count_text(found: Findings) -> str:
    """How many integrals there are; where that is a lower bound, the sentence says so."""
    count, search = found.integral_count, found.integrals
    where = f" in dimension {found.dim}"
    if count == 0 and search is not None and not found.count_is_exact:
        return f"no integral{where} up to degree {search.profile.degree} (relations along orbits)"
    number = "no integral" if count == 0 else counted(count, "independent integral")
    return number + where if found.count_is_exact else f"at least {number}{where}"
